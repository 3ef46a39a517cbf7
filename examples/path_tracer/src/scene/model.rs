//! The scene as the renderer understands it, whatever file it came from.
//!
//! Key decision: one flat, world-space, indexed triangle list. Instances are baked when a file is read; the price is memory for
//! heavily instanced scenes, the gain is one acceleration structure, world-space error bounds and no transform on the hot path.
//!
//! **Invariant:** every number in a [`Scene`] that passed [`Scene::validate`] is finite and every index is in range.
//! **Invariant:** right-handed, +Y up, metres, as glTF has it. Colours are linear Rec. 709.

use std::path::PathBuf;

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::material_extensions::MaterialExtensions;
use super::material_tree::MaterialTree;

/// A complete scene: what is lit, what lights it, and from where it is seen.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Shown in summaries.
    pub name: String,
    /// The first one is rendered unless another is chosen by name. Never empty after loading: a scene without one is framed.
    pub cameras: Vec<Camera>,
    /// World-space vertices.
    pub vertices: Vec<Vertex>,
    /// Counter-clockwise seen from the front.
    pub triangles: Vec<Triangle>,
    /// Per triangle the number of its object, into [`Scene::objects`]; empty when all are one thing, number 0.
    pub object_of: Vec<u32>,
    /// Names of the objects, for messages and lists.
    pub objects: Vec<String>,
    /// Never empty when there are triangles.
    pub materials: Vec<Material>,
    /// Decoded images, shared by materials.
    pub images: Vec<Image>,
    /// Point, spot and directional lights.
    pub lights: Vec<PunctualLight>,
    /// What lights ask for by [`PunctualLight::profile`], each file once.
    pub profiles: Vec<IesProfile>,
    /// What a ray sees that leaves the scene.
    pub environment: Option<Environment>,
    /// What the file can show over time, whether it is shown or not.
    pub animations: Vec<Animation>,
    /// Everything a reader had to drop, replace or assume; one line each, names the thing.
    pub warnings: Vec<String>,
}

impl Scene {
    /// True when something in the scene emits: an environment, a punctual light or the material of a triangle.
    pub fn has_light(&self) -> bool {
        if self.environment.is_some() || !self.lights.is_empty() {
            return true;
        }
        let emits = self.emitting_materials();
        self.triangles.iter().any(|triangle| emits.get(triangle.material as usize) == Some(&true))
    }

    /// Which materials emit somewhere: their factor is above zero where their texture is not black.
    ///
    /// **Cost:** each image is looked at once.
    pub fn emitting_materials(&self) -> Vec<bool> {
        let mut known: Vec<Option<[bool; 3]>> = vec![None; self.images.len()];
        let mut glows = |texture: TextureUse| {
            let (image, known) = (self.images.get(texture.image as usize)?, known.get_mut(texture.image as usize)?);
            Some(*known.get_or_insert_with(|| {
                let mut glows = [false; 3];
                image.texels.iter().for_each(|texel| glows.iter_mut().zip(texel).for_each(|(glows, &value)| *glows |= value > 0));
                glows
            }))
        };
        let mut emits = |material: &Material| {
            let texture = material.emissive_texture.and_then(&mut glows).unwrap_or([true; 3]);
            material.emissive.to_array().into_iter().zip(texture).any(|(factor, glows)| factor > 0.0 && glows)
        };
        self.materials.iter().map(&mut emits).collect()
    }

    /// Makes one object of all triangles that belong to none yet; without such triangles there is none of this name.
    pub fn name_object(&mut self, name: &str) {
        if self.object_of.len() < self.triangles.len() {
            let number = u32::try_from(self.objects.len()).unwrap_or(u32::MAX);
            self.object_of.resize(self.triangles.len(), number);
            self.objects.push(String::from(name));
        }
    }
}

/// One corner of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vertex {
    /// World space, metres.
    pub position: Vec3,
    /// Unit length; the geometric normal when the file has none.
    pub normal: Vec3,
    /// `xyz` unit length, `w` the sign of the bitangent; zero when nothing in the material asks for a tangent space.
    pub tangent: Vec4,
    /// Texture coordinates, set 0 and set 1 (equal when the file has one set).
    pub uv: [Vec2; 2],
    /// Linear colour that multiplies the base colour; white when the file has none.
    pub color: Vec4,
}

/// Three vertices and a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Into [`Scene::vertices`].
    pub vertices: [u32; 3],
    /// Into [`Scene::materials`].
    pub material: u32,
}

/// glTF's metallic-roughness model with transmission.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Shown in messages.
    pub name: String,
    /// Linear colour and opacity.
    pub base_color: Vec4,
    /// sRGB encoded colour, linear alpha.
    pub base_color_texture: Option<TextureUse>,
    /// 0 dielectric coat over Lambert, 1 metal.
    pub metallic: f32,
    /// Perceptual; the microfacet width is its square.
    pub roughness: f32,
    /// Green: roughness, blue: metallic; both linear.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Tangent space, linear.
    pub normal_texture: Option<TextureUse>,
    /// Multiplies x and y of the normal texture.
    pub normal_scale: f32,
    /// Radiance leaving the front (both sides when `double_sided`), the strength multiplied in.
    pub emissive: Vec3,
    /// sRGB encoded, multiplies `emissive`.
    pub emissive_texture: Option<TextureUse>,
    /// What alpha means.
    pub alpha: AlphaMode,
    /// Back faces are seen, with the normal turned towards the viewer.
    pub double_sided: bool,
    /// Share of the light that enters a smooth dielectric instead of its diffuse base.
    pub transmission: f32,
    /// Index of refraction of the inside against the outside.
    pub ior: f32,
    /// True when the surface bounds a solid (refract), false for a thin sheet (pass straight).
    pub solid: bool,
    /// What the inside of a solid leaves of white light after `attenuation_distance`.
    pub attenuation_color: Vec3,
    /// Metres; infinite when the inside absorbs nothing.
    pub attenuation_distance: f32,
    /// What the file says beyond this model, kept whole.
    pub extensions: MaterialExtensions,
    /// Other materials that take the place of this one's lobes. Its emission, alpha and inside stay, and its normal map for the curves; each leaf
    /// has its own normal map or none.
    pub tree: Option<MaterialTree>,
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: String::from("default"),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha: AlphaMode::Opaque,
            double_sided: true,
            transmission: 0.0,
            ior: 1.5,
            solid: false,
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            extensions: MaterialExtensions::default(),
            tree: None,
        }
    }
}

