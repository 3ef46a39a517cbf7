// Stage: finds what the path's ray meets first.

@if(absorption) import package::path_tracer::absorption::absorb;
import package::path_tracer::path::{Path, DIMENSION_ALPHA};
import package::path_tracer::ray_key::ray_key;
import package::path_tracer::traverse::traverse;

// Beyond everything in a normalised scene, with room for the arithmetic on it.
const RAY_END: f32 = 1e30;

fn trace(path: ptr<function, Path>) {
    let key = ray_key(path, DIMENSION_ALPHA);
    let hit = traverse((*path).origin, (*path).direction, RAY_END, (*path).hit_triangle, key, false);
    (*path).hit_triangle = hit.triangle;
    (*path).hit_barycentrics = hit.barycentrics;
    @if(absorption) absorb(path, hit.t);
}
