//! Float EXR: the pixels as they were rendered.
//!
//! Key decision: 32-bit floats in ZIP blocks of 16 lines, which every program reads; the file equals the pixels bit for bit.

use std::io;
use std::path::Path;

use ::exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage};

use super::{atomic, check_size};
use crate::error::Error;

/// Writes linear radiance, row 0 on top, as channels R, G and B.
///
/// # Errors
/// When the size does not fit the pixels, or the operating system refuses.
pub fn write(path: &Path, width: u32, height: u32, pixels: &[[f32; 3]]) -> Result<(), Error> {
    check_size(path, width, height, pixels)?;
    let (width, height) = (width as usize, height as usize);
    let color = |Vec2(x, y): Vec2<usize>| {
        let [r, g, b] = pixels[y * width + x];
        (r, g, b)
    };
    let encoding = Encoding { compression: ::exr::compression::Compression::ZIP16, ..Encoding::FAST_LOSSLESS };
    let layer = Layer::new((width, height), LayerAttributes::default(), encoding, SpecificChannels::rgb(color));
    let image = Image::from_layer(layer);
    atomic::write(path, |writer| image.write().to_buffered(writer).map_err(io::Error::other)).map_err(|e| Error::write(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load_environment;

    // Kills: half floats, rows upside down, and swapped channels; odd sizes leave a short last block.
    #[test]
    fn a_picture_comes_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let pixels: Vec<[f32; 3]> = (0..7 * 19).map(|i| [i as f32 / 3.0, 1.0e-30 * i as f32, 1.0e30]).collect();
        write(&path, 7, 19, &pixels).unwrap();
        let (read, warnings) = load_environment(&path).unwrap();
        assert_eq!((read.width, read.height, read.texels), (7, 19, pixels));
        assert!(warnings.is_empty());
    }
}
