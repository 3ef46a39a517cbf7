//! Schedules side by side, on anyone's program.
//!
//! Key decision: what no device decides stands first (launches, steps, work-groups, lanes that had something to do); times come after, taken in
//! turns and told as ratios with intervals. Every run is also a test: a schedule with another film than the first one's is an error.
//!
//! **Invariant:** all rivals walk the same walks, so they share the roulette.

use std::{fmt::Write as _, time::Instant};

use wavepool::{
    Error, GpuContext, Instruments, Program, Report, Schedule, Scheduler,
    policy::{Execution, WorkSource},
    replay::{Occupancy, replay},
};

use crate::{
    interval::{Interval, bootstrap, median},
    pairs::{Pair, ratio},
};

/// What can be run under a schedule.
pub trait Subject {
    /// Its scheduler, ready to run.
    fn scheduler(&mut self) -> &mut Scheduler;
}

impl Subject for Scheduler {
    fn scheduler(&mut self) -> &mut Scheduler {
        self
    }
}

/// One schedule among its rivals.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Rival {
    /// As [`Schedule`] prints it.
    pub schedule: String,
    /// Counters of a run.
    pub report: Report,
    /// Lane-steps with and without work, if a subgroup runs as long as one of its lanes: the same for all schedules that keep whole tiles.
    pub occupancy: Occupancy,
    /// Bytes of state read and written by stages, if every lane-step goes on; 0 where the state stays in registers.
    pub state_bytes_moved: u64,
    /// Seconds of each run, in the order of the rounds.
    pub seconds: Vec<f64>,
    /// Walks per second.
    pub walks_per_second: Interval,
    /// Time over that of the first schedule, over pairs of the same round.
    pub time_ratio: Interval,
}

impl Rival {
    /// Useful lane-steps over those of all launched work-groups of 256, dead blocks included.
    pub fn group_efficiency(&self) -> f64 {
        match self.report.group_steps {
            0 => 1.0,
            groups => self.occupancy.useful as f64 / (groups as f64 * 256.0),
        }
    }
}

/// Compares schedules on a program that needs no resources: [`compare_schedules`] with a scheduler of its own for each.
///
/// # Errors
/// Those of building and running, [`Error::Conservation`] when the films differ, [`Error::Schedule`] when the roulettes do.
pub fn bench_schedules(
    gpu: &GpuContext,
    program: &Program,
    source: impl WorkSource + Clone + 'static,
    schedules: &[Schedule],
    passes: u32,
    rounds: usize,
) -> Result<Vec<Rival>, Error> {
    compare_schedules(&source, schedules, passes, rounds, |schedule, instruments| {
        Scheduler::builder(program, source.clone()).schedule(schedule).instruments(instruments).build_on(gpu)
    })
}

/// Compares schedules: one run of each to warm up and to count, then `rounds` rounds, forwards and backwards in turns. `build` makes the
/// subject under a schedule; it must walk `source`.
///
/// # Errors
/// Those of `build`, and those of [`bench_schedules`].
pub fn compare_schedules<S: Subject, E: From<Error>>(
    source: &dyn WorkSource,
    schedules: &[Schedule],
    passes: u32,
    rounds: usize,
    mut build: impl FnMut(&Schedule, Instruments) -> Result<S, E>,
) -> Result<Vec<Rival>, E> {
    let Some(first) = schedules.first() else { return Ok(Vec::new()) };
    let roulette = |schedule: &Schedule| schedule.roulette.as_ref().map_or("none", |roulette| roulette.name()).to_owned();
    if let Some(other) = schedules.iter().find(|other| roulette(other) != roulette(first)) {
        return Err(Error::Schedule(format!("`{first}` and `{other}` have other roulettes, so other walks: nothing to compare")).into());
    }
    let instruments = Instruments { lengths: true, ..Instruments::default() };
    let (film, report) = build(first, instruments)?.scheduler().run(passes)?;
    let lengths = report.observed.lengths.ok_or_else(|| Error::Schedule("the lengths of the walks were not kept".into()))?;
    let walks = f64::from(source.pixels()) * f64::from(report.passes);
    let mut subjects = Vec::new();
    let mut rivals = Vec::new();
    for schedule in schedules {
        let mut subject = build(schedule, Instruments::default())?;
        let (other, report) = subject.scheduler().run(passes)?;
        if other.hash() != film.hash() {
            return Err(Error::Conservation(format!("`{schedule}` has another film than `{first}`")).into());
        }
        let is_wavefront = schedule.execution == Execution::Wavefront;
        // Whoever keeps whole tiles runs each subgroup as long as its longest walk.
        let replayed = if is_wavefront { schedule.clone() } else { Schedule::never().with_roulette(schedule.roulette.clone()) };
        let seen = replay(&replayed, source, passes, report.pool_blocks, report.ring, &lengths);
        let bytes: usize = subject.scheduler().layout().kernels.iter().map(|kernel| kernel.bytes().0 + kernel.bytes().1).sum();
        rivals.push(Rival {
            schedule: schedule.to_string(),
            state_bytes_moved: if is_wavefront { bytes as u64 * seen.occupancy.useful } else { 0 },
            occupancy: seen.occupancy,
            report,
            seconds: Vec::new(),
            walks_per_second: Interval { value: 0.0, low: 0.0, high: 0.0 },
            time_ratio: Interval { value: 1.0, low: 1.0, high: 1.0 },
        });
        subjects.push(subject);
    }
    for round in 0..rounds {
        let forwards: Vec<usize> = (0..subjects.len()).collect();
        let order: Vec<usize> = if round % 2 == 0 { forwards } else { forwards.into_iter().rev().collect() };
        for index in order {
            let begun = Instant::now();
            subjects[index].scheduler().run(passes)?;
            rivals[index].seconds.push(begun.elapsed().as_secs_f64());
        }
    }
    let base = rivals[0].seconds.clone();
    for rival in &mut rivals {
        rival.walks_per_second = bootstrap(&rival.seconds, |seconds| walks / median(seconds).max(f64::MIN_POSITIVE));
        let pairs: Vec<Pair> = rival.seconds.iter().zip(&base).map(|(first, second)| Pair { first: *first, second: *second }).collect();
        rival.time_ratio = ratio(&pairs);
    }
    Ok(rivals)
}

