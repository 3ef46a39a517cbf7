//! From the state struct to planes: which 32-bit leaves exist, which of them need memory, where they lie.
//!
//! Key decision: planes are tiled by block. The word of leaf plane `p`, block `b`, lane `l` lies at `b * stride + p * 256 + l` with
//! `stride = planes * 256`: every load is coalesced, a block is one contiguous range, and growing a pool moves nothing.
//!
//! **Invariant:** a leaf that no kernel reads after another has written it has no plane.

mod cells;
mod decode;
mod leaves;
mod planes;
mod sharing;
mod table;

pub use cells::{Cell, Storage};
pub(crate) use cells::{Field, cells, fields, over_cells};
pub use leaves::{Leaf, Scalar};
pub(crate) use leaves::{MOST_LEAVES, flatten, leaf_count};
pub(crate) use planes::lay_out;
pub use planes::{ArrayPlanes, KernelTraffic, Layout};
pub use table::{Moves, Row};

/// Lanes in a block, items in a tile and invocations in a work-group.
pub const BLOCK: u32 = 256;
