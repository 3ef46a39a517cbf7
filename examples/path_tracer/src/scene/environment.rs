//! Panoramas that light a scene: from Radiance `.hdr` and OpenEXR files, or made here.
//!
//! Key decision: texels are cleaned before anybody computes a distribution from them, because one NaN poisons every sum it enters.
//! The exponent bits decide, and every repair is counted.
//!
//! **Invariant:** an [`Environment`] has at least one texel, and every texel is finite and not negative.

mod exr;
mod hdr;

use std::path::Path;

use super::limits;
use super::model::Environment;
use crate::error::{Error, Fault};

/// Colours of an image, row 0 at the top, as they are in its file.
pub(crate) struct Panorama {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) texels: Vec<[f32; 3]>,
    /// What of the file is left out, one line each.
    pub(crate) warnings: Vec<String>,
}

/// Reads a panorama, with one warning line for each kind of repair.
///
/// # Errors
/// When the file cannot be read, breaks its format, or uses a part of it that is not supported.
pub fn load_environment(path: &Path) -> Result<(Environment, Vec<String>), Error> {
    let Panorama { width, height, mut texels, mut warnings } = read_panorama(path)?;
    warnings.extend(sanitise(&mut texels));
    warnings.extend(oddity(&texels));
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let environment = Environment { name, width, height, texels };
    environment.check().map_err(|fault| fault.in_file(path))?;
    Ok((environment, warnings))
}

/// Reads a panorama without repairs.
///
/// # Errors
/// As [`load_environment`].
pub(crate) fn read_panorama(path: &Path) -> Result<Panorama, Error> {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let read = match extension.as_deref() {
        Some("hdr" | "pic") => hdr::read,
        Some("exr") => exr::read,
        _ => return Err(Error::extension(path, ".hdr or .exr")),
    };
    let bytes = limits::read_file(path)?;
    read(&bytes).map_err(|fault| fault.in_file(path))
}

impl Environment {
    /// The same radiance from everywhere. Numbers that cannot be a radiance become zero.
    pub fn constant(radiance: [f32; 3]) -> Environment {
        let mut texels = vec![radiance];
        sanitise(&mut texels);
        Environment { name: String::from("constant"), width: 1, height: 1, texels }
    }

    /// A clear, sunless sky over a dull ground: enough light for a scene that brings none.
    pub fn plain_sky() -> Environment {
        const ZENITH: [f32; 3] = [0.45, 0.62, 0.95];
        const HORIZON: [f32; 3] = [0.95, 0.97, 1.0];
        const GROUND: [f32; 3] = [0.22, 0.20, 0.18];
        let (width, height) = (64u32, 32u32);
        let row = |y: u32| {
            let elevation = (0.5 - (y as f32 + 0.5) / height as f32) * std::f32::consts::PI;
            let mix = elevation.sin().max(0.0).sqrt();
            if elevation > 0.0 { std::array::from_fn(|c| HORIZON[c] + (ZENITH[c] - HORIZON[c]) * mix) } else { GROUND }
        };
        let texels = (0..height).flat_map(|y| std::iter::repeat_n(row(y), width as usize)).collect();
        Environment { name: String::from("plain sky"), width, height, texels }
    }

    /// The module's invariant.
    pub(super) fn check(&self) -> Result<(), Fault> {
        let fault = |what: &str| Err(Fault::invalid(format_args!("environment '{}'", self.name), what));
        if self.texels.is_empty() || self.texels.len() as u64 != u64::from(self.width) * u64::from(self.height) {
            return fault("the texels do not fill the size");
        }
        if !self.texels.as_flattened().iter().all(|&x| x.is_finite() && x >= 0.0) {
            return fault("a texel is not finite or negative");
        }
        Ok(())
    }
}

/// A line for a panorama that is valid, but hardly what its author meant.
fn oddity(texels: &[[f32; 3]]) -> Option<String> {
    // Below this, the sum over the largest panorama is finite.
    const BRIGHTEST: f32 = f32::MAX / limits::ENVIRONMENT_TEXELS as f32;
    let brightest = texels.as_flattened().iter().copied().fold(0.0, f32::max);
    if brightest == 0.0 {
        Some(String::from("the panorama is black and lights nothing"))
    } else if brightest > BRIGHTEST {
        Some(format!("the panorama has a value of {brightest:e}, which leaves nothing else to be seen"))
    } else if texels.len() == 1 {
        Some(String::from("the panorama is a single texel: the same light from everywhere"))
    } else {
        None
    }
}

/// NaN and negative numbers become 0, infinity the largest number; returns a line for each kind that there was.
fn sanitise(texels: &mut [[f32; 3]]) -> Vec<String> {
    const EXPONENT: u32 = 0x7F80_0000;
    let (mut n_nan, mut n_infinite, mut n_negative) = (0u64, 0u64, 0u64);
    for value in texels.as_flattened_mut() {
        let bits = value.to_bits();
        let magnitude = bits & 0x7FFF_FFFF;
        if magnitude > EXPONENT {
            n_nan += 1;
            *value = 0.0;
        } else if bits != magnitude {
            // Minus zero is no defect, but the sign would survive in products.
            n_negative += u64::from(magnitude != 0);
            *value = 0.0;
        } else if magnitude == EXPONENT {
            n_infinite += 1;
            *value = f32::MAX;
        }
    }
    let kinds = [(n_nan, "NaN", "0"), (n_negative, "negative", "0"), (n_infinite, "infinite", "the largest finite number")];
    let line = |(n, kind, new): (u64, &str, &str)| (n > 0).then(|| format!("{n} values are {kind} and become {new}"));
    kinds.into_iter().filter_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a comparison that lets NaN pass, abs() for negative values, counting texels instead of values, and a warning for -0.
    #[test]
    fn six_planted_values_are_repaired_and_counted() {
        let mut texels = vec![[f32::NAN, -1.0, f32::INFINITY], [f32::NEG_INFINITY, -0.0, 1e-45], [-f32::NAN, f32::MAX, 2.0]];
        let lines = sanitise(&mut texels);
        assert_eq!(texels, [[0.0, 0.0, f32::MAX], [0.0, 0.0, 1e-45], [0.0, f32::MAX, 2.0]]);
        assert!(texels.as_flattened().iter().all(|x| x.is_sign_positive()));
        assert_eq!(
            lines,
            [
                "2 values are NaN and become 0",
                "2 values are negative and become 0",
                "1 values are infinite and become the largest finite number"
            ]
        );
        assert!(sanitise(&mut texels).is_empty());
    }

    // Kills: black or absurd panoramas that are shown without a word, and a word about good ones.
    #[test]
    fn odd_panoramas_are_told() {
        assert!(oddity(&[[0.0; 3]; 2]).is_some_and(|line| line.contains("black")));
        assert!(oddity(&[[1.0, 1.7e38, 0.0]; 2]).is_some_and(|line| line.contains("1.7e38")));
        assert!(oddity(&[[1.0; 3]]).is_some_and(|line| line.contains("single texel")));
        assert_eq!(oddity(&[[0.0; 3], [1e30, 0.0, 0.0]]), None);
    }

    // Kills: a sky that is upside down, or that violates the invariant.
    #[test]
    fn the_made_environments_are_valid() {
        let sky = Environment::plain_sky();
        sky.check().unwrap();
        assert!(sky.texels[0][2] > sky.texels[sky.texels.len() - 1][2]);
        Environment::constant([1.0, 2.0, f32::NAN]).check().unwrap();
    }
}
