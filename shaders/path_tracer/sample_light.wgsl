// Stage: picks one light for the surface point and prepares the shadow ray and what it would bring.

import constants::{LIGHT_STRATEGY, STRATEGY_MIS};
import package::math::mis::{PDF_MIN, power_heuristic};
import package::math::offset::offset_point;
import package::path_tracer::lights::sample_one_light;
import package::path_tracer::path::{Path, DIMENSION_LIGHT, DIMENSION_LIGHT_TEXEL, random_at};
import package::path_tracer::records::{ESCAPE_DISTANCE, TRIANGLE_MATERIAL_MASK};
import package::path_tracer::scattering::evaluate_scattering;
import package::path_tracer::scene_access::{load_material, load_triangle};
import package::path_tracer::surface::surface_at;

fn sample_light(path: ptr<function, Path>) {
    let wo = -(*path).direction;
    let triangle = load_triangle((*path).hit_triangle);
    let material = load_material(triangle.material & TRIANGLE_MATERIAL_MASK);
    let surface = surface_at(triangle, material, (*path).hit_barycentrics, wo);
    let words = random_at((*path).pixel, (*path).sample, (*path).depth, DIMENSION_LIGHT);
    let inner_words = random_at((*path).pixel, (*path).sample, (*path).depth, DIMENSION_LIGHT_TEXEL);
    let light = sample_one_light(surface.position, words, inner_words);
    let start = offset_point(surface.position, surface.normal, surface.error, light.wi);
    (*path).shadow_origin = start;
    (*path).shadow_vector = select(light.target_point - start, light.wi * ESCAPE_DISTANCE, light.is_infinite);
    (*path).shadow_radiance = vec3f(0.0);

    // Light through the back of the plane would leak around the shading normal.
    if light.pdf < PDF_MIN || dot(light.wi, surface.normal) <= 0.0 {
        return;
    }
    let value = evaluate_scattering(triangle, material, (*path).hit_barycentrics, surface, wo, light.wi);
    var weight = 1.0;
    if !light.is_singular && LIGHT_STRATEGY == STRATEGY_MIS {
        weight = power_heuristic(light.pdf, value.pdf);
    }
    (*path).shadow_radiance = (*path).beta * value.f_cosine * (light.radiance * (weight / light.pdf));
}
