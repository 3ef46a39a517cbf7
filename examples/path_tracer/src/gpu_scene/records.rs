//! The records themselves: what the buffers of a packed scene hold.
//!
//! Key decision: indices that may be absent use [`NONE`]; flags are bits with names that WGSL receives too.
//!
//! **Invariant:** nothing here is declared a second time in a shader.

use std::fmt::Write as _;

use super::{
    coat,
    record::{declare, gpu_record},
};

/// An index that leads nowhere.
pub const NONE: u32 = u32::MAX;
/// The vector of a shadow ray towards a light at infinity has this length; a normalised scene fits into a ball of half of it.
pub const ESCAPE_DISTANCE: f32 = 8.0;

/// Bits of a triangle's `material` word above the index.
pub mod triangle_flags {
    /// The low bits hold the material's index.
    pub const MATERIAL_MASK: u32 = 0x00ff_ffff;
    /// A hit must ask the material's alpha.
    pub const ALPHA: u32 = 1 << 24;
    /// The material emits.
    pub const EMISSIVE: u32 = 1 << 25;
    /// The corners run clockwise when seen from the front.
    pub const CLOCKWISE: u32 = 1 << 26;
}

/// Bits of [`MaterialRecord::flags`].
pub mod material_flags {
    /// Emits and is seen from both sides.
    pub const DOUBLE_SIDED: u32 = 1;
    /// Alpha is compared with the cutoff.
    pub const ALPHA_MASK: u32 = 2;
    /// Alpha is the probability of being there.
    pub const ALPHA_BLEND: u32 = 4;
    /// Bounds a solid: light is refracted.
    pub const SOLID: u32 = 8;
    /// The dielectric has an interface (its index differs from the outside).
    pub const COAT: u32 = 16;
}

/// Values of [`TermRecord::kind`], and a bit beside them.
pub mod term_kinds {
    /// The same from everywhere.
    pub const CONSTANT: u32 = 0;
    /// Reflectance of a smooth dielectric.
    pub const FRESNEL: u32 = 1;
    /// From one value at the normal to another at the horizon.
    pub const CUSTOM: u32 = 2;
    /// What is left of 1.
    pub const REST: u32 = 4;
}

/// Bits of [`TextureRecord::flags`].
pub mod texture_flags {
    /// Two bits for the wrap along u: 0 repeat, 1 mirror, 2 clamp.
    pub const WRAP_U_SHIFT: u32 = 0;
    /// Two bits for the wrap along v.
    pub const WRAP_V_SHIFT: u32 = 2;
    /// Bilinear instead of nearest.
    pub const LINEAR: u32 = 16;
    /// Reads the second set of texture coordinates.
    pub const SECOND_UV: u32 = 32;
}

/// Values of [`LightRecord::kind`].
pub mod light_kinds {
    /// `index` is a slot in the triangle buffer.
    pub const TRIANGLE: u32 = 0;
    /// `index` is a punctual record.
    pub const PUNCTUAL: u32 = 1;
    /// The environment.
    pub const ENVIRONMENT: u32 = 2;
}

/// Values of [`PunctualRecord::kind`].
pub mod punctual_kinds {
    /// All around.
    pub const POINT: u32 = 0;
    /// Within a cone.
    pub const SPOT: u32 = 1;
    /// Parallel rays.
    pub const DIRECTIONAL: u32 = 2;
}

