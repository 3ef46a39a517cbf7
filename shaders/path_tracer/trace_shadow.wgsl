// Stage: adds the light that was picked, unless something lies between.

import package::path_tracer::path::{Path, DIMENSION_SHADOW_ALPHA};
import package::path_tracer::ray_key::ray_key;
import package::path_tracer::records::NONE;
import package::path_tracer::traverse::traverse;

fn trace_shadow(path: ptr<function, Path>) {
    if all((*path).shadow_radiance == vec3f(0.0)) {
        return;
    }
    let key = ray_key(path, DIMENSION_SHADOW_ALPHA);
    let hit = traverse((*path).shadow_origin, (*path).shadow_vector, 1.0, (*path).hit_triangle, key, true);
    if hit.triangle == NONE {
        (*path).radiance += (*path).shadow_radiance;
    }
}
