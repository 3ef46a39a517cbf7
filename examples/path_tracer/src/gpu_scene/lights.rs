//! Everything that light sampling can pick, with its probability.
//!
//! Key decision: one alias table over emissive triangles, punctual lights and the panorama. Each of these three kinds gets the same share,
//! and within a kind the share goes by power: how much of the panorama's power enters a room, its power does not tell. A light is never
//! less probable than 2^-24 of the whole, so that none is lost to the rounding of its neighbours.
//!
//! **Invariant:** the probability stored with a light is the one its draw realises; a light without power is not in the table.

use std::f64::consts::PI;

use super::{
    LightStrategy,
    alias::AliasTable,
    error::Error,
    geometry::Geometry,
    normalise::Normalisation,
    records::{LightRecord, MaterialRecord, NONE, PunctualRecord, light_kinds, punctual_kinds, triangle_flags},
    textures::mean_color,
};
use crate::scene::{LightKind, PunctualLight, Scene};

const FLOOR: f64 = 1.0 / (1u64 << 24) as f64;

/// The lights of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lights {
    pub(crate) records: Vec<LightRecord>,
    pub(crate) punctuals: Vec<PunctualRecord>,
    pub(crate) alias: AliasTable,
    /// Probability of the panorama.
    pub(crate) environment_selection: f32,
    pub(crate) has_triangles: bool,
}

/// Scales the weights so that every kind of light that is there has the same sum.
fn balance(records: &[LightRecord], weights: &mut [f64]) {
    for kind in [light_kinds::TRIANGLE, light_kinds::PUNCTUAL, light_kinds::ENVIRONMENT] {
        let of_kind = || records.iter().zip(0..).filter(|(record, _)| record.kind == kind).map(|(_, index)| index);
        let sum: f64 = of_kind().map(|index: usize| weights[index]).sum();
        if sum > 0.0 {
            of_kind().for_each(|index| weights[index] /= sum);
        }
    }
}

/// Collects the lights and tells every emissive triangle its entry.
pub(crate) fn pack(
    scene: &Scene,
    normalisation: &Normalisation,
    materials: &[MaterialRecord],
    geometry: &mut Geometry,
    environment_flux: f64,
    strategy: LightStrategy,
) -> Result<Lights, Error> {
    let (mut lights, mut weights) = (Lights::default(), Vec::new());
    if strategy != LightStrategy::Bsdf {
        let powers = emitted_means(scene, materials);
        let slots = geometry.triangles.iter_mut().zip(&geometry.areas).enumerate();
        for (slot, (triangle, &area)) in slots.filter(|(_, (triangle, _))| triangle.material & triangle_flags::EMISSIVE != 0) {
            let (power, inverse_area) = (powers[(triangle.material & triangle_flags::MATERIAL_MASK) as usize] * area, (1.0 / area) as f32);
            if power > 0.0 && inverse_area.is_finite() {
                triangle.light = lights.records.len() as u32;
                lights.records.push(LightRecord { kind: light_kinds::TRIANGLE, index: slot as u32, pmf: 0.0, inverse_area });
                weights.push(power);
            }
        }
        lights.has_triangles = !lights.records.is_empty();
        if environment_flux > 0.0 {
            lights.records.push(LightRecord { kind: light_kinds::ENVIRONMENT, ..LightRecord::default() });
            weights.push(PI * normalisation.radius.powi(2) * environment_flux);
        }
    }
    for (index, light) in scene.lights.iter().enumerate() {
        let (record, power) = punctual(index, light, normalisation)?;
        if power > 0.0 {
            let index = lights.punctuals.len() as u32;
            lights.records.push(LightRecord { kind: light_kinds::PUNCTUAL, index, ..LightRecord::default() });
            lights.punctuals.push(record);
            weights.push(power);
        }
    }
    balance(&lights.records, &mut weights);
    let floor = weights.iter().sum::<f64>() * FLOOR;
    weights.iter_mut().for_each(|weight| *weight = weight.max(floor));
    if let Some(alias) = AliasTable::new(&weights) {
        for (entry, light) in lights.records.iter_mut().enumerate() {
            light.pmf = alias.pmf(entry) as f32;
            if light.kind == light_kinds::ENVIRONMENT {
                lights.environment_selection = light.pmf;
            }
        }
        lights.alias = alias;
    } else {
        // A table that picks nothing, so that a kernel that asks for light anyway gets none.
        lights.records.push(LightRecord { kind: NONE, ..LightRecord::default() });
        lights.alias = AliasTable { log2_columns: 1, columns: vec![[u32::MAX, 0]; 2], counts: Vec::new() };
    }
    Ok(lights)
}

