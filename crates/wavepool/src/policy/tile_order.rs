//! In which order tiles leave the queue.
//!
//! Key decision: an order is a rule of one of two kinds. A formula follows from pass and position alone. A measured order gives each tile
//! a key from what the tile took in its latest pass; the tick sorts by these keys, largest first, ties by tile index.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, the depth-sorted queue.

use std::fmt::Debug;

/// Largest key of a measured order; larger ones count as this.
pub const MAX_KEY: u32 = (1 << crate::control::KEY_BITS) - 1;

/// Decides in which order tiles leave the queue.
pub trait TileOrder: Debug + Send + Sync {
    /// One word, as in `--schedule`.
    fn name(&self) -> &str;

    /// The rule itself.
    fn rule(&self) -> OrderRule<'_>;
}

/// The two kinds of order.
#[derive(Clone, Copy, Debug)]
pub enum OrderRule<'a> {
    /// From pass and position.
    Formula(&'a dyn TileFormula),
    /// From what the tiles took before.
    Measured(&'a dyn TileMeasure),
}

/// A permutation of the tiles, one per pass.
///
/// Must: visit every tile of a pass exactly once; give the same answer on both faces.
pub trait TileFormula: Debug + Send + Sync {
    /// WGSL that declares `fn wf_tile_at(pass_index: u32, position: u32) -> u32`; `wf_control.tiles` holds the number of tiles.
    fn wgsl(&self) -> String;

    /// The same on the host.
    fn tile_at(&self, pass_index: u32, position: u32, tiles: u32) -> u32;
}

/// A key per tile; the largest goes first.
///
/// Must: give the same answer on both faces. May: be called for tiles that still run, with what they took so far. The first pass has no
/// keys and follows the numbers of the tiles.
pub trait TileMeasure: Debug + Send + Sync {
    /// WGSL that declares `fn wf_tile_key(steps: u32, lane_steps: u32, items: u32) -> u32`: steps of the tile, sum of its live lanes over
    /// them (and, while it runs, over the coming step), its items.
    fn wgsl(&self) -> String;

    /// The same on the host.
    fn key(&self, steps: u32, lane_steps: u32, items: u32) -> u32;
}

/// As the work source numbers them: rows of an image from the top.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Scanline;

impl TileOrder for Scanline {
    fn name(&self) -> &str {
        "scanline"
    }

    fn rule(&self) -> OrderRule<'_> {
        OrderRule::Formula(self)
    }
}

impl TileFormula for Scanline {
    fn wgsl(&self) -> String {
        "fn wf_tile_at(pass_index: u32, position: u32) -> u32 { return position; }\n".into()
    }

    fn tile_at(&self, _pass_index: u32, position: u32, _tiles: u32) -> u32 {
        position
    }
}

/// Tiles with the longest walk first: long tiles start first and leave last, short ones fill the holes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DepthMax;

impl TileOrder for DepthMax {
    fn name(&self) -> &str {
        "depth-max"
    }

    fn rule(&self) -> OrderRule<'_> {
        OrderRule::Measured(self)
    }
}

impl TileMeasure for DepthMax {
    fn wgsl(&self) -> String {
        "fn wf_tile_key(steps: u32, lane_steps: u32, items: u32) -> u32 { return steps; }\n".into()
    }

    fn key(&self, steps: u32, _lane_steps: u32, _items: u32) -> u32 {
        steps
    }
}

/// Tiles with the longest mean walk first, in quarters of a step: less at the mercy of a single long walk than [`DepthMax`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DepthMean;

impl TileOrder for DepthMean {
    fn name(&self) -> &str {
        "depth-mean"
    }

    fn rule(&self) -> OrderRule<'_> {
        OrderRule::Measured(self)
    }
}

impl TileMeasure for DepthMean {
    fn wgsl(&self) -> String {
        "fn wf_tile_key(steps: u32, lane_steps: u32, items: u32) -> u32 { return lane_steps * 4u / items; }\n".into()
    }

    fn key(&self, _steps: u32, lane_steps: u32, items: u32) -> u32 {
        lane_steps.wrapping_mul(4) / items.max(1)
    }
}
