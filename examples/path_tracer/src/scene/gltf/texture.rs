//! Images and how materials look into them.
//!
//! Key decision: an image is decoded when the first material that is really shown asks for it, and then shared.
//!
//! **Invariant:** the sizes in an image's header are compared with the caps before its texels are allocated.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

use glam::Vec3;
use image::{ImageFormat, ImageReader, Limits};
use serde::Deserialize;

use super::super::guard::guarded;
use super::super::limits;
use super::super::model::{Image, TextureUse, Wrap};
use super::Warnings;
use super::buffers::Buffers;
use super::json::{Document, TextureInfo, TextureTransform, extension};
use super::uri;
use crate::error::Fault;

/// EXT_texture_webp: an image that is preferred to the texture's own.
#[derive(Default, Deserialize)]
#[serde(default)]
struct WebP {
    source: Option<usize>,
}

/// Reads images on demand.
pub(super) struct Textures<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: &'a Buffers<'a>,
    pub(super) scene: &'a Path,
    /// The images read so far.
    pub(super) images: Vec<Image>,
    pub(super) known: HashMap<usize, u32>,
    pub(super) n_texels: u64,
}

impl Textures<'_> {
    /// What a material's texture slot says; `None` when it can show nothing.
    pub(super) fn read(&mut self, info: &TextureInfo, place: &str, warnings: &mut Warnings) -> Result<Option<TextureUse>, Fault> {
        let outer = |f: Fault| f.within(format_args!("texture {}", info.index));
        let missing = || Fault::invalid(format_args!("texture {}", info.index), "it does not exist");
        let texture = self.document.textures.get(info.index).ok_or_else(missing)?;
        let webp: Option<WebP> = extension(&texture.extensions, "EXT_texture_webp").map_err(outer)?;
        let Some(source) = webp.and_then(|webp| webp.source).or(texture.source) else {
            return match texture.extensions.keys().next() {
                Some(name) => Err(outer(Fault::unsupported("source", name))),
                None => {
                    warnings.push(format!("{place}: texture {} has no image and is left out", info.index));
                    Ok(None)
                }
            };
        };
        let transform: TextureTransform = extension(&info.extensions, "KHR_texture_transform").map_err(outer)?.unwrap_or_default();
        let uv_set = transform.tex_coord.unwrap_or(info.tex_coord);
        if uv_set > 1 {
            warnings.push(format!("{place}: texture {} wants texture coordinates {uv_set}, only 0 and 1 are read", info.index));
            return Ok(None);
        }
        let (wrap, linear) = self.sampler(texture.sampler).map_err(outer)?;
        let image = self.image(source).map_err(outer)?;
        Ok(Some(TextureUse { image, uv_set, wrap, linear, transform: rows(&transform) }))
    }

    fn sampler(&self, index: Option<usize>) -> Result<([Wrap; 2], bool), Fault> {
        let Some(index) = index else { return Ok(([Wrap::Repeat; 2], true)) };
        let fault = |what: &str| Fault::invalid(format_args!("sampler {index}"), what);
        let sampler = self.document.samplers.get(index).ok_or_else(|| fault("it does not exist"))?;
        let wrap = |code: Option<u32>| match code.unwrap_or(10497) {
            10497 => Ok(Wrap::Repeat),
            33648 => Ok(Wrap::Mirror),
            33071 => Ok(Wrap::Clamp),
            _ => Err(fault("the wrapping mode is unknown")),
        };
        Ok(([wrap(sampler.wrap_s)?, wrap(sampler.wrap_t)?], sampler.mag_filter != Some(9728)))
    }

    /// The place of an image in the scene, decoded at the first call.
    fn image(&mut self, index: usize) -> Result<u32, Fault> {
        if let Some(&known) = self.known.get(&index) {
            return Ok(known);
        }
        let place = format!("image {index}");
        let source = self.document.images.get(index).ok_or_else(|| Fault::invalid(&place, "it does not exist"))?;
        let external;
        let bytes = match (source.buffer_view, &source.uri) {
            (Some(view), _) => self.buffers.view(view).map_err(|f| f.within(&place))?.bytes,
            (None, Some(uri)) => {
                external = uri::resolve(uri, self.scene).map_err(|f| f.within(&place))?;
                &external
            }
            (None, None) => return Err(Fault::invalid(place, "there is neither a uri nor a bufferView")),
        };
        let name = match (&source.name, &source.uri) {
            (Some(name), _) => name.clone(),
            (None, Some(uri)) if !uri.starts_with("data:") => uri.clone(),
            _ => place.clone(),
        };
        let image = decode(bytes, name, self.n_texels_left()).map_err(|f| f.within(&place))?;
        let made = self.add(image);
        self.known.insert(index, made);
        Ok(made)
    }

    /// Texels that may still be made.
    pub(super) fn n_texels_left(&self) -> u64 {
        limits::IMAGE_TEXELS.saturating_sub(self.n_texels)
    }

    /// Takes an image into the scene; whoever made it asked for room first.
    pub(super) fn add(&mut self, image: Image) -> u32 {
        self.n_texels += image.texels.len() as u64;
        self.images.push(image);
        u32::try_from(self.images.len() - 1).unwrap_or(u32::MAX)
    }
}

