//! From the sums of a film to layers: means, metres, numbers of things, and how far the mean colour may be off.
//!
//! Key decision: kernels add what they see in normalised space, and the means become metres here in f64, so that a scene far from its
//! origin keeps its digits.
//!
//! **Invariant:** leaves are found by their names in the result; the colour is the first three, whatever else is asked for.

use wavepool::Film;

use crate::{
    gpu_scene::{LayerRequest, Normalisation},
    layers::{Channel, Layer, Values},
};

/// How to read a film.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilmLayers {
    pub(crate) request: LayerRequest,
    pub(crate) transparent: bool,
    pub(crate) normalisation: Normalisation,
}

impl FilmLayers {
    /// The share of the samples that met something; `None` where nobody has asked for it.
    pub(crate) fn alpha(&self, film: &Film) -> Option<Vec<f32>> {
        let leaf = self.transparent.then(|| component(film, ".covered"))??;
        Some((0..film.pixels()).map(|pixel| film.mean(pixel, leaf) as f32).collect())
    }

    /// All layers that were asked for, and the number of samples.
    pub(crate) fn of(&self, film: &Film) -> Vec<Layer> {
        let request = &self.request;
        let mean = |name: &'static str| move |pixel: usize| component(film, name).map_or(0.0, |leaf| film.mean(pixel, leaf));
        let (centre, scale) = (self.normalisation.centre, self.normalisation.scale);
        let mut layers = Vec::new();
        if request.albedo {
            layers.push(quantities(film, "albedo", &[("R", &mean(".albedo.x")), ("G", &mean(".albedo.y")), ("B", &mean(".albedo.z"))]));
        }
        if request.normal {
            layers.push(quantities(film, "normal", &[("X", &mean(".normal.x")), ("Y", &mean(".normal.y")), ("Z", &mean(".normal.z"))]));
        }
        // Over the samples that meet something: a mean with those that do not would lie in front of everything.
        let hit_mean = |pixel: usize, name: &'static str, none: f64, metres: &dyn Fn(f64) -> f64| {
            let hits = component(film, ".hits").map_or(0.0, |leaf| film.sum(pixel, leaf));
            let sum = component(film, name).map_or(0.0, |leaf| film.sum(pixel, leaf));
            if hits > 0.0 { metres(sum / hits) } else { none }
        };
        if request.depth {
            let depth = |pixel| hit_mean(pixel, ".depth", f64::INFINITY, &|mean| mean / scale);
            layers.push(quantities(film, "Z", &[("", &depth)]));
        }
        if request.position {
            let along = |pixel, name, centre: f64| hit_mean(pixel, name, 0.0, &|mean| mean / scale + centre);
            let x = |pixel| along(pixel, ".position.x", centre.x);
            let y = |pixel| along(pixel, ".position.y", centre.y);
            let z = |pixel| along(pixel, ".position.z", centre.z);
            layers.push(quantities(film, "position", &[("X", &x), ("Y", &y), ("Z", &z)]));
        }
        if request.object {
            layers.push(numbers(film, "object", ".object"));
        }
        if request.material {
            layers.push(numbers(film, "material", ".material"));
        }
        if request.variance {
            let variance =
                |radiance: &'static str, square: &'static str| move |pixel: usize| variance_of_mean(film, pixel, radiance, square);
            let red = variance(".radiance.x", ".square.x");
            let green = variance(".radiance.y", ".square.y");
            let blue = variance(".radiance.z", ".square.z");
            layers.push(quantities(film, "variance", &[("R", &red), ("G", &green), ("B", &blue)]));
        }
        let channel = Channel { name: String::new(), values: Values::U32(film.samples().to_vec()) };
        layers.push(Layer { name: String::from("samples"), channels: vec![channel] });
        layers
    }
}

/// The leaf of that name.
fn component(film: &Film, path: &str) -> Option<usize> {
    film.leaves().iter().position(|leaf| leaf.path == path)
}

fn quantities(film: &Film, name: &str, channels: &[(&str, &dyn Fn(usize) -> f64)]) -> Layer {
    let channel = |(name, value): &(&str, &dyn Fn(usize) -> f64)| {
        let values = (0..film.pixels()).map(|pixel| value(pixel) as f32).collect();
        Channel { name: String::from(*name), values: Values::F32(values) }
    };
    Layer { name: String::from(name), channels: channels.iter().map(channel).collect() }
}

/// Sums in which one sample has said a number and all others zero.
fn numbers(film: &Film, name: &str, path: &str) -> Layer {
    let number = |pixel: usize| match component(film, path) {
        // A sum of one number below 2^32 is that number.
        Some(leaf) if film.samples()[pixel] > 0 => film.sum(pixel, leaf) as u32,
        _ => LayerRequest::NOTHING,
    };
    let values = Values::U32((0..film.pixels()).map(number).collect());
    Layer { name: String::from(name), channels: vec![Channel { name: String::new(), values }] }
}

/// The variance of the mean of a pixel: that of its samples, unbiased, over their number. Infinite with fewer than two samples, which say
/// nothing about it.
///
/// The second moment is kept about zero, because no sample knows of another; the difference is taken in f64, so what it loses is the
/// rounding of the film's sums alone. A level of such a sum has at most 256 terms and an error below 2^-17; three sums of two levels leave
/// the variance of a sample known to 2^-14 of the squared mean. Below that (a spread of less than a hundredth of the mean) it may read as
/// zero or as rounding, and what rounding makes negative is 0.
fn variance_of_mean(film: &Film, pixel: usize, radiance: &str, square: &str) -> f64 {
    let samples = f64::from(film.samples()[pixel]);
    let (Some(radiance), Some(square)) = (component(film, radiance), component(film, square)) else { return f64::INFINITY };
    if samples < 2.0 {
        return f64::INFINITY;
    }
    let mean = film.sum(pixel, radiance) / samples;
    ((film.sum(pixel, square) / samples - mean * mean) / (samples - 1.0)).max(0.0)
}
