//! When the dead receive new work, and in which portions.
//!
//! Key decision: the tick asks one yes-or-no question per step; which block gets which tile, and which lane which item, is never a policy's
//! business, it follows from the order of the blocks and of the lanes in them. The tick asks only when the queue holds work and somebody is
//! dead, or when lanes could be packed. What a policy also says, once, is its [`Grain`]: whole tiles, or single items.
//! Sources: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, the threshold rule; Novak, Havran and Dachsbacher, *Path
//! regeneration for interactive path tracing*, 2010, lanes in place; van Antwerpen, *Improving SIMD efficiency for parallel Monte Carlo
//! light transport on the GPU*, 2011, stream compaction.

use std::fmt::Debug;

/// In which portions work is handed out, and over what the stages are launched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Grain {
    /// A tile to a block whose lanes are all dead; the block's number says which item a lane has.
    #[default]
    Tiles,
    /// An item to any dead lane, in place. A lane keeps the number of its item as state: 8 bytes.
    Lanes,
    /// The same, and the stages are launched over a list of the live lanes, without gaps when it has just been made. The state stays where
    /// it is and is reached through the list: 4 bytes more per lane. The list is made anew whenever the policy says yes.
    PackedLanes,
    /// The same, and after the first stage of a step the lanes that go on are listed once more, ordered by what `queue_key` says of them: later
    /// stages find lanes of one kind side by side. 8 bytes more per lane.
    KeyedLanes,
}

impl Grain {
    /// True when lanes of one block may walk items of several tiles.
    pub fn is_by_lane(self) -> bool {
        self != Grain::Tiles
    }

    /// True when stages are launched over lists of lanes.
    pub fn is_packed(self) -> bool {
        matches!(self, Grain::PackedLanes | Grain::KeyedLanes)
    }

    /// What is counted as live and dead.
    pub fn unit(self) -> &'static str {
        if self.is_by_lane() { "lanes" } else { "blocks" }
    }
}

/// Decides in which steps the dead receive new work.
///
/// Must: give the same answer on both faces; use nothing but the arguments. May: answer yes at any time. Unspecified: how many steps pass
/// between two questions. When nobody lives nobody is asked: work is handed out.
pub trait Regeneration: Debug + Send + Sync {
    /// One word, as in `--schedule`.
    fn name(&self) -> &str;

    /// The name with its settings, as in `--schedule`.
    fn spec(&self) -> String {
        self.name().to_owned()
    }

    /// What is handed out to whom.
    fn grain(&self) -> Grain {
        Grain::Tiles
    }

    /// WGSL that declares `fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool`: blocks that live, blocks that do not (lanes, when the
    /// grain is finer than tiles: up to 2^27 of them), steps done so far.
    fn wgsl(&self) -> String;

    /// The same decision on the host.
    fn regenerate(&self, live: u32, dead: u32, step: u32) -> bool;
}

/// A new pass begins only when the pool has run empty; live blocks alone are launched meanwhile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NeverRegenerate;

impl Regeneration for NeverRegenerate {
    fn name(&self) -> &str {
        "never"
    }

    fn wgsl(&self) -> String {
        "fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool { return live == 0u; }\n".into()
    }

    fn regenerate(&self, live: u32, _dead: u32, _step: u32) -> bool {
        live == 0
    }
}

/// Block-in-place: dead blocks take the next tiles when enough of them wait, asked every few steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockInPlace {
    threshold_256: u32,
    check_every: u32,
}

impl BlockInPlace {
    /// Regenerates when dead blocks exceed `threshold` times the live ones (0 to 15, rounded to 1/256), asked in every
    /// `check_every`-th step (at least 1). Values beyond these bounds are refused by [`Schedule`](crate::Schedule) parsing and
    /// brought to the nearest bound here.
    pub fn new(threshold: f32, check_every: u32) -> Self {
        let threshold = if threshold.is_finite() { threshold.clamp(0.0, 15.0) } else { 15.0 };
        BlockInPlace { threshold_256: (threshold * 256.0).round() as u32, check_every: check_every.max(1) }
    }

