//! Tiles whose results differ most between passes go first.
//!
//! Key decision: of a tile, only the sum over its items is followed. Items draw independent numbers, so the variance of the sum over
//! passes is the sum of the variances of its items, and two words per tile replace a plane per result. All tiles have had the same number
//! of passes, so the sum of squared deviations orders them as the variance of their mean does.
//!
//! The key is exponent and two bits of the mantissa: tiles whose variances differ by less than a fifth may change places.
//! Source: B. P. Welford, *Note on a method for calculating corrected sums of squares and products*, 1962.

use super::{OrderRule, TileEstimate, TileOrder};

/// The tile with the largest error first: with the largest variance, between passes, of the sum of its results. The first two passes of a run
/// have seen no difference and follow the numbers of the tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileError;

impl TileOrder for TileError {
    fn name(&self) -> &str {
        "error"
    }

    fn rule(&self) -> OrderRule<'_> {
        OrderRule::Estimated(self)
    }
}

impl TileEstimate for TileError {
    fn wgsl(&self) -> String {
        include_str!("tile_error.wgsl").into()
    }
}
