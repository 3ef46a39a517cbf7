//! Materials: glTF's factors, textures and extensions in terms of the scene's one model.
//!
//! Key decision: what the model cannot express becomes a warning that names it, never a quiet approximation; numbers outside of their
//! range are clamped, because exporters round.

use std::fmt::Display;

use glam::{Vec3, Vec4};
use serde::Deserialize;

use super::super::model::{AlphaMode, Image, Material, TextureUse};
use super::Warnings;
use super::json::{self, TextureInfo, extension};
use super::layers;
use super::specular_glossiness;
use super::texture::Textures;
use crate::error::Fault;
use crate::scene::MaterialExtensions;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct EmissiveStrength {
    emissive_strength: Option<f32>,
}

#[derive(Deserialize)]
struct Ior {
    ior: Option<f32>,
}

/// The texture slots of one material.
pub(super) struct Slots<'s, 't> {
    textures: &'s mut Textures<'t>,
    place: &'s str,
    warnings: &'s mut Warnings,
}

impl Slots<'_, '_> {
    pub(super) fn read(&mut self, slot: &str, info: &Option<TextureInfo>) -> Result<Option<TextureUse>, Fault> {
        match info {
            Some(info) => self.textures.read(info, self.place, self.warnings).map_err(|f| f.within(slot)),
            None => Ok(None),
        }
    }

    pub(super) fn warn(&mut self, what: impl Display) {
        self.warnings.push(format!("{}: {what}", self.place));
    }

    /// For what is the same in every material.
    pub(super) fn warn_file(&mut self, what: &str) {
        self.warnings.push(String::from(what));
    }

    pub(super) fn image(&self, index: u32) -> Result<&Image, Fault> {
        self.textures.images.get(index as usize).ok_or_else(|| Fault::invalid(format_args!("image {index}"), "it does not exist"))
    }

    /// Asks for room for images that are about to be made.
    pub(super) fn check_texels(&self, n_texels: u64) -> Result<(), Fault> {
        match self.textures.n_texels_left() < n_texels {
            true => Err(Fault::unsupported("textures", format_args!("a scene with {n_texels} more texels"))),
            false => Ok(()),
        }
    }

    /// Adds an image that was made and not read.
    pub(super) fn add(&mut self, image: Image) -> u32 {
        self.textures.add(image)
    }
}

/// The metallic-roughness part of a material.
#[derive(Default)]
pub(super) struct Core {
    pub(super) base_color: Vec4,
    pub(super) base_color_texture: Option<TextureUse>,
    pub(super) metallic: f32,
    pub(super) roughness: f32,
    pub(super) metallic_roughness_texture: Option<TextureUse>,
}

impl Core {
    fn read(pbr: &json::MetallicRoughness, slots: &mut Slots<'_, '_>) -> Result<Core, Fault> {
        Ok(Core {
            base_color: Vec4::from_array(pbr.base_color_factor.unwrap_or([1.0; 4])).clamp(Vec4::ZERO, Vec4::ONE),
            base_color_texture: slots.read("baseColorTexture", &pbr.base_color_texture)?,
            metallic: pbr.metallic_factor.unwrap_or(1.0).clamp(0.0, 1.0),
            roughness: pbr.roughness_factor.unwrap_or(1.0).clamp(0.0, 1.0),
            metallic_roughness_texture: slots.read("metallicRoughnessTexture", &pbr.metallic_roughness_texture)?,
        })
    }
}

/// The set of texture coordinates that the tangent space of the material follows; `None` when nothing asks for one.
pub(super) fn tangent_uv_set(material: &Material) -> Option<u32> {
    let extensions = &material.extensions;
    let coat = extensions.clearcoat.and_then(|coat| coat.normal_texture);
    let direction = extensions.anisotropy.map(|anisotropy| anisotropy.texture.map_or(0, |texture| texture.uv_set));
    material.normal_texture.or(coat).map(|texture| texture.uv_set).or(direction)
}

/// The material that primitives without one have.
pub(super) fn fallback() -> Material {
    Material { metallic: 1.0, double_sided: false, ..Material::default() }
}

