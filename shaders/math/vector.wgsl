// Bounds and guards shared by everything that handles vectors.

// The largest component.
fn max_component(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

// The unit vector of `v`, or `fallback` where `v` has no direction.
fn normalize_or(v: vec3f, fallback: vec3f) -> vec3f {
    let square = dot(v, v);
    return select(fallback, v * inverseSqrt(max(square, 7.888609052210118e-31)), square > 7.888609052210118e-31);
}
