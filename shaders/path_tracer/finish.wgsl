// Death of a path: what this sample of the pixel saw.

import package::path_tracer::path::Path;

fn finish(path: ptr<function, Path>) -> vec3f {
    return (*path).radiance;
}
