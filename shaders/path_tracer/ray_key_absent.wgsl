// Takes the place of ray_key.wgsl where no surface is transparent: tracing then reads neither pixel nor sample nor depth.

import package::path_tracer::path::Path;

fn ray_key(path: ptr<function, Path>, purpose: u32) -> vec4u {
    return vec4u(0u);
}
