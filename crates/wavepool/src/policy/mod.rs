//! Policies: the decisions of the scheduler, as traits with two faces.
//!
//! Key decision: each policy has a device face, WGSL linked into the scheduler's kernels, and a host face, a pure function that takes
//! the same decision from the same numbers. Decisions
//! about blocks and tiles use integers and agree bit for bit; a chance of survival is a float, whose last bit WGSL leaves open.
//!
//! **Invariant:** no policy sees a device; what the library's own policies use is public.

mod choice;
mod chooser;
mod execution;
mod lane_compaction;
mod launch_scope;
mod regeneration;
mod roulette;
mod tile_error;
mod tile_order;
mod work_source;

pub use choice::Choice;
pub use chooser::{Chooser, Choosing};
pub use execution::Execution;
pub use lane_compaction::LaneCompaction;
pub use launch_scope::{LAUNCHES, LaunchScope};
pub use regeneration::{BlockInPlace, Grain, KeyedQueues, LaneInPlace, NeverRegenerate, Regeneration, StreamCompaction};
pub use roulette::{PerBlock, PerGroup, PerLane, ROULETTES, Roulette, RouletteScope, Statistic};
pub use tile_error::TileError;
pub use tile_order::{
    DepthDecayed, DepthMax, DepthMean, MAX_KEY, Morton, ORDERS, OrderRule, Scanline, TileEstimate, TileFormula, TileMeasure, TileOrder,
};
pub use work_source::{ImageTiles, LinearRange, TileGrid, WorkSource};
