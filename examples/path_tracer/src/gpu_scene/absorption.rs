//! How strongly solids absorb what passes them: a coefficient per material, for scenes in which any does.
//!
//! Key decision: kernels want one number per length of normalised space, so the colour after a distance becomes the coefficient of Beer
//! and Lambert's law here, in f64. A table of its own keeps the record of a material as it is where nothing absorbs.
//!
//! **Invariant:** coefficients are finite and not negative; those of thin sheets and of what transmits nothing are zero.

use super::{
    normalise::Normalisation,
    records::{MaterialRecord, material_flags},
};
use crate::scene::{Material, Scene};

/// A row for each material, or nothing when no material absorbs.
///
/// **Source:** KHR_materials_volume: what is left of white light after `attenuation_distance` is `attenuation_color`.
pub(crate) fn rows(
    scene: &Scene,
    records: &[MaterialRecord],
    normalisation: &Normalisation,
    warnings: &mut Vec<String>,
) -> Option<Vec<[u32; 4]>> {
    let coefficients: Vec<[f32; 3]> = scene
        .materials
        .iter()
        .zip(records)
        .map(|(material, record)| {
            let has_volume = record.flags & material_flags::SOLID != 0 && record.transmission > 0.0;
            if has_volume { coefficient(material, normalisation, warnings) } else { [0.0; 3] }
        })
        .collect();
    let absorbs = coefficients.iter().flatten().any(|&value| value > 0.0);
    absorbs.then(|| coefficients.iter().map(|[r, g, b]| [r.to_bits(), g.to_bits(), b.to_bits(), 0]).collect())
}

/// Per unit of normalised length.
fn coefficient(material: &Material, normalisation: &Normalisation, warnings: &mut Vec<String>) -> [f32; 3] {
    let distance = f64::from(material.attenuation_distance);
    // Without a distance the colour says nothing.
    if !(distance > 0.0 && distance.is_finite()) {
        return [0.0; 3];
    }
    let color = material.attenuation_color;
    let kept = color.clamp(glam::Vec3::ZERO, glam::Vec3::ONE);
    if kept != color {
        warnings.push(format!("material `{}`: attenuation colour {color} became {kept}", material.name));
    }
    // Black absorbs all at any distance: the largest number stands for infinity, which has no product with zero.
    kept.to_array().map(|left| (-f64::from(left).ln() / (distance * normalisation.scale)).clamp(0.0, f64::from(f32::MAX)) as f32)
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;

    fn packed(material: Material, flags: u32) -> (Option<Vec<[f32; 3]>>, Vec<String>) {
        let record = MaterialRecord { flags, transmission: material.transmission, ..MaterialRecord::default() };
        let normalisation = Normalisation { centre: DVec3::ZERO, scale: 0.25, radius: 1.0 };
        let scene = Scene { materials: vec![Material::default(), material], ..Scene::default() };
        let mut warnings = Vec::new();
        let rows = rows(&scene, &[MaterialRecord::default(), record], &normalisation, &mut warnings);
        (rows.map(|rows| rows.iter().map(|row| [0, 1, 2].map(|channel| f32::from_bits(row[channel]))).collect()), warnings)
    }

    // Kills: a table where nothing absorbs, a coefficient per metre, one that is infinite or negative, absorption in thin sheets.
    #[test]
    fn only_solids_absorb() {
        let amber =
            Material { transmission: 1.0, attenuation_color: Vec3::new(0.5, 1.0, 0.0), attenuation_distance: 2.0, ..Material::default() };
        let (rows, warnings) = packed(amber.clone(), material_flags::SOLID);
        let rows = rows.expect("it absorbs");
        assert_eq!((rows.len(), rows[0]), (2, [0.0; 3]));
        // Half is left after two metres, which are half a unit.
        assert!((f64::from(rows[1][0]) - 2.0 * 2f64.ln()).abs() < 1e-6 && rows[1][1] == 0.0 && rows[1][2] == f32::MAX, "{rows:?}");
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!(packed(amber.clone(), 0).0, None);
        assert_eq!(packed(Material { transmission: 0.0, ..amber.clone() }, material_flags::SOLID).0, None);
        assert_eq!(packed(Material { attenuation_distance: f32::INFINITY, ..amber.clone() }, material_flags::SOLID).0, None);
        assert_eq!(packed(Material { attenuation_color: Vec3::ONE, ..amber.clone() }, material_flags::SOLID).0, None);
        let (rows, warnings) = packed(Material { attenuation_color: Vec3::splat(2.0), ..amber }, material_flags::SOLID);
        assert!(rows.is_none() && warnings.len() == 1 && warnings[0].contains("became"), "{warnings:?}");
    }
}