/// Decodes PNG, JPEG or WebP; the first bytes decide which, because declared types are often wrong.
pub(in crate::scene) fn decode(bytes: &[u8], name: String, n_texels_left: u64) -> Result<Image, Fault> {
    let fault = |what: &str| Fault::invalid("pixels", what);
    let format = match bytes {
        [0x89, b'P', b'N', b'G', ..] => ImageFormat::Png,
        [0xFF, 0xD8, ..] => ImageFormat::Jpeg,
        [0xAB, b'K', b'T', b'X', ..] => return Err(Fault::unsupported("pixels", "KTX (KHR_texture_basisu)")),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => ImageFormat::WebP,
        [b'D', b'D', b'S', b' ', ..] => return Err(Fault::unsupported("pixels", "DDS")),
        [] => return Err(fault("the image is empty")),
        _ => return Err(Fault::unsupported("pixels", "an image that is neither PNG, JPEG nor WebP")),
    };
    let reader = |bytes| ImageReader::with_format(Cursor::new(bytes), format);
    let decoded = guarded(|| {
        let (width, height) = reader(bytes).into_dimensions().map_err(|e| e.to_string())?;
        if width > limits::IMAGE_SIDE || height > limits::IMAGE_SIDE || u64::from(width) * u64::from(height) > n_texels_left {
            return Err(format!("{width} x {height} texels are too many"));
        }
        if u64::from(width) * u64::from(height) > most_texels(bytes, format) {
            return Err(format!("{} bytes cannot hold {width} x {height} texels", bytes.len()));
        }
        let mut reader = reader(bytes);
        let mut caps = Limits::default();
        caps.max_image_width = Some(limits::IMAGE_SIDE);
        caps.max_image_height = Some(limits::IMAGE_SIDE);
        // Sixteen bits a channel are the widest that PNG has; the factor leaves room for the decoder's own rows.
        caps.max_alloc = Some(u64::from(width) * u64::from(height) * 16 + (1 << 24));
        reader.limits(caps);
        reader.decode().map(|image| image.into_rgba8()).map_err(|e| e.to_string())
    })
    .map_err(|what| fault(&what))?;
    let (width, height) = decoded.dimensions();
    let (texels, _) = decoded.as_raw().as_chunks::<4>();
    if texels.is_empty() {
        return Err(fault("there are no texels"));
    }
    Ok(Image { name, width, height, texels: texels.to_vec() })
}

