//! The schedule re-enacted where lanes receive items one by one, in place or packed.
//!
//! Key decision: lanes are numbered through the pool; what the tick finds by prefix sums over blocks, and `generate` by those over lanes,
//! is one walk over all lanes in order here.

use super::{LaneItem, LaneLaunches, Replay, WalkLengths};
use crate::{
    Schedule,
    layout::BLOCK,
    policy::{Grain, OrderRule, TileGrid, WorkSource},
};

/// Sees what is walked at each place of a step.
pub(super) type Observe<'a> = dyn FnMut(&[Option<LaneItem>]) + 'a;

/// As [`replay`](super::replay), for a grain finer than tiles.
pub(super) fn replay_lanes(
    schedule: &Schedule,
    source: &dyn WorkSource,
    passes: u32,
    [pool_blocks, bank_blocks]: [u32; 2],
    ring: u32,
    lengths: &dyn WalkLengths,
    mut observe: Option<&mut Observe<'_>>,
) -> Replay {
    let lanes = pool_blocks.max(1) as usize * BLOCK as usize;
    let in_bank = bank_blocks.max(1) as usize * BLOCK as usize;
    let mut state = State {
        schedule,
        source,
        passes,
        lengths,
        grid: TileGrid::of(source),
        lanes: vec![Lane::default(); lanes],
        in_bank,
        lists: vec![Vec::new(); lanes.div_ceil(in_bank)],
        outstanding: vec![u64::from(source.items()); ring.max(1) as usize],
        next: 0,
        resolved: 0,
        step: 0,
        filled: 0,
        running: Vec::new(),
        visited_banks: 0,
        latest_tile: None,
    };
    let queues = if schedule.grain() == Grain::KeyedLanes { 2 } else { 0 };
    let mut report = Replay { lane_launches: Some(LaneLaunches { queues, ..LaneLaunches::default() }), ..Replay::default() };
    if source.tiles() > 0 {
        while state.resolved < passes {
            state.tick(&mut report);
            if let Some(observe) = observe.as_mut().filter(|_| !state.running.is_empty()) {
                observe(&state.places());
            }
            state.walk(&mut report);
        }
    }
    report
}

#[derive(Clone, Copy, Default)]
struct Lane {
    pass_index: u32,
    tile: u32,
    /// Steps left; 0: dead.
    left: u32,
}

struct State<'a> {
    schedule: &'a Schedule,
    source: &'a dyn WorkSource,
    passes: u32,
    lengths: &'a dyn WalkLengths,
    grid: TileGrid,
    lanes: Vec<Lane>,
    /// Lanes in a bank.
    in_bank: usize,
    /// Of packed lanes, by bank.
    lists: Vec<Vec<usize>>,
    /// Items of the pass in each slot of the ring that have no result.
    outstanding: Vec<u64>,
    /// Places of the queue that have been given away, from the first pass on.
    next: u64,
    resolved: u32,
    step: u32,
    /// Blocks of the current fill.
    filled: u32,
    /// Blocks that run in the coming step.
    running: Vec<usize>,
    /// Banks that `generate` visits before it.
    visited_banks: u32,
    latest_tile: Option<(u32, u32, Box<[u32; BLOCK as usize]>)>,
}

