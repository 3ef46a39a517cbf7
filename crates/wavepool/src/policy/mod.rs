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
// Whole, so that a new policy is told in the file that lists it and nowhere else.
pub use regeneration::*;
pub use roulette::*;
pub use tile_error::TileError;
pub use tile_order::*;
pub use work_source::{ImageTiles, LinearRange, TileGrid, WorkSource};
