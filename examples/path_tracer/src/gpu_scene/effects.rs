//! What a scene calls for, as constants that let compilers drop the rest.
//!
//! **Invariant:** an effect is on only if some object of the scene asks for it.

use super::{
    LightStrategy,
    records::{MaterialRecord, NONE, material_flags},
};
use crate::scene::Vertex;

/// The effects that a packed scene uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Effects {
    /// Some material looks into an image.
    pub textures: bool,
    /// Some material has a normal map.
    pub normal_maps: bool,
    /// Some vertex is not white.
    pub vertex_colors: bool,
    /// Some material is masked or blended.
    pub alpha: bool,
    /// Some material reflects (a metal or a coat).
    pub interfaces: bool,
    /// Some material transmits.
    pub transmission: bool,
    /// There is a panorama that is not black.
    pub environment: bool,
    /// Some triangle emits.
    pub emissive_triangles: bool,
    /// There are point, spot or directional lights.
    pub punctual_lights: bool,
}

impl Effects {
    /// What materials and vertices ask for; lights are filled in when they are packed.
    pub(crate) fn of_surfaces(materials: &[MaterialRecord], vertices: &[Vertex]) -> Effects {
        let any = |test: fn(&MaterialRecord) -> bool| materials.iter().any(test);
        Effects {
            textures: any(|material| {
                let textures = [material.base_color_texture, material.metallic_roughness_texture, material.emissive_texture];
                material.normal_texture != NONE || textures.iter().any(|&texture| texture != NONE)
            }),
            normal_maps: any(|material| material.normal_texture != NONE),
            vertex_colors: vertices.iter().any(|vertex| vertex.color != glam::Vec4::ONE),
            alpha: any(super::materials::has_alpha),
            interfaces: any(|material| {
                let is_coated = material.flags & material_flags::COAT != 0 && material.transmission < 1.0;
                material.metallic > 0.0 || is_coated
            }),
            // A texture may take away what the factor says, and glTF's default factor is 1.
            transmission: any(|material| {
                material.transmission > 0.0 && (material.metallic < 1.0 || material.metallic_roughness_texture != NONE)
            }),
            ..Effects::default()
        }
    }

    /// Rows of four words per vertex.
    pub(crate) fn vertex_rows(&self) -> u32 {
        1 + u32::from(self.textures) + u32::from(self.normal_maps) + u32::from(self.vertex_colors)
    }

    /// The module `path_tracer::effects`.
    pub(crate) fn wgsl(&self, stack: u32, strategy: LightStrategy) -> String {
        let tangent_row = 1 + u32::from(self.textures);
        let color_row = tangent_row + u32::from(self.normal_maps);
        let strategy = u32::from(strategy == LightStrategy::Lights);
        format!(
            "// Generated from the scene: what it calls for.\n\
             const HAS_TEXTURES: bool = {};\nconst HAS_NORMAL_MAPS: bool = {};\nconst HAS_VERTEX_COLORS: bool = {};\n\
             const HAS_ALPHA: bool = {};\nconst HAS_INTERFACES: bool = {};\nconst HAS_TRANSMISSION: bool = {};\n\
             const HAS_ENVIRONMENT: bool = {};\nconst HAS_TRIANGLE_LIGHTS: bool = {};\nconst HAS_PUNCTUAL_LIGHTS: bool = {};\n\
             const VERTEX_ROWS: u32 = {}u;\nconst VERTEX_UV_ROW: u32 = 1u;\nconst VERTEX_TANGENT_ROW: u32 = {tangent_row}u;\n\
             const VERTEX_COLOR_ROW: u32 = {color_row}u;\nconst BVH_STACK: u32 = {}u;\n\
             const STRATEGY_MIS: u32 = 0u;\nconst STRATEGY_LIGHTS: u32 = 1u;\nconst LIGHT_STRATEGY: u32 = {strategy}u;\n",
            self.textures,
            self.normal_maps,
            self.vertex_colors,
            self.alpha,
            self.interfaces,
            self.transmission,
            self.environment,
            self.emissive_triangles,
            self.punctual_lights,
            self.vertex_rows(),
            stack.max(1),
        )
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    // Kills: glass that is drawn black because its metallic factor is 1 and only the texture says 0 (it was, in a Khronos sample).
    #[test]
    fn a_texture_may_undo_the_metal_of_a_glass() {
        let metal = MaterialRecord { transmission: 1.0, metallic: 1.0, metallic_roughness_texture: NONE, ..MaterialRecord::default() };
        assert!(!Effects::of_surfaces(&[metal], &[]).transmission);
        let textured = MaterialRecord { metallic_roughness_texture: 0, ..metal };
        assert!(Effects::of_surfaces(&[textured], &[]).transmission);
    }

    // Kills: a row of attributes that the vertices do not have, an effect that nothing calls for.
    #[test]
    fn a_plain_scene_calls_for_nothing() {
        let material = MaterialRecord {
            base_color_texture: NONE,
            metallic_roughness_texture: NONE,
            normal_texture: NONE,
            emissive_texture: NONE,
            ..MaterialRecord::default()
        };
        let white = Vertex { color: Vec4::ONE, ..Vertex::default() };
        assert_eq!(Effects::of_surfaces(&[material], &[white]), Effects::default());
        let everything = MaterialRecord { normal_texture: 0, metallic: 0.5, transmission: 0.5, ..material };
        let effects = Effects::of_surfaces(&[everything], &[Vertex::default()]);
        assert!(effects.textures && effects.normal_maps && effects.vertex_colors && effects.interfaces && effects.transmission);
        assert_eq!(effects.vertex_rows(), 4);
        let text = effects.wgsl(0, LightStrategy::Mis);
        assert!(text.contains("VERTEX_COLOR_ROW: u32 = 3u") && text.contains("BVH_STACK: u32 = 1u"), "{text}");
    }
}
