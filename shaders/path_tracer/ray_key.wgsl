// What a ray's choice of transparent surfaces is keyed by. Where no surface is transparent, ray_key_absent.wgsl takes this place.

import package::path_tracer::path::{Path, random_at};

fn ray_key(path: ptr<function, Path>, purpose: u32) -> vec4u {
    return random_at((*path).pixel, (*path).sample, (*path).depth, purpose);
}
