//! Materials as records, every number brought into its valid range with a warning.
//!
//! Key decision: an albedo above one would let a closed room gain energy, so base colours are clamped to 0..=1 here, once, and counted;
//! no kernel clamps anything.
//!
//! **Invariant:** a packed material absorbs or conserves energy.

use super::{
    error::Error,
    records::{MaterialRecord, material_flags},
    textures::Textures,
};
use crate::scene::{AlphaMode, Material, Scene};

/// An index of refraction closer to one than this is no interface.
pub(crate) const ETA_MIN_STEP: f32 = 1e-4;
/// Transmission is smooth; a wider perceptual roughness than this deserves a warning.
const SMOOTH_ROUGHNESS: f32 = 0.0316;

/// All materials, and their textures in `textures`.
pub(crate) fn pack(scene: &Scene, textures: &mut Textures, warnings: &mut Vec<String>) -> Result<Vec<MaterialRecord>, Error> {
    scene.materials.iter().enumerate().map(|(index, material)| pack_one(scene, index, material, textures, warnings)).collect()
}

fn pack_one(
    scene: &Scene,
    index: usize,
    material: &Material,
    textures: &mut Textures,
    warnings: &mut Vec<String>,
) -> Result<MaterialRecord, Error> {
    let mut clamped = Vec::new();
    let mut within = |what: &str, value: f32, low: f32, high: f32| {
        let kept = if value.is_finite() { value.clamp(low, high) } else { low };
        if kept != value {
            clamped.push(format!("{what} {value} became {kept}"));
        }
        kept
    };
    let base_color = material.base_color.to_array().map(|value| within("base colour", value, 0.0, 1.0));
    let emissive = material.emissive.to_array().map(|value| within("emission", value, 0.0, f32::MAX));
    let metallic = within("metallic", material.metallic, 0.0, 1.0);
    let roughness = within("roughness", material.roughness, 0.0, 1.0);
    let transmission = within("transmission", material.transmission, 0.0, 1.0);
    let normal_scale = within("normal scale", material.normal_scale, -1e6, 1e6);
    // glTF gives 0 a meaning of its own (a specular workflow in disguise); no light is lost without an interface.
    let eta = if material.ior == 0.0 { 1.0 } else { within("ior", material.ior, 0.1, 100.0) };
    let (mut flags, mut alpha_cutoff) = (0, 0.0);
    match material.alpha {
        AlphaMode::Opaque => {}
        AlphaMode::Mask { cutoff } => {
            flags |= material_flags::ALPHA_MASK;
            alpha_cutoff = within("alpha cutoff", cutoff, 0.0, f32::MAX);
        }
        AlphaMode::Blend => flags |= material_flags::ALPHA_BLEND,
    }
    if material.double_sided {
        flags |= material_flags::DOUBLE_SIDED;
    }
    if material.solid {
        flags |= material_flags::SOLID;
    }
    if eta > 1.0 + ETA_MIN_STEP {
        flags |= material_flags::COAT;
    }
    if transmission > 0.0 && metallic < 1.0 && roughness > SMOOTH_ROUGHNESS {
        warnings.push(format!("material `{}`: rough transmission is drawn smooth (roughness {roughness})", material.name));
    }
    if !clamped.is_empty() {
        warnings.push(format!("material `{}`: {}", material.name, clamped.join(", ")));
    }
    let mut texture = |usage: &Option<_>| textures.add(&scene.images, usage.as_ref(), index);
    let f0 = ((f64::from(eta) - 1.0) / (f64::from(eta) + 1.0)).powi(2) as f32;
    Ok(MaterialRecord {
        base_color,
        emissive,
        alpha_cutoff,
        metallic,
        roughness,
        normal_scale,
        transmission,
        eta,
        f0,
        flags,
        tree: 0,
        base_color_texture: texture(&material.base_color_texture)?,
        metallic_roughness_texture: texture(&material.metallic_roughness_texture)?,
        normal_texture: texture(&material.normal_texture)?,
        emissive_texture: texture(&material.emissive_texture)?,
    })
}

/// True when the material sends out light of its own.
pub(crate) fn is_emissive(material: &MaterialRecord) -> bool {
    material.emissive.iter().any(|&value| value > 0.0)
}

/// True when hits must ask for alpha.
pub(crate) fn has_alpha(material: &MaterialRecord) -> bool {
    material.flags & (material_flags::ALPHA_MASK | material_flags::ALPHA_BLEND) != 0
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    fn packed(material: Material) -> (MaterialRecord, Vec<String>) {
        let mut warnings = Vec::new();
        let scene = Scene { materials: vec![material], ..Scene::default() };
        let records = pack(&scene, &mut Textures::default(), &mut warnings).expect("no textures");
        (records[0], warnings)
    }

    // Kills: an albedo of 1.5 that passes, or one that is clamped without a word.
    #[test]
    fn an_albedo_above_one_is_clamped_and_told() {
        let (record, warnings) = packed(Material { base_color: Vec4::new(1.5, 0.5, -1.0, 1.0), ..Material::default() });
        assert_eq!(record.base_color, [1.0, 0.5, 0.0, 1.0]);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].contains("1.5 became 1") && warnings[0].contains("default"), "{warnings:?}");
    }

    // Kills: a coat on a material whose index says that there is none, which would darken a white furnace.
    #[test]
    fn an_index_of_one_has_no_coat() {
        assert_eq!(packed(Material { ior: 1.0, ..Material::default() }).0.flags & material_flags::COAT, 0);
        let (record, _) = packed(Material::default());
        assert_ne!(record.flags & material_flags::COAT, 0);
        assert!((record.f0 - 0.04).abs() < 1e-7);
    }
}
