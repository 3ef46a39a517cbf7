// Kind of work that a path asks for after the trace: the material that it has met, apart from the paths that have left the scene.

import package::path_tracer::path::Path;
import package::path_tracer::records::{NONE, TRIANGLE_MATERIAL_MASK};
import package::path_tracer::scene_access::triangle_material;

fn queue_key(path: ptr<function, Path>) -> u32 {
    if (*path).hit_triangle == NONE {
        return 0u;
    }
    return 1u + (triangle_material((*path).hit_triangle) & TRIANGLE_MATERIAL_MASK);
}
