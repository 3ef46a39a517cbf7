//! How far a picture is from a reference.
//!
//! Key decision: values that are not finite are counted and left out of every sum, in both pictures alike, because one of them would be the
//! answer to everything else. Errors are relative to the reference, plus a constant that keeps dark pixels from dominating.
//!
//! **Invariant:** every number is finite when the pictures have a finite value in common, and zero when they have none.

use super::Picture;

/// What is added to the squared reference under a squared difference.
///
/// **Source:** Rousselle, Knaus, Zwicker, "Adaptive Sampling and Reconstruction using Greedy Error Minimization" (2011), section 6.
pub const EPSILON: f64 = 0.01;

/// Pixels along a side of the tiles among which the worst is looked for.
pub const TILE: u32 = 16;

/// The result of a comparison.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Difference {
    /// Mean over pixels and channels of the squared difference.
    pub mse: f64,
    /// Mean over pixels and channels of the squared difference over the squared reference + [`EPSILON`].
    pub relative_mse: f64,
    /// Mean of the picture minus mean of the reference.
    pub mean: f64,
    /// The same as a share of the reference's mean; 0 when that is 0.
    pub relative_mean: f64,
    /// The tile with the largest relative error; of several, the first. `None` when no tile has a finite value.
    pub worst: Option<WorstTile>,
    /// Values that are NaN or infinite, of the picture and of the reference.
    pub not_finite: [u64; 2],
}

/// Where a picture is worst.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstTile {
    /// Left column.
    pub x: u32,
    /// Upper row.
    pub y: u32,
    /// As [`Difference::relative_mse`], over the tile.
    pub relative_mse: f64,
}

#[derive(Clone, Copy, Default)]
struct Sums {
    squared: f64,
    relative: f64,
    difference: f64,
    reference: f64,
    count: u64,
}

impl Sums {
    fn add(&mut self, value: f32, reference: f32) {
        let (value, reference) = (f64::from(value), f64::from(reference));
        let difference = value - reference;
        self.squared += difference * difference;
        self.relative += difference * difference / (reference * reference + EPSILON);
        self.difference += difference;
        self.reference += reference;
        self.count += 1;
    }

    fn absorb(&mut self, other: Sums) {
        self.squared += other.squared;
        self.relative += other.relative;
        self.difference += other.difference;
        self.reference += other.reference;
        self.count += other.count;
    }

    fn mean(&self, sum: f64) -> f64 {
        if self.count > 0 { sum / self.count as f64 } else { 0.0 }
    }
}

impl Difference {
    /// Compares the colours of two pictures of one size.
    ///
    /// # Errors
    /// A text that says which sizes do not agree.
    pub fn between(picture: &Picture, reference: &Picture) -> Result<Difference, String> {
        let (width, height) = (picture.width, picture.height);
        if (width, height) != (reference.width, reference.height) {
            return Err(format!("{width}x{height} pixels, where the reference has {}x{}", reference.width, reference.height));
        }
        picture.check()?;
        reference.check()?;
        let (mut all, mut worst, mut not_finite) = (Sums::default(), None::<WorstTile>, [0u64; 2]);
        for y in (0..height).step_by(TILE as usize) {
            for x in (0..width).step_by(TILE as usize) {
                let tile = tile(picture, reference, (x, y), &mut not_finite);
                let relative_mse = tile.mean(tile.relative);
                if tile.count > 0 && worst.is_none_or(|worst| relative_mse > worst.relative_mse) {
                    worst = Some(WorstTile { x, y, relative_mse });
                }
                all.absorb(tile);
            }
        }
        let (mean, reference_mean) = (all.mean(all.difference), all.mean(all.reference));
        Ok(Difference {
            mse: all.mean(all.squared),
            relative_mse: all.mean(all.relative),
            mean,
            relative_mean: if reference_mean == 0.0 { 0.0 } else { mean / reference_mean },
            worst,
            not_finite,
        })
    }
}

fn tile(picture: &Picture, reference: &Picture, (left, upper): (u32, u32), not_finite: &mut [u64; 2]) -> Sums {
    let mut sums = Sums::default();
    for y in upper..picture.height.min(upper + TILE) {
        for x in left..picture.width.min(left + TILE) {
            let pixel = y as usize * picture.width as usize + x as usize;
            for (value, expected) in picture.color[pixel].into_iter().zip(reference.color[pixel]) {
                not_finite[0] += u64::from(!value.is_finite());
                not_finite[1] += u64::from(!expected.is_finite());
                if value.is_finite() && expected.is_finite() {
                    sums.add(value, expected);
                }
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(width: u32, height: u32, value: f32) -> Picture {
        Picture::of_color(width, height, vec![[value; 3]; (width * height) as usize])
    }

    // Kills: errors relative to the picture, a mean without its sign, an average over pixels of sums over channels.
    #[test]
    fn constants_have_known_errors() {
        let difference = Difference::between(&flat(20, 3, 0.5), &flat(20, 3, 0.25)).unwrap();
        assert!((difference.mse - 0.0625).abs() < 1e-12);
        assert!((difference.relative_mse - 0.0625 / (0.0625 + 0.01)).abs() < 1e-12);
        assert!((difference.mean - 0.25).abs() < 1e-12 && (difference.relative_mean - 1.0).abs() < 1e-12);
        assert_eq!(difference.not_finite, [0, 0]);
        let same = Difference::between(&flat(20, 3, 0.5), &flat(20, 3, 0.5)).unwrap();
        assert_eq!((same.mse, same.relative_mse, same.mean), (0.0, 0.0, 0.0));
    }

    // Kills: a tile by its sum instead of its mean (partial tiles would never be worst), columns taken for rows.
    #[test]
    fn the_worst_tile_is_found_at_the_edge() {
        let (mut picture, reference) = (flat(40, 21, 1.0), flat(40, 21, 1.0));
        picture.color[20 * 40 + 39] = [3.0; 3];
        picture.color[0] = [4.0; 3];
        let worst = Difference::between(&picture, &reference).unwrap().worst.unwrap();
        assert_eq!((worst.x, worst.y), (32, 16));
        assert!((worst.relative_mse - 4.0 / 1.01 / 40.0).abs() < 1e-9, "{worst:?}");
    }

    // Kills: one NaN that makes every answer NaN, an infinity that is not counted, a division by zero values.
    #[test]
    fn values_that_are_not_finite_are_counted_apart() {
        let (mut picture, mut reference) = (flat(2, 1, 1.0), flat(2, 1, 1.0));
        picture.color[0] = [f32::NAN, f32::INFINITY, 2.0];
        reference.color[0][1] = f32::NEG_INFINITY;
        let difference = Difference::between(&picture, &reference).unwrap();
        assert_eq!(difference.not_finite, [2, 1]);
        assert!((difference.mse - 0.25).abs() < 1e-12);
        let nothing = Difference::between(&flat(2, 1, f32::NAN), &reference).unwrap();
        assert_eq!((nothing.mse, nothing.worst), (0.0, None));
    }

    // Kills: pictures of different sizes compared as far as they go.
    #[test]
    fn sizes_have_to_agree() {
        let text = Difference::between(&flat(2, 3, 0.0), &flat(3, 2, 0.0)).unwrap_err();
        assert_eq!(text, "2x3 pixels, where the reference has 3x2");
    }
}