/// Reads a material; `place` names it in messages.
pub(super) fn read(source: &json::Material, place: &str, textures: &mut Textures<'_>, warnings: &mut Warnings) -> Result<Material, Fault> {
    let mut slots = Slots { textures, place, warnings };
    let core = match extension::<specular_glossiness::Source>(&source.extensions, "KHR_materials_pbrSpecularGlossiness")? {
        Some(specular) => specular_glossiness::convert(&specular, &mut slots)?,
        None => Core::read(&source.pbr_metallic_roughness, &mut slots)?,
    };
    let mut material = Material {
        name: source.name.clone().unwrap_or_else(|| String::from(place)),
        base_color: core.base_color,
        base_color_texture: core.base_color_texture,
        metallic: core.metallic,
        roughness: core.roughness,
        metallic_roughness_texture: core.metallic_roughness_texture,
        normal_texture: slots.read("normalTexture", &source.normal_texture)?,
        normal_scale: source.normal_texture.as_ref().and_then(|info| info.scale).unwrap_or(1.0),
        emissive: Vec3::from_array(source.emissive_factor).max(Vec3::ZERO),
        emissive_texture: slots.read("emissiveTexture", &source.emissive_texture)?,
        alpha: alpha(source)?,
        double_sided: source.double_sided,
        ..Material::default()
    };

    let extensions = &source.extensions;
    if let Some(EmissiveStrength { emissive_strength }) = extension(extensions, "KHR_materials_emissive_strength")? {
        material.emissive *= emissive_strength.unwrap_or(1.0).max(0.0);
    }
    layers::read(&mut material, extensions, &mut slots)?;
    if let Some(volume) = material.extensions.volume {
        (material.attenuation_color, material.attenuation_distance) = (volume.attenuation_color, volume.attenuation_distance);
    }
    if let Some(Ior { ior: Some(ior) }) = extension(extensions, "KHR_materials_ior")? {
        // Zero stands for a mirror of every angle in converted materials of an older model.
        if ior >= 1.0 {
            material.ior = ior;
        } else {
            slots.warn(format_args!("the index of refraction {ior} is less than 1 and becomes 1.5"));
        }
    }
    if extensions.contains_key("KHR_materials_unlit") {
        make_unlit(&mut material);
        slots.warn("unlit (KHR_materials_unlit): its base colour is shown as emitted light");
    }
    Ok(material)
}

fn alpha(source: &json::Material) -> Result<AlphaMode, Fault> {
    match source.alpha_mode.as_deref() {
        None | Some("OPAQUE") => Ok(AlphaMode::Opaque),
        Some("BLEND") => Ok(AlphaMode::Blend),
        // Above 1 means that nothing is seen at all, which is a legal wish.
        Some("MASK") => Ok(AlphaMode::Mask { cutoff: source.alpha_cutoff.unwrap_or(0.5).max(0.0) }),
        Some(mode) => Err(Fault::invalid("alphaMode", format_args!("'{mode}' is unknown"))),
    }
}

/// Turns the base colour into light and everything else into a black body without a reflection.
fn make_unlit(material: &mut Material) {
    material.emissive = material.base_color.truncate();
    material.emissive_texture = material.base_color_texture;
    // The texture stays for its alpha; the black factor hides its colour.
    material.base_color = Vec3::ZERO.extend(material.base_color.w);
    material.metallic = 0.0;
    material.metallic_roughness_texture = None;
    material.roughness = 1.0;
    material.normal_texture = None;
    material.transmission = 0.0;
    material.solid = false;
    material.ior = 1.0;
    material.extensions = MaterialExtensions::default();
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::buffers::Buffers;
    use super::*;
    use std::path::Path;

    /// A material read from JSON text, and the warnings.
    pub(in super::super) fn read_text(text: &str) -> (Material, Vec<String>) {
        let document = json::Document::default();
        let buffers = Buffers::read(&document, None, Path::new("x.gltf")).unwrap();
        let mut textures = Textures {
            document: &document,
            buffers: &buffers,
            scene: Path::new("x.gltf"),
            images: Vec::new(),
            known: Default::default(),
            n_texels: 0,
        };
        let mut warnings = Warnings::default();
        let material = read(&serde_json::from_str(text).unwrap(), "material 0", &mut textures, &mut warnings).unwrap();
        (material, warnings.into_lines())
    }

    // Kills: a metallic factor that defaults to 0, and a strength that is added or ignored.
    #[test]
    fn defaults_and_factors() {
        let (material, warnings) = read_text(
            r#"{"emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":10},
                "KHR_materials_transmission":{"transmissionFactor":0.75},"KHR_materials_ior":{"ior":1.33},
                "KHR_materials_volume":{"thicknessFactor":0.1}}}"#,
        );
        assert_eq!((material.metallic, material.roughness, material.double_sided), (1.0, 1.0, false));
        assert_eq!(material.emissive, Vec3::new(10.0, 5.0, 0.0));
        assert_eq!((material.transmission, material.ior, material.solid), (0.75, 1.33, true));
        assert_eq!(material.extensions.volume.map(|volume| volume.thickness), Some(0.1));
        assert!(warnings.is_empty());
    }

    // Kills: unlit surfaces that are lit, and an index of refraction of zero that reaches a division.
    #[test]
    fn unlit_and_odd_indices_are_told() {
        let (material, warnings) = read_text(
            r#"{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,0.5]},"alphaMode":"BLEND",
                "extensions":{"KHR_materials_unlit":{},"KHR_materials_ior":{"ior":0}}}"#,
        );
        assert_eq!(material.emissive, Vec3::new(0.5, 0.25, 1.0));
        assert_eq!((material.base_color, material.ior), (Vec4::new(0.0, 0.0, 0.0, 0.5), 1.0));
        assert_eq!(warnings.len(), 2);
    }
}
