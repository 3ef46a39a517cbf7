//! Polygons of files that have them, and what such files leave to be computed: triangles and normals.
//!
//! Key decision: a polygon becomes the fan around its first corner, as its formats say. That is exact for convex polygons only, so the
//! others are counted. Normals shared by faces are their normals weighted by the angle at the corner, because that does not depend on
//! how a polygon is cut into triangles.
//!
//! **Source:** G. Thürmer and C. Wüthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1), 1998.

use glam::{DVec3, Vec3};

use super::gltf::Warnings;
use super::limits;
use crate::error::Fault;

/// The triangles of a polygon; none when there are fewer than three corners.
pub(super) fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let first = corners.first().copied().unwrap_or_default();
    corners.get(1..).unwrap_or_default().windows(2).map(move |pair| [first, pair[0], pair[1]])
}

/// Twice the area of a polygon along its normal (Newell's sum), in f64 because corners may lie far from the origin.
pub(super) fn area_vector(corners: &[Vec3]) -> DVec3 {
    let Some(&first) = corners.first() else { return DVec3::ZERO };
    let edge = |corner: Vec3| corner.as_dvec3() - first.as_dvec3();
    corners.windows(2).map(|pair| edge(pair[0]).cross(edge(pair[1]))).sum()
}

/// False when the fan of the polygon turns over somewhere and so covers what is outside.
pub(super) fn fan_fits(corners: &[Vec3]) -> bool {
    let whole = area_vector(corners);
    let Some(&first) = corners.first() else { return true };
    let edge = |corner: Vec3| corner.as_dvec3() - first.as_dvec3();
    let turned_over = |pair: &[Vec3]| edge(pair[0]).cross(edge(pair[1])).dot(whole) < -1e-6 * whole.length_squared();
    corners.len() <= 3 || !corners.windows(2).any(turned_over)
}

/// Calls `add` with the number of each corner and the unit normal of the polygon times the angle at that corner.
pub(super) fn weighted_normals(corners: &[Vec3], mut add: impl FnMut(usize, Vec3)) {
    let normal = area_vector(corners).normalize_or_zero();
    let count = corners.len();
    let around = |index: usize| corners[index % count].as_dvec3();
    for index in 0..count {
        let (before, after) = (around(index + count - 1) - around(index), around(index + 1) - around(index));
        let angle = before.cross(after).length().atan2(before.dot(after));
        add(index, (normal * angle).as_vec3());
    }
}

/// The linear value of a vertex colour. Neither OBJ nor PLY says how colours are encoded; what writes them writes what a screen shows.
///
/// **Source:** IEC 61966-2-1.
pub(super) fn linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded.max(0.0) / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Says that [`linear`] was applied.
pub(super) const COLORS_WARNING: &str = "the colours of the vertices are taken as sRGB, because the format does not say";

/// Counts polygons against the limits and for the warnings.
#[derive(Default)]
pub(super) struct Tally {
    n_triangles: usize,
    n_small: usize,
    n_dented: usize,
}

impl Tally {
    /// Counts a polygon that was read.
    ///
    /// # Errors
    /// When there are more triangles than a scene may have.
    pub(super) fn polygon(&mut self, n_corners: usize) -> Result<(), Fault> {
        self.n_small += usize::from(n_corners < 3);
        self.n_triangles = self.n_triangles.saturating_add(n_corners.saturating_sub(2));
        if self.n_triangles > limits::TRIANGLES {
            return Err(Fault::unsupported("size", format_args!("a scene of more than {} triangles", limits::TRIANGLES)));
        }
        Ok(())
    }

    /// Counts a polygon whose corners are known.
    pub(super) fn shape(&mut self, corners: &[Vec3]) {
        self.n_dented += usize::from(!fan_fits(corners));
    }

    /// Says what was found.
    pub(super) fn warn(&self, warnings: &mut Warnings) {
        if self.n_small > 0 {
            warnings.push(format!("{} faces have fewer than three corners and are left out", self.n_small));
        }
        if self.n_dented > 0 {
            warnings.push(format!("{} faces have dents that their fans of triangles fill", self.n_dented));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a fan around the last corner, one triangle too few, and a subtraction below zero.
    #[test]
    fn fans_start_at_the_first_corner() {
        assert_eq!(fan(&[4, 5, 6, 7]).collect::<Vec<_>>(), [[4, 5, 6], [4, 6, 7]]);
        for corners in [&[][..], &[1], &[1, 2]] {
            assert_eq!(fan(corners).count(), 0, "{corners:?}");
        }
    }

    // Kills: the largest triangle taken for the whole, which accuses convex polygons that start with a needle.
    #[test]
    fn only_polygons_with_a_dent_are_counted() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        // The dent lies next to the corner around which the fan is made.
        let arrow = [Vec3::ZERO, Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.2, 0.0, 0.0), Vec3::new(1.0, 1.0, 0.0)];
        let dented = [Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.2, 0.0, 0.0), Vec3::new(1.0, 1.0, 0.0), Vec3::ZERO];
        assert!(fan_fits(&square) && fan_fits(&square[..3]) && fan_fits(&[]));
        assert!(fan_fits(&arrow), "this fan covers the arrow exactly");
        assert!(!fan_fits(&dented));
    }

    // Kills: weights by area or by number, which depend on how faces are cut.
    #[test]
    fn weights_are_angles() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let mut found = [Vec3::ZERO; 4];
        weighted_normals(&square, |corner, normal| found[corner] = normal);
        assert!(found.iter().all(|n| n.abs_diff_eq(Vec3::Z * std::f32::consts::FRAC_PI_2, 1e-6)), "{found:?}");
        weighted_normals(&square[..3], |corner, normal| found[corner] = normal);
        assert!(found[0].abs_diff_eq(Vec3::Z * std::f32::consts::FRAC_PI_4, 1e-6), "{found:?}");
    }
}
