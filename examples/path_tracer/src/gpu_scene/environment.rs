//! The panorama as a light: radiances, an exact alias table over its texels, and its rows.
//!
//! Key decision: radiance is constant per texel, and a texel is drawn in proportion to radiance times its exact solid angle. A panorama that
//! does not fit a binding is halved, weighted by solid angle, until it does, with a warning.
//!
//! **Invariant:** the solid angles of all texels add up to 4 pi, and what the kernel divides by is what the table realises.

use std::f64::consts::{PI, TAU};

use super::{alias::AliasTable, error::Error};
use crate::scene::Environment;

/// A panorama ready for the buffers.
#[derive(Clone, Debug)]
pub(crate) struct PackedEnvironment {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Radiance, three per texel.
    pub(crate) texels: Vec<[f32; 3]>,
    /// `None` for a black one, which is no light.
    pub(crate) alias: Option<AliasTable>,
    /// Northern half from the pole: 1 - cos at the upper and the lower edge, solid angle of a texel.
    pub(crate) rows: Vec<[f32; 3]>,
    /// Mean over the channels of the radiance integrated over all directions.
    pub(crate) flux: f64,
}

/// Packs `environment` within `max_texels`.
pub(crate) fn pack(environment: &Environment, max_texels: u64, warnings: &mut Vec<String>) -> Result<PackedEnvironment, Error> {
    let (mut width, mut height) = (environment.width, environment.height);
    if u64::from(width) * u64::from(height) != environment.texels.len() as u64 || environment.texels.is_empty() {
        let (name, texels) = (environment.name.clone(), environment.texels.len());
        return Err(Error::BadImage { what: "environment", name, width, height, texels });
    }
    let mut texels = sanitised(environment, warnings);
    while texels.len() as u64 > max_texels && width > 1 && height > 1 {
        (width, height, texels) = halved(width, height, &texels);
    }
    if width != environment.width {
        let (was_width, was_height) = (environment.width, environment.height);
        warnings.push(format!("environment `{}`: reduced from {was_width} x {was_height} to {width} x {height}", environment.name));
    }
    let solid_angles: Vec<f64> = (0..height).map(|row| solid_angle(row, width, height)).collect();
    let weights: Vec<f64> = texels.iter().enumerate().map(|(i, rgb)| mean(rgb) * solid_angles[i / width as usize]).collect();
    let rows = (0..height.div_ceil(2))
        .map(|row| {
            let lower = if 2 * row + 1 == height { 1.0 } else { one_minus_cosine(row + 1, height) };
            [one_minus_cosine(row, height) as f32, lower as f32, solid_angles[row as usize] as f32]
        })
        .collect();
    Ok(PackedEnvironment { width, height, alias: AliasTable::new(&weights), rows, flux: weights.iter().sum(), texels })
}

fn mean(rgb: &[f32; 3]) -> f64 {
    rgb.iter().map(|&value| f64::from(value)).sum::<f64>() / 3.0
}

fn sanitised(environment: &Environment, warnings: &mut Vec<String>) -> Vec<[f32; 3]> {
    let mut repaired = 0usize;
    let mut repair = |value: f32| {
        let kept = if value >= 0.0 { value.min(f32::MAX) } else { 0.0 };
        repaired += usize::from(kept.to_bits() != value.to_bits() && value != 0.0);
        kept
    };
    let texels = environment.texels.iter().map(|rgb| rgb.map(&mut repair)).collect();
    if repaired > 0 {
        warnings.push(format!("environment `{}`: {repaired} values were negative or not finite", environment.name));
    }
    texels
}

/// 1 - cos of the polar angle of an edge between rows, without cancellation.
fn one_minus_cosine(edge: u32, height: u32) -> f64 {
    2.0 * (PI * f64::from(edge) / f64::from(height) / 2.0).sin().powi(2)
}

/// Of one texel in a row: the difference of cosines as a product of sines.
fn solid_angle(row: u32, width: u32, height: u32) -> f64 {
    let middle = PI * (f64::from(row) + 0.5) / f64::from(height);
    TAU / f64::from(width) * 2.0 * middle.sin() * (PI / f64::from(height) / 2.0).sin()
}

