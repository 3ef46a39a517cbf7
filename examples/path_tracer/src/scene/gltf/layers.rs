//! Material extensions that the scene keeps whole, whether they are shown or not.
//!
//! Key decision: each extension is read with the defaults of its specification and otherwise as written; only an attenuation distance of
//! zero or less, which no light would survive, becomes infinite with a warning.

use glam::Vec3;
use serde::Deserialize;

use super::json::{Extensions, TextureInfo, extension};
use super::material::Slots;
use crate::error::Fault;
use crate::scene::{Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Material, Sheen, Specular, Volume};

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct TransmissionSource {
    transmission_factor: f32,
    transmission_texture: Option<TextureInfo>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct VolumeSource {
    thickness_factor: f32,
    thickness_texture: Option<TextureInfo>,
    attenuation_distance: Option<f32>,
    attenuation_color: Option<[f32; 3]>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct ClearcoatSource {
    clearcoat_factor: f32,
    clearcoat_texture: Option<TextureInfo>,
    clearcoat_roughness_factor: f32,
    clearcoat_roughness_texture: Option<TextureInfo>,
    clearcoat_normal_texture: Option<TextureInfo>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SpecularSource {
    specular_factor: Option<f32>,
    specular_texture: Option<TextureInfo>,
    specular_color_factor: Option<[f32; 3]>,
    specular_color_texture: Option<TextureInfo>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SheenSource {
    sheen_color_factor: [f32; 3],
    sheen_color_texture: Option<TextureInfo>,
    sheen_roughness_factor: f32,
    sheen_roughness_texture: Option<TextureInfo>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct AnisotropySource {
    anisotropy_strength: f32,
    anisotropy_rotation: f32,
    anisotropy_texture: Option<TextureInfo>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct DispersionSource {
    dispersion: f32,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct IridescenceSource {
    iridescence_factor: f32,
    iridescence_texture: Option<TextureInfo>,
    iridescence_ior: Option<f32>,
    iridescence_thickness_minimum: Option<f32>,
    iridescence_thickness_maximum: Option<f32>,
    iridescence_thickness_texture: Option<TextureInfo>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct DiffuseTransmissionSource {
    diffuse_transmission_factor: f32,
    diffuse_transmission_texture: Option<TextureInfo>,
    diffuse_transmission_color_factor: Option<[f32; 3]>,
    diffuse_transmission_color_texture: Option<TextureInfo>,
}

/// Fills the extensions of a material, and what of them its core model has.
pub(super) fn read(material: &mut Material, extensions: &Extensions, slots: &mut Slots<'_, '_>) -> Result<(), Fault> {
    if let Some(source) = extension::<TransmissionSource>(extensions, "KHR_materials_transmission")? {
        material.transmission = source.transmission_factor.clamp(0.0, 1.0);
        material.extensions.transmission_texture = slots.read("transmissionTexture", &source.transmission_texture)?;
    }
    if let Some(source) = extension::<VolumeSource>(extensions, "KHR_materials_volume")? {
        material.solid = source.thickness_factor > 0.0;
        material.extensions.volume = Some(volume(&source, slots)?);
    }
    let kept = &mut material.extensions;
    if let Some(source) = extension::<ClearcoatSource>(extensions, "KHR_materials_clearcoat")? {
        kept.clearcoat = Some(Clearcoat {
            factor: source.clearcoat_factor,
            texture: slots.read("clearcoatTexture", &source.clearcoat_texture)?,
            roughness: source.clearcoat_roughness_factor,
            roughness_texture: slots.read("clearcoatRoughnessTexture", &source.clearcoat_roughness_texture)?,
            normal_texture: slots.read("clearcoatNormalTexture", &source.clearcoat_normal_texture)?,
            normal_scale: source.clearcoat_normal_texture.as_ref().and_then(|info| info.scale).unwrap_or(1.0),
        });
    }
    if let Some(source) = extension::<SpecularSource>(extensions, "KHR_materials_specular")? {
        kept.specular = Some(Specular {
            factor: source.specular_factor.unwrap_or(1.0),
            texture: slots.read("specularTexture", &source.specular_texture)?,
            color: source.specular_color_factor.map_or(Vec3::ONE, Vec3::from_array),
            color_texture: slots.read("specularColorTexture", &source.specular_color_texture)?,
        });
    }
    if let Some(source) = extension::<SheenSource>(extensions, "KHR_materials_sheen")? {
        kept.sheen = Some(Sheen {
            color: Vec3::from_array(source.sheen_color_factor),
            color_texture: slots.read("sheenColorTexture", &source.sheen_color_texture)?,
            roughness: source.sheen_roughness_factor,
            roughness_texture: slots.read("sheenRoughnessTexture", &source.sheen_roughness_texture)?,
        });
    }
    if let Some(source) = extension::<AnisotropySource>(extensions, "KHR_materials_anisotropy")? {
        kept.anisotropy = Some(Anisotropy {
            strength: source.anisotropy_strength,
            rotation: source.anisotropy_rotation,
            texture: slots.read("anisotropyTexture", &source.anisotropy_texture)?,
        });
    }
    kept.dispersion = extension::<DispersionSource>(extensions, "KHR_materials_dispersion")?.map(|source| source.dispersion);
    if let Some(source) = extension::<IridescenceSource>(extensions, "KHR_materials_iridescence")? {
        kept.iridescence = Some(Iridescence {
            factor: source.iridescence_factor,
            texture: slots.read("iridescenceTexture", &source.iridescence_texture)?,
            ior: source.iridescence_ior.unwrap_or(1.3),
            thickness_minimum: source.iridescence_thickness_minimum.unwrap_or(100.0),
            thickness_maximum: source.iridescence_thickness_maximum.unwrap_or(400.0),
            thickness_texture: slots.read("iridescenceThicknessTexture", &source.iridescence_thickness_texture)?,
        });
    }
    if let Some(source) = extension::<DiffuseTransmissionSource>(extensions, "KHR_materials_diffuse_transmission")? {
        kept.diffuse_transmission = Some(DiffuseTransmission {
            factor: source.diffuse_transmission_factor,
            texture: slots.read("diffuseTransmissionTexture", &source.diffuse_transmission_texture)?,
            color: source.diffuse_transmission_color_factor.map_or(Vec3::ONE, Vec3::from_array),
            color_texture: slots.read("diffuseTransmissionColorTexture", &source.diffuse_transmission_color_texture)?,
        });
    }
    Ok(())
}

fn volume(source: &VolumeSource, slots: &mut Slots<'_, '_>) -> Result<Volume, Fault> {
    let attenuation_distance = match source.attenuation_distance {
        Some(distance) if distance > 0.0 => distance,
        Some(distance) => {
            slots.warn(format_args!("the attenuation distance {distance} is not positive and is left out"));
            f32::INFINITY
        }
        None => f32::INFINITY,
    };
    Ok(Volume {
        thickness: source.thickness_factor,
        thickness_texture: slots.read("thicknessTexture", &source.thickness_texture)?,
        attenuation_distance,
        attenuation_color: source.attenuation_color.map_or(Vec3::ONE, Vec3::from_array),
    })
}

#[cfg(test)]
mod tests {
    use super::super::material::tests::read_text;
    use super::*;

    fn kept(extensions: &str) -> Material {
        read_text(&format!(r#"{{"extensions":{{{extensions}}}}}"#)).0
    }

    // Kills: a default that is zero where the specification says otherwise, and a number read into its neighbour's place.
    #[test]
    fn every_record_has_the_defaults_of_its_specification_and_keeps_its_numbers() {
        let names = ["clearcoat", "specular", "sheen", "anisotropy", "dispersion", "iridescence", "diffuse_transmission", "volume"];
        let text = names.map(|name| format!(r#""KHR_materials_{name}":{{}}"#)).join(",");
        let bare = kept(&text).extensions;
        let volume = bare.volume.unwrap();
        assert_eq!((volume.thickness, volume.attenuation_distance, volume.attenuation_color), (0.0, f32::INFINITY, Vec3::ONE));
        let coat = bare.clearcoat.unwrap();
        assert_eq!((coat.factor, coat.roughness, coat.normal_scale), (0.0, 0.0, 1.0));
        assert_eq!(bare.specular.map(|specular| (specular.factor, specular.color)), Some((1.0, Vec3::ONE)));
        assert_eq!(bare.sheen.map(|sheen| (sheen.color, sheen.roughness)), Some((Vec3::ZERO, 0.0)));
        assert_eq!(bare.anisotropy.map(|anisotropy| (anisotropy.strength, anisotropy.rotation)), Some((0.0, 0.0)));
        assert_eq!(bare.dispersion, Some(0.0));
        let film = bare.iridescence.unwrap();
        assert_eq!((film.factor, film.ior, film.thickness_minimum, film.thickness_maximum), (0.0, 1.3, 100.0, 400.0));
        assert_eq!(bare.diffuse_transmission.map(|diffuse| (diffuse.factor, diffuse.color)), Some((0.0, Vec3::ONE)));
        assert!(bare.effective().is_empty(), "{:?}", bare.effective());

        let full = kept(
            r#""KHR_materials_clearcoat":{"clearcoatFactor":0.1,"clearcoatRoughnessFactor":0.2},
               "KHR_materials_specular":{"specularFactor":0.3,"specularColorFactor":[1,2,3]},
               "KHR_materials_sheen":{"sheenColorFactor":[0.4,0.5,0.6],"sheenRoughnessFactor":0.7},
               "KHR_materials_anisotropy":{"anisotropyStrength":0.8,"anisotropyRotation":0.9},
               "KHR_materials_dispersion":{"dispersion":0.33},
               "KHR_materials_iridescence":{"iridescenceFactor":0.11,"iridescenceIor":1.7,"iridescenceThicknessMinimum":5,
                   "iridescenceThicknessMaximum":6},
               "KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":0.12,"diffuseTransmissionColorFactor":[0,1,0]},
               "KHR_materials_volume":{"thicknessFactor":2,"attenuationDistance":3,"attenuationColor":[0.1,0.2,0.3]}"#,
        );
        assert!(full.solid);
        // What the inside absorbs is rendered, the rest is kept.
        assert_eq!((full.attenuation_distance, full.attenuation_color), (3.0, Vec3::new(0.1, 0.2, 0.3)));
        let full = full.extensions;
        assert_eq!(full.clearcoat.map(|coat| (coat.factor, coat.roughness)), Some((0.1, 0.2)));
        assert_eq!(full.specular.map(|specular| (specular.factor, specular.color)), Some((0.3, Vec3::new(1.0, 2.0, 3.0))));
        assert_eq!(full.sheen.map(|sheen| (sheen.color, sheen.roughness)), Some((Vec3::new(0.4, 0.5, 0.6), 0.7)));
        assert_eq!(full.anisotropy.map(|anisotropy| (anisotropy.strength, anisotropy.rotation)), Some((0.8, 0.9)));
        assert_eq!(full.dispersion, Some(0.33));
        let film = full.iridescence.unwrap();
        assert_eq!((film.factor, film.ior, film.thickness_minimum, film.thickness_maximum), (0.11, 1.7, 5.0, 6.0));
        assert_eq!(full.diffuse_transmission.map(|diffuse| (diffuse.factor, diffuse.color)), Some((0.12, Vec3::Y)));
        let volume = full.volume.unwrap();
        assert_eq!((volume.attenuation_distance, volume.attenuation_color), (3.0, Vec3::new(0.1, 0.2, 0.3)));
        assert_eq!(full.effective().len(), names.len() - 1);
    }

    // Kills: a distance of zero that would absorb everything or divide by zero, and one replaced without a word.
    #[test]
    fn an_attenuation_distance_of_zero_is_told() {
        let (material, warnings) = read_text(r#"{"extensions":{"KHR_materials_volume":{"attenuationDistance":0}}}"#);
        assert_eq!(material.extensions.volume.map(|volume| volume.attenuation_distance), Some(f32::INFINITY));
        assert_eq!(warnings.len(), 1, "{warnings:?}");
    }
}
