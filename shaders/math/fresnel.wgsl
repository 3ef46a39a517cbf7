// Reflectance of a smooth interface.
// Source: Fresnel's equations with sin^2 = (1 - c)(1 + c); Schlick, EGSR 1994.

// Indices closer to one than this are no interface at all.
const ETA_MIN_STEP: f32 = 1e-4;

// Unpolarised reflectance; `eta` is the index behind the surface over the index on the viewer's side, `cosine` in [0, 1].
fn fresnel_dielectric(cosine: f32, eta: f32) -> f32 {
    let c = clamp(cosine, 0.0, 1.0);
    let s2 = (1.0 - c) * (1.0 + c) / (eta * eta);
    if s2 >= 1.0 {
        return 1.0;
    }
    let ct = sqrt(1.0 - s2);
    let parallel = (eta * c - ct) / (eta * c + ct);
    let perpendicular = (c - eta * ct) / (c + eta * ct);
    return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

// (1 - c)^5 by multiplication: pow is exp2 of log2 and loses digits.
fn schlick_weight(cosine: f32) -> f32 {
    let m = clamp(1.0 - cosine, 0.0, 1.0);
    let m2 = m * m;
    return m2 * m2 * m;
}
