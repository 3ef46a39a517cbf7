//! Images as words of the texel buffer.
//!
//! Key decision: images stay as 8-bit RGBA, one word per texel, and bytes that encode colour are decoded by a table of 256 values that the
//! host computes in f64. Each way of looking into an image is a record of its own.
//!
//! **Invariant:** every record's image lies inside the buffer.

use std::collections::HashMap;

use super::{
    error::Error,
    records::{NONE, TextureRecord, texture_flags},
};
use crate::scene::{Image, TextureUse, Wrap};

/// Images and records under construction.
#[derive(Debug, Default)]
pub(crate) struct Textures {
    /// The texel buffer so far.
    pub(crate) words: Vec<u32>,
    /// One per distinct use.
    pub(crate) records: Vec<TextureRecord>,
    first_words: HashMap<u32, u32>,
}

impl Textures {
    /// The record for a use, `NONE` for no use.
    pub(crate) fn add(&mut self, images: &[Image], usage: Option<&TextureUse>, material: usize) -> Result<u32, Error> {
        let Some(usage) = usage else { return Ok(NONE) };
        let image = images.get(usage.image as usize).ok_or(Error::Dangling {
            what: "material",
            index: material,
            target: "image",
            value: usage.image,
            count: images.len(),
        })?;
        let first = match self.first_words.get(&usage.image) {
            Some(&first) => first,
            None => self.store(usage.image, image)?,
        };
        let record = TextureRecord {
            row_u: usage.transform[0].into(),
            texels: first,
            row_v: usage.transform[1].into(),
            flags: flags(usage),
            width: image.width,
            height: image.height,
            ..TextureRecord::default()
        };
        let known = self.records.iter().position(|other| *other == record);
        Ok(known.unwrap_or_else(|| {
            self.records.push(record);
            self.records.len() - 1
        }) as u32)
    }

    fn store(&mut self, index: u32, image: &Image) -> Result<u32, Error> {
        let expected = u64::from(image.width) * u64::from(image.height);
        if expected == 0 || image.texels.len() as u64 != expected {
            let (name, texels) = (image.name.clone(), image.texels.len());
            return Err(Error::BadImage { what: "image", name, width: image.width, height: image.height, texels });
        }
        let first = self.words.len();
        if first as u64 + expected > u64::from(u32::MAX) {
            return Err(Error::TooMany { what: "texels", count: first as u64 + expected, limit: u64::from(u32::MAX) });
        }
        self.words.extend(image.texels.iter().map(|&texel| u32::from_le_bytes(texel)));
        self.first_words.insert(index, first as u32);
        Ok(first as u32)
    }
}

fn flags(usage: &TextureUse) -> u32 {
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    };
    let mut flags = wrap(usage.wrap[0]) << texture_flags::WRAP_U_SHIFT | wrap(usage.wrap[1]) << texture_flags::WRAP_V_SHIFT;
    if usage.linear {
        flags |= texture_flags::LINEAR;
    }
    if usage.uv_set == 1 {
        flags |= texture_flags::SECOND_UV;
    }
    flags
}

/// The linear value of an sRGB byte. Source: IEC 61966-2-1.
pub(crate) fn srgb_to_linear(byte: u8) -> f64 {
    let encoded = f64::from(byte) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The mean linear colour of an image, which weighs lights that wear it.
pub(crate) fn mean_color(image: &Image) -> [f64; 3] {
    let mut histogram = [[0u64; 256]; 3];
    for texel in &image.texels {
        for (channel, counts) in histogram.iter_mut().enumerate() {
            counts[usize::from(texel[channel])] += 1;
        }
    }
    let count = image.texels.len().max(1) as f64;
    histogram.map(|counts| (0u8..=255).zip(counts).map(|(byte, times)| srgb_to_linear(byte) * times as f64).sum::<f64>() / count)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn image() -> Image {
        Image { name: String::from("checker"), width: 2, height: 1, texels: vec![[255, 0, 128, 255], [255, 255, 128, 0]] }
    }

    fn usage(linear: bool) -> TextureUse {
        TextureUse { image: 0, uv_set: 1, wrap: [Wrap::Mirror, Wrap::Clamp], linear, transform: [Vec3::X, Vec3::Y] }
    }

    // Kills: an image stored once per use, flags in the wrong bits, channels in the wrong order.
    #[test]
    fn an_image_is_stored_once() {
        let mut textures = Textures::default();
        let indices: Vec<u32> =
            [true, false, true].iter().map(|&linear| textures.add(&[image()], Some(&usage(linear)), 0).expect("a good image")).collect();
        assert_eq!(indices, [0, 1, 0]);
        assert_eq!(textures.words, [0xff80_00ff, 0x0080_ffff]);
        assert_eq!(textures.records[0].flags, 1 | 2 << 2 | texture_flags::LINEAR | texture_flags::SECOND_UV);
        assert_eq!(textures.add(&[image()], None, 0), Ok(NONE));
    }

    // Kills: a mean of encoded bytes, a channel read from its neighbour.
    #[test]
    fn the_mean_is_linear() {
        let mean = mean_color(&image());
        assert!((mean[0] - 1.0).abs() < 1e-12 && (mean[1] - 0.5).abs() < 1e-12, "{mean:?}");
        assert!((mean[2] - 0.215_860_5).abs() < 1e-6, "{mean:?}");
    }

    // Kills: an image whose texels are fewer than its size promises.
    #[test]
    fn a_short_image_is_refused() {
        let short = Image { texels: vec![[0; 4]], ..image() };
        let error = Textures::default().add(&[short], Some(&usage(true)), 0).expect_err("one texel of two");
        assert_eq!(error.to_string(), "image `checker` is 2 x 1 and has 1 texels");
    }
}
