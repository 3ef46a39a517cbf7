//! Pictures of schedules: blocks across, steps down, every tile in its colour, as in the worked example of the paper.
//!
//! Key decision: a picture is made of what a run has written down (which tile went where, how many steps each walk took) and of nothing
//! else. A walk of n steps is alive in the first n steps of its tile, so the live lanes of every block in every step follow exactly.
//! What is given up: the megakernel, which has no steps to draw.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, the listing of eight blocks and sixteen tiles.
//!
//! **Invariant:** the cells of a [`Chart`] add up, step by step, to the counters of the tick; records that do not are refused.

mod axis;
mod color;
mod html;
mod lines;
mod panel;
mod raster;
mod svg;
#[cfg(test)]
mod tests;
mod words;

pub use axis::{Axis, AxisScale};
pub use html::html;
pub use lines::{Line, LinePanel, lines};
pub use svg::svg;
use words::{LETTERS, listed};

use std::collections::BTreeMap;

use wavepool::{
    Report, Schedule,
    plan::{Plan, Size},
    policy::Execution,
    policy::WorkSource,
    profile::Steps,
    replay::{LaneItem, WalkLengths, watch_lanes},
};

/// Lanes of a block.
const BLOCK: u32 = 256;

/// Why there is nothing to draw.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The run has no record of steps and lengths.
    #[error("`{schedule}` has no steps to draw: {why}")]
    NoSteps {
        /// The schedule, printed.
        schedule: String,
        /// What is missing.
        why: &'static str,
    },
    /// The lengths are not those of the steps.
    #[error("step {step}: {found} {what} by the lengths of the walks, {recorded} by the record of the step")]
    Contradiction {
        /// From 1.
        step: usize,
        /// Blocks or lanes.
        what: &'static str,
        /// Counted from the lengths.
        found: u32,
        /// Counted by the tick.
        recorded: u32,
    },
}

/// Why a megakernel cannot be drawn.
const INSIDE: &str = "a megakernel keeps its steps inside of one launch";
/// Why a choice among schedules cannot.
const TURNS: &str = "schedules take turns at whole passes; draw one of them";

/// Asks, before the run, whether a schedule can be drawn.
///
/// # Errors
/// [`Error::NoSteps`] for a megakernel and for several schedules in turns.
pub fn check(schedule: &Schedule) -> Result<(), Error> {
    let refuse = |why| Err(Error::NoSteps { schedule: schedule.to_string(), why });
    match schedule.execution {
        _ if !schedule.candidates.is_empty() => refuse(TURNS),
        Execution::Wavefront => Ok(()),
        _ => refuse(INSIDE),
    }
}

/// Sizes that a record of steps does not tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pool {
    /// Blocks.
    pub blocks: u32,
    /// Buffers that they are spread over, evenly; a stage is launched once for each with a live block.
    pub banks: u32,
    /// Stages of the program.
    pub stages: u32,
}

/// One step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Row {
    /// Blocks that live in it.
    pub live_blocks: u32,
    /// Lanes alive when it begins.
    pub live_lanes: u32,
    /// Blocks that start a tile in it.
    pub new_blocks: u32,
    /// Where lanes receive single items: how many do before it.
    pub new_lanes: u32,
    /// Dispatches with at least one group.
    pub launches: u32,
}

/// A tile in a block, from its first step to its last. Where lanes receive single items: the tile that most lanes of the block walk, for as long
/// as that is so.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// Where it lives.
    pub block: u32,
    /// Which pass it belongs to.
    pub pass_index: u32,
    /// Which tile.
    pub tile: u32,
    /// The step in which it begins, from 0.
    pub first: u32,
    /// Live lanes of the block in each of its steps, at least 1 in each.
    pub live_lanes: Vec<u16>,
}

impl Span {
    /// The step after its last.
    pub fn end(&self) -> u32 {
        self.first + self.live_lanes.len() as u32
    }
}

/// What a schedule has done, ready to be drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chart {
    title: String,
    blocks: u32,
    rows: Vec<Row>,
    spans: Vec<Span>,
    has_passes: bool,
    has_letters: bool,
    /// True when the lanes of a block walk items of several tiles.
    is_mixed: bool,
}

