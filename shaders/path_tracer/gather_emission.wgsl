// Stage: adds the light that the ray ran into, weighted against light sampling, and ends paths that left or may not scatter again.

@if(triangle_lights) import package::path_tracer::triangle_front::front_normal;
@if(triangle_lights) import package::path_tracer::emission::emitted_radiance;
@if(environment) import package::path_tracer::environment::environment_towards;
@if(environment || triangle_lights) import package::path_tracer::found_weight::found_weight;
@if(triangle_lights) import package::path_tracer::light_triangle::triangle_light_pdf;
import package::path_tracer::path::Path;
import package::path_tracer::records::{NONE, TRIANGLE_EMISSIVE, TRIANGLE_MATERIAL_MASK};
import package::path_tracer::scene_access::{load_light, load_material, load_triangle, triangle_material, view};

fn gather_emission(path: ptr<function, Path>) -> u32 {
    let slot = (*path).hit_triangle;
    if slot == NONE {
        // It lights a transparent picture and is not seen behind it.
        @if(environment && transparent) if (*path).depth == 0u { return FINISH; }
        @if(environment) {
            let seen = environment_towards((*path).direction);
            let weight = found_weight(path, seen.pdf * view.environment_selection);
            (*path).radiance += (*path).beta * (seen.radiance * weight);
        }
        return FINISH;
    }
    @if(triangle_lights) if (triangle_material(slot) & TRIANGLE_EMISSIVE) != 0u {
        let triangle = load_triangle(slot);
        let material = load_material(triangle.material & TRIANGLE_MATERIAL_MASK);
        let e1 = triangle.v1 - triangle.v0;
        let e2 = triangle.v2 - triangle.v0;
        let plane = front_normal(triangle);
        let barycentrics = (*path).hit_barycentrics;
        let is_front = dot(plane, (*path).direction) <= 0.0;
        let radiance = emitted_radiance(triangle, material, barycentrics, is_front);
        var light_pdf = 0.0;
        if triangle.light != NONE {
            let light = load_light(triangle.light);
            let offset = triangle.v0 + barycentrics.x * e1 + barycentrics.y * e2 - (*path).origin;
            light_pdf = light.pmf * triangle_light_pdf(light.inverse_area, offset, plane);
        }
        (*path).radiance += (*path).beta * (radiance * found_weight(path, light_pdf));
    }
    return select(CONTINUE, FINISH, (*path).depth >= view.max_depth);
}
