// Light that a solid absorbs: Beer and Lambert's law along a ray that ends at the inner side of the solid's surface.
// The medium is that of the surface which is met from behind, as the refraction there takes it to be: solids do not overlap.
// Source: KHR_materials_volume.

import constants::ABSORPTION_TABLE;
import package::path_tracer::triangle_front::front_normal;
import package::path_tracer::path::Path;
import package::path_tracer::records::{NONE, TRIANGLE_MATERIAL_MASK};
import package::path_tracer::scene_access::{load_triangle, table_row};

// `distance` is the length of the ray in normalised space, in which the table has its coefficients.
fn absorb(path: ptr<function, Path>, distance: f32) {
    if (*path).hit_triangle == NONE {
        return;
    }
    let triangle = load_triangle((*path).hit_triangle);
    let coefficient = bitcast<vec3f>(table_row(ABSORPTION_TABLE + (triangle.material & TRIANGLE_MATERIAL_MASK)).xyz);
    let plane = front_normal(triangle);
    if dot(plane, (*path).direction) > 0.0 {
        (*path).beta *= exp(-coefficient * distance);
    }
}
