//! KHR_materials_pbrSpecularGlossiness in terms of metallic-roughness.
//!
//! Key decision: the conversion that Khronos published with the extension, texel by texel where textures ask for it: new images of the
//! base colour and of metallic and roughness are made, the factors multiplied in. Glossiness becomes one minus roughness. What it gives up
//! is the colour of the reflection of dielectrics, which metallic-roughness does not have.
//!
//! Source: KhronosGroup/glTF, `extensions/2.0/Archived/KHR_materials_pbrSpecularGlossiness`, conversion between the workflows.

use glam::{Vec3, Vec4};
use serde::Deserialize;

use super::json::TextureInfo;
use super::material::{Core, Slots};
use crate::error::Fault;
use crate::scene::{Image, TextureUse};

/// Reflectance of every dielectric in metallic-roughness.
const DIELECTRIC: f32 = 0.04;
const EPSILON: f32 = 1e-6;

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Source {
    diffuse_factor: Option<[f32; 4]>,
    diffuse_texture: Option<TextureInfo>,
    specular_factor: Option<[f32; 3]>,
    glossiness_factor: Option<f32>,
    specular_glossiness_texture: Option<TextureInfo>,
}

/// The core of the material.
pub(super) fn convert(source: &Source, slots: &mut Slots<'_, '_>) -> Result<Core, Fault> {
    slots.warn_file("KHR_materials_pbrSpecularGlossiness is converted to metallic-roughness");
    let unit = |values: Vec4| values.clamp(Vec4::ZERO, Vec4::ONE);
    let diffuse = unit(Vec4::from_array(source.diffuse_factor.unwrap_or([1.0; 4])));
    let specular = Vec3::from_array(source.specular_factor.unwrap_or([1.0; 3]));
    // Glossiness travels as the alpha of the specular colour, as it does in the texture.
    let mut specular = unit(specular.extend(source.glossiness_factor.unwrap_or(1.0)));
    let diffuse_texture = slots.read("diffuseTexture", &source.diffuse_texture)?;
    let mut specular_texture = slots.read("specularGlossinessTexture", &source.specular_glossiness_texture)?;

    if let (Some(one), Some(other)) = (diffuse_texture, specular_texture)
        && (TextureUse { image: 0, ..one }) != (TextureUse { image: 0, ..other })
    {
        slots.warn("the specular-glossiness texture does not lie on the diffuse texture, so its mean is used");
        specular *= mean(slots.image(other.image)?);
        specular_texture = None;
    }
    let Some(layout) = specular_texture.or(diffuse_texture) else {
        let (base_color, metallic) = metallic_from_specular(diffuse.truncate(), specular.truncate());
        return Ok(Core { base_color: base_color.extend(diffuse.w), metallic, roughness: 1.0 - specular.w, ..Core::default() });
    };
    if specular_texture.is_none() && brightness(specular.truncate()) < DIELECTRIC {
        // All texels are dielectrics and scale alike, so the texture stays as it is.
        let scale = (1.0 - specular.truncate().max_element()) / (1.0 - DIELECTRIC);
        let base_color = (diffuse.truncate() * scale).min(Vec3::ONE).extend(diffuse.w);
        let roughness = 1.0 - specular.w;
        return Ok(Core { base_color, base_color_texture: diffuse_texture, metallic: 0.0, roughness, ..Core::default() });
    }
    let (diffuse_image, specular_image) = (diffuse_texture.map(|used| used.image), specular_texture.map(|used| used.image));
    let (base_color, metallic_roughness) = {
        let image = |index: Option<u32>| index.map(|index| slots.image(index)).transpose();
        let (diffuse_image, specular_image) = (image(diffuse_image)?, image(specular_image)?);
        let side = |of: fn(&Image) -> u32| diffuse_image.map_or(1, of).max(specular_image.map_or(1, of));
        let (width, height) = (side(|image| image.width), side(|image| image.height));
        slots.check_texels(2 * u64::from(width) * u64::from(height))?;
        bake((diffuse, diffuse_image), (specular, specular_image), [width, height])
    };
    let texture = |image: u32| Some(TextureUse { image, ..layout });
    Ok(Core {
        base_color: Vec3::ONE.extend(diffuse.w),
        base_color_texture: texture(slots.add(base_color)),
        metallic: 1.0,
        roughness: 1.0,
        metallic_roughness_texture: texture(slots.add(metallic_roughness)),
    })
}

/// The images of the base colour and of metallic and roughness.
fn bake(diffuse: (Vec4, Option<&Image>), specular: (Vec4, Option<&Image>), [width, height]: [u32; 2]) -> (Image, Image) {
    let n_texels = width as usize * height as usize;
    let (mut colors, mut surfaces) = (Vec::with_capacity(n_texels), Vec::with_capacity(n_texels));
    let linear: Vec<f32> = (0..=255u8).map(|byte| linear_from_srgb(f32::from(byte) / 255.0)).collect();
    let look = |(factor, image): (Vec4, Option<&Image>), x: u32, y: u32| match image {
        Some(image) => factor * texel(image, (x, width), (y, height), &linear),
        None => factor,
    };
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let (diffuse_here, specular_here) = (look((diffuse.0.truncate().extend(1.0), diffuse.1), x, y), look(specular, x, y));
        let (base_color, metallic) = metallic_from_specular(diffuse_here.truncate(), specular_here.truncate());
        let [r, g, b] = base_color.to_array().map(|value| byte(srgb_from_linear(value)));
        colors.push([r, g, b, byte(diffuse_here.w)]);
        surfaces.push([255, byte(1.0 - specular_here.w), byte(metallic), 255]);
    }
    let image = |name: &str, texels| Image { name: format!("converted {name}"), width, height, texels };
    (image("base colour", colors), image("metallic-roughness", surfaces))
}

