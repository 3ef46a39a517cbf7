//! Textures of a material as files of linear floats, factors multiplied in.
//!
//! Key decision: a factor on top of a texture is something that few renderers have, so it is multiplied into the texels; floats lose nothing.

use std::path::Path;

use glam::Vec4;

use crate::{
    error::Error,
    output::{Options, Picture, write_picture},
    scene::{Image, Scene, TextureUse},
};

/// What is taken from a texel.
#[derive(Clone, Copy)]
pub(super) enum Take {
    /// Three channels through the curve of sRGB.
    Color(Vec4),
    /// One channel as it is, times a factor.
    Channel(usize, f32),
    /// Three channels as they are, x and y scaled about the middle.
    Normal(f32),
}

/// The curve of sRGB, IEC 61966-2-1.
fn linear(encoded: u8) -> f32 {
    let value = f32::from(encoded) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

fn texel(take: Take, texel: [u8; 4]) -> [f32; 3] {
    match take {
        Take::Color(factor) => [0, 1, 2].map(|channel| linear(texel[channel]) * factor[channel]),
        Take::Channel(channel, factor) => [f32::from(texel[channel]) / 255.0 * factor; 3],
        Take::Normal(scale) => {
            let about = |channel: usize, scale: f32| (f32::from(texel[channel]) / 255.0 - 0.5) * scale + 0.5;
            [about(0, scale), about(1, scale), about(2, 1.0)]
        }
    }
}

/// Writes an EXR file next to the scene.
pub(super) fn write(path: &Path, image: &Image, take: Take) -> Result<(), Error> {
    let texels: Vec<[f32; 3]> = image.texels.iter().map(|stored| texel(take, *stored)).collect();
    write_floats(path, image.width, image.height, texels)
}

/// Writes linear floats.
pub(super) fn write_floats(path: &Path, width: u32, height: u32, texels: Vec<[f32; 3]>) -> Result<(), Error> {
    write_picture(path, &Picture::of_color(width, height, texels), &Options::default()).map(|_| ())
}

/// The image of a texture.
pub(super) fn image<'a>(scene: &'a Scene, texture: &TextureUse) -> Option<&'a Image> {
    scene.images.get(texture.image as usize)
}
