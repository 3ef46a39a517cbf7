// Stage: finds what the path's ray meets first.

import package::path_tracer::effects::HAS_ALPHA;
import package::path_tracer::path::{Path, DIMENSION_ALPHA, random_at};
import package::path_tracer::traverse::traverse;

// Beyond everything in a normalised scene, with room for the arithmetic on it.
const RAY_END: f32 = 1e30;

fn trace(path: ptr<function, Path>) {
    var key = vec4u(0u);
    if HAS_ALPHA {
        key = random_at((*path).pixel, (*path).sample, (*path).depth, DIMENSION_ALPHA);
    }
    let hit = traverse((*path).origin, (*path).direction, RAY_END, (*path).hit_triangle, key, false);
    (*path).hit_triangle = hit.triangle;
    (*path).hit_barycentrics = hit.barycentrics;
}
