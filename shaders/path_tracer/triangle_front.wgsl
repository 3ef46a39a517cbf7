// The front of a packed triangle is where the scene's corners run counter-clockwise. Packing has sorted the corners, which may have turned the
// triangle over.

import package::math::triangle::triangle_plane;
import package::path_tracer::records::TRIANGLE_CLOCKWISE;
import package::path_tracer::scene_access::Triangle;

// The normal of the sorted corners, or its opposite: towards the front.
fn towards_front(triangle: Triangle, normal: vec3f) -> vec3f {
    return select(normal, -normal, (triangle.material & TRIANGLE_CLOCKWISE) != 0u);
}

fn front_normal(triangle: Triangle) -> vec3f {
    return towards_front(triangle, triangle_plane(triangle.v1 - triangle.v0, triangle.v2 - triangle.v0).normal);
}
