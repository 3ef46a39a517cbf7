// Emissive triangles as lights: uniform by area, density per solid angle distance^2 / (area cosine).

import package::math::offset::{hit_point_error, offset_point};
import package::math::random::unit_f32;
import package::path_tracer::triangle_front::front_normal;
@if(alpha) import package::path_tracer::alpha::coverage;
import package::path_tracer::emission::emitted_radiance;
import package::path_tracer::light_sample::LightSample;
import package::path_tracer::records::{Light, TRIANGLE_ALPHA, TRIANGLE_MATERIAL_MASK};
import package::path_tracer::scene_access::{load_material, load_triangle};
@if(alpha) import package::path_tracer::texture::base_color_at;

// Below this cosine a light is left to BSDF sampling, in sampling and in densities alike (2^-20).
const LIGHT_COSINE_MIN: f32 = 9.5367431640625e-7;

// Density of area sampling for a point at `offset` from the viewer, per solid angle, without the light's selection; 0 where never drawn.
fn triangle_light_pdf(inverse_area: f32, offset: vec3f, plane_normal: vec3f) -> f32 {
    let square = dot(offset, offset);
    let projected = abs(dot(offset, plane_normal));
    let distance = sqrt(square);
    if projected < LIGHT_COSINE_MIN * distance || projected <= 0.0 {
        return 0.0;
    }
    return inverse_area * square * (distance / projected);
}

fn sample_triangle_light(light: Light, reference: vec3f, words: vec2u) -> LightSample {
    let triangle = load_triangle(light.index);
    let material = load_material(triangle.material & TRIANGLE_MATERIAL_MASK);
    let root = sqrt(unit_f32(words.x));
    let barycentrics = vec2f(root * (1.0 - unit_f32(words.y)), root * unit_f32(words.y));
    let e1 = triangle.v1 - triangle.v0;
    let e2 = triangle.v2 - triangle.v0;
    let normal = front_normal(triangle);
    let point = triangle.v0 + barycentrics.x * e1 + barycentrics.y * e2;
    let offset = point - reference;
    let is_front = dot(normal, offset) < 0.0;
    var radiance = emitted_radiance(triangle, material, barycentrics, is_front);
    @if(alpha) if (triangle.material & TRIANGLE_ALPHA) != 0u {
        radiance *= coverage(material, base_color_at(material, triangle.vertices, barycentrics).w);
    }
    let target_point = offset_point(point, normal, hit_point_error(triangle.v0, e1, e2), -offset);
    let pdf = triangle_light_pdf(light.inverse_area, offset, normal);
    return LightSample(target_point, false, offset * inverseSqrt(max(dot(offset, offset), 7.888609052210118e-31)), radiance, pdf, false);
}
