//! The schedule re-enacted on the CPU.
//!
//! Key decision: replay receives how long each walk is, and the policies' host faces, nothing that a device has seen or decided. It takes
//! the tick's decisions again, block by block, so a scheduler that does anything else than its policies say disagrees with it. Where an
//! order looks at results, replay is told what these said of each tile after each pass, which is the same under every schedule. What is
//! given up: executions whose order the hardware decides (the megakernel's lanes) have no steps to compare.
//!
//! **Invariant:** for every device-decided wavefront schedule, [`Replay`] equals the device's counters exactly.

mod lanes;
mod occupancy;
mod queue;

pub use occupancy::{Occupancy, WIDTHS};
use queue::Queue;
use std::collections::BTreeSet;

use crate::{
    Schedule,
    layout::BLOCK,
    policy::{TileGrid, WorkSource},
};

/// How many steps each walk takes.
///
/// **Shape:** `lengths(pass, tile)` fills one entry per place of the tile, 256 of them; 0 where the tile has no item, at least 1 elsewhere.
pub trait WalkLengths {
    /// Writes the lengths of one tile.
    fn of_tile(&self, pass_index: u32, tile: u32, lengths: &mut [u32; BLOCK as usize]);

    /// What an [order by results](crate::policy::OrderRule::Estimated) says of a tile after so many resolved passes. Replay computes no
    /// results, so it has to be told; the answer is the same under every schedule with that order. 0 where nobody knows.
    fn key_after(&self, _passes: u32, _tile: u32) -> u32 {
        0
    }
}

impl<F: Fn(u32, u32, &mut [u32; BLOCK as usize])> WalkLengths for F {
    fn of_tile(&self, pass_index: u32, tile: u32, lengths: &mut [u32; BLOCK as usize]) {
        self(pass_index, tile, lengths);
    }
}

/// A tile that was handed to a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Assignment {
    /// The step in which the tile begins.
    pub step: u32,
    /// Who receives it.
    pub block: u32,
    /// Which pass it belongs to.
    pub pass_index: u32,
    /// Which tile.
    pub tile: u32,
}

/// What a schedule does with a workload.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replay {
    /// Live blocks in each step.
    pub live_blocks: Vec<u32>,
    /// Work-groups that each stage is launched with in each step: live blocks, all of the current fill, or as many as the lists of packed
    /// lanes need.
    pub launched_blocks: Vec<u32>,
    /// Lanes alive at the beginning of each step.
    pub live_lanes: Vec<u32>,
    /// Tiles (or lanes that received an item) at each regeneration, in order.
    pub regenerations: Vec<u32>,
    /// Every assignment, in order; empty where lanes receive single items.
    pub assignments: Vec<Assignment>,
    /// Ticks after which a pass was resolved, by pass: the number of steps done by then.
    pub resolved_after: Vec<u32>,
    /// Useful and launched lane-steps.
    pub occupancy: Occupancy,
    /// Where lanes receive single items.
    lane_launches: Option<LaneLaunches>,
}

/// By step: the banks in which a kernel has something to do.
#[derive(Clone, Debug, Default, PartialEq)]
struct LaneLaunches {
    stage: Vec<u32>,
    generate: Vec<u32>,
    /// Launches of each step that lay out queues.
    queues: u32,
}

impl Replay {
    /// Steps in which a block was live.
    pub fn steps(&self) -> u64 {
        self.live_blocks.len() as u64
    }

    /// Sum of live blocks over the steps.
    pub fn block_steps(&self) -> u64 {
        self.live_blocks.iter().map(|blocks| u64::from(*blocks)).sum()
    }

    /// Dispatches with at least one group, of a program with so many stages in a pool of one bank, as [`Report::launches`](crate::Report)
    /// counts them.
    pub fn launches(&self, stages: usize) -> u64 {
        let ticks = 1 + self.steps();
        if self.lane_launches.is_some() {
            let of_steps: u64 = (0..self.live_blocks.len()).map(|step| u64::from(self.lane_launches_of(step, stages))).sum();
            return ticks + of_steps + self.resolved_after.len() as u64;
        }
        ticks + stages as u64 * self.steps() + (self.regenerations.len() + self.resolved_after.len()) as u64
    }

    /// Where lanes receive single items: launches of a step, ticks and resolves apart; else 0.
    pub fn lane_launches_of(&self, step: usize, stages: usize) -> u32 {
        let Some(launches) = &self.lane_launches else { return 0 };
        let of = |banks: &[u32]| banks.get(step).copied().unwrap_or(0);
        (stages as u32 + launches.queues) * of(&launches.stage) + of(&launches.generate)
    }

