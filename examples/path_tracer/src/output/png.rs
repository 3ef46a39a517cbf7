//! 8-bit and 16-bit sRGB PNG.
//!
//! Key decision: exposure, a tone map and the exact sRGB curve, nothing else; a picture that should look different is graded from the EXR.
//! Alpha is a factor of the colour in a [`Picture`] and none in a PNG, so it is divided out before anything bends the colour. Facts are
//! texts in front of the pixels, under the names that they have in an EXR.
//!
//! **Invariant:** a picture without facts is header and pixels, nothing else.

use std::io;
use std::path::Path;

use ::png::text_metadata::{ITXtChunk, TEXtChunk};
use ::png::{BitDepth, ColorType, Compression, Encoder, EncodingError, Filter};

use super::{Bits, Facts, Options, Picture, atomic, picture, tone_map::between_0_and};
use crate::error::Error;

/// Writes a checked picture.
///
/// # Errors
/// When the operating system refuses.
pub(super) fn write(path: &Path, picture: &Picture, options: &Options) -> Result<Vec<String>, Error> {
    let values = displayed(picture, options);
    let (bytes, depth) = match options.bits {
        Bits::Eight => (quantised_8(&values), BitDepth::Eight),
        Bits::Sixteen => (quantised_16(&values), BitDepth::Sixteen),
    };
    let form = Form {
        size: [picture.width, picture.height],
        color: if picture.alpha.is_some() { ColorType::Rgba } else { ColorType::Rgb },
        depth,
    };
    let texts = texts(&picture.facts);
    atomic::write(path, |writer| encode(writer, &form, &texts, &bytes).map_err(io::Error::other)).map_err(|e| Error::write(path, e))?;
    Ok(picture.left_out(true, "a .png").into_iter().collect())
}

/// Writes RGB bytes as they are, row 0 at the top.
///
/// # Errors
/// When they do not fill the size, or the operating system refuses.
pub(super) fn write_bytes(path: &Path, size: [u32; 2], bytes: &[u8]) -> Result<(), Error> {
    let form = Form { size, color: ColorType::Rgb, depth: BitDepth::Eight };
    atomic::write(path, |writer| encode(writer, &form, &[], bytes).map_err(io::Error::other)).map_err(|e| Error::write(path, e))
}

/// The bytes of [`write_bytes`] that a file of the picture would have; alpha is divided out and left out.
pub(super) fn bytes(picture: &Picture, options: &Options) -> Vec<u8> {
    let values = displayed(picture, options);
    let channels = if picture.alpha.is_some() { 4 } else { 3 };
    quantised_8(&values).chunks(channels).flat_map(|pixel| pixel.iter().take(3)).copied().collect()
}

/// What the header says.
struct Form {
    size: [u32; 2],
    color: ColorType,
    depth: BitDepth,
}

/// Header, texts and pixels; with the packing that the crate `image` has by default.
fn encode(writer: &mut impl io::Write, form: &Form, texts: &[(String, String)], bytes: &[u8]) -> Result<(), EncodingError> {
    let mut encoder = Encoder::new(writer, form.size[0], form.size[1]);
    encoder.set_color(form.color);
    encoder.set_depth(form.depth);
    encoder.set_compression(Compression::Fast);
    encoder.set_filter(Filter::Adaptive);
    let mut writer = encoder.write_header()?;
    for (name, value) in texts {
        // The older kind of text is read by more programs and holds Latin-1, the newer one UTF-8.
        if value.is_ascii() {
            writer.write_text_chunk(&TEXtChunk::new(name, value))?;
        } else {
            writer.write_text_chunk(&ITXtChunk::new(name, value))?;
        }
    }
    writer.write_image_data(bytes)?;
    writer.finish()
}

/// The program under the keyword that the format has for it, then everything that is known; nothing of nothing.
///
/// **Source:** PNG, third edition, 11.3.3 (textual information).
fn texts(facts: &Facts) -> Vec<(String, String)> {
    if facts.texts.is_empty() {
        return Vec::new();
    }
    let facts = facts.texts.iter().map(|(name, value)| (picture::line(name), picture::line(value)));
    [(String::from("Software"), String::from(picture::SOFTWARE))].into_iter().chain(facts).collect()
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

/// In the byte order of the file.
fn quantised_16(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| ((value * 65_535.0 + 0.5) as u16).to_be_bytes()).collect()
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

    // Kills: a fact left out, renamed or out of order, a text of another alphabet as Latin-1, a line break, texts behind the pixels.
    #[test]
    fn facts_are_texts_before_the_pixels() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let mut picture = Picture::of_color(2, 1, vec![[0.25; 3]; 2]);
        let facts = [("command", "path-tracer render 'a b.glb' --seed 7"), ("scene", "H\u{e4}user \u{5bb6}"), ("seed", "7\n8")];
        picture.facts.texts = facts.map(|(name, text)| (name.to_owned(), text.to_owned())).into();
        write_picture(&path, &picture, &Options::default()).unwrap();
        // The decoder has not come to the pixels yet.
        let reader = ::png::Decoder::new(io::BufReader::new(std::fs::File::open(&path).unwrap())).read_info().unwrap();
        let plain = reader.info().uncompressed_latin1_text.iter().map(|chunk| (chunk.keyword.as_str(), chunk.text.as_str()));
        let expected = [("Software", picture::SOFTWARE), facts[0], ("seed", "7 8")];
        assert_eq!(plain.collect::<Vec<_>>(), expected);
        let utf8: Vec<_> = reader.info().utf8_text.iter().map(|chunk| (chunk.keyword.as_str(), chunk.get_text().unwrap())).collect();
        assert_eq!(utf8, [("scene", facts[1].1.to_owned())]);
        assert_eq!(image::open(&path).unwrap().into_rgb8().get_pixel(1, 0).0, [137; 3]);
    }

    // Kills: a chunk in a picture of which nothing is known, another packing than before.
    #[test]
    fn a_picture_without_facts_is_header_and_pixels() {
        use image::ImageEncoder as _;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let color: Vec<[f32; 3]> = (0..600).map(|i| [i as f32 / 600.0, (i % 7) as f32 / 7.0, 0.5]).collect();
        let picture = Picture { alpha: Some(vec![1.0; 600]), ..Picture::of_color(30, 20, color) };
        write_picture(&path, &picture, &Options::default()).unwrap();
        let mut expected = Vec::new();
        let bytes = quantised_8(&displayed(&picture, &Options::default()));
        let encoder = image::codecs::png::PngEncoder::new(&mut expected);
        encoder.write_image(&bytes, 30, 20, image::ExtendedColorType::Rgba8).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), expected);
    }
}
