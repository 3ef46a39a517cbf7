//! 8-bit sRGB PNG.
//!
//! Key decision: exposure and the exact sRGB curve, clipped at 1, nothing else; a picture that should look different is graded from the
//! EXR.

use std::io;
use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::{atomic, check_size};
use crate::error::Error;

/// Writes linear radiance, row 0 on top, multiplied by `2^exposure`.
///
/// # Errors
/// When the size does not fit the pixels, or the operating system refuses.
pub fn write(path: &Path, width: u32, height: u32, pixels: &[[f32; 3]], exposure: f32) -> Result<(), Error> {
    check_size(path, width, height, pixels)?;
    let scale = exposure.exp2();
    let bytes: Vec<u8> = pixels.as_flattened().iter().map(|&value| encode_srgb(value * scale)).collect();
    atomic::write(path, |writer| {
        PngEncoder::new(writer).write_image(&bytes, width, height, ExtendedColorType::Rgb8).map_err(io::Error::other)
    })
    .map_err(|e| Error::write(path, e))
}

/// The byte that shows a linear value; NaN is black.
///
/// **Source:** IEC 61966-2-1.
pub fn encode_srgb(linear: f32) -> u8 {
    let clipped = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    let encoded = if clipped <= 0.003_130_8 { 12.92 * clipped } else { 1.055 * clipped.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a plain power of 2.2, truncation instead of rounding, and wrap-around above 1.
    #[test]
    fn known_values_of_the_curve() {
        let cases = [(0.0, 0), (0.5, 188), (0.18, 118), (1.0, 255), (0.002, 7), (0.001, 3), (7.0, 255), (-1.0, 0), (f32::NAN, 0)];
        for (linear, byte) in cases {
            assert_eq!(encode_srgb(linear), byte, "{linear}");
        }
        assert_eq!(encode_srgb(f32::INFINITY), 255);
        // Each byte comes back from the middle of its interval.
        for byte in 0..=255u8 {
            let s = f32::from(byte) / 255.0;
            let linear = if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
            assert_eq!(encode_srgb(linear), byte);
        }
    }

    // Kills: rows upside down, swapped channels, and exposure with the wrong sign.
    #[test]
    fn a_picture_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let pixels = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.25, 0.25, 0.25], [0.0; 3], [1.0; 3]];
        write(&path, 2, 3, &pixels, 1.0).unwrap();
        let read = image::open(&path).unwrap().into_rgb8();
        assert_eq!(read.dimensions(), (2, 3));
        assert_eq!((read.get_pixel(0, 0).0, read.get_pixel(1, 0).0, read.get_pixel(0, 1).0), ([255, 0, 0], [0, 255, 0], [0, 0, 255]));
        assert_eq!(read.get_pixel(1, 1).0, [188; 3]);
    }
}
