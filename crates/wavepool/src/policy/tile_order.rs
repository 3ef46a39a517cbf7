//! In which order tiles leave the queue.

use std::fmt::Debug;

/// A permutation of the tiles, one per pass.
///
/// Must: visit every tile of a pass exactly once; give the same answer on both faces.
pub trait TileOrder: Debug + Send + Sync {
    /// One word, as in `--schedule`.
    fn name(&self) -> &str;

    /// WGSL that declares `fn wf_tile_at(pass_index: u32, position: u32) -> u32`; `wf_control.tiles` holds the number of tiles.
    fn wgsl(&self) -> String;

    /// The same on the host.
    fn tile_at(&self, pass_index: u32, position: u32, tiles: u32) -> u32;
}

/// As the work source numbers them: rows of an image from the top.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Scanline;

impl TileOrder for Scanline {
    fn name(&self) -> &str {
        "scanline"
    }

    fn wgsl(&self) -> String {
        "fn wf_tile_at(pass_index: u32, position: u32) -> u32 { return position; }\n".into()
    }

    fn tile_at(&self, _pass_index: u32, position: u32, _tiles: u32) -> u32 {
        position
    }
}