/// What the alpha of the base colour means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// Opaque at or above the cutoff, absent below.
    Mask {
        /// In 0..=1.
        cutoff: f32,
    },
    /// Opaque with probability alpha.
    Blend,
}

/// How a material looks into an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// Into [`Scene::images`].
    pub image: u32,
    /// 0 or 1: which of [`Vertex::uv`].
    pub uv_set: u32,
    /// Along u and v.
    pub wrap: [Wrap; 2],
    /// Bilinear when true, nearest when false.
    pub linear: bool,
    /// `uv' = rows * (u, v, 1)`: the two rows of the affine texture transform; identity when the file has none.
    pub transform: [Vec3; 2],
}

/// What happens outside the unit square of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Repeat.
    Repeat,
    /// Repeat, every second time mirrored.
    Mirror,
    /// Continue the border texel.
    Clamp,
}

/// An 8-bit image as stored in the file (no colour conversion applied), row 0 at the top (v = 0).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Shown in messages.
    pub name: String,
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// RGBA, `width * height` entries.
    pub texels: Vec<[u8; 4]>,
}

/// A light without extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PunctualLight {
    /// Point, spot or directional.
    pub kind: LightKind,
    /// World space; unused for directional lights.
    pub position: Vec3,
    /// Unit vector along which the light travels; unused for point lights.
    pub direction: Vec3,
    /// Linear colour times intensity: candela (W/sr) for point and spot, lux (W/m2) for directional.
    pub intensity: Vec3,
    /// Metres beyond which the light does not reach, `f32::INFINITY` when unlimited.
    pub range: f32,
    /// Into [`Scene::profiles`]: how strong the light is in which direction. Kept, and not rendered yet.
    pub profile: Option<u32>,
}

/// A measured distribution of light over directions, in a file of the IES (LM-63). Found, and not read yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IesProfile {
    /// As the scene's file calls it.
    pub name: String,
    /// Where it is: in the folder of the scene's file or below.
    pub path: PathBuf,
}

/// The shape of a [`PunctualLight`]. Falloff of spots as KHR_lights_punctual defines it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// All around.
    Point,
    /// Within a cone.
    Spot {
        /// Radians from the axis where falloff starts.
        inner: f32,
        /// Radians from the axis where it ends.
        outer: f32,
    },
    /// Parallel rays.
    Directional,
}

/// An equirectangular panorama. The middle of the image lies towards -Z, +X is to the right of it, the top row is +Y.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Shown in messages.
    pub name: String,
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// Linear radiance, `width * height` entries, row 0 at the top; finite and not negative.
    pub texels: Vec<[f32; 3]>,
}

/// A movement of a scene's parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    /// As [`LoadOptions::animation`](super::LoadOptions::animation) asks for it, or its number in the file.
    pub name: String,
    /// Its first and its last key, as the file says without being asked about the keys themselves; `None` when it says nothing.
    pub seconds: Option<[f32; 2]>,
}

/// Where the scene is seen from: looks along -Z of its own space, +Y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Shown in listings.
    pub name: String,
    /// Rigid: no scale.
    pub world_from_camera: Mat4,
    /// Lens.
    pub projection: Projection,
}

/// The lens of a [`Camera`]; the width follows from the image's aspect ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole.
    Perspective {
        /// Full vertical angle in radians.
        vertical_fov: f32,
    },
    /// Parallel.
    Orthographic {
        /// Half of the visible height in metres.
        half_height: f32,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a factor that counts as light although its texture is black, or black in the only channel that the factor has; a texture that
    // hides the light of materials without one, or of materials that no triangle has.
    #[test]
    fn a_black_texture_emits_nothing() {
        let usage = |image| TextureUse { image, uv_set: 0, wrap: [Wrap::Repeat; 2], linear: true, transform: [Vec3::X, Vec3::Y] };
        let image = |texels: Vec<[u8; 4]>| Image { name: String::new(), width: texels.len() as u32, height: 1, texels };
        let glow =
            |emissive: Vec3, texture: Option<u32>| Material { emissive, emissive_texture: texture.map(usage), ..Material::default() };
        let scene = |material: Material| Scene {
            triangles: vec![Triangle { vertices: [0; 3], material: 1 }],
            materials: vec![glow(Vec3::ONE, None), material],
            images: vec![image(vec![[0, 0, 0, 255]; 2]), image(vec![[0; 4], [0, 1, 0, 0]])],
            ..Scene::default()
        };
        for (material, is_light) in [
            (glow(Vec3::ZERO, None), false),
            (glow(Vec3::X, None), true),
            (glow(Vec3::ONE, Some(0)), false),
            (glow(Vec3::ONE, Some(1)), true),
            (glow(Vec3::X, Some(1)), false),
            (glow(Vec3::Y, Some(1)), true),
        ] {
            assert_eq!(scene(material.clone()).has_light(), is_light, "{material:?}");
        }
    }
}
