//! What materials of glTF can say beyond [`Material`](super::Material)'s core, kept whole.
//!
//! Key decision: one optional record for each extension, in the terms and with the defaults of its specification. A record is kept even
//! when the renderer does not show it yet; the reader then says so in [`Scene::warnings`](super::Scene::warnings). It gives up on
//! interpretation: nothing is clamped, folded together or turned into another model here.
//!
//! Source: the Khronos registry, `extensions/2.0/Khronos/KHR_materials_*`.

use std::path::PathBuf;

use glam::Vec3;

use super::model::TextureUse;

/// The records of a material; `None` where the file has no such extension.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaterialExtensions {
    /// KHR_materials_transmission: red multiplies [`Material::transmission`](super::Material::transmission).
    pub transmission_texture: Option<TextureUse>,
    /// KHR_materials_volume.
    pub volume: Option<Volume>,
    /// KHR_materials_clearcoat.
    pub clearcoat: Option<Clearcoat>,
    /// KHR_materials_specular.
    pub specular: Option<Specular>,
    /// KHR_materials_sheen.
    pub sheen: Option<Sheen>,
    /// KHR_materials_anisotropy.
    pub anisotropy: Option<Anisotropy>,
    /// KHR_materials_dispersion: 20 divided by the Abbe number, 0 for none.
    pub dispersion: Option<f32>,
    /// KHR_materials_iridescence.
    pub iridescence: Option<Iridescence>,
    /// KHR_materials_diffuse_transmission.
    pub diffuse_transmission: Option<DiffuseTransmission>,
    /// The custom properties `height_map` and `height_scale`, which are no extension.
    pub height_map: Option<HeightMap>,
}

/// The inside of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Metres in the space of the mesh; only a rasteriser needs the number, 0 means a thin sheet.
    pub thickness: f32,
    /// Green multiplies the thickness.
    pub thickness_texture: Option<TextureUse>,
    /// Mean free path in metres of world space, `f32::INFINITY` when nothing is absorbed.
    pub attenuation_distance: f32,
    /// What white light becomes after [`Volume::attenuation_distance`]; linear.
    pub attenuation_color: Vec3,
}

/// A clear dielectric layer with an index of refraction of 1.5 on top of everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearcoat {
    /// Share of the surface that is covered.
    pub factor: f32,
    /// Red multiplies the factor.
    pub texture: Option<TextureUse>,
    /// Perceptual.
    pub roughness: f32,
    /// Green multiplies the roughness.
    pub roughness_texture: Option<TextureUse>,
    /// Tangent space, linear; without one the layer follows the geometry and not the normal map of the base.
    pub normal_texture: Option<TextureUse>,
    /// Multiplies x and y of the normal texture.
    pub normal_scale: f32,
}

/// The strength and the colour of the reflection of a dielectric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specular {
    /// Strength.
    pub factor: f32,
    /// Alpha multiplies the factor.
    pub texture: Option<TextureUse>,
    /// Linear colour of the reflection at normal incidence; may exceed 1.
    pub color: Vec3,
    /// sRGB encoded, multiplies the colour.
    pub color_texture: Option<TextureUse>,
}

/// Light scattered back by the fibres of cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Linear; black means no sheen.
    pub color: Vec3,
    /// sRGB encoded, multiplies the colour.
    pub color_texture: Option<TextureUse>,
    /// Perceptual.
    pub roughness: f32,
    /// Alpha multiplies the roughness.
    pub roughness_texture: Option<TextureUse>,
}

/// A highlight that is longer in one direction of the tangent space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anisotropy {
    /// 0 round, 1 longest.
    pub strength: f32,
    /// Radians, counter-clockwise from the tangent.
    pub rotation: f32,
    /// Red and green: the direction in -1..=1, blue: multiplies the strength; linear.
    pub texture: Option<TextureUse>,
}

/// Interference in a thin film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iridescence {
    /// Share of the surface that is covered.
    pub factor: f32,
    /// Red multiplies the factor.
    pub texture: Option<TextureUse>,
    /// Index of refraction of the film.
    pub ior: f32,
    /// Nanometres where the thickness texture is 0.
    pub thickness_minimum: f32,
    /// Nanometres where the thickness texture is 1 or absent.
    pub thickness_maximum: f32,
    /// Green blends between the two.
    pub thickness_texture: Option<TextureUse>,
}

