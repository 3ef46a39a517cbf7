//! Pictures back from files, for comparing: linear colours, as they are, without repairs.
//!
//! Key decision: EXR and Radiance files go through the readers of environments, before these replace what cannot be radiance; so whatever
//! can light a scene can be compared.

use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, ImageReader, Limits};

use super::{Picture, decode_srgb, npy, pfm};
use crate::error::{Error, Fault};
use crate::scene::{
    environment::{self, Panorama},
    limits,
};

/// Reads a picture by the ending of its name, with a line for each part of it that is left out.
///
/// **Units:** PNG is taken for sRGB and becomes linear; everything else is linear as it is.
///
/// # Errors
/// When the file cannot be read, breaks its format, or uses a part of it that is not supported.
pub fn read_picture(path: &Path) -> Result<(Picture, Vec<String>), Error> {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let of_parts = |(width, height, color)| Picture::of_color(width, height, color);
    let in_file = |fault: Fault| fault.in_file(path);
    let (picture, notes): (Picture, Vec<String>) = match extension.as_deref() {
        Some("exr" | "hdr" | "pic") => {
            let Panorama { width, height, texels, warnings } = environment::read_panorama(path)?;
            (Picture::of_color(width, height, texels), warnings)
        }
        Some("png") => read_png(&limits::read_file(path)?).map_err(in_file)?,
        Some("pfm") => (of_parts(pfm::read(&limits::read_file(path)?).map_err(in_file)?), Vec::new()),
        Some("npy") => (of_parts(npy::read(&limits::read_file(path)?).map_err(in_file)?), Vec::new()),
        _ => return Err(Error::extension(path, ".exr, .hdr, .png, .pfm or .npy")),
    };
    Ok((picture, notes.into_iter().map(|note| format!("{}: {note}", path.display())).collect()))
}

fn read_png(bytes: &[u8]) -> Result<(Picture, Vec<String>), Fault> {
    let mut caps = Limits::default();
    (caps.max_image_width, caps.max_image_height) = (Some(limits::IMAGE_SIDE * 2), Some(limits::IMAGE_SIDE * 2));
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    reader.limits(caps);
    let image = reader.decode().map_err(|error| Fault::invalid("content", error))?;
    let notes = image.color().has_alpha().then(|| String::from("alpha is left out")).into_iter().collect();
    // Bytes become 16 bits without loss: 65,535 is 257 times 255.
    let rows = image.into_rgb16();
    let color = rows.pixels().map(|pixel| pixel.0.map(|value| decode_srgb(f32::from(value) / 65_535.0))).collect();
    Ok((Picture::of_color(rows.width(), rows.height(), color), notes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{Bits, Options, write_picture};

    fn picture() -> Picture {
        let color = (0..6).map(|i| [i as f32 / 5.0, 0.25, 1.0 - i as f32 / 7.0]).collect();
        Picture::of_color(3, 2, color)
    }

    // Kills: a format that is written and cannot be read; rows turned round, channels swapped, sRGB taken for linear.
    #[test]
    fn what_is_written_can_be_read() {
        let folder = tempfile::tempdir().unwrap();
        let deep = Options { bits: Bits::Sixteen, ..Options::default() };
        let half = Options { half: true, ..Options::default() };
        let plain = Options::default();
        for (name, options, tolerance) in [
            ("a.exr", plain, 0.0),
            ("b.exr", half, 3e-4),
            ("a.pfm", plain, 0.0),
            ("a.npy", plain, 0.0),
            ("a.png", plain, 5e-3),
            ("b.png", deep, 2e-5),
        ] {
            let path = folder.path().join(name);
            write_picture(&path, &picture(), &options).unwrap();
            let (read, notes) = read_picture(&path).unwrap();
            assert_eq!((read.width, read.height, notes.len()), (3, 2, 0), "{name}");
            let pairs = read.color.as_flattened().iter().zip(picture().color.into_flattened());
            pairs.for_each(|(a, b)| assert!((a - b).abs() <= tolerance, "{name}: {a} {b}"));
        }
    }

    // Kills: NaN, infinity and negative numbers repaired before they are compared.
    #[test]
    fn nothing_is_repaired() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.exr", "a.pfm", "a.npy"] {
            let path = folder.path().join(name);
            write_picture(&path, &Picture::of_color(1, 1, vec![[f32::NAN, f32::INFINITY, -1.0]]), &Options::default()).unwrap();
            let color = read_picture(&path).unwrap().0.color[0];
            assert!(color[0].is_nan() && color[1..] == [f32::INFINITY, -1.0], "{name}: {color:?}");
        }
    }

    // Kills: a panic or a message without the file's name on a broken file.
    #[test]
    fn broken_files_are_named() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.exr", "a.hdr", "a.png", "a.pfm", "a.npy", "a.txt"] {
            let path = folder.path().join(name);
            std::fs::write(&path, b"nothing of the kind").unwrap();
            let text = read_picture(&path).unwrap_err().to_string();
            assert!(text.contains(name), "{text}");
        }
    }
}
