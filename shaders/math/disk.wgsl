// The unit square onto the disk and the hemisphere, without trigonometry of the hardware.
// Source: Shirley and Chiu, A Low Distortion Map Between Disk and Square, JGT 2(3), 1997, in the branch-light form with signed radii.

import package::math::angle::{cos_sin_eighth, QUARTER_PI};

// Uniform on the unit disk.
fn disk_from_square(u: vec2f) -> vec2f {
    let offset = 2.0 * u - 1.0;
    let by_x = abs(offset.x) > abs(offset.y);
    let radius = select(offset.y, offset.x, by_x);
    let other = select(offset.x, offset.y, by_x);
    if radius == 0.0 {
        return vec2f(0.0);
    }
    let cs = cos_sin_eighth(QUARTER_PI * (other / radius));
    return radius * select(cs.yx, cs, by_x);
}

// Proportional to the cosine around +z; its density is z / pi. Where 1 - r^2 rounds to zero, half a unit stands for it: a direction in
// the plane itself would be on neither side of it.
fn cosine_hemisphere(u: vec2f) -> vec3f {
    let d = disk_from_square(u);
    return vec3f(d, sqrt(max(2.98023223876953125e-8, 1.0 - dot(d, d))));
}
