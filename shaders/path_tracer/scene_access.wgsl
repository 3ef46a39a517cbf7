// The buffers of a packed scene and how to read a record from them.

import package::path_tracer::records::{View, Triangle, Material, Texture, Light, Punctual, TRIANGLE_ROWS, MATERIAL_ROWS, TEXTURE_ROWS, LIGHT_ROWS, PUNCTUAL_ROWS, unpack_triangle, unpack_material, unpack_texture, unpack_light, unpack_punctual};

@group(1) @binding(0) var<uniform> view: View;
@group(1) @binding(1) var<storage, read> bvh: array<vec4u>;
@group(1) @binding(2) var<storage, read> triangles: array<vec4u>;
@group(1) @binding(3) var<storage, read> tables: array<vec4u>;
@group(1) @binding(4) var<storage, read> texels: array<u32>;

fn load_triangle(slot: u32) -> Triangle {
    let at = slot * TRIANGLE_ROWS;
    return unpack_triangle(triangles[at], triangles[at + 1u], triangles[at + 2u], triangles[at + 3u]);
}

fn load_material(index: u32) -> Material {
    let at = view.materials + index * MATERIAL_ROWS;
    return unpack_material(tables[at], tables[at + 1u], tables[at + 2u], tables[at + 3u], tables[at + 4u]);
}

fn load_texture(index: u32) -> Texture {
    let at = view.textures + index * TEXTURE_ROWS;
    return unpack_texture(tables[at], tables[at + 1u], tables[at + 2u]);
}

fn load_light(index: u32) -> Light {
    return unpack_light(tables[view.lights + index * LIGHT_ROWS]);
}

fn load_punctual(index: u32) -> Punctual {
    let at = view.punctuals + index * PUNCTUAL_ROWS;
    return unpack_punctual(tables[at], tables[at + 1u], tables[at + 2u], tables[at + 3u]);
}