gpu_record! {
    /// The uniform: camera, limits, and where the tables begin (in rows of 16 bytes unless said otherwise).
    pub struct ViewRecord as "View" {
        /// Normalised space.
        camera_origin: vec3f,
        /// 0 perspective, 1 orthographic.
        projection: u32,
        /// One pixel to the right.
        camera_right: vec3f,
        /// Pixels.
        width: u32,
        /// One pixel up.
        camera_up: vec3f,
        /// Pixels.
        height: u32,
        /// Unit length.
        camera_forward: vec3f,
        /// Keys all random numbers.
        seed: u32,
        /// First node, packed as the traversal wants it; [`NONE`] without triangles.
        bvh_root: u32,
        /// Vertex attributes, in the triangle buffer.
        vertices: u32,
        /// In the tables.
        materials: u32,
        /// In the tables.
        textures: u32,
        /// In the tables.
        lights: u32,
        /// In the tables.
        punctuals: u32,
        /// Alias entries of the lights, two per row.
        light_alias: u32,
        /// Logarithm of their number.
        light_alias_log2: u32,
        /// Alias entries of the panorama, two per row.
        environment_alias: u32,
        /// Logarithm of their number.
        environment_alias_log2: u32,
        /// Realised probabilities of the texels, four per row.
        environment_pmf: u32,
        /// Rows of the northern half.
        environment_rows: u32,
        /// Texels.
        environment_width: u32,
        /// Texels.
        environment_height: u32,
        /// First word of the radiances, in the texel buffer.
        environment_texels: u32,
        /// Probability that light selection picks the panorama.
        environment_selection: f32,
        /// First word of the 256 linear values of sRGB bytes, in the texel buffer.
        srgb_decoding: u32,
        /// A path scatters at most this often.
        max_depth: u32,
        /// Survival is certain before this depth.
        roulette_depth: u32,
        /// Survival is never less probable.
        roulette_floor: f32,
        /// Albedos of coats.
        coat_albedo: u32,
        /// Unused.
        pad0: u32,
        /// Unused.
        pad1: u32,
        /// Unused.
        pad2: u32,
    }
}

gpu_record! {
    /// A triangle in the order of the hierarchy's leaves.
    pub struct TriangleRecord as "PackedTriangle" {
        /// First corner, in normalised space like all of them. They follow each other without gaps: what a walk reads are nine words.
        v0: vec3f,
        /// Second corner.
        v1_x: f32,
        /// Second corner and the beginning of the third one.
        v1_yz_v2_xy: vec4f,
        /// Its end.
        v2_z: f32,
        /// Its index in the scene, which decides between coincident triangles.
        id: u32,
        /// Index and [`triangle_flags`].
        material: u32,
        /// Its entry among the lights or [`NONE`].
        light: u32,
        /// Into the vertex attributes.
        vertices: vec3u,
        /// Unused.
        pad: u32,
    }
}

gpu_record! {
    /// A surface as glTF describes it, every number in its valid range.
    pub struct MaterialRecord as "Material" {
        /// Linear, in 0..=1.
        base_color: vec4f,
        /// Radiance.
        emissive: vec3f,
        /// Of [`material_flags::ALPHA_MASK`].
        alpha_cutoff: f32,
        /// 0..=1
        metallic: f32,
        /// Perceptual.
        roughness: f32,
        /// Of x and y.
        normal_scale: f32,
        /// 0..=1
        transmission: f32,
        /// Index inside over index outside.
        eta: f32,
        /// Reflectance of the dielectric at normal incidence.
        f0: f32,
        /// See [`material_flags`].
        flags: u32,
        /// One more than the row at which its list of lobes begins; 0 for a material that is no tree.
        tree: u32,
        /// Into the textures, or [`NONE`].
        base_color_texture: u32,
        /// Into the textures, or [`NONE`].
        metallic_roughness_texture: u32,
        /// Into the textures, or [`NONE`].
        normal_texture: u32,
        /// Into the textures, or [`NONE`].
        emissive_texture: u32,
    }
}

gpu_record! {
    /// A leaf of a tree of materials, with the constant part of its share.
    pub struct LobeRecord as "Lobe" {
        /// Into the materials.
        material: u32,
        /// Above 0.
        factor: f32,
        /// Row of the first term, in the table of trees.
        terms: u32,
        /// Number of terms.
        term_count: u32,
    }
}

gpu_record! {
    /// A factor of a lobe's share that depends on the point or the view.
    pub struct TermRecord as "Term" {
        /// See [`term_kinds`].
        kind: u32,
        /// Multiplies the curve.
        weight: f32,
        /// Into the textures, or [`NONE`].
        texture: u32,
        /// The index of refraction, or the value at normal incidence.
        start: f32,
        /// The value at the horizon.
        grazing: f32,
        /// Of the rise towards the horizon.
        exponent: f32,
        /// Unused.
        pad0: u32,
        /// Unused.
        pad1: u32,
    }
}

