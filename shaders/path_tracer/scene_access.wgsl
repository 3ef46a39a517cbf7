// The buffers of a packed scene and how to read a record from them.
//
// With `uniform_rows` the rows of a small scene lie in uniform memory, two words to a number of 64 bits: see `gpu_scene::placement`.

@if(uniform_rows) import constants::{BVH_BUFFER_ROWS, TRIANGLE_BUFFER_ROWS, TABLE_BUFFER_ROWS};
import package::path_tracer::records::{View, Material, Texture, Light, Punctual, PACKED_TRIANGLE_ROWS, MATERIAL_ROWS, TEXTURE_ROWS, LIGHT_ROWS, PUNCTUAL_ROWS, unpack_packed_triangle, unpack_material, unpack_texture, unpack_light, unpack_punctual};

@group(1) @binding(0) var<uniform> view: View;
@if(!uniform_rows) @group(1) @binding(1) var<storage, read> bvh: array<vec4u>;
@if(!uniform_rows) @group(1) @binding(2) var<storage, read> triangles: array<vec4u>;
@if(!uniform_rows) @group(1) @binding(3) var<storage, read> tables: array<vec4u>;
@if(uniform_rows) @group(1) @binding(1) var<uniform> bvh: array<vec2<u64>, BVH_BUFFER_ROWS>;
@if(uniform_rows) @group(1) @binding(2) var<uniform> triangles: array<vec2<u64>, TRIANGLE_BUFFER_ROWS>;
@if(uniform_rows) @group(1) @binding(3) var<uniform> tables: array<vec2<u64>, TABLE_BUFFER_ROWS>;
@group(1) @binding(4) var<storage, read> texels: array<u32>;

@if(uniform_rows) fn words_of(row: vec2<u64>) -> vec4u {
    return vec4u(u32(row.x), u32(row.x >> 32u), u32(row.y), u32(row.y >> 32u));
}

fn bvh_row(at: u32) -> vec4u {
    @if(uniform_rows) return words_of(bvh[at]);
    @if(!uniform_rows) return bvh[at];
}

// Triangles first, then attributes of vertices.
fn triangle_row(at: u32) -> vec4u {
    @if(uniform_rows) return words_of(triangles[at]);
    @if(!uniform_rows) return triangles[at];
}

fn triangle_word(at: u32, component: u32) -> u32 {
    @if(uniform_rows) return words_of(triangles[at])[component];
    @if(!uniform_rows) return triangles[at][component];
}

fn table_row(at: u32) -> vec4u {
    @if(uniform_rows) return words_of(tables[at]);
    @if(!uniform_rows) return tables[at];
}

fn table_word(at: u32, component: u32) -> u32 {
    @if(uniform_rows) return words_of(tables[at])[component];
    @if(!uniform_rows) return tables[at][component];
}

struct Triangle {
    // Normalised space.
    v0: vec3f,
    v1: vec3f,
    v2: vec3f,
    // Into the vertex attributes.
    vertices: vec3u,
    // Index and flags.
    material: u32,
    // Its entry among the lights or NONE.
    light: u32,
}

// The corners alone.
fn triangle_corners(slot: u32) -> mat3x3f {
    let at = slot * PACKED_TRIANGLE_ROWS;
    let first = bitcast<vec4f>(triangle_row(at));
    let second = bitcast<vec4f>(triangle_row(at + 1u));
    return mat3x3f(first.xyz, vec3f(first.w, second.xy), vec3f(second.zw, bitcast<f32>(triangle_word(at + 2u, 0u))));
}

// Number in the scene.
fn triangle_id(slot: u32) -> u32 {
    return triangle_word(slot * PACKED_TRIANGLE_ROWS + 2u, 1u);
}

// Index of the material and flags.
fn triangle_material(slot: u32) -> u32 {
    return triangle_word(slot * PACKED_TRIANGLE_ROWS + 2u, 2u);
}

fn load_triangle(slot: u32) -> Triangle {
    let at = slot * PACKED_TRIANGLE_ROWS;
    let packed = unpack_packed_triangle(triangle_row(at), triangle_row(at + 1u), triangle_row(at + 2u), triangle_row(at + 3u));
    let middle = packed.v1_yz_v2_xy;
    let v1 = vec3f(packed.v1_x, middle.xy);
    return Triangle(packed.v0, v1, vec3f(middle.zw, packed.v2_z), packed.vertices, packed.material, packed.light);
}

fn load_material(index: u32) -> Material {
    let at = view.materials + index * MATERIAL_ROWS;
    return unpack_material(table_row(at), table_row(at + 1u), table_row(at + 2u), table_row(at + 3u), table_row(at + 4u));
}

fn load_texture(index: u32) -> Texture {
    let at = view.textures + index * TEXTURE_ROWS;
    return unpack_texture(table_row(at), table_row(at + 1u), table_row(at + 2u));
}

fn load_light(index: u32) -> Light {
    return unpack_light(table_row(view.lights + index * LIGHT_ROWS));
}

fn load_punctual(index: u32) -> Punctual {
    let at = view.punctuals + index * PUNCTUAL_ROWS;
    return unpack_punctual(table_row(at), table_row(at + 1u), table_row(at + 2u), table_row(at + 3u));
}