impl Chart {
    /// Of a run with the instruments for steps and lengths.
    ///
    /// # Errors
    /// [`Error::NoSteps`] when they were off or the schedule is a megakernel, [`Error::Contradiction`] when the run was stopped before
    /// the last pass was resolved.
    pub fn of_run(report: &Report, plan: &Plan) -> Result<Self, Error> {
        let none = |why| Error::NoSteps { schedule: report.schedule.clone(), why };
        if report.lane_steps == 0 && report.items_started > 0 {
            return Err(none(INSIDE));
        }
        let observed = &report.observed;
        let (Some(steps), Some(lengths)) = (&observed.steps, &observed.lengths) else {
            return Err(none("steps and lengths were not observed"));
        };
        let stages = plan.step.iter().filter(|launch| launch.size == Size::LiveBlocks).count() as u32;
        let pool = Pool { blocks: report.pool_blocks, banks: report.banks, stages };
        Chart::new(&report.schedule, pool, steps, lengths)
    }

    /// Of a record of steps and the lengths of the walks, whether a device or a replay has made them.
    ///
    /// # Errors
    /// [`Error::Contradiction`] when the two are not of one run.
    pub fn new(title: &str, pool: Pool, steps: &Steps, lengths: &dyn WalkLengths) -> Result<Self, Error> {
        let mut lanes_left = [0; BLOCK as usize];
        let spans: Vec<Span> = steps
            .assignments
            .iter()
            .map(|assignment| {
                lengths.of_tile(assignment.pass_index, assignment.tile, &mut lanes_left);
                Span {
                    block: assignment.block,
                    pass_index: assignment.pass_index,
                    tile: assignment.tile,
                    first: assignment.step.saturating_sub(1),
                    live_lanes: lanes_by_step(&lanes_left),
                }
            })
            .collect();
        let mut rows = vec![Row::default(); steps.steps.len()];
        let bank_blocks = pool.blocks.div_ceil(pool.banks.max(1)).max(1);
        let mut live_banks = vec![vec![(false, false); pool.banks.max(1) as usize]; rows.len()];
        for span in &spans {
            for (step, lanes) in (span.first..).zip(&span.live_lanes) {
                let Some(row) = rows.get_mut(step as usize) else { break };
                row.live_blocks += 1;
                row.live_lanes += u32::from(*lanes);
                row.new_blocks += u32::from(step == span.first);
                if let Some(bank) = live_banks[step as usize].get_mut((span.block / bank_blocks) as usize) {
                    *bank = (true, bank.1 || step == span.first);
                }
            }
        }
        for (step, (row, record)) in rows.iter().zip(&steps.steps).enumerate() {
            for (what, found, recorded) in [
                ("live blocks", row.live_blocks, record.live_blocks),
                ("live lanes", row.live_lanes, record.live_lanes),
                ("new blocks", row.new_blocks, record.new_blocks),
            ] {
                if found != recorded {
                    return Err(Error::Contradiction { step: step + 1, what, found, recorded });
                }
            }
        }
        for (row, banks) in rows.iter_mut().zip(&live_banks) {
            let live = banks.iter().filter(|bank| bank.0).count() as u32;
            let new = banks.iter().filter(|bank| bank.1).count() as u32;
            row.launches = new + live * pool.stages + 1;
        }
        for step in &steps.resolved_after {
            if let Some(row) = rows.get_mut(step.saturating_sub(1) as usize) {
                row.launches += 1;
            }
        }
        let has_passes = spans.iter().any(|span| span.pass_index > 0);
        let has_letters = spans.iter().all(|span| span.tile < LETTERS);
        Ok(Chart { title: title.to_owned(), blocks: pool.blocks, rows, spans, has_passes, has_letters, is_mixed: false })
    }

