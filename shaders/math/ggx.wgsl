// The GGX microfacet distribution, isotropic, in the local frame (normal = +z).
// Source: Walter et al., EGSR 2007; Heitz, JCGT 3(2), 2014 (height-correlated masking); Dupuy and Benyoub, HPG 2023 (visible
// normals from spherical caps). Sines come from x and y of the vector, never from 1 - z^2.

import package::math::angle::cos_sin_turns;

// Density of microfacet normals.
fn ggx_distribution(h: vec3f, alpha: f32) -> f32 {
    let s = alpha * alpha;
    let q = (h.x * h.x + h.y * h.y) / s + h.z * h.z;
    return 1.0 / (3.14159265358979 * s * q * q);
}

// Smith's lambda; `v.z` is at least 1e-6.
fn ggx_lambda(v: vec3f, alpha: f32) -> f32 {
    let t = alpha / v.z;
    let s = (v.x * v.x + v.y * v.y) * (t * t);
    return 0.5 * s / (1.0 + sqrt(1.0 + s));
}

// A normal visible from `wo`; its density is D G1 max(0, wo.h) / wo.z.
fn sample_visible_normal(wo: vec3f, alpha: f32, u: vec2f) -> vec3f {
    let stretched = normalize(vec3f(wo.xy * alpha, wo.z));
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let sine = sqrt(max(0.0, (1.0 - z) * (1.0 + z)));
    let cap = vec3f(sine * cos_sin_turns(u.x), z);
    let half_vector = cap + stretched;
    let h = vec3f(half_vector.xy * alpha, max(half_vector.z, 0.0));
    let square = dot(h, h);
    // Only a cap point opposite to the view leaves no direction.
    return select(vec3f(0.0, 0.0, 1.0), h * inverseSqrt(square), square > 1e-30);
}
