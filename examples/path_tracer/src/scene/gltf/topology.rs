//! From glTF's primitive modes to separate triangles.
//!
//! Key decision: winding is settled here, so that every later step sees counter-clockwise triangles only.

use crate::error::Fault;

/// The modes that make triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Triangles,
    Strip,
    Fan,
}

impl Mode {
    /// `None` for points and lines.
    pub(super) fn of(code: u32) -> Result<Option<Mode>, Fault> {
        match code {
            0..=3 => Ok(None),
            4 => Ok(Some(Mode::Triangles)),
            5 => Ok(Some(Mode::Strip)),
            6 => Ok(Some(Mode::Fan)),
            _ => Err(Fault::invalid("mode", format_args!("{code} is unknown"))),
        }
    }

    pub(super) fn n_triangles(self, n_indices: usize) -> usize {
        match self {
            Mode::Triangles => n_indices / 3,
            Mode::Strip | Mode::Fan => n_indices.saturating_sub(2),
        }
    }

    /// Indices at the end that make no triangle.
    pub(super) fn n_left_over(self, n_indices: usize) -> usize {
        match self {
            Mode::Triangles => n_indices % 3,
            Mode::Strip | Mode::Fan => 0,
        }
    }

    pub(super) fn triangles(self, indices: &[u32]) -> Vec<[u32; 3]> {
        match self {
            Mode::Triangles => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            // Every second triangle of a strip runs the other way round.
            Mode::Strip => {
                let turn = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] };
                indices.windows(3).enumerate().map(turn).collect()
            }
            Mode::Fan => indices.windows(2).skip(1).map(|pair| [pair[0], pair[1], indices[0]]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a strip that does not turn its odd triangles, and a fan around the wrong vertex.
    #[test]
    fn all_modes_wind_the_same_way() {
        assert_eq!(Mode::Triangles.triangles(&[0, 1, 2, 3, 4, 5, 6]), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(Mode::Strip.triangles(&[0, 1, 2, 3]), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(Mode::Fan.triangles(&[0, 1, 2, 3]), [[1, 2, 0], [2, 3, 0]]);
    }

    // Kills: a subtraction below zero for lists that are too short, and a count that differs from the list.
    #[test]
    fn short_lists_make_no_triangles() {
        for mode in [Mode::Triangles, Mode::Strip, Mode::Fan] {
            for n in 0..9 {
                let indices: Vec<u32> = (0..n).collect();
                assert_eq!(mode.triangles(&indices).len(), mode.n_triangles(indices.len()), "{mode:?} {n}");
            }
        }
    }
}