    /// Of a run in which lanes receive single items, with the instruments for steps and lengths, of `source` under `schedule`. A block, or of
    /// packed lanes a work-group, has the colour of the tile that most of its lanes walk.
    ///
    /// # Errors
    /// As [`of_run`](Self::of_run).
    pub fn of_items(report: &Report, stages: usize, schedule: &Schedule, source: &dyn WorkSource) -> Result<Self, Error> {
        let (Some(steps), Some(lengths)) = (&report.observed.steps, &report.observed.lengths) else {
            let why = "steps and lengths were not observed";
            return Err(Error::NoSteps { schedule: report.schedule.clone(), why });
        };
        let mut mixture = Mixture::default();
        let blocks = [report.pool_blocks, report.pool_blocks.div_ceil(report.banks.max(1))];
        let mut observe = |places: &[Option<LaneItem>]| mixture.add(places);
        let seen = watch_lanes(schedule, source, report.passes, blocks, report.ring, lengths, &mut observe);
        let mut rows = Vec::new();
        for (step, record) in steps.steps.iter().enumerate() {
            let of = |figures: &[u32]| figures.get(step).copied().unwrap_or(0);
            for (what, found, recorded) in [
                ("live blocks", of(&seen.live_blocks), record.live_blocks),
                ("live lanes", of(&seen.live_lanes), record.live_lanes),
                ("work-groups", of(&seen.launched_blocks), record.launched_blocks),
            ] {
                if found != recorded {
                    return Err(Error::Contradiction { step: step + 1, what, found, recorded });
                }
            }
            let resolves = steps.resolved_after.iter().filter(|after| **after as usize == step + 1).count() as u32;
            rows.push(Row {
                live_blocks: record.launched_blocks,
                live_lanes: record.live_lanes,
                new_blocks: mixture.spans.iter().filter(|span| span.first as usize == step).count() as u32,
                new_lanes: record.new_blocks,
                launches: 1 + seen.lane_launches_of(step, stages) + resolves,
            });
        }
        let spans = mixture.spans;
        let has_passes = spans.iter().any(|span| span.pass_index > 0);
        let has_letters = spans.iter().all(|span| span.tile < LETTERS);
        Ok(Chart { title: report.schedule.clone(), blocks: report.pool_blocks, rows, spans, has_passes, has_letters, is_mixed: true })
    }

    /// The schedule, printed.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Blocks of the pool.
    pub fn blocks(&self) -> u32 {
        self.blocks
    }

    /// The steps.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Every tile that was handed out, in order.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// All launches: those of the steps, and the tick before them.
    pub fn launches(&self) -> u64 {
        1 + self.rows.iter().map(|row| u64::from(row.launches)).sum::<u64>()
    }

    /// Lanes alive of those in live blocks, over all steps, 0 to 1.
    pub fn occupancy(&self) -> f64 {
        let sum = |of: fn(&Row) -> u32| self.rows.iter().map(|row| u64::from(of(row))).sum::<u64>() as f64;
        sum(|row| row.live_lanes) / (sum(|row| row.live_blocks) * f64::from(BLOCK)).max(1.0)
    }
}

/// Which tile most lanes of a block walk, step by step.
#[derive(Default)]
struct Mixture {
    step: u32,
    spans: Vec<Span>,
    /// By block: its latest span.
    latest: Vec<Option<usize>>,
}

impl Mixture {
    fn add(&mut self, places: &[Option<LaneItem>]) {
        self.latest.resize(places.len() / BLOCK as usize, None);
        for (block, lanes) in (0..).zip(places.chunks(BLOCK as usize)) {
            let mut counts = BTreeMap::new();
            lanes.iter().flatten().for_each(|item| *counts.entry(*item).or_insert(0_u16) += 1);
            // Of equally many the first, so that a picture can be made again.
            let most = counts.iter().max_by_key(|(item, count)| (**count, std::cmp::Reverse(**item)));
            let Some((item, _)) = most else { continue };
            let live = counts.values().sum();
            let latest = self.latest[block as usize].map(|span| &mut self.spans[span]);
            match latest.filter(|span| (span.pass_index, span.tile) == (item.pass_index, item.tile) && span.end() == self.step) {
                Some(span) => span.live_lanes.push(live),
                None => {
                    self.latest[block as usize] = Some(self.spans.len());
                    let LaneItem { pass_index, tile } = *item;
                    self.spans.push(Span { block, pass_index, tile, first: self.step, live_lanes: vec![live] });
                }
            }
        }
        self.step += 1;
    }
}

/// Live lanes in each step of a tile whose walks have the given lengths.
fn lanes_by_step(lengths: &[u32; BLOCK as usize]) -> Vec<u16> {
    let longest = lengths.iter().max().map_or(0, |longest| *longest as usize);
    let mut ends = vec![0_u16; longest + 1];
    lengths.iter().for_each(|length| ends[*length as usize] += 1);
    let mut alive = BLOCK as u16;
    ends[..longest]
        .iter()
        .map(|ended| {
            alive -= ended;
            alive
        })
        .collect()
}
