//! Drawings of schedules to files: SVG for pages, HTML for stepping through time.
//!
//! Key decision: the ending chooses, as with pictures, and it is asked before the long work.

use std::{io::Write as _, path::Path};

use super::{atomic, check_place};
use crate::error::Error;

/// A kind of drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A still.
    Svg,
    /// A page with controls.
    Html,
}

/// Asks, before the long work, whether [`write()`] can succeed: the name has a known ending and files can be made in its folder.
/// Nothing stays behind.
///
/// # Errors
/// When the ending is unknown, or the operating system refuses.
pub fn check_writable(path: &Path) -> Result<Format, Error> {
    let format = match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("svg") => Format::Svg,
        Some("html") => Format::Html,
        _ => return Err(Error::extension(path, ".svg or .html")),
    };
    check_place(path)?;
    Ok(format)
}

/// Writes a finished drawing.
///
/// # Errors
/// When the operating system refuses.
pub fn write(path: &Path, text: &str) -> Result<(), Error> {
    atomic::write(path, |writer| writer.write_all(text.as_bytes())).map_err(|e| Error::write(path, e))
}