/// The rivals as rows of a Markdown table, with `label` before each; the head is [`TABLE_HEAD`].
pub fn table(label: &str, rivals: &[Rival]) -> String {
    let mut rows = String::new();
    for rival in rivals {
        let [w8, w32, w64] = rival.occupancy.efficiency().map(|share| share * 100.0);
        let (rate, time) = (rival.walks_per_second, rival.time_ratio);
        let _ = writeln!(
            rows,
            "| {label} | `{}` | {} | {} | {} | {:.1} | {w8:.1}, {w32:.1}, {w64:.1} | {:.1} | {:.3} [{:.3}, {:.3}] | {:.3} [{:.3}, {:.3}] |",
            rival.schedule,
            rival.report.launches,
            rival.report.steps,
            rival.report.group_steps,
            rival.group_efficiency() * 100.0,
            rival.state_bytes_moved as f64 / 1e6,
            rate.value / 1e6,
            rate.low / 1e6,
            rate.high / 1e6,
            time.value,
            time.low,
            time.high
        );
    }
    rows
}

/// Head of [`table`].
pub const TABLE_HEAD: &str = "| scene | schedule | launches | steps | groups | useful of groups, % | useful at widths 8, 32, 64, % | state moved, MB | Mwalks/s | time over the first |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
";

#[cfg(test)]
mod tests {
    use super::*;
    use wavepool::ImageTiles;

    const WALK: &str = "
        struct Walk { left: u32, sum: u32 }
        fn generate(w: ptr<function, Walk>, item: Item) { (*w).left = 1u + item.pixel % 7u; }
        fn hop(w: ptr<function, Walk>) -> u32 {
            (*w).sum += (*w).left;
            (*w).left -= 1u;
            if ((*w).left == 0u) { return FINISH; }
            return CONTINUE;
        }
        fn finish(w: ptr<function, Walk>) -> u32 { return (*w).sum; }";

    /// Kills: rivals that are not what they are called, counted in the wrong place, or timed against another; useful lane-steps that depend on
    /// the schedule; dead groups that cost nothing in the table.
    #[test]
    fn rivals_are_counted_and_timed() {
        crate::conformance::run(|gpu| {
            let program = Program::builder("walk").source("walk.wgsl", WALK).stage("hop").build().map_err(|error| error.to_string())?;
            let source = ImageTiles { width: 64, height: 64 };
            let schedules =
                ["never", "never-full", "block", "megakernel"].map(|name| name.parse::<Schedule>().expect(name).with_pool_blocks(4));
            let rivals = bench_schedules(gpu, &program, source, &schedules, 2, 3).map_err(|error| error.to_string())?;
            let useful: u64 = 2 * (0..64 * 64_u64).map(|pixel| 1 + pixel % 7).sum::<u64>();
            assert!(rivals.iter().all(|rival| rival.occupancy.useful == useful && rival.seconds.len() == 3));
            assert!(rivals[1].group_efficiency() <= rivals[0].group_efficiency());
            assert_eq!((rivals[0].time_ratio.value, rivals[3].state_bytes_moved), (1.0, 0));
            // Flag and both words read, both words written: 20 bytes.
            assert_eq!(rivals[0].state_bytes_moved, 20 * useful);
            assert!(rivals[3].report.launches < rivals[0].report.launches);
            let text = table("made up", &rivals);
            assert_eq!(text.lines().count(), 4);
            let columns = TABLE_HEAD.lines().next().map(|head| head.matches('|').count());
            assert!(text.lines().all(|line| Some(line.matches('|').count()) == columns), "{text}");
            let mixed = [Schedule::never(), Schedule::never().with_roulette(None)];
            assert!(bench_schedules(gpu, &program, source, &mixed, 1, 1).expect_err("other walks").to_string().contains("other roulettes"));
            Ok(())
        });
    }
}
