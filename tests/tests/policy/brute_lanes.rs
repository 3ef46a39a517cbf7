//! Items handed to lanes, re-enacted a second time, as slowly and plainly as possible.
//!
//! Key decision: as for tiles, nothing is counted down. Kept are the places of the queue that have been given away, each with its lane, the
//! step it begins in and the length of its walk (0 where the place has no item), and the steps before which a list was made. Who lives, who
//! sits where and which blocks run is read from these anew, for every step, at the end.

use wavepool::replay::WIDTHS;
use wavepool_tests::workloads::{Order, Portion, Workload};

use crate::brute_force::along_the_curve;

/// A place of the queue that has been given away.
struct Given {
    lane: usize,
    birth: u32,
    pass_index: u32,
    length: u32,
}

impl Given {
    fn lives_in(&self, step: u32) -> bool {
        self.birth <= step && step - self.birth < self.length
    }
}

/// What can be compared with a replay.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Found {
    pub(crate) live_blocks: Vec<u32>,
    pub(crate) launched_blocks: Vec<u32>,
    pub(crate) live_lanes: Vec<u32>,
    pub(crate) regenerations: Vec<u32>,
    pub(crate) resolved_after: Vec<u32>,
    pub(crate) useful: u64,
    pub(crate) launched: [u64; 3],
}

/// Re-enacts a workload in a pool with banks of `bank_blocks`.
pub(crate) fn brute_lanes(workload: &Workload, portion: Portion, bank_blocks: u32) -> Found {
    let lanes = workload.pool as usize * 256;
    let order: Vec<u32> = if workload.order == Order::Morton { along_the_curve(workload) } else { (0..workload.tiles()).collect() };
    let mut queue: Vec<(u32, u32)> = Vec::new();
    for pass_index in 0..workload.passes {
        for tile in &order {
            queue.extend(workload.lengths(pass_index, *tile).iter().map(|length| (pass_index, *length)));
        }
    }
    let mut given: Vec<Given> = Vec::new();
    // (step it holds from, its length)
    let mut lists: Vec<(u32, Vec<usize>)> = Vec::new();
    let mut found = Found::default();
    let mut done = 0;
    let per_pass = workload.tiles() as usize * 256;
    while found.resolved_after.len() < workload.passes as usize {
        let oldest = found.resolved_after.len() as u32;
        // A pass is complete when all its items have ended; places without an item may still wait in the queue.
        let items = queue.iter().filter(|(pass_index, length)| *pass_index == oldest && *length > 0).count();
        let ended = given.iter().filter(|item| item.pass_index == oldest && item.length > 0 && !item.lives_in(done + 1)).count();
        if ended == items {
            found.resolved_after.push(done);
        }
        let horizon = workload.passes.min(found.resolved_after.len() as u32 + workload.ring) as usize;
        let mut is_living = vec![false; lanes];
        given.iter().filter(|item| item.lives_in(done + 1)).for_each(|item| is_living[item.lane] = true);
        let live = is_living.iter().filter(|lives| **lives).count();
        let waiting = &queue[given.len()..horizon * per_pass];
        let is_asked = live == 0 || done.checked_rem(portion.every()) == Some(0);
        let free: Vec<usize> = (0..lanes).filter(|lane| !is_living[*lane]).collect();
        let receivers: Vec<usize> = if is_asked { free.into_iter().take(waiting.len()).collect() } else { Vec::new() };
        if !receivers.is_empty() {
            found.regenerations.push(receivers.len() as u32);
        }
        let is_stale = lists.last().is_some_and(|(_, list)| list.len() > live);
        if !receivers.is_empty() || live == 0 || (is_asked && is_stale) {
            let mut list = Vec::new();
            for bank in 0..workload.pool.div_ceil(bank_blocks) {
                let of_bank = |lane: &usize| (*lane / 256) as u32 / bank_blocks == bank;
                list.extend((0..lanes).filter(|lane| is_living[*lane]).filter(of_bank));
                list.extend(receivers.iter().copied().filter(of_bank));
            }
            lists.push((done + 1, list));
        }
        let waiting = waiting.to_vec();
        for (lane, (pass_index, length)) in receivers.into_iter().zip(waiting) {
            given.push(Given { lane, birth: done + 1, pass_index, length });
        }
        if given.iter().any(|item| item.birth == done + 1 || item.lives_in(done + 1)) {
            done += 1;
        }
    }
    integrate(workload, portion, bank_blocks, &given, &lists, done, &mut found);
    found
}

/// The figures of every step.
fn integrate(
    workload: &Workload,
    portion: Portion,
    bank_blocks: u32,
    given: &[Given],
    lists: &[(u32, Vec<usize>)],
    steps: u32,
    found: &mut Found,
) {
    let mut fill = 0;
    for step in 1..=steps {
        let mut is_living = vec![false; workload.pool as usize * 256];
        let mut runs = vec![false; workload.pool as usize];
        let mut is_new_fill = true;
        for item in given.iter().filter(|item| item.birth == step || item.lives_in(step)) {
            runs[item.lane / 256] = true;
            is_living[item.lane] |= item.length > 0;
            is_new_fill &= item.birth == step;
        }
        let running: Vec<usize> = (0..runs.len()).filter(|block| runs[*block]).collect();
        fill = running.last().map_or(0, |last| last + 1).max(if is_new_fill { 0 } else { fill });
        let live = is_living.iter().filter(|lives| **lives).count();
        found.live_blocks.push(running.len() as u32);
        found.live_lanes.push(live as u32);
        found.useful += live as u64;
        let in_banks: Vec<Vec<usize>> = match portion {
            Portion::Lanes(_) => running.iter().map(|block| (block * 256..(block + 1) * 256).collect()).collect(),
            Portion::Packed(_) => {
                let (_, list) = lists.iter().rfind(|(from, _)| *from <= step).expect("a list holds");
                let banks = workload.pool.div_ceil(bank_blocks);
                let of = |bank: u32| list.iter().copied().filter(|lane| (*lane / 256) as u32 / bank_blocks == bank).collect();
                (0..banks).map(of).collect()
            }
        };
        found.launched_blocks.push(match portion {
            Portion::Lanes(_) if workload.is_full() => fill as u32,
            Portion::Lanes(_) => running.len() as u32,
            Portion::Packed(_) => in_banks.iter().map(|list| list.len().div_ceil(256) as u32).sum(),
        });
        for (width, launched) in WIDTHS.iter().zip(&mut found.launched) {
            let groups = in_banks.iter().flat_map(|list| list.chunks(*width as usize));
            *launched += groups.filter(|seats| seats.iter().any(|lane| is_living[*lane])).count() as u64 * u64::from(*width);
        }
    }
}
