// What denoisers want to know: reflectance and shading normal of the first surface that does not send all light on in single directions.
// Mirrors and smooth glass are followed, so that the mean over the samples is the blend of what they reflect and transmit.
// Source: Open Image Denoise, documentation of the filter RT. The albedo of a layered material is its base colour: the reflectance of the
// base and of a metal at normal incidence, and the tint of glass.

@if(layer_albedo && triangle_lights) import package::path_tracer::triangle_front::front_normal;
@if(layer_albedo && triangle_lights) import package::path_tracer::emission::emitted_radiance;
@if(layer_albedo && environment) import package::path_tracer::environment::environment_towards;
@if(layer_albedo && delta_surfaces) import package::path_tracer::eta_scale::current_eta_scale;
@if(delta_surfaces) import package::path_tracer::layer_surface::is_delta_surface;
@if(layer_albedo) import package::path_tracer::layer_surface::surface_albedo;
import package::path_tracer::path::Path;
import package::path_tracer::records::{NONE, TRIANGLE_EMISSIVE, TRIANGLE_MATERIAL_MASK};
import package::path_tracer::scene_access::{load_material, load_triangle};
import package::path_tracer::surface::surface_at;

fn note_features(path: ptr<function, Path>) {
    @if(delta_surfaces) let is_settled = (*path).layer_settled != 0u;
    @else let is_settled = (*path).depth > 0u;
    if is_settled {
        return;
    }
    let slot = (*path).hit_triangle;
    if slot == NONE {
        @if(layer_albedo && environment && transparent) if (*path).depth == 0u { return; }
        @if(layer_albedo && environment) note_albedo(path, environment_towards((*path).direction).radiance);
        return;
    }
    let triangle = load_triangle(slot);
    let material = load_material(triangle.material & TRIANGLE_MATERIAL_MASK);
    let barycentrics = (*path).hit_barycentrics;
    let surface = surface_at(triangle, material, barycentrics, -(*path).direction);
    let emits = (triangle.material & TRIANGLE_EMISSIVE) != 0u;
    @if(delta_surfaces) {
        if !emits && is_delta_surface(triangle, material, barycentrics, surface, -(*path).direction) {
            return;
        }
        (*path).layer_settled = 1u;
    }
    @if(layer_normal) (*path).layer_normal = surface.frame.normal;
    @if(layer_albedo) {
        var seen = surface_albedo(triangle, material, barycentrics, surface, -(*path).direction);
        @if(triangle_lights) if emits {
            let plane = front_normal(triangle);
            seen += emitted_radiance(triangle, material, barycentrics, dot(plane, (*path).direction) <= 0.0);
        }
        note_albedo(path, seen);
    }
}

// Cut to what an albedo can be, as it is seen through the mirrors and the glass before it; radiance that swells in glass does not count.
@if(layer_albedo) fn note_albedo(path: ptr<function, Path>, seen: vec3f) {
    var albedo = min(seen, vec3f(1.0));
    @if(delta_surfaces) albedo *= (*path).beta * current_eta_scale(path);
    (*path).layer_albedo = clamp(albedo, vec3f(0.0), vec3f(1.0));
}
