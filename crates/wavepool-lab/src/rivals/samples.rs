//! Rivals that never ran, for tests of what is written about them.

use wavepool::{
    Report, Schedule,
    profile::{KernelTime, Times},
    replay::Occupancy,
};

use super::{Rival, Run};
use crate::Interval;

/// Of that name and speed, with round numbers.
pub(crate) fn rival(name: &str, walks_per_second: f64) -> Rival {
    let mut report = Report::default();
    (report.launches, report.steps, report.passes, report.pool_blocks) = (700, 70, 4, 32);
    let run = |seconds: f64| Run { seconds, processor: Some(seconds * 1.5) };
    let kernel = |kernel: &str, nanoseconds| KernelTime { kernel: kernel.into(), launches: 70, nanoseconds };
    Rival {
        name: name.into(),
        schedule: name.parse::<Schedule>().unwrap_or_default().to_string(),
        report,
        film: 7,
        occupancy: Some(Occupancy { useful: 900, launched: [1000, 1200, 1800], ..Occupancy::default() }),
        group_steps: Some(8),
        state_bytes_moved: Some(5_000_000),
        runs: vec![run(0.25), run(0.5), run(1.0)],
        walks_per_second: Interval { value: walks_per_second, low: walks_per_second * 0.95, high: walks_per_second * 1.1 },
        time_ratio: Interval { value: 1.0, low: 0.9, high: 1.1 },
        times: Some(Times { kernels: vec![kernel("trace", 9_000_000), kernel("tick", 1_000_000)], ..Times::default() }),
    }
}
