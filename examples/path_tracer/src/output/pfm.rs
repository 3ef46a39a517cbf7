//! Portable float map: the pixels as they were rendered, behind a header of three lines.
//!
//! Key decision: written here, because the format is smaller than any interface to a library for it. Little-endian, which the negative
//! scale says; rows from the bottom to the top, which the format demands.
//!
//! **Source:** Paul Debevec, "PFM: Portable FloatMap".

use std::io::Write as _;
use std::path::Path;

use super::{Picture, atomic};
use crate::error::{Error, Fault};

/// Writes a checked picture.
///
/// # Errors
/// When the operating system refuses.
pub(super) fn write(path: &Path, picture: &Picture) -> Result<Vec<String>, Error> {
    let width = picture.width as usize;
    atomic::write(path, |writer| {
        write!(writer, "PF\n{} {}\n-1.0\n", picture.width, picture.height)?;
        for value in picture.color.chunks(width).rev().flatten().flatten() {
            writer.write_all(&value.to_le_bytes())?;
        }
        Ok(())
    })
    .map_err(|e| Error::write(path, e))?;
    Ok(picture.left_out(false, "a .pfm").into_iter().collect())
}

/// Width, height and colours; grey maps are spread over all three channels.
pub(super) fn read(bytes: &[u8]) -> Result<(u32, u32, Vec<[f32; 3]>), Fault> {
    let broken = |what: &str| Fault::invalid("header", what);
    let mut rest = bytes;
    let mut words = std::iter::from_fn(|| next_word(&mut rest));
    let channels = match words.next() {
        Some(b"PF") => 3,
        Some(b"Pf") => 1,
        _ => return Err(broken("it does not begin with PF or Pf")),
    };
    let mut number = || words.next().and_then(|word| std::str::from_utf8(word).ok());
    let mut side = || number().and_then(|word| word.parse::<u32>().ok()).filter(|side| *side > 0);
    let (Some(width), Some(height)) = (side(), side()) else { return Err(broken("width and height should be two whole numbers")) };
    let scale = number().and_then(|word| word.parse::<f32>().ok()).filter(|scale| scale.is_finite() && *scale != 0.0);
    let Some(scale) = scale else { return Err(broken("the scale should be a number other than 0")) };
    let need = u64::from(width).saturating_mul(u64::from(height)).saturating_mul(channels * 4);
    if rest.len() as u64 != need {
        return Err(Fault::invalid("content", format_args!("{} bytes, where {width} x {height} pixels have {need}", rest.len())));
    }
    let values = rest.as_chunks::<4>().0.iter().map(|&word| if scale < 0.0 { f32::from_le_bytes(word) } else { f32::from_be_bytes(word) });
    let color: Vec<[f32; 3]> = if channels == 3 {
        let values: Vec<f32> = values.collect();
        values.as_chunks::<3>().0.to_vec()
    } else {
        values.map(|value| [value; 3]).collect()
    };
    let upright = color.chunks(width as usize).rev().flatten().copied().collect();
    Ok((width, height, upright))
}

/// Letters up to one white character, which is taken too.
fn next_word<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let end = rest.iter().take(64).position(u8::is_ascii_whitespace)?;
    let (word, behind) = rest.split_at(end);
    *rest = &behind[1..];
    Some(word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{Options, write_picture};

    // Kills: rows from the top, big-endian numbers under a negative scale, a header of other lines.
    #[test]
    fn the_bytes_are_those_of_the_format() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pfm");
        let picture = Picture::of_color(1, 2, vec![[1.0, 2.0, 3.0], [-4.0, f32::NAN, 1e-40]]);
        assert!(write_picture(&path, &picture, &Options::default()).unwrap().is_empty());
        let mut expected = b"PF\n1 2\n-1.0\n".to_vec();
        [-4.0, f32::NAN, 1e-40, 1.0, 2.0, 3.0].iter().for_each(|value: &f32| expected.extend(value.to_le_bytes()));
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(bytes, expected);
        let (width, height, color) = read(&bytes).unwrap();
        assert_eq!((width, height, color[0], color[1][0], color[1][2]), (1, 2, [1.0, 2.0, 3.0], -4.0, 1e-40));
        assert!(color[1][1].is_nan());
    }

    // Kills: a header that is trusted about the size, big-endian and grey files misread.
    #[test]
    fn other_files_are_read_or_refused() {
        let grey = [&b"Pf\n1 1\n1.0\n"[..], &2.5f32.to_be_bytes()].concat();
        assert_eq!(read(&grey).unwrap(), (1, 1, vec![[2.5; 3]]));
        let long = [&grey[..], b"x"].concat();
        for bytes in [&b""[..], b"PF", b"P6\n1 1\n255\n", b"PF\n4294967295 4294967295\n-1\n", b"PF\n0 1\n-1\n", b"PF\n1 1\n0\n", &long] {
            assert!(read(bytes).is_err(), "{bytes:?}");
        }
    }
}