/// The most texels that an image of so many bytes can have; decoders make room for what a header promises.
fn most_texels(bytes: &[u8], format: ImageFormat) -> u64 {
    let n_bits = bytes.len() as u64 * 8;
    if format == ImageFormat::Jpeg {
        // Every block of 64 texels takes a bit at least.
        return n_bits.saturating_mul(64);
    }
    // Deflate makes 1032 bytes out of one at most; the header of a PNG says how many bits a texel has.
    let channels = match bytes.get(25) {
        Some(2) => 3,
        Some(4) => 2,
        Some(6) => 4,
        _ => 1,
    };
    let depth = bytes.get(24).copied().unwrap_or(1).max(1);
    n_bits.saturating_mul(1032) / (u64::from(depth) * channels)
}

/// Scale first, then rotation, then offset. The rotation is counter-clockwise as seen in the picture, where v grows downwards; the
/// extension's own test model shows that this sense is meant.
fn rows(transform: &TextureTransform) -> [Vec3; 2] {
    let [u, v] = transform.offset.unwrap_or([0.0; 2]);
    let [scale_u, scale_v] = transform.scale.unwrap_or([1.0; 2]);
    let (sin, cos) = transform.rotation.sin_cos();
    [Vec3::new(cos * scale_u, sin * scale_v, u), Vec3::new(-sin * scale_u, cos * scale_v, v)]
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: rotation before scale, clockwise rotation, and a scaled offset.
    #[test]
    fn texture_transforms_follow_the_extension() {
        let transform =
            TextureTransform { offset: Some([0.25, 0.5]), rotation: std::f32::consts::FRAC_PI_2, scale: Some([2.0, 3.0]), tex_coord: None };
        let rows = rows(&transform);
        let at = |u: f32, v: f32| [rows[0].dot(Vec3::new(u, v, 1.0)), rows[1].dot(Vec3::new(u, v, 1.0))];
        for ((u, v), expected) in [((0.0, 0.0), [0.25, 0.5]), ((1.0, 0.0), [0.25, -1.5]), ((0.0, 1.0), [3.25, 0.5])] {
            let [x, y] = at(u, v);
            assert!((x - expected[0]).abs() < 1e-5 && (y - expected[1]).abs() < 1e-5, "{u} {v}: {x} {y}");
        }
    }

    // Kills: a format chosen by name instead of content, and silence about what is not supported.
    #[test]
    fn other_formats_are_refused_by_name() {
        for (bytes, name) in [(&b"\xABKTX 20\xBB"[..], "basisu"), (b"GIF89a", "PNG"), (b"DDS \0", "DDS"), (b"BM\0\0", "PNG")] {
            let text = decode(bytes, String::new(), 1).unwrap_err().in_named("x").to_string();
            assert!(text.contains(name), "{text}");
        }
    }

    // Kills: a bound that refuses the flattest honest pictures, and one that believes a header.
    #[test]
    fn sizes_are_compared_with_what_bytes_can_hold() {
        for format in [ImageFormat::Png, ImageFormat::Jpeg] {
            let mut bytes = Vec::new();
            let flat = image::GrayImage::from_pixel(2048, 1024, image::Luma([128]));
            flat.write_to(&mut Cursor::new(&mut bytes), format).unwrap();
            assert!(decode(&bytes, String::new(), u64::MAX).is_ok(), "{format:?}: {} bytes", bytes.len());
            let cut = decode(&bytes[..bytes.len() / 16], String::new(), u64::MAX);
            let text = cut.map(|image| image.texels.len()).unwrap_err().in_named("x").to_string();
            assert!(text.contains("bytes cannot hold 2048 x 1024 texels"), "{format:?}: {text}");
        }
    }

    // Kills: a cap that is only asked after the texels are there.
    #[test]
    fn the_budget_of_texels_is_kept() {
        let mut png = Vec::new();
        image::RgbaImage::new(5, 4).write_to(&mut Cursor::new(&mut png), ImageFormat::Png).unwrap();
        assert!(decode(&png, String::new(), 19).is_err());
        assert_eq!(decode(&png, String::new(), 20).unwrap().texels.len(), 20);
    }
}
