// Where a new ray may start so that it cannot meet the triangle it leaves.
// Source: Appendix A of our numerics: a bound on the error of v0 + b1 e1 + b2 e2 from the size of the vertices, times 4 because WGSL
// rounds either way (after Waechter, van Antwerpen and Klehm), then one unit in the last place per component.

// Largest error of an interpolated hit point in each coordinate.
fn hit_point_error(v0: vec3f, e1: vec3f, e2: vec3f) -> vec3f {
    let edges = abs(e1) + abs(e2) + abs(e1 - e2);
    let extent = max(edges.x, max(edges.y, edges.z));
    return 4.0 * (5.9604644775390625e-8 * abs(v0) + vec3f(1.1920928955078125e-7 * extent));
}

// `point` moved within the triangle's plane until no edge is nearer than `margin`. Next to a concave edge the error of the point may
// lie behind the neighbouring triangle, and a ray from there would leave a closed room (2 in 3e7 rays did, in a box).
fn inset_point(point: vec3f, barycentrics: vec2f, e1: vec3f, e2: vec3f, normal: vec3f, area: f32, margin: f32) -> vec3f {
    let weights = vec3f(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    let sizes = vec3f(length(e2 - e1), length(e2), length(e1));
    let missing = max(vec3f(0.0), vec3f(margin) - weights * (2.0 * area / sizes));
    if all(missing == vec3f(0.0)) {
        return point;
    }
    let push = missing / sizes;
    return point + cross(normal, (e2 - e1) * push.x - e2 * push.y + e1 * push.z);
}

// `point` moved off the surface to the side that `direction` leaves to.
fn offset_point(point: vec3f, normal: vec3f, error: vec3f, direction: vec3f) -> vec3f {
    let side = select(-normal, normal, dot(direction, normal) >= 0.0);
    return step_outward(point + dot(error, abs(normal)) * side, side);
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
