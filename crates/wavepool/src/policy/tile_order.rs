//! In which order tiles leave the queue.
//!
//! Key decision: an order is a rule of one of three kinds. A formula follows from pass and position alone. A measured order gives each tile
//! a key from what the tile took in its latest pass, an estimated one from the results of its passes; the tick sorts by these keys, largest
//! first, ties by tile index.
//! With several passes of a tile in flight, what is remembered must not depend on which ends first: a tile is measured against what was
//! known when it began, and the latest pass counts.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, the depth-sorted queue.

use std::{fmt::Debug, sync::Arc};

use super::{Choice, TileError, TileGrid};

/// Largest key of a measured order; larger ones count as this.
pub const MAX_KEY: u32 = (1 << crate::control::KEY_BITS) - 1;

/// Decides in which order tiles leave the queue.
pub trait TileOrder: Debug + Send + Sync {
    /// One word, as in `--schedule`.
    fn name(&self) -> &str;

    /// The rule itself.
    fn rule(&self) -> OrderRule<'_>;
}

/// The library's orders, as `order=` names them.
pub const ORDERS: &[Choice<Arc<dyn TileOrder>>] = &[
    Choice { name: "scanline", about: "as the work source numbers the tiles", make: || Arc::new(Scanline) },
    Choice { name: "morton", about: "along a Z-shaped curve, so that tiles in flight lie close together", make: || Arc::new(Morton) },
    Choice {
        name: "hilbert",
        about: "along a curve without jumps, so that tiles in flight lie closer together still",
        make: || Arc::new(Hilbert),
    },
    Choice { name: "depth-max", about: "the tile with the longest walk of its latest pass first", make: || Arc::new(DepthMax) },
    Choice { name: "depth-mean", about: "the tile with the longest mean walk of its latest pass first", make: || Arc::new(DepthMean) },
    Choice { name: "depth-decayed", about: "as depth-max, averaged over passes", make: || Arc::new(DepthDecayed) },
    Choice { name: "error", about: "the tile whose results differ most between passes first", make: || Arc::new(TileError) },
];

/// The three kinds of order.
#[derive(Clone, Copy, Debug)]
pub enum OrderRule<'a> {
    /// From pass and position.
    Formula(&'a dyn TileFormula),
    /// From what the tiles took before.
    Measured(&'a dyn TileMeasure),
    /// From what came out of them.
    Estimated(&'a dyn TileEstimate),
}

impl OrderRule<'_> {
    /// Words that the device keeps of a tile among the counters: where tiles are sorted, an entry and a key to sort by; what an estimate
    /// remembers, too.
    pub(crate) fn words_per_tile(&self) -> u32 {
        match self {
            OrderRule::Formula(_) => 0,
            OrderRule::Measured(_) => 2,
            OrderRule::Estimated(_) => 4,
        }
    }
}

/// A permutation of the tiles, one per pass.
///
/// Must: visit every tile of a pass exactly once; give the same answer on both faces.
pub trait TileFormula: Debug + Send + Sync {
    /// WGSL that declares `fn wf_tile_at(pass_index: u32, position: u32) -> u32`; `wf_control.tiles` holds the number of tiles,
    /// `wf_control.work.z` that of their columns (0: no grid, the same as 1).
    fn wgsl(&self) -> String;

    /// The same on the host.
    fn tile_at(&self, pass_index: u32, position: u32, grid: TileGrid) -> u32;
}

/// A key per tile; the largest goes first.
///
/// Must: give the same answer on both faces; give at least 1. May: be called for tiles that still run, with what they took so far and
/// nothing remembered; such a tile counts with the larger of that and its remembered key. The first pass has no keys and follows the
/// numbers of the tiles.
pub trait TileMeasure: Debug + Send + Sync {
    /// False when the key never depends on `lane_steps`, which is then 0 on both faces: summing it costs a read and a write per block and
    /// tick.
    fn reads_lane_steps(&self) -> bool {
        true
    }

    /// WGSL that declares `fn wf_tile_key(remembered: u32, steps: u32, lane_steps: u32, items: u32) -> u32`: the key that the tile had
    /// when it began, 0 when it had none; steps of the tile; sum of its live lanes over them (and, while it runs, over the coming step);
    /// its items.
    fn wgsl(&self) -> String;

    /// The same on the host.
    fn key(&self, remembered: u32, steps: u32, lane_steps: u32, items: u32) -> u32;
}

/// A key per tile from the results of its resolved passes; the largest goes first. Before a tile's first pass is resolved its key is 0.
///
/// Key decision: there is no host face. Replay has no results; it is told the keys that a run with this order has
/// [kept](crate::Instruments::lengths), see [`WalkLengths::key_after`](crate::replay::WalkLengths::key_after).
pub trait TileEstimate: Debug + Send + Sync {
    /// WGSL that declares `fn wf_tile_estimate(memory: vec2u, sum: f32, passes: u32) -> vec3u`. It is called once per tile and pass, in the
    /// order of passes, with what it said last time (zeros at first), the sum over the tile's items of all their `f32` leaves as added
    /// to the film, and the number of passes with this one. It returns the new memory and the key.
    fn wgsl(&self) -> String;
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

    fn tile_at(&self, _pass_index: u32, position: u32, _grid: TileGrid) -> u32 {
        position
    }
}

/// Along the Z-shaped curve over the grid of tiles, so that tiles in flight together lie close together. Without a grid: scanline.
/// Source: Morton, *A computer oriented geodetic data base and a new technique in file sequencing*, 1966.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Morton;

impl TileOrder for Morton {
    fn name(&self) -> &str {
        "morton"
    }

    fn rule(&self) -> OrderRule<'_> {
        OrderRule::Formula(self)
    }
}

