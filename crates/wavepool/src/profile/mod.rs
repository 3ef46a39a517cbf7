//! What instruments have seen of a run, as data: steps, walk lengths, device times; the statistics file and the trace made of them.
//!
//! Key decision: numbers that do not depend on how fast a device is come first, times apart; the file has a version, and its reader needs
//! nothing else to explain a run.
//!
//! **Invariant:** nothing here sees a device.

mod lengths;
mod statistics;
mod trace;

pub use lengths::Lengths;
pub use statistics::{SCHEMA, Statistics};

use crate::replay::Assignment;

/// Launches kept one by one, at most; sums go on.
pub(crate) const MOST_EVENTS: usize = 1 << 20;

/// One step, as the tick before it has decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StepRecord {
    /// Blocks that live in it.
    pub live_blocks: u32,
    /// Lanes that are alive when it begins.
    pub live_lanes: u32,
    /// Blocks that start a tile in it; where lanes receive single items, dead lanes that do.
    pub new_blocks: u32,
    /// Work-groups that each stage is launched with: the live blocks, all of the current fill, or what the lists of packed lanes need.
    pub launched_blocks: u32,
}

/// Every step of a run, and every tile that was handed out, in order; single items are not told one by one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    /// The steps in which a block was live.
    pub steps: Vec<StepRecord>,
    /// Which block received which tile, and when.
    pub assignments: Vec<Assignment>,
    /// By pass: how many steps had been done when it was resolved.
    pub resolved_after: Vec<u32>,
}

/// Device time of one kernel.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KernelTime {
    /// As in the plan.
    pub kernel: String,
    /// How often it was launched, launches without groups included.
    pub launches: u64,
    /// Nanoseconds of all of them.
    pub nanoseconds: u64,
}

/// One launch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// As in the plan.
    pub kernel: String,
    /// Counted from 1; 0 is the tick before the first step.
    pub step: u64,
    /// Since the first launch.
    pub begin_ns: u64,
    /// How long it took.
    pub duration_ns: u64,
}

/// Device times, by the device's own clock.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// In the order of their first launch.
    pub kernels: Vec<KernelTime>,
    /// From the first launch to the end of the last one.
    pub span_ns: u64,
    /// Between the submissions: the device waited for the host.
    pub idle_ns: u64,
    /// Submissions that were timed.
    pub submissions: u64,
    /// Launches one by one, the first million of them.
    pub events: Vec<Event>,
    /// Launches that are in the sums but not in the list.
    pub events_left_out: u64,
}

impl Times {
    pub(crate) fn add(&mut self, kernel: &str, nanoseconds: u64) {
        let place = self.kernels.iter().position(|entry| entry.kernel == kernel).unwrap_or_else(|| {
            self.kernels.push(KernelTime { kernel: kernel.to_owned(), ..KernelTime::default() });
            self.kernels.len() - 1
        });
        self.kernels[place].launches += 1;
        self.kernels[place].nanoseconds += nanoseconds;
    }

    /// Nanoseconds of all launches.
    pub fn busy_ns(&self) -> u64 {
        self.kernels.iter().map(|kernel| kernel.nanoseconds).sum()
    }

    /// The kernels that do no work of the program: their part of all device time, 0 to 1.
    pub fn scheduling_share(&self) -> f64 {
        let own = ["tick", "advance", "queues", "enqueue"];
        let scheduling: u64 =
            self.kernels.iter().filter(|kernel| own.contains(&kernel.kernel.as_str())).map(|kernel| kernel.nanoseconds).sum();
        scheduling as f64 / self.busy_ns().max(1) as f64
    }
}

/// What instruments have seen of a run; each part is there when it was asked for and the device could give it.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Observed {
    /// What every tick has decided.
    pub steps: Option<Steps>,
    /// How many steps each walk took.
    pub lengths: Option<Lengths>,
    /// Device times; absent on devices without timestamps.
    pub times: Option<Times>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: sums that forget a launch, or count the stages as scheduling.
    #[test]
    fn times_add_up_by_kernel() {
        let mut times = Times::default();
        for (kernel, took) in [("trace", 70), ("tick", 2), ("trace", 26), ("queues", 1), ("enqueue", 1)] {
            times.add(kernel, took);
        }
        assert_eq!(times.kernels[0], KernelTime { kernel: "trace".into(), launches: 2, nanoseconds: 96 });
        assert_eq!((times.busy_ns(), times.scheduling_share()), (100, 0.04));
    }
}