impl State<'_> {
    fn tick(&mut self, report: &mut Replay) {
        let ring = self.outstanding.len() as u32;
        let oldest = (self.resolved % ring) as usize;
        if self.resolved < self.passes && self.outstanding[oldest] == 0 {
            self.outstanding[oldest] = u64::from(self.source.items());
            self.resolved += 1;
            report.resolved_after.push(self.step);
        }
        let live = self.lanes.iter().filter(|lane| lane.left > 0).count();
        let dead: Vec<usize> = (0..self.lanes.len()).filter(|lane| self.lanes[*lane].left == 0).collect();
        let places = u64::from(self.source.tiles()) * u64::from(BLOCK);
        let queued = u64::from(self.passes.min(self.resolved + ring)) * places - self.next;
        let answer = live == 0 || self.schedule.regeneration.regenerate(live as u32, dead.len() as u32, self.step);
        let given = if answer { queued.min(dead.len() as u64) as usize } else { 0 };
        if given > 0 {
            report.regenerations.push(given as u32);
        }
        let listed: usize = self.lists.iter().map(Vec::len).sum();
        let packs = given > 0 || live == 0 || (answer && live < listed);
        let receiving = &dead[..given];

        let block_of = |lane: &usize| lane / BLOCK as usize;
        let mut visited: Vec<usize> = receiving.iter().map(block_of).collect();
        visited.dedup();
        let mut running: Vec<usize> = (0..self.lanes.len()).filter(|lane| self.lanes[*lane].left > 0).map(|lane| block_of(&lane)).collect();
        running.extend(&visited);
        running.sort_unstable();
        running.dedup();
        if live == 0 {
            self.filled = 0;
        }
        self.filled = self.filled.max(running.last().map_or(0, |block| *block as u32 + 1));
        if self.schedule.grain().is_packed() {
            visited = if packs { running.clone() } else { Vec::new() };
            if packs {
                let in_bank = self.in_bank;
                for (bank, list) in self.lists.iter_mut().enumerate() {
                    let bank = bank * in_bank..((bank + 1) * in_bank).min(self.lanes.len());
                    *list = bank.clone().filter(|lane| self.lanes[*lane].left > 0).collect();
                    list.extend(receiving.iter().filter(|lane| bank.contains(lane)));
                }
            }
        }
        let mut banks: Vec<usize> = visited.iter().map(|block| block * BLOCK as usize / self.in_bank).collect();
        banks.dedup();
        self.visited_banks = banks.len() as u32;
        self.running = running;

        for lane in receiving {
            let (queued, index) = (self.next / u64::from(BLOCK), (self.next % u64::from(BLOCK)) as usize);
            let tiles = u64::from(self.source.tiles());
            let (pass_index, position) = ((queued / tiles) as u32, (queued % tiles) as u32);
            let OrderRule::Formula(formula) = self.schedule.order.rule() else { return };
            let tile = formula.tile_at(pass_index, position, self.grid);
            let left = self.length(pass_index, tile, index);
            self.lanes[*lane] = Lane { pass_index, tile, left };
            self.next += 1;
        }
    }

    fn length(&mut self, pass_index: u32, tile: u32, index: usize) -> u32 {
        if self.latest_tile.as_ref().is_none_or(|(latest_pass, latest_tile, _)| (*latest_pass, *latest_tile) != (pass_index, tile)) {
            let mut lengths = Box::new([0; BLOCK as usize]);
            self.lengths.of_tile(pass_index, tile, &mut lengths);
            self.latest_tile = Some((pass_index, tile, lengths));
        }
        self.latest_tile.as_ref().map_or(0, |(.., lengths)| lengths[index])
    }

    /// What is walked at each place of the work-groups.
    fn places(&self) -> Vec<Option<LaneItem>> {
        let item = |lane: &Lane| (lane.left > 0).then_some(LaneItem { pass_index: lane.pass_index, tile: lane.tile });
        if !self.schedule.grain().is_packed() {
            return self.lanes.iter().map(item).collect();
        }
        let mut places = vec![None; self.lanes.len()];
        for (bank, list) in self.lists.iter().enumerate() {
            for (place, lane) in places[bank * self.in_bank..].iter_mut().zip(list) {
                *place = item(&self.lanes[*lane]);
            }
        }
        places
    }

    /// One step of every live lane.
    fn walk(&mut self, report: &mut Replay) {
        let live = self.running.len() as u32;
        if live == 0 {
            return;
        }
        self.step += 1;
        let left: Vec<u32> = self.lanes.iter().map(|lane| lane.left).collect();
        let in_bank = self.in_bank / BLOCK as usize;
        let (groups, banks) = match self.schedule.grain() {
            Grain::PackedLanes | Grain::KeyedLanes => {
                for list in &self.lists {
                    report.occupancy.launch(&list.iter().map(|lane| left[*lane]).collect::<Vec<_>>());
                }
                let groups = self.lists.iter().map(|list| list.len().div_ceil(BLOCK as usize) as u32).sum();
                (groups, self.lists.iter().filter(|list| !list.is_empty()).count())
            }
            _ => {
                for block in &self.running {
                    report.occupancy.launch(&left[block * BLOCK as usize..(block + 1) * BLOCK as usize]);
                }
                let groups = self.schedule.launch.launched(live, self.filled);
                let mut banks: Vec<usize> = self.running.iter().map(|block| block / in_bank).collect();
                banks.dedup();
                let all = (self.filled as usize).div_ceil(in_bank);
                (groups, if self.schedule.launch.launched(0, 1) == 1 { all } else { banks.len() })
            }
        };
        report.live_blocks.push(live);
        report.launched_blocks.push(groups);
        report.live_lanes.push(left.iter().filter(|left| **left > 0).count() as u32);
        if let Some(launches) = &mut report.lane_launches {
            launches.stage.push(banks as u32);
            launches.generate.push(self.visited_banks);
        }
        let ring = self.outstanding.len() as u32;
        for lane in self.lanes.iter_mut().filter(|lane| lane.left > 0) {
            lane.left -= 1;
            if lane.left == 0 {
                self.outstanding[(lane.pass_index % ring) as usize] -= 1;
            }
        }
    }
}
