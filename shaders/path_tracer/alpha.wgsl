// Whether a surface is there for one ray: alpha masks and stochastic transparency.

import package::math::random::{pcg4d, unit_f32};
import package::path_tracer::records::{Material, MATERIAL_ALPHA_BLEND, MATERIAL_ALPHA_MASK, TRIANGLE_MATERIAL_MASK};
import package::path_tracer::scene_access::{load_material, load_triangle};
import package::path_tracer::texture::base_color_at;

// Probability that the surface is there.
fn coverage(material: Material, alpha: f32) -> f32 {
    if (material.flags & MATERIAL_ALPHA_MASK) != 0u {
        return select(0.0, 1.0, alpha >= material.alpha_cutoff);
    }
    return select(1.0, alpha, (material.flags & MATERIAL_ALPHA_BLEND) != 0u);
}

// Decided by the ray's key and the triangle's index in the scene, never by the order in which triangles are met.
fn is_present(slot: u32, id: u32, barycentrics: vec2f, key: vec4u) -> bool {
    let triangle = load_triangle(slot);
    let material = load_material(triangle.material & TRIANGLE_MATERIAL_MASK);
    let probability = coverage(material, base_color_at(material, triangle.vertices, barycentrics).w);
    let words = pcg4d(vec4u(key.x, key.y, key.z, id));
    return unit_f32(words.x) < probability;
}
