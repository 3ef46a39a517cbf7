// Conservative ray-box test: never misses a box that the exact ray meets.
// Source: Williams et al., JGT 10(1), 2005; Ize, Robust BVH Ray Traversal, JCGT 2(2), 2013, with a larger margin because WGSL rounds
// sums and products either way and allows a reciprocal 2.5 units: 2 (1 + 2.5 + 1) 2^-23 < 2^-19.

const BOX_MARGIN: f32 = 1.0000019073486328;

// Reciprocals of a direction; components too small to divide by are replaced, keeping their sign.
fn safe_reciprocal(direction: vec3f) -> vec3f {
    let smallest = vec3f(7.888609052210118e-31);
    let signed_smallest = select(smallest, -smallest, direction < vec3f(0.0));
    return 1.0 / select(direction, signed_smallest, abs(direction) < smallest);
}

// Where the ray enters the box, or a value above `t_max` when it does not.
fn enter_box(low: vec3f, high: vec3f, origin: vec3f, reciprocal: vec3f, t_max: f32) -> f32 {
    let a = (low - origin) * reciprocal;
    let b = (high - origin) * reciprocal;
    let near = min(a, b);
    let far = max(a, b);
    let t_enter = max(max(near.x, near.y), max(near.z, 0.0));
    let t_leave = min(min(far.x, far.y), far.z) * BOX_MARGIN;
    return select(3.0e38, t_enter, t_enter <= min(t_leave, t_max));
}
