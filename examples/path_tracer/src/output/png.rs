//! 8-bit and 16-bit sRGB PNG.
//!
//! Key decision: exposure, a tone map and the exact sRGB curve, nothing else; a picture that should look different is graded from the EXR.
//! Alpha is a factor of the colour in a [`Picture`] and none in a PNG, so it is divided out before anything bends the colour.

use std::io;
use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::{Bits, Options, Picture, atomic, tone_map::between_0_and};
use crate::error::Error;

/// Writes a checked picture.
///
/// # Errors
/// When the operating system refuses.
pub(super) fn write(path: &Path, picture: &Picture, options: &Options) -> Result<Vec<String>, Error> {
    let values = displayed(picture, options);
    let (bytes, kind): (Vec<u8>, ExtendedColorType) = match (options.bits, picture.alpha.is_some()) {
        (Bits::Eight, false) => (quantised_8(&values), ExtendedColorType::Rgb8),
        (Bits::Eight, true) => (quantised_8(&values), ExtendedColorType::Rgba8),
        (Bits::Sixteen, false) => (quantised_16(&values), ExtendedColorType::Rgb16),
        (Bits::Sixteen, true) => (quantised_16(&values), ExtendedColorType::Rgba16),
    };
    encode(path, [picture.width, picture.height], &bytes, kind)?;
    Ok(picture.left_out(true, "a .png").into_iter().collect())
}

/// Writes RGB bytes as they are, row 0 at the top.
///
/// # Errors
/// When they do not fill the size, or the operating system refuses.
pub(super) fn write_bytes(path: &Path, size: [u32; 2], bytes: &[u8]) -> Result<(), Error> {
    encode(path, size, bytes, ExtendedColorType::Rgb8)
}

/// The bytes of [`write_bytes`] that a file of the picture would have; alpha is divided out and left out.
pub(super) fn bytes(picture: &Picture, options: &Options) -> Vec<u8> {
    let values = displayed(picture, options);
    let channels = if picture.alpha.is_some() { 4 } else { 3 };
    quantised_8(&values).chunks(channels).flat_map(|pixel| pixel.iter().take(3)).copied().collect()
}

fn encode(path: &Path, [width, height]: [u32; 2], bytes: &[u8], kind: ExtendedColorType) -> Result<(), Error> {
    // The encoder panics on bytes that do not fill the size.
    if u64::from(width) * u64::from(height) * u64::from(kind.bits_per_pixel()) != bytes.len() as u64 * 8 {
        return Err(Error::write(path, format_args!("{} bytes do not fill {width} x {height}", bytes.len())));
    }
    atomic::write(path, |writer| PngEncoder::new(writer).write_image(bytes, width, height, kind).map_err(io::Error::other))
        .map_err(|e| Error::write(path, e))
}

/// All values of the file in order, each in 0..=1.
fn displayed(picture: &Picture, options: &Options) -> Vec<f32> {
    let scale = options.exposure.exp2();
    let pixel = |color: [f32; 3], alpha: f32| {
        let straight = if alpha > 0.0 { scale / alpha } else { 0.0 };
        options.tone_map.apply(color.map(|value| value * straight)).map(encode_srgb)
    };
    match &picture.alpha {
        None => picture.color.iter().flat_map(|&color| pixel(color, 1.0)).collect(),
        Some(alpha) => picture
            .color
            .iter()
            .zip(alpha.iter().map(|&alpha| between_0_and(1.0, alpha)))
            .flat_map(|(&color, alpha)| pixel(color, alpha).into_iter().chain([alpha]))
            .collect(),
    }
}

fn quantised_8(values: &[f32]) -> Vec<u8> {
    values.iter().map(|value| (value * 255.0 + 0.5) as u8).collect()
}

/// In the byte order of this machine, as the encoder takes them.
fn quantised_16(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| ((value * 65_535.0 + 0.5) as u16).to_ne_bytes()).collect()
}

/// The share of a display's range that shows a linear value in 0..=1.
///
/// **Source:** IEC 61966-2-1.
pub fn encode_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { (1.055 * linear.powf(1.0 / 2.4) - 0.055).min(1.0) }
}

/// The linear value that [`encode_srgb`] encodes as `encoded`.
///
/// **Source:** IEC 61966-2-1.
pub fn decode_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{ToneMap, write_picture};

    // Kills: a plain power of 2.2, truncation instead of rounding, and wrap-around above 1.
    #[test]
    fn known_values_of_the_curve() {
        let byte = |linear: f32| {
            let picture = Picture::of_color(1, 1, vec![[linear; 3]]);
            quantised_8(&displayed(&picture, &Options::default()))[0]
        };
        let cases = [(0.0, 0), (0.5, 188), (0.18, 118), (1.0, 255), (0.002, 7), (0.001, 3), (7.0, 255), (-1.0, 0), (f32::NAN, 0)];
        for (linear, expected) in cases {
            assert_eq!(byte(linear), expected, "{linear}");
        }
        assert_eq!(byte(f32::INFINITY), 255);
        // Each byte comes back from the middle of its interval.
        for expected in 0..=255u8 {
            assert_eq!(byte(decode_srgb(f32::from(expected) / 255.0)), expected);
        }
    }

    // Kills: rows upside down, swapped channels, exposure with the wrong sign, 16 bits in the wrong byte order or from 8.
    #[test]
    fn a_picture_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let color = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.25, 0.25, 0.25], [0.0; 3], [1.0; 3]];
        let picture = Picture::of_color(2, 3, color);
        let exposed = Options { exposure: 1.0, ..Options::default() };
        write_picture(&path, &picture, &exposed).unwrap();
        let read = image::open(&path).unwrap().into_rgb8();
        assert_eq!(read.dimensions(), (2, 3));
        assert_eq!((read.get_pixel(0, 0).0, read.get_pixel(1, 0).0, read.get_pixel(0, 1).0), ([255, 0, 0], [0, 255, 0], [0, 0, 255]));
        assert_eq!(read.get_pixel(1, 1).0, [188; 3]);

        write_picture(&path, &picture, &Options { bits: Bits::Sixteen, ..exposed }).unwrap();
        let image::DynamicImage::ImageRgb16(read) = image::open(&path).unwrap() else { panic!("not 16 bits") };
        assert_eq!((read.get_pixel(0, 0).0, read.get_pixel(1, 1).0), ([65_535, 0, 0], [48_192; 3]));
    }

    // Kills: colours that stay multiplied by alpha, alpha bent by the sRGB curve or the exposure, a tone map that is not asked for.
    #[test]
    fn alpha_is_divided_out_and_stays_linear() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let color = vec![[0.25, 0.125, 0.0], [0.0; 3]];
        let picture = Picture { alpha: Some(vec![0.5, 0.0]), ..Picture::of_color(2, 1, color) };
        write_picture(&path, &picture, &Options::default()).unwrap();
        let read = image::open(&path).unwrap().into_rgba8();
        assert_eq!((read.get_pixel(0, 0).0, read.get_pixel(1, 0).0), ([188, 137, 0, 128], [0; 4]));
        write_picture(&path, &picture, &Options { tone_map: ToneMap::Agx, ..Options::default() }).unwrap();
        assert!(image::open(&path).unwrap().into_rgba8().get_pixel(0, 0).0[2] > 20);
    }
}
