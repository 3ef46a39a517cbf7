//! Moves a scene into the ball of unit size around the origin, so that no kernel needs a length of its own.
//!
//! Key decision: the middle of the bounds is subtracted in f64 and the rest is multiplied by a power of two. Scaling a whole scene by a
//! power of two, or moving it by a vector its coordinates represent exactly, therefore changes no bit of what is packed.
//!
//! **Invariant:** every packed position lies in [-1, 1] in each coordinate.

use glam::{DVec3, Vec3};

/// The map from the scene's metres to normalised space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    /// The point that becomes the origin, in metres.
    pub centre: DVec3,
    /// Normalised length per metre: a power of two.
    pub scale: f64,
    /// Radius of the ball around the origin that holds all of the scene, normalised.
    pub radius: f64,
}

impl Normalisation {
    /// For a scene whose points are these; without points nothing is moved.
    pub fn of(points: impl Iterator<Item = Vec3>) -> Normalisation {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in points {
            low = low.min(point.as_dvec3());
            high = high.max(point.as_dvec3());
        }
        if low.x > high.x {
            return Normalisation { centre: DVec3::ZERO, scale: 1.0, radius: 1.0 };
        }
        let half = (high - low) * 0.5;
        let size = half.max_element();
        if size <= 0.0 {
            return Normalisation { centre: (low + high) * 0.5, scale: 1.0, radius: 1.0 };
        }
        let scale = 2f64.powi(-exponent_above(size));
        Normalisation { centre: (low + high) * 0.5, scale, radius: half.length() * scale }
    }

    /// A position.
    pub fn point(&self, point: Vec3) -> Vec3 {
        ((point.as_dvec3() - self.centre) * self.scale).as_vec3()
    }

    /// A length.
    pub fn length(&self, length: f32) -> f64 {
        f64::from(length) * self.scale
    }
}

/// The smallest k with `size <= 2^k`, read from the bits because a logarithm rounds.
fn exponent_above(size: f64) -> i32 {
    let exponent = (size.to_bits() >> 52) as i32 - 1023;
    if size.to_bits() << 12 == 0 { exponent } else { exponent + 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a logarithm that rounds a size just above a power of two down to it.
    #[test]
    fn the_exponent_is_exact() {
        for exponent in [-120, -1, 0, 1, 77] {
            let power = 2f64.powi(exponent);
            assert_eq!(exponent_above(power), exponent);
            assert_eq!(exponent_above(power.next_up()), exponent + 1);
            assert_eq!(exponent_above(power.next_down()), exponent);
        }
    }

    // Kills: a scale that is no power of two, a centre rounded to f32.
    #[test]
    fn powers_of_two_change_nothing() {
        let points: Vec<Vec3> = (0..50).map(|i| Vec3::new((i * 37 % 19) as f32 * 0.3, (i * 11 % 7) as f32 * 0.7, i as f32 * 0.1)).collect();
        let reference = Normalisation::of(points.iter().copied());
        for exponent in [-20, -3, 5, 23] {
            let factor = 2f32.powi(exponent);
            let scaled = Normalisation::of(points.iter().map(|&point| point * factor));
            for &point in &points {
                assert_eq!(scaled.point(point * factor), reference.point(point), "2^{exponent}");
                assert!(reference.point(point).abs().max_element() <= 1.0);
            }
        }
    }

    // Kills: a scene that keeps the rounding of a far-away origin.
    #[test]
    fn moving_by_exact_vectors_changes_nothing() {
        let points: Vec<Vec3> = (0..50).map(|i| Vec3::new((i * 37 % 19) as f32, (i * 11 % 7) as f32, i as f32) * 0.25).collect();
        let offset = Vec3::new(65536.0, -1024.0, 8192.0);
        let (here, there) = (Normalisation::of(points.iter().copied()), Normalisation::of(points.iter().map(|&point| point + offset)));
        for &point in &points {
            assert_eq!(here.point(point), there.point(point + offset));
        }
    }
}
