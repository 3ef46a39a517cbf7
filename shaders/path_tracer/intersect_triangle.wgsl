// Watertight ray-triangle test. A ray aimed at a shared edge or vertex meets one of the triangles, whatever the compiler contracts:
// an edge function orders its two ends canonically, so that both triangles compute the very same number with opposite signs.
// Source: Woop, Benthin and Wald, JCGT 2(1), 2013; canonical order: Appendix A of our numerics.

// A ray prepared for the test: the axis where its direction is largest, and the shear that turns it into the z axis.
struct RayShear {
    axis: u32,
    shear: vec3f,
}

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

// Twice the signed area of the triangle (origin, a, b) in the sheared plane.
fn edge_function(a: vec2f, b: vec2f) -> f32 {
    let swapped = b.x < a.x || (b.x == a.x && b.y < a.y);
    let p = select(a, b, swapped);
    let q = select(b, a, swapped);
    let value = p.x * q.y - p.y * q.x;
    return select(value, -value, swapped);
}

// Both sides count. `barycentrics` are the weights of the second and third vertex.
fn intersect_triangle(v0: vec3f, v1: vec3f, v2: vec3f, origin: vec3f, ray: RayShear) -> TriangleHit {
    let a = shear_vertex(v0, origin, ray);
    let b = shear_vertex(v1, origin, ray);
    let c = shear_vertex(v2, origin, ray);
    let weight0 = edge_function(b.xy, c.xy);
    let weight1 = edge_function(c.xy, a.xy);
    let weight2 = edge_function(a.xy, b.xy);
    let inside = min(weight0, min(weight1, weight2)) >= 0.0 || max(weight0, max(weight1, weight2)) <= 0.0;
    let sum = weight0 + weight1 + weight2;
    // A sum that small is a triangle seen edge-on; the bound is where division is still defined in a scene of unit size.
    if !inside || abs(sum) < 1.2e-38 {
        return TriangleHit(0.0, vec2f(0.0), false);
    }
    let t = (weight0 * a.z + weight1 * b.z + weight2 * c.z) / sum;
    return TriangleHit(t, vec2f(weight1, weight2) / sum, t > 0.0);
}
