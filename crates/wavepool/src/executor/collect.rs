//! Gathers what instruments bring home, submission by submission.

use super::{readback::Snapshot, run::Launched, times::Timed};
use crate::{
    control::record,
    profile::{Event, MOST_EVENTS, Observed, StepRecord, Steps, Times},
    replay::Assignment,
};

#[derive(Debug, Default)]
pub(super) struct Collector {
    steps: Steps,
    has_steps: bool,
    times: Times,
    has_times: bool,
    last_end: Option<u64>,
    origin: Option<u64>,
}

impl Collector {
    /// Takes what the ticks of a submission have written down; `capacity` is in steps.
    pub(super) fn add_record(&mut self, snapshot: &Snapshot, capacity: u32) {
        self.has_steps = true;
        let words = |place: u32, count: u32| &snapshot.record[place as usize..(place + count) as usize];
        for step in 0..snapshot.control.record_steps.min(capacity) {
            let entry = words(step * record::PER_STEP, record::PER_STEP);
            if entry[3] > 0 {
                self.steps.resolved_after.push(self.steps.steps.len() as u32);
            }
            if entry[0] > 0 {
                self.steps.steps.push(StepRecord {
                    live_blocks: entry[0],
                    live_lanes: entry[1],
                    new_blocks: entry[2],
                    launched_blocks: entry[4],
                });
            }
        }
        let base = capacity * record::PER_STEP;
        for assignment in 0..snapshot.control.record_assignments {
            let entry = words(base + assignment * record::PER_ASSIGNMENT, record::PER_ASSIGNMENT);
            self.steps.assignments.push(Assignment { step: entry[0], block: entry[1], pass_index: entry[2], tile: entry[3] });
        }
    }

    /// Takes the times of a submission.
    pub(super) fn add_times(&mut self, timed: &[Timed], launched: &[Launched], name: impl Fn(usize) -> String) {
        let (Some(first), Some(last)) = (timed.first(), timed.last()) else { return };
        self.has_times = true;
        let origin = *self.origin.get_or_insert(first.begin);
        if let Some(end) = self.last_end {
            self.times.idle_ns += first.begin.saturating_sub(end);
        }
        self.last_end = Some(last.end);
        self.times.submissions += 1;
        self.times.span_ns = last.end.saturating_sub(origin);
        for timed in timed {
            let Some(launched) = launched.get(timed.launch) else { continue };
            let kernel = name(launched.dispatch);
            let took = timed.end - timed.begin;
            self.times.add(&kernel, took);
            if self.times.events.len() < MOST_EVENTS {
                self.times.events.push(Event {
                    kernel,
                    step: launched.step,
                    begin_ns: timed.begin.saturating_sub(origin),
                    duration_ns: took,
                });
            } else {
                self.times.events_left_out += 1;
            }
        }
    }

    pub(super) fn finish(self) -> Observed {
        Observed { steps: self.has_steps.then_some(self.steps), lengths: None, times: self.has_times.then_some(self.times) }
    }
}
