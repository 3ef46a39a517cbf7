//! What a scene calls for: the one place that says which features the path tracer's WGSL may ask for.
//!
//! Key decision: a feature removes text (`@if` in WGSL) and so state, functions and branches; a constant is a number inside of what stays.
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
    /// Some light can be picked. When none can, there are no stages that look for one.
    pub samplable_lights: bool,
    /// Some solid absorbs what passes it.
    pub absorption: bool,
    /// Some material is a tree.
    pub material_trees: bool,
    /// Some surface may send light on in single directions only: a mirror, or smooth glass. Layers are seen through it.
    pub delta_surfaces: bool,
}

impl Effects {
    /// What materials and vertices ask for; lights are filled in when they are packed.
    pub(crate) fn of_surfaces(materials: &[MaterialRecord], vertices: &[Vertex]) -> Effects {
        let any = |test: fn(&MaterialRecord) -> bool| materials.iter().any(test);
        let vertex_colors = vertices.iter().any(|vertex| vertex.color != glam::Vec4::ONE);
        Effects {
            textures: any(|material| {
                let textures = [material.base_color_texture, material.metallic_roughness_texture, material.emissive_texture];
                material.normal_texture != NONE || textures.iter().any(|&texture| texture != NONE)
            }),
            normal_maps: any(|material| material.normal_texture != NONE),
            vertex_colors,
            alpha: any(super::materials::has_alpha),
            interfaces: any(|material| {
                let is_coated = material.flags & material_flags::COAT != 0 && material.transmission < 1.0;
                material.metallic > 0.0 || is_coated
            }),
            // A texture may take away what the factor says, and glTF's default factor is 1.
            transmission: any(|material| {
                material.transmission > 0.0 && (material.metallic < 1.0 || material.metallic_roughness_texture != NONE)
            }),
            material_trees: any(|material| material.tree != 0),
            delta_surfaces: materials.iter().any(|material| may_be_delta(material, vertex_colors)),
            ..Effects::default()
        }
    }

    /// Rows of four words per vertex.
    pub(crate) fn vertex_rows(&self) -> u32 {
        1 + u32::from(self.textures) + u32::from(self.normal_maps) + u32::from(self.vertex_colors)
    }

    /// By the names under which `@if` asks for them.
    pub fn features(&self) -> [(&'static str, bool); 13] {
        [
            ("textures", self.textures),
            ("normal_maps", self.normal_maps),
            ("vertex_colors", self.vertex_colors),
            ("alpha", self.alpha),
            ("interfaces", self.interfaces),
            ("transmission", self.transmission),
            ("environment", self.environment),
            ("triangle_lights", self.emissive_triangles),
            ("punctual_lights", self.punctual_lights),
            ("samplable_lights", self.samplable_lights),
            ("absorption", self.absorption),
            ("material_trees", self.material_trees),
            ("delta_surfaces", self.delta_surfaces),
        ]
    }

    /// Constants of the WGSL: rows of a vertex, entries of the stack on the way through the hierarchy, how light is found.
    pub(crate) fn constants(&self, stack: u32, strategy: LightStrategy) -> [(&'static str, u32); 8] {
        let tangent_row = 1 + u32::from(self.textures);
        [
            ("VERTEX_ROWS", self.vertex_rows()),
            ("VERTEX_UV_ROW", 1),
            ("VERTEX_TANGENT_ROW", tangent_row),
            ("VERTEX_COLOR_ROW", tangent_row + u32::from(self.normal_maps)),
            ("BVH_STACK", stack.max(1)),
            ("STRATEGY_MIS", 0),
            ("STRATEGY_LIGHTS", 1),
            ("LIGHT_STRATEGY", u32::from(strategy == LightStrategy::Lights)),
        ]
    }
}

/// Narrower distributions of normals are mirrors, as the WGSL module `microfacet` has it.
pub(crate) const ALPHA_MIRROR: f32 = 0.001;

/// True unless it is certain that no point of the surface is a mirror or smooth glass alone: textures may take away what factors say.
fn may_be_delta(material: &MaterialRecord, has_vertex_colors: bool) -> bool {
    let is_textured = material.metallic_roughness_texture != NONE;
    let may_be_black =
        material.base_color_texture != NONE || has_vertex_colors || material.base_color[..3].iter().all(|&value| value <= 0.0);
    let may_lack_base = material.metallic >= 1.0 || material.transmission >= 1.0 || may_be_black;
    let has_interface = material.metallic > 0.0 || material.flags & material_flags::COAT != 0;
    let may_mirror = has_interface && (is_textured || material.roughness * material.roughness < ALPHA_MIRROR);
    may_lack_base && (may_mirror || material.transmission > 0.0)
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

    // Kills: a bound on mirrors that the kernels do not have.
    #[test]
    fn host_and_kernels_agree_on_mirrors() {
        let module = wavepool_shaders::PATH_TRACER.iter().find(|module| module.path == "path_tracer::microfacet").expect("it is there");
        assert!(module.text.contains(&format!("const ALPHA_MIRROR: f32 = {ALPHA_MIRROR};")));
    }

    // Kills: following paths through surfaces that are never smooth alone, or not following where a texture makes one so.
    #[test]
    fn only_mirrors_and_glass_call_for_followed_paths() {
        let plain = MaterialRecord {
            base_color: [0.5; 4],
            roughness: 0.0,
            flags: material_flags::COAT,
            base_color_texture: NONE,
            metallic_roughness_texture: NONE,
            normal_texture: NONE,
            emissive_texture: NONE,
            ..MaterialRecord::default()
        };
        let metal = MaterialRecord { metallic: 1.0, ..plain };
        let glass = MaterialRecord { transmission: 1.0, roughness: 0.5, ..plain };
        let rough = MaterialRecord { roughness: 0.1, ..metal };
        let cases = [
            ("polished plastic", plain, false),
            ("half glass", MaterialRecord { transmission: 0.5, ..plain }, false),
            ("rough metal", rough, false),
            ("metal", metal, true),
            ("glass", glass, true),
            ("black plastic", MaterialRecord { base_color: [0.0, 0.0, 0.0, 1.0], ..plain }, true),
            ("plastic with a picture", MaterialRecord { base_color_texture: 0, ..plain }, true),
            ("metal with a picture of roughness", MaterialRecord { metallic_roughness_texture: 0, ..rough }, true),
        ];
        for (name, material, expected) in cases {
            assert_eq!(Effects::of_surfaces(&[material], &[]).delta_surfaces, expected, "{name}");
        }
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
        let constants = effects.constants(0, LightStrategy::Mis);
        assert!(constants.contains(&("VERTEX_COLOR_ROW", 3)) && constants.contains(&("BVH_STACK", 1)), "{constants:?}");
    }
}
