//! Pictures to files: 8-bit sRGB PNG for looking, float EXR for measuring; texts for reading; drawings of schedules.
//!
//! Key decision: a file appears complete or not at all. It is written next to its final place and renamed there, so a failure leaves an
//! older picture untouched.

mod atomic;
pub mod drawing;
pub mod exr;
pub mod png;
pub mod text;

use std::path::Path;

use crate::error::Error;

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8 bits, sRGB, exposed and clipped.
    Png,
    /// 32-bit float, linear Rec. 709, as rendered.
    Exr,
}

impl Format {
    /// The format that the ending of the name asks for.
    ///
    /// # Errors
    /// When the ending is unknown.
    pub fn of(path: &Path) -> Result<Format, Error> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("png") => Ok(Format::Png),
            Some("exr") => Ok(Format::Exr),
            _ => Err(Error::extension(path, ".png or .exr")),
        }
    }
}

/// Asks, before the long work, whether [`write()`] can succeed: the name has a known ending and files can be made in its folder.
/// Nothing stays behind.
///
/// # Errors
/// When the ending is unknown, or the operating system refuses.
pub fn check_writable(path: &Path) -> Result<Format, Error> {
    let format = Format::of(path)?;
    check_place(path)?;
    Ok(format)
}

/// Asks, before the long work, whether a file of any name can be written here. Nothing stays behind.
///
/// # Errors
/// When the operating system refuses.
pub fn check_place(path: &Path) -> Result<(), Error> {
    if path.is_dir() {
        return Err(Error::write(path, "this is a folder"));
    }
    atomic::check(path).map_err(|e| Error::write(path, e))
}

/// Writes a JSON document.
///
/// # Errors
/// When the operating system refuses.
pub fn write_json(path: &Path, document: &serde_json::Value) -> Result<(), Error> {
    atomic::write(path, |writer| {
        serde_json::to_writer(&mut *writer, document).map_err(std::io::Error::other)?;
        std::io::Write::write_all(writer, b"\n")
    })
    .map_err(|e| Error::write(path, e))
}

/// Writes a picture of linear mean radiance, row 0 on top, in the format of the name. `exposure` is in EV and changes PNG only.
///
/// # Errors
/// When the ending is unknown, the size does not fit the pixels, or the operating system refuses.
pub fn write(path: &Path, width: u32, height: u32, pixels: &[[f32; 3]], exposure: f32) -> Result<(), Error> {
    match Format::of(path)? {
        Format::Png => png::write(path, width, height, pixels, exposure),
        Format::Exr => exr::write(path, width, height, pixels),
    }
}

/// Both encoders index pixels by the size.
fn check_size(path: &Path, width: u32, height: u32, pixels: &[[f32; 3]]) -> Result<(), Error> {
    if pixels.is_empty() || pixels.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(Error::write(path, format_args!("{} pixels do not fill {width} x {height}", pixels.len())));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: finding out after rendering that the file cannot be written, and leaving an empty file behind.
    #[test]
    fn writability_is_known_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.PNG");
        assert_eq!(check_writable(&path).unwrap(), Format::Png);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        assert!(check_writable(&folder.path().join("missing/picture.png")).is_err());
        assert!(check_writable(&folder.path().join("..")).is_err());
        let text = check_writable(Path::new("picture.jpg")).unwrap_err().to_string();
        assert!(text.contains(".png") && text.contains(".exr"), "{text}");
        std::fs::create_dir(folder.path().join("folder.exr")).unwrap();
        assert!(check_writable(&folder.path().join("folder.exr")).is_err());
    }

    // Kills: a size that does not fit the pixels reaching an encoder.
    #[test]
    fn the_size_has_to_fit() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "a.exr"] {
            let path = folder.path().join(name);
            assert!(write(&path, 2, 2, &[[0.0; 3]; 3], 0.0).is_err());
            assert!(write(&path, 0, 0, &[], 0.0).is_err());
            assert!(!path.exists());
        }
    }
}