    /// Dead blocks per live block that must wait.
    pub fn threshold(&self) -> f32 {
        self.threshold_256 as f32 / 256.0
    }

    /// Steps between two questions.
    pub fn check_every(&self) -> u32 {
        self.check_every
    }
}

impl Default for BlockInPlace {
    /// Half of the live blocks, every second step: the paper's values.
    fn default() -> Self {
        BlockInPlace::new(0.5, 2)
    }
}

impl Regeneration for BlockInPlace {
    fn name(&self) -> &str {
        "block"
    }

    fn spec(&self) -> String {
        format!("block,threshold={},check_every={}", self.threshold(), self.check_every)
    }

    fn wgsl(&self) -> String {
        format!(
            "fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool {{\n    \
             return live == 0u || (step % {}u == 0u && dead * 256u > live * {}u);\n}}\n",
            self.check_every, self.threshold_256
        )
    }

    fn regenerate(&self, live: u32, dead: u32, step: u32) -> bool {
        live == 0 || (step.is_multiple_of(self.check_every) && dead.wrapping_mul(256) > live.wrapping_mul(self.threshold_256))
    }
}

/// A dead lane takes the next item at once, where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaneInPlace {
    check_every: u32,
}

impl LaneInPlace {
    /// Hands out items in every `check_every`-th step (at least 1).
    pub fn new(check_every: u32) -> Self {
        LaneInPlace { check_every: check_every.max(1) }
    }
}

impl Default for LaneInPlace {
    /// In every step.
    fn default() -> Self {
        LaneInPlace::new(1)
    }
}

impl Regeneration for LaneInPlace {
    fn name(&self) -> &str {
        "per-lane"
    }

    fn spec(&self) -> String {
        format!("per-lane,check_every={}", self.check_every)
    }

    fn grain(&self) -> Grain {
        Grain::Lanes
    }

    fn wgsl(&self) -> String {
        every_wgsl(self.check_every)
    }

    fn regenerate(&self, live: u32, _dead: u32, step: u32) -> bool {
        live == 0 || step.is_multiple_of(self.check_every)
    }
}

/// Live lanes are listed without gaps every few steps, and new items begin behind them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamCompaction {
    every: u32,
}

impl StreamCompaction {
    /// Compacts in every `every`-th step (at least 1).
    pub fn new(every: u32) -> Self {
        StreamCompaction { every: every.max(1) }
    }
}

impl Default for StreamCompaction {
    /// In every fourth step: the more frequent of the two that van Antwerpen reports.
    fn default() -> Self {
        StreamCompaction::new(4)
    }
}

impl Regeneration for StreamCompaction {
    fn name(&self) -> &str {
        "compaction"
    }

    fn spec(&self) -> String {
        format!("compaction,every={}", self.every)
    }

    fn grain(&self) -> Grain {
        Grain::PackedLanes
    }

    fn wgsl(&self) -> String {
        every_wgsl(self.every)
    }

    fn regenerate(&self, live: u32, _dead: u32, step: u32) -> bool {
        live == 0 || step.is_multiple_of(self.every)
    }
}

/// Queues by kind: dead lanes take the next items and live ones are listed anew in every step, and after the first stage the list is ordered
/// by the program's `queue_key`. Source: Laine, Karras and Aila, *Megakernels considered harmful: wavefront path tracing on GPUs*, 2013, whose
/// queues are one per material. Which lane of a kind comes first is the hardware's choice, and shows nowhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeyedQueues;

impl Regeneration for KeyedQueues {
    fn name(&self) -> &str {
        "keyed"
    }

    fn grain(&self) -> Grain {
        Grain::KeyedLanes
    }

    fn wgsl(&self) -> String {
        every_wgsl(1)
    }

    fn regenerate(&self, _live: u32, _dead: u32, _step: u32) -> bool {
        true
    }
}

fn every_wgsl(steps: u32) -> String {
    format!("fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool {{ return live == 0u || step % {steps}u == 0u; }}\n")
}