    /// The same for a pool in banks of `bank_blocks`, each of which takes launches of its own; `lengths` are those that were replayed. Where
    /// lanes receive single items, [`replay_in_banks`] has been told of the banks, and they are not asked for here.
    pub fn launches_in_banks(&self, stages: usize, bank_blocks: u32, lengths: &dyn WalkLengths) -> u64 {
        if self.lane_launches.is_some() {
            return self.launches(stages);
        }
        let bank_blocks = bank_blocks.max(1);
        let mut alive = vec![BTreeSet::new(); self.live_blocks.len()];
        let mut born = BTreeSet::new();
        let mut walks = [0; BLOCK as usize];
        for given in &self.assignments {
            lengths.of_tile(given.pass_index, given.tile, &mut walks);
            let (first, bank) = (given.step as usize - 1, given.block / bank_blocks);
            let steps = walks.iter().max().map_or(0, |longest| *longest as usize);
            alive.iter_mut().skip(first).take(steps).for_each(|banks| _ = banks.insert(bank));
            born.insert((given.step, bank));
        }
        let launched = |(step, banks): (usize, &BTreeSet<u32>)| match self.launched_blocks[step] {
            blocks if blocks > self.live_blocks[step] => u64::from(blocks.div_ceil(bank_blocks)),
            _ => banks.len() as u64,
        };
        let stage_launches: u64 = alive.iter().enumerate().map(launched).sum();
        1 + self.steps() + stages as u64 * stage_launches + (born.len() + self.resolved_after.len()) as u64
    }

    /// Sum over the steps of the work-groups that each stage was launched with.
    pub fn group_steps(&self) -> u64 {
        self.launched_blocks.iter().map(|blocks| u64::from(*blocks)).sum()
    }

    /// Sum over the steps of lanes alive when the step began.
    pub fn lane_steps(&self) -> u64 {
        self.live_lanes.iter().map(|lanes| u64::from(*lanes)).sum()
    }
}

/// One slot of the pool.
struct Block {
    pass_index: u32,
    tile: u32,
    /// The step the tile began in, from 1.
    birth: u32,
    items: u32,
    /// The key that was remembered of the tile when it began.
    remembered: u32,
    /// Live lanes summed over the steps so far, the coming one included.
    lane_steps: u32,
    /// Steps left per lane.
    left: [u32; BLOCK as usize],
}

/// Re-enacts `schedule` on `passes` passes of `source` with a pool of `pool_blocks` and results of `ring` passes in flight.
pub fn replay(schedule: &Schedule, source: &dyn WorkSource, passes: u32, pool_blocks: u32, ring: u32, lengths: &dyn WalkLengths) -> Replay {
    replay_in_banks(schedule, source, passes, [pool_blocks, pool_blocks], ring, lengths)
}

/// The same for a pool in banks of `bank_blocks`, where these matter: packed lanes have a list in each bank.
pub fn replay_in_banks(
    schedule: &Schedule,
    source: &dyn WorkSource,
    passes: u32,
    [pool_blocks, bank_blocks]: [u32; 2],
    ring: u32,
    lengths: &dyn WalkLengths,
) -> Replay {
    if schedule.grain().is_by_lane() {
        return lanes::replay_lanes(schedule, source, passes, [pool_blocks, bank_blocks], ring, lengths, None);
    }
    let mut state = State {
        pool: (0..pool_blocks.max(1)).map(|_| None).collect(),
        outstanding: vec![source.tiles(); ring.max(1) as usize],
        queue: Queue::new(schedule.order.rule(), TileGrid::of(source)),
        resolved: 0,
        step: 0,
        filled: 0,
    };
    let mut report = Replay::default();
    if source.tiles() > 0 {
        while state.resolved < passes {
            state.tick(schedule, source, passes, lengths, &mut report);
            state.walk(schedule, &mut report);
        }
    }
    report
}

/// What a lane walks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LaneItem {
    /// The pass of its item.
    pub pass_index: u32,
    /// The tile that the item stems from.
    pub tile: u32,
}

/// The same where lanes receive single items, and `observe` sees every step: for each place of the launched work-groups, block by block of the
/// pool, what is walked there. Packed lanes stand in the places of their list, bank by bank. Other grains are not observed.
pub fn watch_lanes(
    schedule: &Schedule,
    source: &dyn WorkSource,
    passes: u32,
    blocks: [u32; 2],
    ring: u32,
    lengths: &dyn WalkLengths,
    observe: &mut dyn FnMut(&[Option<LaneItem>]),
) -> Replay {
    if schedule.grain().is_by_lane() {
        return lanes::replay_lanes(schedule, source, passes, blocks, ring, lengths, Some(observe));
    }
    replay_in_banks(schedule, source, passes, blocks, ring, lengths)
}

struct State<'a> {
    pool: Vec<Option<Block>>,
    /// Tiles of the pass in each slot of the ring that have not been retired.
    outstanding: Vec<u32>,
    queue: Queue<'a>,
    resolved: u32,
    step: u32,
    /// Blocks of the current fill.
    filled: u32,
}

