//! A schedule re-enacted a second time, as slowly and plainly as possible.
//!
//! Key decision: nothing is counted down. Only the list of tiles that have begun is kept, each with the step it begins in and the lengths
//! of its walks; whatever is asked (who lives, who has ended, what a tile is worth) is read from that list anew each time. The per-step
//! figures are not gathered on the way, they are integrated over the list at the end. No function of the replay and no host face of a
//! policy is used; thresholds and orders are written out again from their description.

use wavepool::replay::{Assignment, Occupancy, Replay};

use wavepool_tests::workloads::{Order, Workload};

/// A tile that has begun: its walks live from step `birth` on.
struct Begun {
    birth: u32,
    block: u32,
    pass_index: u32,
    tile: u32,
    lengths: Vec<u32>,
    /// Steps of the longest walk.
    longest: u32,
    /// The key remembered of the tile when it began.
    remembered: u32,
}

impl Begun {
    /// True when no walk is left after `done` steps.
    fn has_ended(&self, done: u32) -> bool {
        self.birth + self.longest <= done + 1
    }

    /// Lanes that live in a step.
    fn lanes_in(&self, step: u32) -> u32 {
        self.lengths.iter().filter(|length| step >= self.birth && step - self.birth < **length).count() as u32
    }

    /// What the tile is worth once it has taken `steps` steps, `lane_steps` by its lanes.
    fn worth(&self, order: Order, remembered: u32, steps: u32, lane_steps: u32) -> u32 {
        let items = self.lengths.iter().filter(|length| **length != 0).count() as u32;
        let worth = match order {
            Order::Scanline | Order::Morton => 0.0,
            Order::DepthMax => f64::from(steps),
            Order::DepthMean => (f64::from(lane_steps) / f64::from(items) * 4.0).floor(),
            Order::DepthDecayed if remembered == 0 => f64::from(steps) * 4.0,
            Order::DepthDecayed => (f64::from(remembered) * 0.75 + f64::from(steps.min(1023)) + 0.5).floor(),
        };
        worth.min(1023.0) as u32
    }

    /// What it is worth when it ends.
    fn final_worth(&self, order: Order) -> u32 {
        self.worth(order, self.remembered, self.longest, self.lengths.iter().sum())
    }

    /// What it is worth while it runs, after `done` steps; the coming step counts for the lanes.
    fn worth_so_far(&self, order: Order, done: u32) -> u32 {
        let age = done + 1 - self.birth;
        self.worth(order, 0, age, self.lengths.iter().map(|length| *length.min(&(age + 1))).sum())
    }
}

/// What is remembered of a tile after `done` steps: the latest of its passes that have ended.
fn remembered(begun: &[Begun], order: Order, tile: u32, done: u32) -> u32 {
    let ended = begun.iter().filter(|other| other.tile == tile && other.has_ended(done));
    ended.max_by_key(|other| other.pass_index).map_or(0, |latest| latest.final_worth(order))
}

/// The order of a pass that is fixed after `done` steps, by comparing every tile with every other.
fn measured(begun: &[Begun], workload: &Workload, done: u32) -> Vec<u32> {
    let order = workload.order;
    let worths: Vec<u32> = (0..workload.tiles())
        .map(|tile| {
            let running = begun.iter().filter(|other| other.tile == tile && !other.has_ended(done));
            let most = running.map(|other| other.worth_so_far(order, done)).max().unwrap_or(0);
            most.max(remembered(begun, order, tile, done))
        })
        .collect();
    let place = |tile: usize| {
        let before = |other: &usize| worths[*other] > worths[tile] || (worths[*other] == worths[tile] && *other < tile);
        (0..worths.len()).filter(before).count()
    };
    (0..worths.len()).map(|position| (0..worths.len()).find(|tile| place(*tile) == position).expect("places differ") as u32).collect()
}

/// All tiles by the interleaved bits of row and column.
pub(crate) fn along_the_curve(workload: &Workload) -> Vec<u32> {
    let code = |tile: u32| {
        let (x, y) = (u64::from(tile % workload.columns), u64::from(tile / workload.columns));
        (0..32).map(|bit| (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1)).sum::<u64>()
    };
    let mut tiles: Vec<u32> = (0..workload.tiles()).collect();
    tiles.sort_by_key(|tile| code(*tile));
    tiles
}

/// Does the dead wait long enough? Asked only when somebody lives.
fn pays(workload: &Workload, live: u32, dead: u32, done: u32) -> bool {
    let Some((threshold, check_every)) = workload.block else { return false };
    // Both sides are whole numbers of 256ths, and far below 2^53.
    done.checked_rem(check_every) == Some(0) && f64::from(dead) / f64::from(threshold) > f64::from(live)
}