/// Half as wide and half as high; an odd last row or column joins its neighbours.
fn halved(width: u32, height: u32, texels: &[[f32; 3]]) -> (u32, u32, Vec<[f32; 3]>) {
    let (new_width, new_height) = (width / 2, height / 2);
    let mut result = Vec::with_capacity((new_width * new_height) as usize);
    for y in 0..new_height {
        let rows = 2 * y..if y + 1 == new_height { height } else { 2 * y + 2 };
        for x in 0..new_width {
            let columns = 2 * x..if x + 1 == new_width { width } else { 2 * x + 2 };
            let (mut sum, mut total) = ([0.0; 3], 0.0);
            for row in rows.clone() {
                let weight = solid_angle(row, width, height);
                for column in columns.clone() {
                    let texel = texels[(row * width + column) as usize];
                    (0..3).for_each(|channel| sum[channel] += weight * f64::from(texel[channel]));
                    total += weight;
                }
            }
            result.push(sum.map(|value| (value / total) as f32));
        }
    }
    (new_width, new_height, result)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(width: u32, height: u32, texels: impl Fn(u32, u32) -> [f32; 3]) -> Environment {
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texels(x, y)).collect();
        Environment { name: String::from("sky"), width, height, texels }
    }

    // Kills: sin(theta) d_theta d_phi instead of the exact solid angle, a middle row of an odd image that counts half.
    #[test]
    fn solid_angles_add_up_to_the_sphere() {
        for (width, height) in [(1, 1), (2, 1), (4, 3), (7, 5), (64, 32), (1024, 512)] {
            let sum: f64 = (0..height).map(|row| solid_angle(row, width, height) * f64::from(width)).sum();
            assert!((sum / (4.0 * PI) - 1.0).abs() < 1e-12, "{width} x {height}: {sum}");
            let packed = pack(&environment(width, height, |_, _| [1.0; 3]), 1 << 20, &mut Vec::new()).expect("a good map");
            assert!((packed.flux / (4.0 * PI) - 1.0).abs() < 1e-12);
            assert_eq!(packed.rows.len(), height.div_ceil(2) as usize);
            assert_eq!((packed.rows[0][0], packed.rows.last().map(|row| row[1])), (0.0, Some(1.0)));
        }
    }

    // Kills: halving that drops the last column of an odd image or weighs the poles like the equator.
    #[test]
    fn halving_keeps_the_flux() {
        let map = environment(37, 19, |x, y| [(x * y % 11) as f32, 1.0, x as f32]);
        let (full, mut warnings) = (pack(&map, 1 << 20, &mut Vec::new()).expect("a good map"), Vec::new());
        let reduced = pack(&map, 100, &mut warnings).expect("a good map");
        assert_eq!((reduced.width, reduced.height, warnings.len()), (9, 4, 1));
        // Texels that moved across the merged border column make the sums differ a little.
        assert!((reduced.flux / full.flux - 1.0).abs() < 0.1, "{} against {}", reduced.flux, full.flux);
        let even = environment(64, 32, |x, y| [(x * y % 11) as f32, 1.0, x as f32]);
        let (full, reduced) = (pack(&even, 1 << 20, &mut Vec::new()), pack(&even, 512, &mut Vec::new()));
        let (full, reduced) = (full.expect("a good map"), reduced.expect("a good map"));
        assert!((reduced.flux / full.flux - 1.0).abs() < 1e-6, "{} against {}", reduced.flux, full.flux);
    }

    // Kills: a table made for darkness, NaN that reaches a table, a repair without a word.
    #[test]
    fn darkness_and_broken_values() {
        assert_eq!(pack(&environment(8, 4, |_, _| [0.0; 3]), 100, &mut Vec::new()).expect("a good map").alias, None);
        let mut warnings = Vec::new();
        let broken = environment(8, 4, |x, _| [f32::NAN, -1.0, if x == 0 { f32::INFINITY } else { -0.0 }]);
        let packed = pack(&broken, 100, &mut warnings).expect("a repaired map");
        assert!(packed.texels.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
        assert!(warnings[0].contains("68 values"), "{warnings:?}");
    }
}
