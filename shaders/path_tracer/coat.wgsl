// How much light a dielectric coat reflects, from a table of the host's: f0 A + B, linear in the square root of the cosine and in
// perceptual roughness. The means belong to exactly this interpolation.

import package::path_tracer::records::{COAT_COSINE_CELLS, COAT_ROUGHNESS_ROWS};
import package::path_tracer::scene_access::{table_row, view};

struct Coat {
    // Reflectance at normal incidence; negative without a coat.
    f0: f32,
    // First row of the table for the two nearest roughnesses, and the share of the second.
    low_row: u32,
    high_row: u32,
    blend: f32,
}

fn coat_of(f0: f32, roughness: f32) -> Coat {
    let place = clamp(roughness, 0.0, 1.0) * f32(COAT_ROUGHNESS_ROWS - 1u);
    let low = min(u32(place), COAT_ROUGHNESS_ROWS - 2u);
    let row = view.coat_albedo + low * (COAT_COSINE_CELLS + 1u);
    return Coat(f0, row, row + COAT_COSINE_CELLS + 1u, place - f32(low));
}

// Share of light from one direction that the coat lets through to the base, and of the base's light that it lets out again.
fn coat_transmittance(coat: Coat, cosine: f32) -> f32 {
    if coat.f0 < 0.0 {
        return 1.0;
    }
    let place = sqrt(clamp(cosine, 0.0, 1.0)) * f32(COAT_COSINE_CELLS);
    let cell = min(u32(place), COAT_COSINE_CELLS - 1u);
    let low = bitcast<vec4f>(table_row(coat.low_row + 1u + cell));
    let high = bitcast<vec4f>(table_row(coat.high_row + 1u + cell));
    let ends = low + (high - low) * coat.blend;
    let parts = ends.xy + (ends.zw - ends.xy) * (place - f32(cell));
    return 1.0 - (coat.f0 * parts.x + parts.y);
}

// The cosine-weighted mean of the transmittance over the hemisphere.
fn coat_mean_transmittance(coat: Coat) -> f32 {
    let low = bitcast<vec2f>(table_row(coat.low_row).xy);
    let high = bitcast<vec2f>(table_row(coat.high_row).xy);
    let parts = low + (high - low) * coat.blend;
    return 1.0 - (coat.f0 * parts.x + parts.y);
}
