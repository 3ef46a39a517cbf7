//! Schedules side by side, on anyone's program.
//!
//! Key decision: what no device decides stands first (launches, steps, work-groups, lanes that had something to do); times come after, taken in
//! turns and told as ratios with intervals. Every run is also a test: a schedule with another film than the first one's is an error.
//! What is found can be written as CSV, as Markdown and as charts; nothing else knows the numbers.
//!
//! **Invariant:** rivals of one roulette walk the same walks, so they have the same film.

pub mod ablation;
mod chart;
pub mod choosing;
mod claims;
mod csv;
mod markdown;
mod rounds;
#[cfg(test)]
pub(crate) mod samples;
pub mod sweep;

pub use chart::chart;
pub use claims::{Terms, claims};
pub use csv::{COLUMNS, Column, csv, field};
pub use markdown::{STAGES_HEAD, TABLE_HEAD, glance, stages, table};
pub use rounds::Rounds;

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use wavepool::{
    Error, GpuContext, Instruments, Program, Report, Schedule, Scheduler,
    layout::Layout,
    policy::{Execution, WorkSource},
    profile::{Lengths, Times},
    replay::{Occupancy, replay_in_banks},
};

use crate::{
    clock::process_time,
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
    /// What tables and charts call it: the schedule, printed, until somebody writes a shorter word here.
    pub name: String,
    /// As [`Schedule`] prints it.
    pub schedule: String,
    /// Counters of a run.
    pub report: Report,
    /// Hash of the film.
    pub film: u64,
    /// Lane-steps with and without work, if a subgroup runs as long as one of its lanes: the same for all schedules that keep whole tiles.
    /// Where only some stages pack their lanes, the mean over the stages. `None` where the hardware decides which lanes meet, and for
    /// candidates that take turns.
    pub occupancy: Option<Occupancy>,
    /// Work-groups summed over the steps in which they ran, dead ones that were launched included; a group of a megakernel runs as long as
    /// its longest walk. `None` as above.
    pub group_steps: Option<u64>,
    /// Bytes of state read and written by stages, if every lane-step goes on; 0 where the state stays in registers, `None` as above.
    pub state_bytes_moved: Option<u64>,
    /// What each run took, in the order of the rounds.
    pub runs: Vec<Run>,
    /// Walks per second.
    pub walks_per_second: Interval,
    /// Time over that of the first schedule, over pairs of the same round.
    pub time_ratio: Interval,
    /// Device times of one run apart from the timed ones, without its single launches; `None` where the device has no timestamps.
    pub times: Option<Times>,
}

/// What one run took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Seconds on the wall.
    pub seconds: f64,
    /// Seconds of processor time of the process, which are the work itself where the driver is software, and the price of asking elsewhere;
    /// `None` where the system does not tell.
    pub processor: Option<f64>,
}

/// Rivals on one workload, at one place of whatever varies.
#[derive(Clone, Debug)]
pub struct Cell {
    /// What was walked, such as the name of a scene.
    pub workload: String,
    /// What varies from cell to cell, such as the maximum depth.
    pub at: u32,
    /// Who took part.
    pub rivals: Vec<Rival>,
}

impl Rival {
    /// Useful lane-steps over those of all launched work-groups of 256, dead blocks included.
    pub fn group_efficiency(&self) -> Option<f64> {
        match (self.occupancy, self.group_steps) {
            (Some(occupancy), Some(groups)) if groups > 0 => Some(occupancy.useful as f64 / (groups as f64 * 256.0)),
            (Some(_), Some(_)) => Some(1.0),
            _ => None,
        }
    }

    /// Median seconds of a run.
    pub fn seconds(&self) -> f64 {
        median(&self.runs.iter().map(|run| run.seconds).collect::<Vec<_>>())
    }