/// Light that leaves diffusely on the other side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// Share of the diffuse light that is transmitted.
    pub factor: f32,
    /// Alpha multiplies the factor.
    pub texture: Option<TextureUse>,
    /// Linear.
    pub color: Vec3,
    /// sRGB encoded, multiplies the colour.
    pub color_texture: Option<TextureUse>,
}

/// A picture of how far a surface stands out. Found, and neither read nor rendered yet.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    /// As the scene's file calls it.
    pub name: String,
    /// Where it is: in the folder of the scene's file or below.
    pub path: PathBuf,
    /// As the scene's file has it.
    pub scale: Option<f32>,
}

impl MaterialExtensions {
    /// All textures of all records.
    pub fn textures(&self) -> impl Iterator<Item = &TextureUse> {
        let mut all = vec![&self.transmission_texture];
        all.extend(self.volume.iter().map(|volume| &volume.thickness_texture));
        all.extend(self.clearcoat.iter().flat_map(|coat| [&coat.texture, &coat.roughness_texture, &coat.normal_texture]));
        all.extend(self.specular.iter().flat_map(|specular| [&specular.texture, &specular.color_texture]));
        all.extend(self.sheen.iter().flat_map(|sheen| [&sheen.color_texture, &sheen.roughness_texture]));
        all.extend(self.anisotropy.iter().map(|anisotropy| &anisotropy.texture));
        all.extend(self.iridescence.iter().flat_map(|film| [&film.texture, &film.thickness_texture]));
        all.extend(self.diffuse_transmission.iter().flat_map(|diffuse| [&diffuse.texture, &diffuse.color_texture]));
        all.into_iter().flatten()
    }

    /// True when every number of every record is finite; an attenuation distance may be infinite.
    pub fn is_finite(&self) -> bool {
        let volume =
            |volume: &Volume| volume.thickness.is_finite() && volume.attenuation_distance > 0.0 && volume.attenuation_color.is_finite();
        let clearcoat = |coat: &Clearcoat| [coat.factor, coat.roughness, coat.normal_scale].iter().all(|x| x.is_finite());
        let specular = |specular: &Specular| specular.factor.is_finite() && specular.color.is_finite();
        let sheen = |sheen: &Sheen| sheen.color.is_finite() && sheen.roughness.is_finite();
        let anisotropy = |anisotropy: &Anisotropy| anisotropy.strength.is_finite() && anisotropy.rotation.is_finite();
        let iridescence =
            |film: &Iridescence| [film.factor, film.ior, film.thickness_minimum, film.thickness_maximum].iter().all(|x| x.is_finite());
        let diffuse = |diffuse: &DiffuseTransmission| diffuse.factor.is_finite() && diffuse.color.is_finite();
        self.volume.iter().all(volume)
            && self.clearcoat.iter().all(clearcoat)
            && self.specular.iter().all(specular)
            && self.sheen.iter().all(sheen)
            && self.anisotropy.iter().all(anisotropy)
            && self.dispersion.iter().all(|x| x.is_finite())
            && self.iridescence.iter().all(iridescence)
            && self.diffuse_transmission.iter().all(diffuse)
            && self.height_map.iter().all(|map| map.scale.is_none_or(f32::is_finite))
    }

    /// The specification names of the records that would change the picture if they were shown: those with other values than the neutral
    /// ones of their extension.
    pub fn effective(&self) -> Vec<&'static str> {
        let tints = |specular: Specular| {
            let textured = specular.texture.is_some() || specular.color_texture.is_some();
            specular.factor != 1.0 || specular.color != Vec3::ONE || textured
        };
        [
            (self.transmission_texture.is_some(), "KHR_materials_transmission (texture)"),
            (self.clearcoat.is_some_and(|coat| coat.factor != 0.0), "KHR_materials_clearcoat"),
            (self.specular.is_some_and(tints), "KHR_materials_specular"),
            (self.sheen.is_some_and(|sheen| sheen.color != Vec3::ZERO), "KHR_materials_sheen"),
            (self.anisotropy.is_some_and(|anisotropy| anisotropy.strength != 0.0), "KHR_materials_anisotropy"),
            (self.dispersion.is_some_and(|dispersion| dispersion != 0.0), "KHR_materials_dispersion"),
            (self.iridescence.is_some_and(|film| film.factor != 0.0), "KHR_materials_iridescence"),
            (self.diffuse_transmission.is_some_and(|diffuse| diffuse.factor != 0.0), "KHR_materials_diffuse_transmission"),
        ]
        .into_iter()
        .filter_map(|(is_effective, name)| is_effective.then_some(name))
        .collect()
    }
}
