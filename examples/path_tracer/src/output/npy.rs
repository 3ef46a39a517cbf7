//! NumPy's own file of one array: `numpy.load` gives float32 of shape (height, width, 3).
//!
//! Key decision: written here, because of the format only one array in row order is used. Reading takes the arrays that others write of
//! pictures: floats of 2, 4 or 8 bytes in either byte order, grey, RGB or RGBA, in row order.
//!
//! **Source:** NumPy, `numpy.lib.format`, version 1.0 of the format.

use std::io::Write as _;
use std::path::Path;

use half::f16;

use super::{Picture, atomic};
use crate::error::{Error, Fault};

const MAGIC: &[u8] = b"\x93NUMPY";
/// Data begin at a multiple of this.
const ALIGNMENT: usize = 64;

/// Writes a checked picture.
///
/// # Errors
/// When the operating system refuses.
pub(super) fn write(path: &Path, picture: &Picture) -> Result<Vec<String>, Error> {
    let shape = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, 3), }}", picture.height, picture.width);
    // Magic, version and length take ten bytes, the line break one.
    let padded = (shape.len() + 11).next_multiple_of(ALIGNMENT) - 11;
    atomic::write(path, |writer| {
        writer.write_all(MAGIC)?;
        writer.write_all(&[1, 0])?;
        // A shape of two 32-bit numbers is far from 65,535 characters.
        writer.write_all(&(padded as u16 + 1).to_le_bytes())?;
        writeln!(writer, "{shape:padded$}")?;
        picture.color.as_flattened().iter().try_for_each(|value| writer.write_all(&value.to_le_bytes()))
    })
    .map_err(|e| Error::write(path, e))?;
    Ok(picture.left_out(false, "an .npy").into_iter().collect())
}

/// Width, height and colours. Grey is spread over all three channels, a fourth channel is left out.
pub(super) fn read(bytes: &[u8]) -> Result<(u32, u32, Vec<[f32; 3]>), Fault> {
    let (header, content) = split(bytes)?;
    let broken = |what: &str| Fault::invalid("header", what);
    let after = |key: &str| header.split_once(key).map(|(_, rest)| rest.trim_start_matches([':', ' ']));
    if !after("'fortran_order'").is_some_and(|rest| rest.starts_with("False")) {
        return Err(Fault::unsupported("header", "an array in the order of columns"));
    }
    let kind = after("'descr'").and_then(|rest| rest.strip_prefix('\'')?.split('\'').next()).ok_or_else(|| broken("no 'descr'"))?;
    let (order, size) = match kind {
        "<f2" | ">f2" | "<f4" | ">f4" | "<f8" | ">f8" => (&kind[..1], usize::from(kind.as_bytes()[2] - b'0')),
        _ => return Err(Fault::unsupported("header", format_args!("the type {kind} (f2, f4 and f8 are read)"))),
    };
    let shape = after("'shape'").and_then(|rest| rest.strip_prefix('(')?.split(')').next()).ok_or_else(|| broken("no 'shape'"))?;
    let sides: Option<Vec<u32>> = shape.split(',').map(str::trim).filter(|side| !side.is_empty()).map(|side| side.parse().ok()).collect();
    let (height, width, channels) = match sides.as_deref() {
        Some([height, width]) => (*height, *width, 1),
        Some([height, width, channels @ (1 | 3 | 4)]) => (*height, *width, *channels as usize),
        _ => return Err(Fault::unsupported("header", format_args!("the shape ({shape}); (h, w), (h, w, 3) and (h, w, 4) are read"))),
    };
    let need = u64::from(width).saturating_mul(u64::from(height)).saturating_mul((channels * size) as u64);
    if need == 0 || content.len() as u64 != need {
        return Err(Fault::invalid("content", format_args!("{} bytes, where the shape ({shape}) has {need}", content.len())));
    }
    let mut values = content.chunks_exact(size).map(|word| number(word, order == "<"));
    let mut color = Vec::with_capacity(content.len() / (channels * size));
    while let Some(first) = values.next() {
        color.push(match channels {
            1 => [first; 3],
            _ => {
                let (green, blue) = (values.next().unwrap_or(0.0), values.next().unwrap_or(0.0));
                if channels == 4 {
                    let _alpha = values.next();
                }
                [first, green, blue]
            }
        });
    }
    Ok((width, height, color))
}

