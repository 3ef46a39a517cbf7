//! Pictures to files: PNG for looking, EXR with layers and facts for grading and measuring, PFM and NumPy arrays for scripts; texts for
//! reading; drawings of schedules; contact sheets.
//!
//! Key decision: a file appears complete or not at all. It is written next to its final place and renamed there, so a failure leaves an
//! older picture untouched.

mod atomic;
pub mod difference;
pub mod drawing;
mod exr;
pub mod flip;
mod font;
mod npy;
mod pfm;
mod picture;
mod png;
mod read;
pub mod sheet;
pub mod tev;
pub mod text;
mod tone_map;

use std::path::Path;

pub use picture::{Bits, Facts, Options, Part, Picture};
pub use png::{decode_srgb, encode_srgb};
pub use read::read_picture;
pub use tone_map::ToneMap;

use crate::error::Error;

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8 or 16 bits, sRGB, exposed and tone-mapped.
    Png,
    /// Floats or halves, linear Rec. 709, as rendered, with all layers and facts.
    Exr,
    /// Floats as rendered, colour alone.
    Pfm,
    /// An array of floats as rendered, colour alone.
    Npy,
}

/// Said when a name has none of them.
const ENDINGS: &str = ".png, .exr, .pfm or .npy";

impl Format {
    /// The format that the ending of the name asks for.
    ///
    /// # Errors
    /// When the ending is unknown.
    pub fn of(path: &Path) -> Result<Format, Error> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("png") => Ok(Format::Png),
            Some("exr") => Ok(Format::Exr),
            Some("pfm") => Ok(Format::Pfm),
            Some("npy") => Ok(Format::Npy),
            _ => Err(Error::extension(path, ENDINGS)),
        }
    }
}

/// Asks, before the long work, whether [`write_picture`] can succeed: the name has a known ending and files can be made in its folder.
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

/// Writes a picture in the format of the name. What the format cannot hold, or not as it is, is told in the lines that come back.
///
/// # Errors
/// When the ending is unknown, a plane of the picture does not fit its size, or the operating system refuses.
pub fn write_picture(path: &Path, picture: &Picture, options: &Options) -> Result<Vec<String>, Error> {
    let format = Format::of(path)?;
    picture.check().map_err(|what| Error::write(path, what))?;
    match format {
        Format::Png => png::write(path, picture, options),
        Format::Exr => exr::write(path, picture, options),
        Format::Pfm => pfm::write(path, picture),
        Format::Npy => npy::write(path, picture),
    }
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
        for name in ["a.png", "a.exr", "a.pfm", "a.npy"] {
            let path = folder.path().join(name);
            for picture in [Picture::of_color(2, 2, vec![[0.0; 3]; 3]), Picture::default()] {
                assert!(write_picture(&path, &picture, &Options::default()).is_err());
            }
            assert!(!path.exists());
        }
    }

    // Kills: layers or alpha that a format leaves out without a word.
    #[test]
    fn what_is_left_out_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let channel = crate::layers::Channel { name: String::new(), values: crate::layers::Values::U32(vec![1]) };
        let layers = vec![crate::layers::Layer { name: "samples".into(), channels: vec![channel] }];
        let picture = Picture { layers, alpha: Some(vec![1.0]), ..Picture::of_color(1, 1, vec![[0.5; 3]]) };
        let notes = |name: &str| write_picture(&folder.path().join(name), &picture, &Options::default()).unwrap();
        assert_eq!(notes("a.png"), ["a .png has no place for samples; an .exr has"]);
        assert_eq!(notes("a.pfm"), ["a .pfm has no place for A, samples; an .exr has"]);
        assert_eq!(notes("a.npy"), ["an .npy has no place for A, samples; an .exr has"]);
        assert!(notes("a.exr").is_empty());
    }
}
