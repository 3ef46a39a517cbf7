// Weights for two sampling strategies that may produce the same path.
// Source: Veach, Robust Monte Carlo Methods, chapter 9 (power heuristic, exponent 2); divided by the larger density first, so that
// no square over- or underflows over the whole range of f32.

// Densities below this count as zero, in sampling and in evaluation alike (2^-100).
const PDF_MIN: f32 = 7.888609052210118e-31;

// The weight of the strategy with density `a` against the one with density `b`.
fn power_heuristic(a: f32, b: f32) -> f32 {
    let larger = max(a, b);
    if larger < PDF_MIN {
        return 0.0;
    }
    let x = a / larger;
    let y = b / larger;
    return x * x / (x * x + y * y);
}
