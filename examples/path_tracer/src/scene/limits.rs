//! The largest things that a file may ask for.
//!
//! Key decision: fixed caps instead of options. They are far above what fits a GPU, and only there so that a small hostile file cannot
//! exhaust the memory through instancing or compression.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::Error;

/// Bytes of one file on disk.
pub const FILE_BYTES: u64 = 4 << 30;
/// Vertices after all instances are baked.
pub const VERTICES: usize = 1 << 25;
/// Triangles after all instances are baked.
pub const TRIANGLES: usize = 1 << 26;
/// Elements of an accessor that has no data of its own.
pub const IMPLIED_ELEMENTS: usize = 1 << 17;
/// Side of an image in texels.
pub const IMAGE_SIDE: u32 = 1 << 14;
/// Texels of all images of a scene together.
pub const IMAGE_TEXELS: u64 = 1 << 28;
/// Texels of an environment.
pub const ENVIRONMENT_TEXELS: usize = 1 << 27;

/// Reads a regular file that is not larger than [`FILE_BYTES`].
///
/// # Errors
/// When the operating system refuses, or the path names something that is not a file.
pub fn read_file(path: &Path) -> Result<Vec<u8>, Error> {
    let refuse = |reason: std::io::Error| Error::read(path, reason);
    // The kind is asked before opening, because opening a pipe waits for its other end.
    let size = {
        let metadata = std::fs::metadata(path).map_err(refuse)?;
        if !metadata.is_file() {
            return Err(Error::read(path, "this is not a file"));
        }
        metadata.len()
    };
    if size > FILE_BYTES {
        return Err(Error::read(path, format_args!("{size} bytes are more than the {FILE_BYTES} that are accepted")));
    }
    let mut bytes = Vec::new();
    File::open(path).map_err(refuse)?.take(FILE_BYTES).read_to_end(&mut bytes).map_err(refuse)?;
    Ok(bytes)
}
