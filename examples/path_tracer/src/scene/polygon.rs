//! Polygons of files that have them, and what such files leave to be computed: triangles and normals.
//!
//! Key decision: a polygon becomes the fan around its first corner, as its formats say, where that covers it exactly. Where the fan would
//! cover what is outside (a dent, as in the wall of a room with a door), ears are cut off instead, seen along the axis nearest to its normal;
//! corners on a straight edge may go with them. Normals shared by faces are their normals weighted by the angle at the corner, because that
//! does not depend on how a polygon is cut into triangles.
//!
//! **Source:** G. Thürmer and C. Wüthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1), 1998.

use earcut::Earcut;
use glam::{DVec3, Vec3};

use super::gltf::Warnings;
use super::limits;
use crate::error::Fault;

/// Corners of the largest polygon whose ears are cut: the time may grow with their third power.
const MOST_CORNERS: usize = 512;
/// A polygon is cut well when its triangles have its area, up to this part of it.
const AREA_ERROR: f64 = 1e-3;

/// The fan around the first of so many corners, by their places; nothing when there are fewer than three.
fn fan(count: usize) -> impl Iterator<Item = [usize; 3]> {
    (2..count).map(|last| [0, last - 1, last])
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

/// Cuts polygons into triangles, and counts them against the limits and for the warnings.
#[derive(Default)]
pub(super) struct Tally {
    n_triangles: usize,
    n_small: usize,
    n_filled: usize,
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    ears: Vec<usize>,
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

    /// Calls `add` with the triangles of a polygon, by the places of their corners, turned the way that it is; at most two less than it has
    /// corners.
    pub(super) fn cut(&mut self, corners: &[Vec3], mut add: impl FnMut([usize; 3])) {
        let whole = area_vector(corners);
        if fan_fits(corners) || !self.cut_ears(corners, whole) {
            fan(corners.len()).for_each(add);
            return;
        }
        let (ears, _) = self.ears.as_chunks::<3>();
        for &[a, b, c] in ears {
            let turned = area_vector(&[corners[a], corners[b], corners[c]]).dot(whole) < 0.0;
            add(if turned { [a, c, b] } else { [a, b, c] });
        }
    }

    /// Fills `ears`; false, and counted, when that fails.
    fn cut_ears(&mut self, corners: &[Vec3], whole: DVec3) -> bool {
        // Seen along the axis nearest to the normal; relative to a corner, because all of them may lie far from the origin.
        let axis = whole.abs().max_position();
        let [across, up] = [(axis + 1) % 3, (axis + 2) % 3];
        self.flat.clear();
        self.flat.extend(corners.iter().map(|corner| {
            let from_first = corner.as_dvec3() - corners[0].as_dvec3();
            [from_first[across], from_first[up]]
        }));
        self.ears.clear();
        if corners.len() <= MOST_CORNERS {
            self.earcut.earcut_slice(&self.flat, &[], &mut self.ears);
        }
        let (ears, _) = self.ears.as_chunks::<3>();
        let area = |[a, b, c]: [usize; 3]| area_vector(&[corners[a], corners[b], corners[c]])[axis].abs();
        let covered: f64 = ears.iter().map(|&ear| area(ear)).sum();
        // Polygons that cross themselves have no inside that all agree on.
        let is_covered = (covered - whole[axis].abs()).abs() <= AREA_ERROR * whole[axis].abs();
        self.n_filled += usize::from(!is_covered);
        is_covered
    }

    /// Says what was found.
    pub(super) fn warn(&self, warnings: &mut Warnings) {
        if self.n_small > 0 {
            warnings.push(format!("{} faces have fewer than three corners and are left out", self.n_small));
        }
        if self.n_filled > 0 {
            warnings
                .push(format!("{} faces cross themselves or have more than {MOST_CORNERS} corners: fans fill their dents", self.n_filled));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(corners: &[Vec3]) -> (Vec<[usize; 3]>, Vec<String>) {
        let (mut tally, mut triangles, mut warnings) = (Tally::default(), Vec::new(), Warnings::default());
        tally.cut(corners, |triangle| triangles.push(triangle));
        tally.warn(&mut warnings);
        (triangles, warnings.into_lines())
    }

    // Kills: a fan around the last corner, one triangle too few, and a subtraction below zero.
    #[test]
    fn fans_start_at_the_first_corner() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        assert_eq!(cut(&square).0, [[0, 1, 2], [0, 2, 3]]);
        for count in 0..3 {
            assert_eq!(cut(&square[..count]).0.len(), 0, "{count}");
        }
    }

    // Kills: the largest triangle taken for the whole, which accuses convex polygons that start with a needle.
    #[test]
    fn only_polygons_with_a_dent_need_ears() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        // The dent lies next to the corner around which the fan is made.
        let arrow = [Vec3::ZERO, Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.2, 0.0, 0.0), Vec3::new(1.0, 1.0, 0.0)];
        let dented = [Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.2, 0.0, 0.0), Vec3::new(1.0, 1.0, 0.0), Vec3::ZERO];
        assert!(fan_fits(&square) && fan_fits(&square[..3]) && fan_fits(&[]));
        assert!(fan_fits(&arrow), "this fan covers the arrow exactly");
        assert!(!fan_fits(&dented));
    }

    // Kills: dents that are filled, triangles that look the other way, an axis that the polygon is thin along.
    #[test]
    fn dents_stay_open() {
        // A wall with a door, upright in each direction and from both sides: 12 of 16 squares.
        let outline = [[1, 0], [0, 0], [0, 4], [4, 4], [4, 0], [3, 0], [3, 2], [1, 2]];
        for axis in 0..3 {
            for is_reversed in [false, true] {
                let mut wall: Vec<Vec3> = outline
                    .iter()
                    .map(|&[x, y]| {
                        let mut corner = Vec3::splat(1000.0);
                        (corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (x as f32, y as f32);
                        corner
                    })
                    .collect();
                if is_reversed {
                    wall.reverse();
                }
                assert!(!fan_fits(&wall), "the first corner does not see all others");
                let (triangles, warnings) = cut(&wall);
                let whole = area_vector(&wall);
                let areas: Vec<f64> = triangles.iter().map(|places| area_vector(&places.map(|place| wall[place]))[axis]).collect();
                assert_eq!((areas.len(), areas.iter().sum::<f64>()), (6, whole[axis]), "{axis} {is_reversed}");
                assert!(areas.iter().all(|area| area.signum() == whole[axis].signum()), "{axis} {is_reversed}: {areas:?}");
                assert!(warnings.is_empty());
            }
        }
    }

    // Kills: a face without an inside that is left out, or filled in silence.
    #[test]
    fn faces_that_cross_themselves_are_told() {
        let star = [[0.0, 3.0], [2.0, -3.0], [-3.0, 1.0], [3.0, 1.0], [-2.0, -3.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
        let (triangles, warnings) = cut(&star);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        assert!(warnings[0].starts_with("1 faces cross themselves"), "{warnings:?}");
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
