// What a ray's choice of transparent surfaces is keyed by. Where no surface is transparent, tracing reads neither pixel nor sample nor
// depth.

import package::path_tracer::path::{Path, random_at};

fn ray_key(path: ptr<function, Path>, purpose: u32) -> vec4u {
    @if(alpha) return random_at((*path).pixel, (*path).sample, (*path).depth, purpose);
    @else return vec4u(0u);
}
