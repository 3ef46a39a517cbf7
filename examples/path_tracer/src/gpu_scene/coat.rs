//! How much light a dielectric coat reflects: directional albedos of a GGX interface under Schlick's reflectance.
//!
//! Key decision: the light that reaches the base is what the coat does not reflect, by the coat's own albedo and not by Fresnel's formula at
//! the shading normal, which would darken rough surfaces at grazing angles (to 0.28 of a white furnace). The kernels interpolate
//! this table linearly, and the means are integrals of that interpolant, so that base and normalisation agree exactly.
//!
//! Reflectance f0 + (1 - f0) s splits into f0 A + B; cells hold A and B at both ends of an interval of the square root of the cosine.
//! Source: Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017; Karis, 2013 (the split).
//!
//! **Invariant:** A + B is at most 1.

use std::sync::OnceLock;

/// Intervals of the square root of the cosine.
pub const COSINE_CELLS: u32 = 64;
/// Rows of perceptual roughness, from 0 to 1.
pub const ROUGHNESS_ROWS: u32 = 33;

/// Words per roughness: the mean (A, B, 0, 0), then four per cell.
pub(crate) fn table() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| (0..ROUGHNESS_ROWS).flat_map(|row| row_of(f64::from(row) / f64::from(ROUGHNESS_ROWS - 1))).collect())
}

fn row_of(roughness: f64) -> Vec<f32> {
    let root = |node: u32| f64::from(node) / f64::from(COSINE_CELLS);
    let nodes: Vec<[f64; 2]> = (0..=COSINE_CELLS).map(|node| albedo(root(node).powi(2), roughness * roughness)).collect();
    let mut mean = [0.0; 2];
    for (cell, ends) in (0..COSINE_CELLS).zip(nodes.windows(2)) {
        // 4 u^3 du, the cosine weight in u, against a linear function: exact in closed form.
        let (low, high) = (root(cell), root(cell + 1));
        let (zeroth, first) = (high.powi(4) - low.powi(4), 0.8 * (high.powi(5) - low.powi(5)));
        for (channel, sum) in mean.iter_mut().enumerate() {
            let slope = (ends[1][channel] - ends[0][channel]) / (high - low);
            *sum += (ends[0][channel] - slope * low) * zeroth + slope * first;
        }
    }
    let cells = nodes.windows(2).flat_map(|ends| ends.as_flattened().to_vec());
    mean.into_iter().chain([0.0; 2]).chain(cells).map(|value| value as f32).collect()
}

/// A and B for one view direction, by a regular grid over visible normals.
fn albedo(cosine: f64, alpha: f64) -> [f64; 2] {
    let z = cosine.max(1e-6);
    let schlick = |c: f64| (1.0 - c).clamp(0.0, 1.0).powi(5);
    if alpha == 0.0 {
        return [1.0 - schlick(z), schlick(z)];
    }
    let (rings, spokes) = (64, 24);
    let (x, lambda) = ((1.0 - z * z).max(0.0).sqrt(), |tangent2: f64| 0.5 * ((1.0 + alpha * alpha * tangent2).sqrt() - 1.0));
    let length = (alpha * alpha * x * x + z * z).sqrt();
    let (stretched_x, stretched_z) = (alpha * x / length, z / length);
    let lambda_o = lambda(x * x / (z * z));
    let mut sums = [0.0; 2];
    for ring in 0..rings {
        // Squared, because the rim of the cap holds the normals that shadow each other.
        let to_rim = (f64::from(ring) + 0.5) / f64::from(rings);
        let cap_z = to_rim * to_rim * (1.0 + stretched_z) - stretched_z;
        let sine = (1.0 - cap_z * cap_z).max(0.0).sqrt();
        for spoke in 0..spokes {
            let (sin_phi, cos_phi) = (std::f64::consts::PI * (f64::from(spoke) + 0.5) / f64::from(spokes)).sin_cos();
            let h = [alpha * (sine * cos_phi + stretched_x), alpha * sine * sin_phi, (cap_z + stretched_z).max(0.0)];
            let size = h.iter().map(|part| part * part).sum::<f64>().sqrt();
            if size <= 0.0 {
                continue;
            }
            let wo_h = (x * h[0] + z * h[2]) / size;
            let wi_z = 2.0 * wo_h * h[2] / size - z;
            if wi_z > 0.0 {
                let lambda_i = lambda((1.0 - wi_z * wi_z).max(0.0) / (wi_z * wi_z));
                let weight = (1.0 + lambda_o) / (1.0 + lambda_o + lambda_i) * 2.0 * to_rim / f64::from(rings * spokes);
                sums[0] += weight * (1.0 - schlick(wo_h));
                sums[1] += weight * schlick(wo_h);
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: masking forgotten or squared, alpha for roughness: closed forms of the single-scattering albedo, S17 of the numerics.
    #[test]
    fn albedos_match_closed_forms() {
        let cases = [(1.0, 1.0, 1.0 - 2f64.ln()), (1.0, 0.5, 0.687_849), (1.0, 0.1, 0.988_304), (0.5, 0.5, 0.6986), (0.2, 1.0, 0.6415)];
        for (cosine, alpha, expected) in cases {
            let [a, b] = albedo(cosine, alpha);
            assert!((a + b - expected).abs() < 1e-3, "cos {cosine} alpha {alpha}: {} for {expected}", a + b);
        }
    }

    // Kills: a mean that weighs the nodes without the cosine: a smooth interface has 1/21 as its mean of B.
    #[test]
    fn the_mean_of_a_smooth_coat_is_known() {
        let row = row_of(0.0);
        assert!((row[1] - 1.0 / 21.0).abs() < 2e-4, "{}", row[1]);
        assert!((row[0] + row[1] - 1.0).abs() < 1e-6);
    }

    // Kills: a row too short, an albedo that gains energy.
    #[test]
    fn the_table_has_its_shape() {
        assert_eq!(table().len() as u32, ROUGHNESS_ROWS * 4 * (COSINE_CELLS + 1));
        assert!(table().chunks(2).all(|cell| cell[0] >= 0.0 && cell[1] >= 0.0 && cell[0] + cell[1] <= 1.0 + 1e-6));
    }
}