    /// Median seconds of processor time of a run.
    pub fn processor_seconds(&self) -> Option<f64> {
        let told: Option<Vec<f64>> = self.runs.iter().map(|run| run.processor).collect();
        told.filter(|told| !told.is_empty()).map(|told| median(&told))
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
    rounds: impl Into<Rounds>,
) -> Result<Vec<Rival>, Error> {
    compare_schedules(&source, schedules, passes, rounds, |schedule, instruments| {
        Scheduler::builder(program, source.clone()).schedule(schedule).instruments(instruments).build_on(gpu)
    })
}

/// Compares schedules: one run of each to warm up and to count, two for device times, of which the second counts, then `rounds` rounds, forwards and backwards in turns.
/// `build` makes the subject under a schedule; it must walk `source`.
///
/// # Errors
/// Those of `build`, and those of [`bench_schedules`].
pub fn compare_schedules<S: Subject, E: From<Error>>(
    source: &dyn WorkSource,
    schedules: &[Schedule],
    passes: u32,
    rounds: impl Into<Rounds>,
    build: impl FnMut(&Schedule, Instruments) -> Result<S, E>,
) -> Result<Vec<Rival>, E> {
    if let Some((first, other)) = schedules.first().zip(schedules.iter().find(|other| roulette(other) != roulette(&schedules[0]))) {
        return Err(Error::Schedule(format!("`{first}` and `{other}` have other roulettes, so other walks: nothing to compare")).into());
    }
    compare_across_roulettes(source, schedules, passes, rounds, build)
}

/// The same for schedules of several roulettes, whose walks differ: films are compared among those of one roulette, times are those of as
/// many walks, and what a walk costs in noise is not told.
///
/// # Errors
/// Those of `build` and of running, [`Error::Conservation`] when films of one roulette differ.
pub fn compare_across_roulettes<S: Subject, E: From<Error>>(
    source: &dyn WorkSource,
    schedules: &[Schedule],
    passes: u32,
    rounds: impl Into<Rounds>,
    mut build: impl FnMut(&Schedule, Instruments) -> Result<S, E>,
) -> Result<Vec<Rival>, E> {
    let walks = f64::from(source.items()) * f64::from(passes);
    let mut lengths_by_roulette: BTreeMap<String, Lengths> = BTreeMap::new();
    let mut films = Films::default();
    let mut subjects = Vec::new();
    let mut rivals = Vec::new();
    for schedule in schedules {
        let roulette = roulette(schedule);
        // Instruments watch one schedule: of candidates that take turns, films and times alone are known.
        let is_one = schedule.candidates.is_empty();
        if is_one && !lengths_by_roulette.contains_key(&roulette) {
            let instruments = Instruments { lengths: true, ..Instruments::default() };
            let (film, report) = build(schedule, instruments)?.scheduler().run(passes)?;
            films.check(schedule, film.hash())?;
            let kept = report.observed.lengths.ok_or_else(|| Error::Schedule("the lengths of the walks were not kept".into()))?;
            lengths_by_roulette.insert(roulette.clone(), kept);
        }
        let instruments = Instruments { times: is_one, ..Instruments::default() };
        let mut watched = build(schedule, instruments)?;
        // A driver may compile a kernel at its first launch, and that would be device time.
        watched.scheduler().run(passes)?;
        let (film, report) = watched.scheduler().run(passes)?;
        films.check(schedule, film.hash())?;
        let times = report.observed.times.map(|times| Times { events: Vec::new(), ..times });
        let mut subject = build(schedule, Instruments::default())?;
        let (film, report) = subject.scheduler().run(passes)?;
        films.check(schedule, film.hash())?;
        let lengths = lengths_by_roulette.get(&roulette).filter(|_| is_one);
        let layout = subject.scheduler().layout();
        let lanes = lengths.and_then(|lengths| lanes_of(schedule, source, &report, lengths, layout));
        rivals.push(Rival {
            name: schedule.to_string(),
            schedule: schedule.to_string(),
            report,
            film: film.hash(),
            occupancy: lanes.map(|(occupancy, ..)| occupancy),
            group_steps: lanes.map(|(_, groups, _)| groups),
            state_bytes_moved: lanes.map(|(.., bytes)| bytes),
            runs: Vec::new(),
            walks_per_second: Interval { value: 0.0, low: 0.0, high: 0.0 },
            time_ratio: Interval { value: 1.0, low: 1.0, high: 1.0 },
            times,
        });
        subjects.push(subject);
    }
    let runs = race(&mut subjects, passes, rounds.into())?;
    let base: Vec<f64> = runs.first().map(|runs| runs.iter().map(|run| run.seconds).collect()).unwrap_or_default();
    for (rival, runs) in rivals.iter_mut().zip(runs) {
        let pairs: Vec<Pair> = runs.iter().zip(&base).map(|(run, base)| Pair { first: run.seconds, second: *base }).collect();
        rival.walks_per_second = walks_per_second(walks, &runs);
        rival.time_ratio = ratio(&pairs);
        rival.runs = runs;
    }
    Ok(rivals)
}

/// Something under the name of a schedule.
pub type Named<T> = (String, T);

/// Those that can be built, in their order, and what was said to the others.
pub fn willing<S, E: std::fmt::Display>(
    schedules: impl IntoIterator<Item = Named<Schedule>>,
    mut build: impl FnMut(&Schedule, Instruments) -> Result<S, E>,
) -> (Vec<Named<Schedule>>, Vec<Named<String>>) {
    let (mut taken, mut left_out) = (Vec::new(), Vec::new());
    for (name, schedule) in schedules {
        match build(&schedule, Instruments::default()) {
            Ok(_) => taken.push((name, schedule)),
            Err(why) => left_out.push((name, why.to_string())),
        }
    }
    (taken, left_out)
}

fn roulette(schedule: &Schedule) -> String {
    schedule.roulette.as_ref().map_or("none", |roulette| roulette.name()).to_owned()
}

/// The films seen so far, by roulette: whose it was, and its hash.
#[derive(Default)]
struct Films(BTreeMap<String, (String, u64)>);

impl Films {
    fn check(&mut self, schedule: &Schedule, film: u64) -> Result<(), Error> {
        let (first, seen) = self.0.entry(roulette(schedule)).or_insert_with(|| (schedule.to_string(), film));
        match *seen == film {
            true => Ok(()),
            false => Err(Error::Conservation(format!("`{schedule}` has another film than `{first}`"))),
        }
    }
}

/// Occupancy, work-groups over the steps and bytes of state, where they follow from the lengths of the walks.
fn lanes_of(
    schedule: &Schedule,
    source: &dyn WorkSource,
    report: &Report,
    lengths: &Lengths,
    layout: &Layout,
) -> Option<(Occupancy, u64, u64)> {
    let bytes: usize = layout.kernels.iter().map(|kernel| kernel.bytes().0 + kernel.bytes().1).sum();
    let blocks = [report.pool_blocks, report.pool_blocks.div_ceil(report.banks.max(1))];
    let replayed = |schedule: &Schedule| replay_in_banks(schedule, source, report.passes, blocks, report.ring, lengths);
    match schedule.execution {
        Execution::Wavefront => {
            let mut lanes = replayed(schedule).occupancy;
            // Stages that pack lanes launch fewer subgroups; a step has so many of these stages, and so many others.
            let stages = layout.kernels.len().max(1) as u64;
            let packing = layout.kernels.iter().filter(|kernel| schedule.local.packs(&kernel.stage)).count() as u64;
            for (launched, local) in lanes.launched.iter_mut().zip(lanes.launched_local) {
                *launched = (local * packing + *launched * (stages - packing)) / stages;
            }
            Some((lanes, report.group_steps, bytes as u64 * lanes.useful))
        }
        // Whoever keeps whole tiles runs each subgroup as long as its longest walk.
        Execution::Megakernel | Execution::Persistent => {
            let seen = replayed(&Schedule::never().with_roulette(schedule.roulette.clone()));
            Some((seen.occupancy, seen.group_steps(), 0))
        }
        _ => None,
    }
}

/// Times of all subjects, taken in turns.
fn race<S: Subject>(subjects: &mut [S], passes: u32, rounds: Rounds) -> Result<Vec<Vec<Run>>, Error> {
    let mut runs = vec![Vec::new(); subjects.len()];
    rounds.take(subjects.len(), |index| {
        let (begun, processor) = (Instant::now(), process_time());
        subjects[index].scheduler().run(passes)?;
        let spent = process_time().zip(processor).map(|(after, before)| after.saturating_sub(before));
        runs[index].push(Run { seconds: begun.elapsed().as_secs_f64(), processor: spent.as_ref().map(Duration::as_secs_f64) });
        Ok(())
    })?;
    Ok(runs)
}

fn walks_per_second(walks: f64, runs: &[Run]) -> Interval {
    bootstrap(runs, |runs| walks / median(&runs.iter().map(|run| run.seconds).collect::<Vec<_>>()).max(f64::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wavepool::ImageTiles;

    pub(super) const WALK: &str = "
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
            assert!(rivals.iter().all(|rival| rival.occupancy.map(|lanes| lanes.useful) == Some(useful) && rival.runs.len() == 3));
            assert!(rivals.iter().all(|rival| rival.film == rivals[0].film && rival.name == rival.schedule));
            assert!(rivals[1].group_efficiency() <= rivals[0].group_efficiency());
            // Every tile holds walks of 7 steps, so every group of the megakernel runs for 7.
            assert_eq!((rivals[0].time_ratio.value, rivals[3].state_bytes_moved, rivals[3].group_steps), (1.0, Some(0), Some(2 * 16 * 7)));
            // Flag and both words read, both words written: 20 bytes.
            assert_eq!(rivals[0].state_bytes_moved, Some(20 * useful));
            assert!(rivals[3].report.launches < rivals[0].report.launches);
            let runs = rivals.iter().flat_map(|rival| &rival.runs);
            assert!(runs.clone().all(|run| run.seconds > 0.0) && rivals[0].walks_per_second.value > 0.0);
            assert_eq!(runs.clone().all(|run| run.processor.is_some()), process_time().is_some());
            for rival in &rivals {
                if let Some(times) = &rival.times {
                    assert!(times.events.is_empty() && times.busy_ns() > 0, "{}: sums alone are kept", rival.name);
                }
            }
            let mixed = [Schedule::never(), Schedule::never().with_roulette(None)];
            assert!(bench_schedules(gpu, &program, source, &mixed, 1, 1).expect_err("other walks").to_string().contains("other roulettes"));
            Ok(())
        });
    }

