// A panorama as a light: radiance is constant per texel for sampling and for rays that leave the scene alike, texels are picked by an
// integer table, directions are uniform in solid angle within a texel.
//
// The middle of the image lies towards -z, +x is to the right of it, the top row is +y. Rows are told apart by 1 - cos of the angle
// to the nearer pole against the very numbers that the sampler uses, so that both agree on the texel of a direction.

import package::math::angle::{angle_in_turns, cos_sin_turns};
import package::math::random::unit_f32;
import package::path_tracer::alias_table::pick_alias;
import package::path_tracer::scene_access::{table_row, table_word, texels, view};

struct EnvironmentSample {
    direction: vec3f,
    radiance: vec3f,
    // Per solid angle, without the probability of picking the panorama among the lights.
    pdf: f32,
}

// A row of the northern half: 1 - cos at its upper and lower edge and the solid angle of one of its texels.
fn environment_row(index: u32) -> vec3f {
    return bitcast<vec3f>(table_row(view.environment_rows + index).xyz);
}

fn environment_texel_radiance(texel: u32) -> vec3f {
    let at = view.environment_texels + 3u * texel;
    return bitcast<vec3f>(vec3u(texels[at], texels[at + 1u], texels[at + 2u]));
}

// Realised probability of a texel over its solid angle.
fn environment_texel_pdf(texel: u32, solid_angle: f32) -> f32 {
    return bitcast<f32>(table_word(view.environment_pmf + (texel >> 2u), texel & 3u)) / solid_angle;
}

// Which row of the northern half, counted from the pole, holds a direction at this distance from the pole.
fn environment_row_of(one_minus_cosine: f32, turns_from_pole: f32) -> u32 {
    let rows = (view.environment_height + 1u) / 2u;
    var row = min(u32(turns_from_pole * 2.0 * f32(view.environment_height)), rows - 1u);
    let edges = environment_row(row);
    if one_minus_cosine < edges.x && row > 0u {
        row -= 1u;
    } else if one_minus_cosine >= edges.y && row + 1u < rows {
        row += 1u;
    }
    return row;
}

// What a ray sees that leaves the scene, and how likely light sampling would have picked that direction.
fn environment_towards(direction: vec3f) -> EnvironmentSample {
    let height = abs(direction.y);
    let sine2 = direction.x * direction.x + direction.z * direction.z;
    let northern = environment_row_of(sine2 / (1.0 + height), angle_in_turns(sqrt(sine2), height));
    let row = select(view.environment_height - 1u - northern, northern, direction.y >= 0.0);
    let turns = angle_in_turns(direction.x, -direction.z) + 0.5;
    let column = min(u32(turns * f32(view.environment_width)), view.environment_width - 1u);
    let texel = row * view.environment_width + column;
    let pdf = environment_texel_pdf(texel, environment_row(northern).z);
    return EnvironmentSample(direction, environment_texel_radiance(texel), pdf);
}

// `texel_words` pick the texel, `inner_words` the direction within it.
fn sample_environment(texel_words: vec2u, inner_words: vec2u) -> EnvironmentSample {
    let texel = pick_alias(view.environment_alias, view.environment_alias_log2, texel_words.x, texel_words.y);
    let row = texel / view.environment_width;
    let column = texel - row * view.environment_width;
    let is_northern = 2u * row < view.environment_height;
    let northern = select(view.environment_height - 1u - row, row, is_northern);
    let edges = environment_row(northern);
    let u = vec2f(unit_f32(inner_words.x), unit_f32(inner_words.y));
    var one_minus_cosine = edges.x + (edges.y - edges.x) * u.y;
    var sign = select(-1.0, 1.0, is_northern);
    if 2u * row + 1u == view.environment_height {
        // The middle row of an odd image straddles the equator: half of the range for each side.
        let cosine = (1.0 - edges.x) * (1.0 - 2.0 * u.y);
        one_minus_cosine = 1.0 - abs(cosine);
        sign = select(-1.0, 1.0, cosine >= 0.0);
    }
    let sine = sqrt(max(0.0, one_minus_cosine * (2.0 - one_minus_cosine)));
    let cs = cos_sin_turns((f32(column) + u.x) / f32(view.environment_width) - 0.5);
    let direction = vec3f(sine * cs.y, sign * (1.0 - one_minus_cosine), -sine * cs.x);
    return EnvironmentSample(direction, environment_texel_radiance(texel), environment_texel_pdf(texel, edges.z));
}
