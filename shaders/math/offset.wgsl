// Where a new ray may start so that it cannot meet the triangle it leaves.
// Source: Appendix A of our numerics: a bound on the error of v0 + b1 e1 + b2 e2 from the size of the vertices, times 4 because WGSL
// rounds either way (after Waechter, van Antwerpen and Klehm), then one unit in the last place per component.

// Largest error of an interpolated hit point along `normal`.
fn hit_point_error(v0: vec3f, e1: vec3f, e2: vec3f, normal: vec3f) -> f32 {
    let edges = abs(e1) + abs(e2) + abs(e1 - e2);
    let extent = max(edges.x, max(edges.y, edges.z));
    let bound = 4.0 * (5.9604644775390625e-8 * abs(v0) + vec3f(1.1920928955078125e-7 * extent));
    return dot(bound, abs(normal));
}

// `point` moved off the surface to the side that `direction` leaves to.
fn offset_point(point: vec3f, normal: vec3f, error: f32, direction: vec3f) -> vec3f {
    let side = select(-normal, normal, dot(direction, normal) >= 0.0);
    return step_outward(point + error * side, side);
}

// Each component one representable number further along the sign of `direction`.
fn step_outward(point: vec3f, direction: vec3f) -> vec3f {
    let bits = bitcast<vec3i>(point);
    let outward = select(vec3i(-1), vec3i(1), (point < vec3f(0.0)) == (direction < vec3f(0.0)));
    let stepped = bitcast<vec3f>(bits + outward);
    // Next to zero the neighbour would be denormal and may be flushed.
    let tiny = abs(point) < vec3f(7.888609052210118e-31);
    let floor_step = select(vec3f(7.888609052210118e-31), vec3f(-7.888609052210118e-31), direction < vec3f(0.0));
    let moved = select(stepped, floor_step, tiny);
    return select(moved, point, direction == vec3f(0.0));
}