/// Power per area of each material: pi times the mean radiance, for both sides if both emit.
fn emitted_means(scene: &Scene, materials: &[MaterialRecord]) -> Vec<f64> {
    let mean = |(record, material): (&MaterialRecord, &crate::scene::Material)| {
        let image = material.emissive_texture.and_then(|usage| scene.images.get(usage.image as usize));
        let texture = image.map_or([1.0; 3], mean_color);
        let radiance: f64 = record.emissive.iter().zip(texture).map(|(&value, factor)| f64::from(value) * factor).sum::<f64>() / 3.0;
        radiance * PI * if material.double_sided { 2.0 } else { 1.0 }
    };
    materials.iter().zip(&scene.materials).map(mean).collect()
}

/// A punctual light in normalised space and its power there. Lengths shrink by the scale, so candelas shrink by its square.
fn punctual(index: usize, light: &PunctualLight, normalisation: &Normalisation) -> Result<(PunctualRecord, f64), Error> {
    let factor = if light.kind == LightKind::Directional { 1.0 } else { normalisation.scale * normalisation.scale };
    let intensity = light.intensity.to_array().map(|value| (f64::from(value) * factor) as f32);
    let range = normalisation.length(light.range);
    let position = if light.kind == LightKind::Directional { glam::Vec3::ZERO } else { normalisation.point(light.position) };
    let valid = intensity.iter().all(|value| value.is_finite() && *value >= 0.0) && position.is_finite() && range > 0.0;
    let direction = light.direction.as_dvec3().normalize_or_zero().as_vec3();
    if !valid || !direction.is_finite() {
        return Err(Error::OutOfRange { what: "light", index, value: format!("{light:?}") });
    }
    let mean = intensity.iter().map(|&value| f64::from(value)).sum::<f64>() / 3.0;
    let mut record = PunctualRecord {
        position: position.to_array(),
        direction: direction.to_array(),
        inverse_range: (1.0 / range) as f32,
        intensity,
        ..PunctualRecord::default()
    };
    let power = match light.kind {
        LightKind::Point => 4.0 * PI * mean,
        LightKind::Spot { inner, outer } => {
            let (inner, outer) = (f64::from(inner).cos(), f64::from(outer).cos());
            // KHR_lights_punctual's own guard against a ramp without width.
            let scale = 1.0 / (inner - outer).max(0.001);
            record.kind = punctual_kinds::SPOT;
            (record.spot_scale, record.spot_offset) = (scale as f32, (-outer * scale) as f32);
            2.0 * PI * (1.0 - 0.5 * (inner + outer)).max(0.0) * mean
        }
        LightKind::Directional => {
            record.kind = punctual_kinds::DIRECTIONAL;
            PI * normalisation.radius.powi(2) * mean
        }
    };
    Ok((record, power))
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;

    fn packed(lights: Vec<PunctualLight>, environment_flux: f64, scale: f64) -> Lights {
        let scene = Scene { lights, ..Scene::default() };
        let normalisation = Normalisation { centre: DVec3::ZERO, scale, radius: 1.0 };
        let mut geometry = Geometry { hierarchy: Default::default(), triangles: Vec::new(), areas: Vec::new() };
        pack(&scene, &normalisation, &[], &mut geometry, environment_flux, LightStrategy::Mis).expect("good lights")
    }

    fn point(intensity: f32) -> PunctualLight {
        let intensity = Vec3::splat(intensity);
        PunctualLight { kind: LightKind::Point, position: Vec3::X, direction: Vec3::ZERO, intensity, range: f32::INFINITY, profile: None }
    }

    // Kills: a dim light with probability zero, a black light in the table, probabilities that are not the table's.
    #[test]
    fn dim_lights_are_found_and_black_ones_are_not() {
        let lights = packed(vec![point(1e9), point(0.0), point(1e-9)], 0.0, 1.0);
        assert_eq!(lights.records.len(), 2);
        assert!(lights.records[1].pmf > 5e-8, "{}", lights.records[1].pmf);
        let sum: f64 = (0..2).map(|entry| lights.alias.pmf(entry)).sum();
        assert_eq!(sum, 1.0);
    }

    // Kills: candelas that keep their value while metres shrink.
    #[test]
    fn intensity_shrinks_with_the_square_of_the_scale() {
        let lights = packed(vec![point(3.0)], 0.0, 0.25);
        assert_eq!((lights.punctuals[0].intensity, lights.punctuals[0].position), ([0.1875; 3], [0.25, 0.0, 0.0]));
        assert_eq!(lights.punctuals[0].inverse_range, 0.0);
    }

    // Kills: a scene in the dark whose kernels read a table that is not there.
    #[test]
    fn darkness_has_a_table_that_picks_nothing() {
        let lights = packed(Vec::new(), 0.0, 1.0);
        assert_eq!((lights.records[0].kind, lights.records[0].pmf, lights.environment_selection), (NONE, 0.0, 0.0));
        assert_eq!(packed(Vec::new(), 2.0, 1.0).environment_selection, 1.0);
    }
}