/// Re-enacts a workload.
pub(crate) fn brute_force(workload: &Workload) -> Replay {
    let tiles = workload.tiles();
    let mut begun: Vec<Begun> = Vec::new();
    let mut queue: Vec<(u32, u32)> = Vec::new();
    let mut open = 0;
    let mut report = Replay::default();
    let mut done = 0;
    // The order of the next pass to be opened.
    let first: Vec<u32> = (0..tiles).collect();
    let mut next_order = if workload.order == Order::Morton { along_the_curve(workload) } else { first };
    while report.resolved_after.len() < workload.passes as usize {
        // Resolve one pass, if it is complete.
        let oldest = report.resolved_after.len() as u32;
        if begun.iter().filter(|tile| tile.pass_index == oldest && tile.has_ended(done)).count() as u32 == tiles {
            report.resolved_after.push(done);
        }
        let horizon = workload.passes.min(report.resolved_after.len() as u32 + workload.ring);
        let living: Vec<u32> = begun.iter().filter(|tile| !tile.has_ended(done)).map(|tile| tile.block).collect();
        let free: Vec<u32> = (0..workload.pool).filter(|block| !living.contains(block)).collect();
        let waiting = queue.len() as u32 + (horizon - open) * tiles;
        let (live, dead) = (living.len() as u32, free.len() as u32);
        if dead > 0 && waiting > 0 && (live == 0 || pays(workload, live, dead, done)) {
            let mut given = Vec::new();
            let mut fixed = None;
            for block in free.iter().take(waiting as usize) {
                if queue.is_empty() {
                    queue = next_order.iter().map(|tile| (open, *tile)).collect();
                    open += 1;
                }
                given.push((*block, queue.remove(0)));
                if queue.is_empty() && workload.order.is_measured() {
                    // The queue of a pass runs dry: the order of the next is fixed, from what was known before this tick gave anything.
                    next_order = fixed.get_or_insert_with(|| measured(&begun, workload, done)).clone();
                }
            }
            report.regenerations.push(given.len() as u32);
            for (block, (pass_index, tile)) in given {
                let remembered = remembered(&begun, workload.order, tile, done);
                let lengths = workload.lengths(pass_index, tile).to_vec();
                report.assignments.push(Assignment { step: done + 1, block, pass_index, tile });
                let longest = lengths.iter().copied().max().expect("a tile has 256 places");
                begun.push(Begun { birth: done + 1, block, pass_index, tile, lengths, longest, remembered });
            }
        }
        if begun.iter().any(|tile| !tile.has_ended(done)) {
            done += 1;
        }
    }
    integrate(&begun, done, workload.is_full(), &mut report);
    report
}

/// The last block that has held a tile since the pool was empty.
fn last_of_fill(begun: &[Begun], step: u32) -> u32 {
    let opens =
        |tile: &&Begun| tile.birth <= step && begun.iter().all(|other| other.birth >= tile.birth || other.has_ended(tile.birth - 1));
    let opened = begun.iter().filter(opens).map(|tile| tile.birth).max().expect("somebody lives");
    begun.iter().filter(|tile| (opened..=step).contains(&tile.birth)).map(|tile| tile.block).max().expect("the same")
}

/// The figures of every step, tile by tile and lane by lane.
fn integrate(begun: &[Begun], steps: u32, is_full: bool, report: &mut Replay) {
    for step in 1..=steps {
        let live: Vec<_> = begun.iter().filter(|tile| tile.birth <= step && !tile.has_ended(step - 1)).collect();
        report.live_blocks.push(live.len() as u32);
        report.launched_blocks.push(if is_full { last_of_fill(begun, step) + 1 } else { live.len() as u32 });
        report.live_lanes.push(live.iter().map(|tile| tile.lanes_in(step)).sum());
    }
    // A subgroup runs as long as its longest walk.
    let launched = |width: usize| {
        let of_tile =
            |tile: &Begun| tile.lengths.chunks(width).map(|lanes| *lanes.iter().max().expect("lanes") as usize * width).sum::<usize>();
        begun.iter().map(of_tile).sum::<usize>() as u64
    };
    let useful = begun.iter().flat_map(|tile| &tile.lengths).map(|length| u64::from(*length)).sum();
    // Packed, a block needs as many subgroups as its lanes fill.
    let packed = |width: u32| {
        let of_step = |tile: &Begun, step: u32| u64::from(tile.lanes_in(step).div_ceil(width) * width);
        begun.iter().map(|tile| (tile.birth..tile.birth + tile.longest).map(|step| of_step(tile, step)).sum::<u64>()).sum()
    };
    let launched_local = [packed(8), packed(32), packed(64)];
    report.occupancy = Occupancy { useful, launched: [launched(8), launched(32), launched(64)], launched_local };
}
