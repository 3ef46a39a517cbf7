// Plane and area of a triangle from two of its edges, at any size.

struct TrianglePlane {
    normal: vec3f,
    area: f32,
}

// Edges are divided by their largest component first, so that the cross product neither over- nor underflows.
fn triangle_plane(e1: vec3f, e2: vec3f) -> TrianglePlane {
    let larger = max(abs(e1), abs(e2));
    let scale = max(larger.x, max(larger.y, larger.z));
    let c = cross(e1 / scale, e2 / scale);
    let twice_area = length(c);
    return TrianglePlane(c / twice_area, 0.5 * twice_area * scale * scale);
}