impl TileFormula for Morton {
    fn wgsl(&self) -> String {
        let quarter = "fn wf_quarter(turn: u32, quarter: u32) -> vec3u { return vec3u(quarter & 1u, quarter >> 1u, 0u); }\n";
        format!("{CURVE}{quarter}")
    }

    fn tile_at(&self, _pass_index: u32, position: u32, grid: TileGrid) -> u32 {
        tile_along(position, grid, |_, quarter| [quarter & 1, quarter >> 1, 0])
    }
}

/// Along a curve without jumps: on a square grid of a power of two every tile touches the one before. Without a grid: scanline.
/// Source: Hilbert, *Ueber die stetige Abbildung einer Linie auf ein Flaechenstueck*, 1891.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hilbert;

impl TileOrder for Hilbert {
    fn name(&self) -> &str {
        "hilbert"
    }

    fn rule(&self) -> OrderRule<'_> {
        OrderRule::Formula(self)
    }
}

/// A turn exchanges the coordinates (bit 0) and turns them by half a circle (bit 1): the first quarter exchanges, the last one does both.
impl TileFormula for Hilbert {
    fn wgsl(&self) -> String {
        let quarter = "fn wf_quarter(turn: u32, quarter: u32) -> vec3u {
    var at = vec2u(quarter >> 1u, ((quarter + 1u) >> 1u) & 1u);
    at = select(at, at.yx, (turn & 1u) > 0u) ^ vec2u(turn >> 1u);
    let turned = turn ^ select(select(0u, 3u, quarter == 3u), 1u, quarter == 0u);
    return vec3u(at, turned);
}
";
        format!("{CURVE}{quarter}")
    }

    fn tile_at(&self, _pass_index: u32, position: u32, grid: TileGrid) -> u32 {
        tile_along(position, grid, |turn, quarter| {
            let (x, y) = (quarter >> 1, (quarter + 1) >> 1 & 1);
            let (x, y) = if turn & 1 > 0 { (y, x) } else { (x, y) };
            let turned = [1, 0, 0, 3][quarter as usize];
            [x ^ turn >> 1, y ^ turn >> 1, turn ^ turned]
        })
    }
}

/// The device face of [`tile_along`]; asks for `fn wf_quarter(turn: u32, quarter: u32) -> vec3u`.
const CURVE: &str = include_str!("curve.wgsl");

/// The tile at a place along a curve that cuts squares in four: `quarter` of a turn and a number says where the quarter of that number
/// lies (x, y) and how the curve is turned within it.
fn tile_along(position: u32, grid: TileGrid, quarter: impl Fn(u32, u32) -> [u32; 3]) -> u32 {
    let (columns, rows) = (u64::from(grid.columns()), u64::from(grid.rows()));
    // Tiles of the square at a corner, in all rows but a shorter last one, and in that.
    let short = u64::from(grid.tiles()) % columns;
    let whole_rows = u64::from(grid.tiles()) / columns;
    let in_square = |[x, y]: [u64; 2], side: u64| {
        let wide = columns.saturating_sub(x).min(side) * whole_rows.saturating_sub(y).min(side);
        let rest = if (y..y + side).contains(&whole_rows) { short.saturating_sub(x).min(side) } else { 0 };
        wide + rest
    };
    let mut side = columns.max(rows).next_power_of_two();
    let (mut corner, mut turn) = ([0; 2], 0);
    let mut left = u64::from(position);
    while side > 1 {
        side /= 2;
        for number in 0..4 {
            let [x, y, turned] = quarter(turn, number);
            let at = [corner[0] + u64::from(x) * side, corner[1] + u64::from(y) * side];
            let tiles = in_square(at, side);
            if left < tiles {
                (corner, turn) = (at, turned);
                break;
            }
            left -= tiles;
        }
    }
    (corner[1] * columns + corner[0]) as u32
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
    fn reads_lane_steps(&self) -> bool {
        false
    }

    fn wgsl(&self) -> String {
        "fn wf_tile_key(remembered: u32, steps: u32, lane_steps: u32, items: u32) -> u32 { return steps; }\n".into()
    }

    fn key(&self, _remembered: u32, steps: u32, _lane_steps: u32, _items: u32) -> u32 {
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
        "fn wf_tile_key(remembered: u32, steps: u32, lane_steps: u32, items: u32) -> u32 { return lane_steps * 4u / items; }\n".into()
    }

    fn key(&self, _remembered: u32, _steps: u32, lane_steps: u32, items: u32) -> u32 {
        lane_steps.wrapping_mul(4) / items.max(1)
    }
}