/// Header and data.
fn split(bytes: &[u8]) -> Result<(&str, &[u8]), Fault> {
    let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| Fault::invalid("header", "it is no array of NumPy"))?;
    let cut = || Fault::invalid("header", "it is cut off");
    let (start, length) = match rest {
        [1, _, a, b, ..] => (4, usize::from(u16::from_le_bytes([*a, *b]))),
        [2 | 3, _, a, b, c, d, ..] => (6, u32::from_le_bytes([*a, *b, *c, *d]) as usize),
        [version, ..] if *version > 3 => return Err(Fault::unsupported("header", format_args!("version {version} of the format"))),
        _ => return Err(cut()),
    };
    let header = rest[start..].get(..length).ok_or_else(cut)?;
    let text = std::str::from_utf8(header).map_err(|_| Fault::invalid("header", "it is not UTF-8"))?;
    Ok((text, &rest[start + length..]))
}

/// A word of 2, 4 or 8 bytes.
fn number(word: &[u8], is_little: bool) -> f32 {
    let mut little = [0u8; 8];
    for (index, byte) in word.iter().enumerate() {
        little[if is_little { index } else { word.len() - 1 - index }] = *byte;
    }
    let [a, b, c, d, ..] = little;
    match word.len() {
        2 => f16::from_le_bytes([a, b]).to_f32(),
        4 => f32::from_le_bytes([a, b, c, d]),
        _ => f64::from_le_bytes(little) as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{Options, write_picture};

    // Kills: width before height, columns first, big-endian numbers, data that do not begin at a multiple of 64.
    #[test]
    fn the_bytes_are_those_of_the_format() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let picture = Picture::of_color(1, 2, vec![[1.0, 2.0, 3.0], [-4.0, f32::INFINITY, 1e-40]]);
        assert!(write_picture(&path, &picture, &Options::default()).unwrap().is_empty());
        let bytes = std::fs::read(&path).unwrap();
        let (header, data) = bytes.split_at(128);
        assert_eq!(&header[..10], b"\x93NUMPY\x01\x00\x76\x00");
        let text = std::str::from_utf8(&header[10..]).unwrap();
        assert!(text.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 1, 3), }  ") && text.ends_with(" \n"), "{text:?}");
        let expected: Vec<u8> = [1.0, 2.0, 3.0, -4.0, f32::INFINITY, 1e-40].iter().flat_map(|value: &f32| value.to_le_bytes()).collect();
        assert_eq!(data, expected);
        assert_eq!(read(&bytes).unwrap(), (1, 2, picture.color));
    }

    // Kills: a shape that is trusted about the size, other types and orders misread instead of refused.
    #[test]
    fn other_arrays_are_read_or_refused() {
        let array = |kind: &str, order: &str, shape: &str, data: &[u8]| {
            let header = format!("{{'shape': {shape}, 'fortran_order': {order}, 'descr': '{kind}'}}\n");
            let length = (header.len() as u16).to_le_bytes();
            [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
        };
        assert_eq!(read(&array(">f8", "False", "(1, 1)", &2.5f64.to_be_bytes())).unwrap(), (1, 1, vec![[2.5; 3]]));
        let halves: Vec<u8> = [1.0, 2.0, 3.0, 9.0].iter().flat_map(|value| f16::from_f32(*value).to_le_bytes()).collect();
        assert_eq!(read(&array("<f2", "False", "(1, 1, 4)", &halves)).unwrap(), (1, 1, vec![[1.0, 2.0, 3.0]]));
        let refused = [
            array("<f4", "True", "(1, 1)", &[0; 4]),
            array("<i4", "False", "(1, 1)", &[0; 4]),
            array("<f4", "False", "(4294967295, 4294967295, 4)", &[0; 4]),
            array("<f4", "False", "(1, 1, 2)", &[0; 8]),
            array("<f4", "False", "(0, 1)", &[]),
            array("<f4", "False", "(1, 1)", &[0; 5]),
            b"\x93NUMPY\x01\x00\xff\xff{}".to_vec(),
            b"\x93NUMPY\x09\x00".to_vec(),
            b"\x93NUMPY".to_vec(),
        ];
        refused.iter().for_each(|bytes| assert!(read(bytes).is_err(), "{bytes:?}"));
    }
}
