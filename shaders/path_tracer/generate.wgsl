// Birth of a path: a ray through a uniformly chosen place in its pixel (box filter).

import package::math::random::unit_f32;
import package::path_tracer::camera::camera_ray;
@if(transmission) import package::path_tracer::eta_scale::begin_eta_scale;
@if(samplable_lights) import package::path_tracer::found_weight::remember_pdf;
import package::path_tracer::path::{Path, random_camera};
import package::path_tracer::records::NONE;

fn generate(path: ptr<function, Path>, item: Item) {
    let words = random_camera(item.pixel, item.sample);
    let ray = camera_ray(item_coordinates(item), vec2f(unit_f32(words.x), unit_f32(words.y)));
    (*path).pixel = item.pixel;
    (*path).sample = item.sample;
    (*path).depth = 0u;
    (*path).origin = ray.origin;
    (*path).direction = ray.direction;
    (*path).beta = vec3f(1.0);
    (*path).radiance = vec3f(0.0);
    (*path).hit_triangle = NONE;
    @if(samplable_lights) remember_pdf(path, 0.0);
    @if(transmission) begin_eta_scale(path);
}
