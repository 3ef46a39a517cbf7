// Death of a path where more than the radiance is asked for: what this sample of the pixel saw, the radiance first.

import package::path_tracer::path::Path;
@if(transparent) import package::path_tracer::records::NONE;

struct Seen {
    radiance: vec3f,
    // 1 when the camera's ray has met something.
    @if(transparent) covered: u32,
    // For the variance of the mean: the second moment about zero.
    @if(layer_variance) square: vec3f,
    @if(layer_albedo) albedo: vec3f,
    @if(layer_normal) normal: vec3f,
    @if(layer_depth || layer_position) hits: u32,
    @if(layer_depth) depth: f32,
    @if(layer_position) position: vec3f,
    @if(layer_object) object: u32,
    @if(layer_material) material: u32,
}

fn finish(path: ptr<function, Path>) -> Seen {
    var seen: Seen;
    seen.radiance = (*path).radiance;
    // A path that has scattered nowhere and met nothing last has met nothing at all.
    @if(transparent) seen.covered = select(1u, 0u, (*path).depth == 0u && (*path).hit_triangle == NONE);
    @if(layer_variance) seen.square = (*path).radiance * (*path).radiance;
    @if(layer_albedo) seen.albedo = (*path).layer_albedo;
    @if(layer_normal) seen.normal = (*path).layer_normal;
    @if(layer_depth || layer_position) seen.hits = (*path).layer_hits;
    @if(layer_depth) seen.depth = (*path).layer_depth;
    @if(layer_position) seen.position = (*path).layer_position;
    @if(layer_object) seen.object = (*path).layer_object;
    @if(layer_material) seen.material = (*path).layer_material;
    return seen;
}