    /// Kills: instruments on candidates that take turns, which refuse them; lanes of a stage that packs them counted as those of one that does
    /// not.
    #[test]
    fn candidates_and_packed_lanes_have_rows() {
        crate::conformance::run(|gpu| {
            let program = Program::builder("walk").source("walk.wgsl", WALK).stage("hop").build().map_err(|error| error.to_string())?;
            let source = ImageTiles { width: 64, height: 64 };
            let schedules = ["auto", "never", "never,local=all"].map(|name| name.parse::<Schedule>().expect(name).with_pool_blocks(4));
            let rivals = bench_schedules(gpu, &program, source, &schedules, 3, 2).map_err(|error| error.to_string())?;
            assert!(rivals[0].occupancy.is_none() && rivals[0].state_bytes_moved.is_none() && rivals[0].times.is_none());
            let [plain, packed] = [1, 2].map(|rival: usize| rivals[rival].occupancy.expect("one schedule"));
            assert_eq!((packed.useful, packed.launched), (plain.useful, plain.launched_local));
            assert!(packed.launched[1] < plain.launched[1], "{packed:?} {plain:?}");
            Ok(())
        });
    }

    /// Kills: films of other roulettes compared with one another, films of one roulette not compared at all.
    #[test]
    fn films_are_compared_by_roulette() {
        let mut films = Films::default();
        let (lane, none) = (Schedule::block(), Schedule::never().with_roulette(None));
        assert_eq!([films.check(&lane, 1), films.check(&none, 2), films.check(&lane, 1)].map(|seen| seen.is_ok()), [true; 3]);
        let told = films.check(&Schedule::never(), 2).expect_err("another film").to_string();
        assert!(told.contains("another film than `block"), "{told}");
    }

    /// Kills: a schedule that cannot be built lost without a word, or taken along.
    #[test]
    fn refusals_are_told() {
        let named = |name: &str| (name.to_owned(), name.parse::<Schedule>().expect(name));
        let build = |schedule: &Schedule, _| match schedule.to_string().starts_with("per-lane") {
            true => Err("no lanes here"),
            false => Ok(()),
        };
        let (taken, left_out) = willing(["never", "per-lane", "block"].map(named), build);
        assert_eq!(taken.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["never", "block"]);
        assert_eq!(left_out, [("per-lane".to_owned(), "no lanes here".to_owned())]);
    }
}
