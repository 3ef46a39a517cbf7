// Watertight ray-triangle test. A ray aimed at a shared edge or vertex meets one of the triangles, whatever the compiler contracts:
// corners come in a canonical order (by x, then y, then z), so an edge function has the lesser end first in both triangles, which compute the
// very same number. No sign is flipped before the comparison: a compiler might move it into the difference and contract another product.
// Source: Woop, Benthin and Wald, JCGT 2(1), 2013; canonical order: Appendix A of our numerics.

// A ray prepared for the test: the axis where its direction is largest, and the shear that turns it into the z axis.
struct RayShear {
    axis: u32,
    shear: vec3f,
}

// `barycentrics` are the weights of the second and third corner.
struct TriangleHit {
    t: f32,
    barycentrics: vec2f,
    found: bool,
}

fn largest_axis_last(v: vec3f, axis: u32) -> vec3f {
    return select(select(v, v.zxy, axis == 1u), v.yzx, axis == 0u);
}

fn shear_of_ray(direction: vec3f) -> RayShear {
    let size = abs(direction);
    let axis = select(select(2u, 1u, size.y >= size.z), 0u, size.x >= size.y && size.x >= size.z);
    let d = largest_axis_last(direction, axis);
    return RayShear(axis, vec3f(d.x / d.z, d.y / d.z, 1.0 / d.z));
}

fn shear_vertex(vertex: vec3f, origin: vec3f, ray: RayShear) -> vec3f {
    let v = largest_axis_last(vertex - origin, ray.axis);
    return vec3f(v.x - ray.shear.x * v.z, v.y - ray.shear.y * v.z, ray.shear.z * v.z);
}

// Twice the signed area of the triangle (origin, a, b) in the sheared plane; `a` must be the lesser end of the edge.
fn edge_function(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Both sides count.
fn intersect_triangle(v0: vec3f, v1: vec3f, v2: vec3f, origin: vec3f, ray: RayShear) -> TriangleHit {
    let a = shear_vertex(v0, origin, ray);
    let b = shear_vertex(v1, origin, ray);
    let c = shear_vertex(v2, origin, ray);
    let ab = edge_function(a.xy, b.xy);
    let bc = edge_function(b.xy, c.xy);
    // Along the last edge the triangle lies on the other side.
    let ac = edge_function(a.xy, c.xy);
    let inside = (ab >= 0.0 && bc >= 0.0 && ac <= 0.0) || (ab <= 0.0 && bc <= 0.0 && ac >= 0.0);
    let sum = bc - ac + ab;
    let t = (bc * a.z - ac * b.z + ab * c.z) / sum;
    // A sum that small is a triangle seen edge-on; the bound is where division is still defined in a scene of unit size.
    return TriangleHit(t, vec2f(-ac, ab) / sum, inside && abs(sum) >= 1.2e-38 && t > 0.0);
}