impl State<'_> {
    fn tick(&mut self, schedule: &Schedule, source: &dyn WorkSource, passes: u32, lengths: &dyn WalkLengths, report: &mut Replay) {
        let ring = self.outstanding.len() as u32;
        // What is resolved after this tick says nothing in it.
        let known = self.resolved;
        for slot in &mut self.pool {
            if let Some(block) = slot.take_if(|block| block.left.iter().all(|left| *left == 0)) {
                self.queue.tile_ended(&block, self.step);
                self.outstanding[(block.pass_index % ring) as usize] -= 1;
            } else if let Some(block) = slot {
                block.lane_steps += block.left.iter().filter(|left| **left > 0).count() as u32;
            }
        }
        let oldest = (self.resolved % ring) as usize;
        if self.resolved < passes && self.outstanding[oldest] == 0 {
            self.outstanding[oldest] = source.tiles();
            self.resolved += 1;
            report.resolved_after.push(self.step);
        }

        let live = self.pool.iter().flatten().count() as u32;
        if live == 0 {
            self.filled = 0;
        }
        let dead = self.pool.len() as u32 - live;
        let queued = self.queue.left(passes.min(self.resolved + ring));
        if dead == 0 || queued == 0 || (live > 0 && !schedule.regeneration.regenerate(live, dead, self.step)) {
            return;
        }
        let assigned = queued.min(u64::from(dead)) as u32;
        report.regenerations.push(assigned);
        let tiles = self.queue.take(assigned, self.pool.iter().flatten(), self.step, &|tile| lengths.key_after(known, tile));
        // The lowest dead blocks receive tiles, first those of the fill.
        self.filled = self.filled.max(live + assigned);
        let free = self.pool.iter_mut().enumerate().filter(|(_, slot)| slot.is_none());
        for ((block, slot), (pass_index, tile)) in free.zip(tiles) {
            let mut left = [0; BLOCK as usize];
            lengths.of_tile(pass_index, tile, &mut left);
            let items = left.iter().filter(|left| **left > 0).count() as u32;
            // The tick counts the coming step before it hands out tiles.
            let birth = self.step + 1;
            report.assignments.push(Assignment { step: birth, block: block as u32, pass_index, tile });
            let remembered = self.queue.remembered(tile);
            *slot = Some(Block { pass_index, tile, birth, items, remembered, lane_steps: items, left });
        }
    }

    /// One step of every live block.
    fn walk(&mut self, schedule: &Schedule, report: &mut Replay) {
        let live = self.pool.iter().flatten().count() as u32;
        if live == 0 {
            return;
        }
        self.step += 1;
        let mut lanes = 0;
        for block in self.pool.iter_mut().flatten() {
            lanes += report.occupancy.launch(&block.left);
            block.left.iter_mut().for_each(|left| *left = left.saturating_sub(1));
        }
        report.live_blocks.push(live);
        report.launched_blocks.push(schedule.launch.launched(live, self.filled));
        report.live_lanes.push(lanes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{policy::BlockInPlace, policy::LinearRange};

    /// The worked example of the paper: 8 blocks, 16 tiles, tiles die after the given steps.
    fn lengths_of(depth: &'static [u32]) -> impl Fn(u32, u32, &mut [u32; 256]) {
        move |_, tile, lengths| lengths.fill(depth[tile as usize])
    }

    /// Kills: a tile in two blocks, a dead block left idle though the queue holds tiles, an assignment out of block order.
    #[test]
    fn dead_blocks_take_the_next_tiles_in_block_order() {
        let schedule = Schedule::block().with_regeneration(BlockInPlace::new(0.0, 1));
        let source = LinearRange { count: 4 * 256 };
        let seen = replay(&schedule, &source, 1, 2, 2, &lengths_of(&[3, 1, 1, 2]));
        let order: Vec<_> = seen.assignments.iter().map(|a| (a.step, a.block, a.tile)).collect();
        assert_eq!(order, [(1, 0, 0), (1, 1, 1), (2, 1, 2), (3, 1, 3)]);
        assert_eq!(seen.live_blocks, [2, 2, 2, 1]);
        assert_eq!(seen.block_steps(), 7);
        assert_eq!(seen.lane_steps(), 7 * 256);
        assert_eq!(seen.resolved_after, [4]);
    }

    /// Kills: a pool without regeneration that takes tiles before it is empty.
    #[test]
    fn never_waits_for_the_last_walk() {
        let source = LinearRange { count: 4 * 256 };
        let seen = replay(&Schedule::never(), &source, 1, 2, 2, &lengths_of(&[3, 1, 1, 2]));
        assert_eq!(seen.live_blocks, [2, 1, 1, 2, 1]);
        assert_eq!(seen.regenerations, [2, 2]);
    }
}