gpu_record! {
    /// An image and how to look into it.
    pub struct TextureRecord as "Texture" {
        /// Row of the transform that gives u.
        row_u: vec3f,
        /// First word in the texel buffer.
        texels: u32,
        /// Row of the transform that gives v.
        row_v: vec3f,
        /// See [`texture_flags`].
        flags: u32,
        /// Texels.
        width: u32,
        /// Texels.
        height: u32,
        /// Unused.
        pad0: u32,
        /// Unused.
        pad1: u32,
    }
}

gpu_record! {
    /// One entry of the light selection.
    pub struct LightRecord as "Light" {
        /// See [`light_kinds`].
        kind: u32,
        /// What it means depends on the kind.
        index: u32,
        /// Realised probability of being picked.
        pmf: f32,
        /// Triangles: one over the area.
        inverse_area: f32,
    }
}

gpu_record! {
    /// A light without extent.
    pub struct PunctualRecord as "Punctual" {
        /// Normalised space.
        position: vec3f,
        /// See [`punctual_kinds`].
        kind: u32,
        /// Along which light travels.
        direction: vec3f,
        /// One over the range, 0 when unlimited.
        inverse_range: f32,
        /// Radiant intensity in normalised space, or irradiance.
        intensity: vec3f,
        /// Of the cosine.
        spot_scale: f32,
        /// After the scale.
        spot_offset: f32,
        /// Unused.
        pad0: u32,
        /// Unused.
        pad1: u32,
        /// Unused.
        pad2: u32,
    }
}

/// The WGSL of all records and flags: the module `path_tracer::records`.
pub fn records_wgsl() -> String {
    let mut text = String::from("// Generated from the Rust declarations of the records.\n");
    declare::<ViewRecord>(&mut text);
    declare::<TriangleRecord>(&mut text);
    declare::<MaterialRecord>(&mut text);
    declare::<LobeRecord>(&mut text);
    declare::<TermRecord>(&mut text);
    declare::<TextureRecord>(&mut text);
    declare::<LightRecord>(&mut text);
    declare::<PunctualRecord>(&mut text);
    for (name, value) in CONSTANTS {
        let _ = writeln!(text, "const {name}: u32 = {value}u;");
    }
    let _ = writeln!(text, "const ESCAPE_DISTANCE: f32 = {ESCAPE_DISTANCE:?};");
    text
}

const CONSTANTS: &[(&str, u32)] = &[
    ("NONE", NONE),
    ("COAT_COSINE_CELLS", coat::COSINE_CELLS),
    ("COAT_ROUGHNESS_ROWS", coat::ROUGHNESS_ROWS),
    ("TRIANGLE_MATERIAL_MASK", triangle_flags::MATERIAL_MASK),
    ("TRIANGLE_ALPHA", triangle_flags::ALPHA),
    ("TRIANGLE_EMISSIVE", triangle_flags::EMISSIVE),
    ("TRIANGLE_CLOCKWISE", triangle_flags::CLOCKWISE),
    ("MATERIAL_DOUBLE_SIDED", material_flags::DOUBLE_SIDED),
    ("MATERIAL_ALPHA_MASK", material_flags::ALPHA_MASK),
    ("MATERIAL_ALPHA_BLEND", material_flags::ALPHA_BLEND),
    ("MATERIAL_SOLID", material_flags::SOLID),
    ("MATERIAL_COAT", material_flags::COAT),
    ("TERM_FRESNEL", term_kinds::FRESNEL),
    ("TERM_CUSTOM", term_kinds::CUSTOM),
    ("TERM_REST", term_kinds::REST),
    ("TEXTURE_WRAP_U_SHIFT", texture_flags::WRAP_U_SHIFT),
    ("TEXTURE_WRAP_V_SHIFT", texture_flags::WRAP_V_SHIFT),
    ("TEXTURE_LINEAR", texture_flags::LINEAR),
    ("TEXTURE_SECOND_UV", texture_flags::SECOND_UV),
    ("LIGHT_TRIANGLE", light_kinds::TRIANGLE),
    ("LIGHT_PUNCTUAL", light_kinds::PUNCTUAL),
    ("LIGHT_ENVIRONMENT", light_kinds::ENVIRONMENT),
    ("PUNCTUAL_POINT", punctual_kinds::POINT),
    ("PUNCTUAL_SPOT", punctual_kinds::SPOT),
    ("PUNCTUAL_DIRECTIONAL", punctual_kinds::DIRECTIONAL),
];
