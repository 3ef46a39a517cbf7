// Angles to a few units in the last place. WGSL allows its own sin and cos an error of 2^-11 and its atan2 one of 4096 units,
// which is a texel of a large panorama, so these are ours: reduction without rounding, then polynomials interpolated at
// Chebyshev nodes (relative error of the polynomials below 1.2e-8).

const TAU: f32 = 6.283185307179586;
const QUARTER_PI: f32 = 0.7853981633974483;

// Cosine and sine of an angle in [-pi/4, pi/4].
fn cos_sin_eighth(angle: f32) -> vec2f {
    let z = angle * angle;
    let sine = angle + angle * z * (-0.166666642 + z * (0.00833274797 - z * 0.000195878907));
    let cosine = 1.0 - 0.5 * z + z * z * (0.0416666642 + z * (-0.00138883025 + z * 2.45479423e-5));
    return vec2f(cosine, sine);
}

// Cosine and sine of an angle given in turns, for |turns| up to a few thousand.
fn cos_sin_turns(turns: f32) -> vec2f {
    let quarter = floor(turns * 4.0 + 0.5);
    let cs = cos_sin_eighth((turns - quarter * 0.25) * TAU);
    let quadrant = u32(i32(quarter) & 3);
    let swapped = select(cs, vec2f(-cs.y, cs.x), (quadrant & 1u) == 1u);
    return select(swapped, -swapped, quadrant >= 2u);
}

// The angle of (x, y) in turns, in [-0.5, 0.5]; 0 for the zero vector.
fn angle_in_turns(y: f32, x: f32) -> f32 {
    let ax = abs(x);
    let ay = abs(y);
    let larger = max(ax, ay);
    if larger < 1.2e-38 {
        return 0.0;
    }
    let ratio = min(ax, ay) / larger;
    // Above tan(pi/8) the polynomial works on the difference to pi/4.
    let folded = ratio > 0.41421356;
    let t = select(ratio, (ratio - 1.0) / (ratio + 1.0), folded);
    let z = t * t;
    let tail = -0.333333313 + z * (0.199995399 + z * (-0.142639503 + z * (0.107436687 - z * 0.0645171851)));
    var turns = (t + t * z * tail) / TAU + select(0.0, 0.125, folded);
    turns = select(turns, 0.25 - turns, ay > ax);
    turns = select(turns, 0.5 - turns, x < 0.0);
    return select(turns, -turns, y < 0.0);
}
