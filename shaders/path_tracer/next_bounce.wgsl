// Stage: draws the direction in which the path goes on, or ends it.

import package::math::mis::PDF_MIN;
import package::math::offset::offset_point;
import package::math::onb::to_world;
import package::math::vector::max_component;
@if(transmission) import package::path_tracer::eta_scale::multiply_eta_scale;
@if(samplable_lights) import package::path_tracer::found_weight::remember_pdf;
import package::path_tracer::path::{Path, DIMENSION_BSDF, random_at};
import package::path_tracer::records::TRIANGLE_MATERIAL_MASK;
import package::path_tracer::scattering::sample_scattering;
import package::path_tracer::scene_access::{load_material, load_triangle};
import package::path_tracer::surface::surface_at;

fn next_bounce(path: ptr<function, Path>) -> u32 {
    let wo = -(*path).direction;
    let triangle = load_triangle((*path).hit_triangle);
    let material = load_material(triangle.material & TRIANGLE_MATERIAL_MASK);
    let surface = surface_at(triangle, material, (*path).hit_barycentrics, wo);
    let words = random_at((*path).pixel, (*path).sample, (*path).depth, DIMENSION_BSDF);
    let scattered = sample_scattering(triangle, material, (*path).hit_barycentrics, surface, wo, words);
    let drawn = scattered.drawn;
    var direction = normalize(to_world(scattered.frame, drawn.wi));
    let beta = (*path).beta * drawn.weight;
    if max_component(beta) < PDF_MIN {
        return FINISH;
    }

    // Above the shading plane must be above the true one too, and below both when transmitted. A direction that was drawn with a density
    // ends here; one of a mirror or of glass has none and is bent to the right side instead, so that no light is lost.
    let height = dot(direction, surface.normal);
    if (drawn.wi.z > 0.0) != (height > 0.0) {
        if drawn.pdf > 0.0 {
            return FINISH;
        }
        direction -= 2.0 * height * surface.normal;
    }
    (*path).beta = beta;
    (*path).direction = direction;
    (*path).origin = offset_point(surface.position, surface.normal, surface.error, direction);
    @if(samplable_lights) remember_pdf(path, drawn.pdf);
    @if(transmission) multiply_eta_scale(path, drawn.eta_scale);
    (*path).depth += 1u;
    return CONTINUE;
}