/// The texel of an image that covers the middle of a texel of a grid that may be finer.
fn texel(image: &Image, (x, width): (u32, u32), (y, height): (u32, u32), linear: &[f32]) -> Vec4 {
    let scaled = |at: u32, from: u32, to: u32| (u64::from(at) * u64::from(to) / u64::from(from)) as usize;
    let index = scaled(y, height, image.height) * image.width as usize + scaled(x, width, image.width);
    let [r, g, b, a] = image.texels.get(index).copied().unwrap_or_default();
    let [r, g, b] = [r, g, b].map(|byte| linear[usize::from(byte)]);
    Vec4::new(r, g, b, f32::from(a) / 255.0)
}

fn mean(image: &Image) -> Vec4 {
    let sum = |sum: [f64; 4], texel: &[u8; 4]| {
        let [r, g, b, a] = texel.map(|byte| f32::from(byte) / 255.0);
        let values = [linear_from_srgb(r), linear_from_srgb(g), linear_from_srgb(b), a];
        [0, 1, 2, 3].map(|i| sum[i] + f64::from(values[i]))
    };
    let n_texels = image.texels.len().max(1) as f64;
    Vec4::from_array(image.texels.iter().fold([0.0; 4], sum).map(|x| (x / n_texels) as f32))
}

/// Base colour and metallic of a diffuse and a specular colour, all linear.
fn metallic_from_specular(diffuse: Vec3, specular: Vec3) -> (Vec3, f32) {
    let left = 1.0 - specular.max_element();
    let metallic = solve_metallic(brightness(diffuse), brightness(specular), left);
    let from_diffuse = diffuse * (left / (1.0 - DIELECTRIC) / (1.0 - metallic).max(EPSILON));
    let from_specular = (specular - DIELECTRIC * (1.0 - metallic)) / metallic.max(EPSILON);
    let base_color = from_diffuse.lerp(from_specular, metallic * metallic);
    (base_color.clamp(Vec3::ZERO, Vec3::ONE), metallic)
}

/// The positive root of the quadratic that equates the brightness of both models.
fn solve_metallic(diffuse: f32, specular: f32, left: f32) -> f32 {
    if specular < DIELECTRIC {
        return 0.0;
    }
    let b = diffuse * left / (1.0 - DIELECTRIC) + specular - 2.0 * DIELECTRIC;
    let c = DIELECTRIC - specular;
    let discriminant = (b * b - 4.0 * DIELECTRIC * c).max(0.0);
    ((-b + discriminant.sqrt()) / (2.0 * DIELECTRIC)).clamp(0.0, 1.0)
}

/// As it is perceived.
fn brightness(color: Vec3) -> f32 {
    (color * color).dot(Vec3::new(0.299, 0.587, 0.114)).sqrt()
}

fn linear_from_srgb(value: f32) -> f32 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

fn srgb_from_linear(value: f32) -> f32 {
    if value <= 0.003_130_8 { value * 12.92 } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::super::material::tests::read_text;
    use super::*;

    // Kills: a wrong root, and the two blends swapped: the conversion must undo the way from metallic-roughness to specular-glossiness.
    #[test]
    fn the_conversion_undoes_its_inverse() {
        for metallic in [0.0f32, 0.25, 0.5, 0.75, 1.0] {
            for base in [Vec3::splat(0.7), Vec3::splat(0.2)] {
                // What a metallic-roughness material reflects: the published forward direction, grey so that brightness is exact.
                let specular = Vec3::splat(DIELECTRIC).lerp(base, metallic);
                let diffuse = base * (1.0 - DIELECTRIC) * (1.0 - metallic) / (1.0 - specular.max_element());
                let (color, found) = metallic_from_specular(diffuse, specular);
                assert!((found - metallic).abs() < 1e-3 && color.abs_diff_eq(base, 2e-3), "{metallic} {base}: {found} {color}");
            }
        }
    }

    // Kills: glossiness taken as roughness, alpha lost, and a conversion without a word.
    #[test]
    fn factors_are_converted_and_told_once() {
        let (material, warnings) = read_text(
            r#"{"extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.5,0.25,0.125,0.5],
                "specularFactor":[0,0,0],"glossinessFactor":0.75}}}"#,
        );
        let expected = (Vec3::new(0.5, 0.25, 0.125) / 0.96).extend(0.5);
        assert!(material.base_color.abs_diff_eq(expected, 1e-6), "{}", material.base_color);
        assert_eq!((material.metallic, material.roughness), (0.0, 0.25));
        assert_eq!(warnings, ["KHR_materials_pbrSpecularGlossiness is converted to metallic-roughness"]);
    }

    // Kills: images of different sizes read beyond their ends, alpha that gets its factor twice, channels in the wrong place.
    #[test]
    fn texels_are_converted_where_they_lie() {
        let image = |width: u32, height: u32, texels: &[[u8; 4]]| Image { name: String::new(), width, height, texels: texels.to_vec() };
        let diffuse = image(2, 1, &[[255, 255, 255, 128], [0, 0, 0, 255]]);
        let specular = image(1, 2, &[[0, 0, 0, 255], [255, 255, 255, 51]]);
        let (color, surface) = bake((Vec4::new(1.0, 1.0, 1.0, 0.5), Some(&diffuse)), (Vec4::ONE, Some(&specular)), [2, 2]);
        assert_eq!(color.texels[0], [255, 255, 255, 128]);
        assert_eq!(color.texels[1], [0, 0, 0, 255]);
        assert_eq!(surface.texels[0], [255, 0, 0, 255], "black and glossy: a smooth dielectric");
        assert_eq!((color.texels[3], surface.texels[3]), ([255, 255, 255, 255], [255, 204, 255, 255]), "white: a rough metal");
    }
}
