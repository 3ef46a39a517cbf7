// The state of one light path and the table of its random dimensions.
//
// Random numbers are keyed by (pixel, sample, dimension, seed); a dimension is four words. Dimension 0 is the camera's, and each
// scattering event owns a block of eight, in which every purpose has a fixed place. What is not used is not drawn and moves nothing:
//   0 BSDF (x lobe, yz direction, w lobe of a tree)      1 light (xy which light, zw which texel, or where on the triangle)
//   2 light (xy within the texel)      3 alpha along the path's ray      4 alpha along the shadow ray      5..7 free

import package::math::random::pcg4d;
import package::path_tracer::scene_access::view;

const DIMENSION_BSDF: u32 = 0u;
const DIMENSION_LIGHT: u32 = 1u;
const DIMENSION_LIGHT_TEXEL: u32 = 2u;
const DIMENSION_ALPHA: u32 = 3u;
const DIMENSION_SHADOW_ALPHA: u32 = 4u;
const DIMENSIONS_PER_BOUNCE: u32 = 8u;

struct Path {
    // Key of the random numbers.
    pixel: u32,
    sample: u32,
    // Scattering events so far.
    depth: u32,
    // The ray being followed; the direction has unit length.
    origin: vec3f,
    direction: vec3f,
    // What a unit of radiance found along the ray adds to the pixel.
    beta: vec3f,
    // Found so far.
    radiance: vec3f,
    // Slot of the triangle met last (NONE: left the scene) and where on it; also the triangle that the next ray leaves.
    hit_triangle: u32,
    hit_barycentrics: vec2f,
    // Density with which the direction was drawn; 0 when no other strategy could have found it.
    @if(samplable_lights) bsdf_pdf: f32,
    // Product of squared relative indices, so that roulette does not see radiance swell inside glass.
    @if(transmission) eta_scale: f32,
    // From a surface point to a light, and what arrives if nothing lies between (t in 0..1).
    @if(samplable_lights) shadow_origin: vec3f,
    @if(samplable_lights) shadow_vector: vec3f,
    @if(samplable_lights) shadow_radiance: vec3f,
    // For the layers that are asked for: of the first surface that is not a mirror or glass alone, and 1 once it has been found.
    @if(layer_albedo) layer_albedo: vec3f,
    @if(layer_normal) layer_normal: vec3f,
    @if(delta_surfaces && (layer_albedo || layer_normal)) layer_settled: u32,
    // Of what the camera's ray has met: 1 if there is anything, the distance along the camera's axis, the place, and the numbers.
    @if(layer_depth || layer_position) layer_hits: u32,
    @if(layer_depth) layer_depth: f32,
    @if(layer_position) layer_position: vec3f,
    @if(layer_object) layer_object: u32,
    @if(layer_material) layer_material: u32,
}

// Four random words of one purpose at one scattering event.
fn random_at(pixel: u32, sample_index: u32, depth: u32, purpose: u32) -> vec4u {
    let dimension = (depth + 1u) * DIMENSIONS_PER_BOUNCE + purpose;
    return pcg4d(vec4u(pixel, sample_index, dimension, view.seed));
}

// Four random words of the camera.
fn random_camera(pixel: u32, sample_index: u32) -> vec4u {
    return pcg4d(vec4u(pixel, sample_index, 0u, view.seed));
}