/// Tiles with the longest walk first, averaged over passes: in quarters of a step, a new pass counts for a quarter and all earlier ones
/// for the rest. One lucky walk of one pass moves a tile less than under [`DepthMax`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DepthDecayed;

impl TileOrder for DepthDecayed {
    fn name(&self) -> &str {
        "depth-decayed"
    }

    fn rule(&self) -> OrderRule<'_> {
        OrderRule::Measured(self)
    }
}

impl TileMeasure for DepthDecayed {
    fn reads_lane_steps(&self) -> bool {
        false
    }

    fn wgsl(&self) -> String {
        format!(
            "fn wf_tile_key(remembered: u32, steps: u32, lane_steps: u32, items: u32) -> u32 {{\n    \
             let latest = min(steps, {MAX_KEY}u) * 4u;\n    \
             return select((remembered * 3u + latest + 2u) / 4u, latest, remembered == 0u);\n}}\n"
        )
    }

    fn key(&self, remembered: u32, steps: u32, _lane_steps: u32, _items: u32) -> u32 {
        let latest = steps.min(MAX_KEY) * 4;
        if remembered == 0 { latest } else { (remembered * 3 + latest + 2) / 4 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a curve that leaves a grid which is not a square of a power of two, that leaves out tiles of a shorter last row, or that is
    /// no curve at all.
    #[test]
    fn morton_visits_every_tile_of_any_grid_once() {
        for columns in 0..20 {
            for tiles in 1..120 {
                let grid = TileGrid::new(tiles, columns);
                let mut tiles_seen: Vec<u32> = (0..tiles).map(|position| Morton.tile_at(3, position, grid)).collect();
                // Two columns are visited in pairs, which is row by row.
                assert_eq!(tiles_seen.is_sorted(), grid.columns() <= 2 || grid.rows() == 1, "{grid:?}: {tiles_seen:?}");
                tiles_seen.sort_unstable();
                assert!(tiles_seen.into_iter().eq(0..tiles), "{grid:?}");
            }
        }
        let order =
            |tiles, columns| (0..tiles).map(|position| Morton.tile_at(0, position, TileGrid::new(tiles, columns))).collect::<Vec<_>>();
        assert_eq!(order(16, 4), [0, 1, 4, 5, 2, 3, 6, 7, 8, 9, 12, 13, 10, 11, 14, 15]);
        assert_eq!(order(11, 3), [0, 1, 3, 4, 2, 5, 6, 7, 9, 10, 8]);
        assert_eq!(order(5, 0), [0, 1, 2, 3, 4]);
        // The curve of a large grid ends in its last tile.
        let large = TileGrid::new(u32::MAX, 1 << 16);
        assert_eq!(Morton.tile_at(0, u32::MAX - 1, large), u32::MAX - 1);
    }

    /// Kills: a quarter in the wrong place or turned the wrong way, which leaves a jump; a tile left out where the grid is no square.
    #[test]
    fn hilbert_never_jumps() {
        for side in [2, 4, 16, 64] {
            let grid = TileGrid::new(side * side, side);
            let at = |position| Hilbert.tile_at(0, position, grid);
            let steps = (1..side * side).map(|position| [at(position - 1), at(position)].map(|tile| [tile % side, tile / side]));
            let jumps = steps.filter(|[[x, y], [to_x, to_y]]| x.abs_diff(*to_x) + y.abs_diff(*to_y) != 1);
            assert_eq!(jumps.count(), 0, "side {side}");
        }
        for (tiles, columns) in [(11, 3), (119, 17), (64, 0), (90, 40)] {
            let grid = TileGrid::new(tiles, columns);
            let mut seen: Vec<u32> = (0..tiles).map(|position| Hilbert.tile_at(0, position, grid)).collect();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..tiles), "{grid:?}");
        }
    }

    /// Kills: a first measurement averaged with nothing; a mean that never reaches what it is the mean of; a product that overflows.
    #[test]
    fn a_decayed_key_follows_the_steps() {
        assert_eq!(DepthDecayed.key(0, 10, 0, 0), 40);
        assert_eq!(DepthDecayed.key(40, 10, 0, 0), 40);
        assert_eq!(DepthDecayed.key(40, 30, 0, 0), 60);
        let settle = |from: u32| (0..40).fold(from, |key, _| DepthDecayed.key(key, 20, 0, 0));
        assert!(settle(1000).abs_diff(80) <= 2 && settle(4).abs_diff(80) <= 2);
        assert!(DepthDecayed.key(MAX_KEY, u32::MAX, 0, 0) >= MAX_KEY);
    }
}
