// Light that a surface emits of itself.

import package::path_tracer::records::{Material, MATERIAL_DOUBLE_SIDED, NONE};
import package::path_tracer::scene_access::Triangle;
@if(textures) import package::path_tracer::texture::{sample_texture, texture_coordinates};

// Radiance towards a viewer in front of the triangle or behind it.
fn emitted_radiance(triangle: Triangle, material: Material, barycentrics: vec2f, is_front: bool) -> vec3f {
    if !is_front && (material.flags & MATERIAL_DOUBLE_SIDED) == 0u {
        return vec3f(0.0);
    }
    var radiance = material.emissive;
    @if(textures) if material.emissive_texture != NONE {
        radiance *= sample_texture(material.emissive_texture, texture_coordinates(triangle.vertices, barycentrics), true).xyz;
    }
    return radiance;
}
