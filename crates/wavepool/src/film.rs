//! The film: what all finished passes have added up to, per pixel.

use xxhash_rust::xxh3::Xxh3;

use crate::layout::{Leaf, Scalar};

/// Sums and sample counts per pixel, exactly as the device keeps them.
///
/// **Shape:** `pixels` entries per plane, in pixel order. Floats have three planes (sums of 256 terms, of 256 sums, of the rest),
/// integers two (low and high word).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    leaves: Vec<Leaf>,
    samples: Vec<u32>,
    /// Per leaf: its planes, each `pixels` words.
    planes: Vec<Vec<Vec<u32>>>,
    not_finite: u64,
}

/// Words that a leaf of the result takes per pixel of the film.
pub(crate) fn planes_of(scalar: Scalar) -> usize {
    if scalar == Scalar::F32 { 3 } else { 2 }
}

impl Film {
    /// Sorts the device's words (`planes x places`) into pixel order; `pixel_of` tells the pixel of a place.
    pub(crate) fn gather(
        leaves: &[Leaf],
        pixels: usize,
        places: usize,
        words: &[u32],
        pixel_of: impl Fn(usize) -> Option<u32>,
        not_finite: u64,
    ) -> Self {
        let mut samples = vec![0; pixels];
        let mut planes: Vec<Vec<Vec<u32>>> = leaves.iter().map(|leaf| vec![vec![0; pixels]; planes_of(leaf.scalar)]).collect();
        for place in 0..places {
            let Some(pixel) = pixel_of(place).map(|pixel| pixel as usize).filter(|pixel| *pixel < pixels) else { continue };
            let mut plane = words.iter().skip(place).step_by(places.max(1));
            samples[pixel] = plane.next().copied().unwrap_or(0);
            for target in planes.iter_mut().flatten() {
                target[pixel] = plane.next().copied().unwrap_or(0);
            }
        }
        Film { leaves: leaves.to_vec(), samples, planes, not_finite }
    }

    /// How many pixels.
    pub fn pixels(&self) -> usize {
        self.samples.len()
    }

    /// The scalars of a result, in declaration order.
    pub fn leaves(&self) -> &[Leaf] {
        &self.leaves
    }

    /// How many results each pixel has received.
    pub fn samples(&self) -> &[u32] {
        &self.samples
    }

    /// Results that were NaN or infinite; each counted as a sample of value zero.
    pub fn not_finite(&self) -> u64 {
        self.not_finite
    }

    /// The sum of leaf `leaf` over the samples of `pixel`; exact for integers below 2^53.
    ///
    /// # Panics
    /// When the leaf or the pixel does not exist.
    pub fn sum(&self, pixel: usize, leaf: usize) -> f64 {
        let words = self.planes[leaf].iter().map(|plane| plane[pixel]);
        match self.leaves[leaf].scalar {
            Scalar::F32 => words.map(|word| f64::from(f32::from_bits(word))).sum(),
            _ => words.zip([1.0, 4_294_967_296.0]).map(|(word, unit)| f64::from(word) * unit).sum(),
        }
    }

    /// The mean of leaf `leaf` over the samples of `pixel`; zero when there is none.
    ///
    /// # Panics
    /// When the leaf or the pixel does not exist.
    pub fn mean(&self, pixel: usize, leaf: usize) -> f64 {
        let samples = f64::from(self.samples[pixel]);
        if samples > 0.0 { self.sum(pixel, leaf) / samples } else { 0.0 }
    }

    /// XXH3 over the raw sums and sample counts: equal hashes, equal films.
    pub fn hash(&self) -> u64 {
        let mut hash = Xxh3::new();
        for plane in std::iter::once(&self.samples).chain(self.planes.iter().flatten()) {
            plane.iter().for_each(|word| hash.update(&word.to_le_bytes()));
        }
        hash.digest()
    }
}
