//! The best settings of each schedule, found by trying them.
//!
//! Key decision: first the settings of the policy at one size of the pool, then sizes of the pool at the best settings, all rivals in turns.
//! What is given up: the best of all pairs, for a sum of trials instead of their product. The best of many trials is a lucky one too, so its
//! speed here says nothing; whoever compares measures it again.
//!
//! **Invariant:** a setting is tried wherever the library reads it, so a new schedule that takes a known key needs no entry here.

use wavepool::{Error, Instruments, Schedule, policy::WorkSource};

use super::{Films, Rounds, Subject, csv::field, markdown::cell, race, walks_per_second};
use crate::Interval;

/// What is tried.
#[derive(Clone, Debug)]
pub struct Grid<'a> {
    /// Values of each key, tried in every combination by the schedules that read the key.
    pub settings: &'a [(&'a str, &'a [&'a str])],
    /// Sizes of the pool in blocks; settings are tried at the first.
    pub pools: &'a [u32],
}

/// One schedule that was tried.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Trial {
    /// The name that it was made from.
    pub name: String,
    /// The schedule, with its pool.
    pub schedule: Schedule,
    /// Walks per second.
    pub walks_per_second: Interval,
    /// Runs that were timed.
    pub runs: usize,
    /// True for the fastest of its name in the last round of trials.
    pub is_best: bool,
}

/// `name` with every combination of the settings that it reads.
///
/// # Errors
/// [`Error::Schedule`] when there is no schedule of that name.
pub fn combinations(name: &str, settings: &[(&str, &[&str])]) -> Result<Vec<Schedule>, Error> {
    name.parse::<Schedule>()?;
    let mut texts = vec![name.to_owned()];
    for (key, values) in settings {
        let reads = |value: &&&str| format!("{name},{key}={value}").parse::<Schedule>().is_ok();
        let read: Vec<&&str> = values.iter().filter(reads).collect();
        if !read.is_empty() {
            texts = texts.iter().flat_map(|text| read.iter().map(move |value| format!("{text},{key}={value}"))).collect();
        }
    }
    texts.iter().map(|text| text.parse()).collect()
}

/// Tries the grid on every schedule of `names`. All share the roulette of their defaults, and their films are compared.
///
/// # Errors
/// Those of `build` and of running, [`Error::Conservation`] when films differ, [`Error::Schedule`] for an unknown name.
pub fn sweep<S: Subject, E: From<Error>>(
    source: &dyn WorkSource,
    names: &[&str],
    grid: &Grid<'_>,
    passes: u32,
    rounds: impl Into<Rounds>,
    mut build: impl FnMut(&Schedule, Instruments) -> Result<S, E>,
) -> Result<Vec<Trial>, E> {
    let rounds = rounds.into();
    let walks = f64::from(source.items()) * f64::from(passes);
    let Some(first_pool) = grid.pools.first() else { return Ok(Vec::new()) };
    let mut films = Films::default();
    let mut attempt = |candidates: Vec<(String, Schedule)>| -> Result<Vec<Trial>, E> {
        let mut subjects = Vec::new();
        for (_, schedule) in &candidates {
            let mut subject = build(schedule, Instruments::default())?;
            let (film, _) = subject.scheduler().run(passes)?;
            films.check(schedule, film.hash())?;
            subjects.push(subject);
        }
        let runs = race(&mut subjects, passes, rounds)?;
        let trials = candidates.into_iter().zip(runs).map(|((name, schedule), runs)| {
            let walks_per_second = walks_per_second(walks, &runs);
            Trial { name, schedule, walks_per_second, runs: runs.len(), is_best: false }
        });
        Ok(trials.collect())
    };
    let mut candidates = Vec::new();
    for name in names {
        let schedules = combinations(name, grid.settings)?;
        candidates.extend(schedules.into_iter().map(|schedule| ((*name).to_owned(), schedule.with_pool_blocks(*first_pool))));
    }
    // What has nothing to set waits for the sizes of the pool.
    let has_choice = |name: &str| candidates.iter().filter(|(other, _)| other == name).count() > 1;
    let (choices, settled): (Vec<_>, Vec<_>) = candidates.iter().cloned().partition(|(name, _)| has_choice(name));
    let mut trials = attempt(choices)?;
    let mut best: Vec<(String, Schedule)> = Vec::new();
    for name in names {
        let settled = settled.iter().find(|(other, _)| other == name).map(|(_, schedule)| schedule);
        best.extend(
            fastest(&trials, name).map(|place| &trials[place].schedule).or(settled).map(|schedule| ((*name).to_owned(), schedule.clone())),
        );
    }
    let sized = |(name, schedule): &(String, Schedule)| {
        let (name, schedule) = (name.clone(), schedule.clone());
        grid.pools.iter().map(move |blocks| (name.clone(), schedule.clone().with_pool_blocks(*blocks)))
    };
    let mut pools = attempt(best.iter().flat_map(sized).collect())?;
    for name in names {
        if let Some(place) = fastest(&pools, name) {
            pools[place].is_best = true;
        }
    }
    trials.extend(pools);
    Ok(trials)
}

/// Where the fastest trial of that name stands.
fn fastest(trials: &[Trial], name: &str) -> Option<usize> {
    let of_name = trials.iter().enumerate().filter(|(_, trial)| trial.name == name);
    of_name.max_by(|(_, one), (_, other)| one.walks_per_second.value.total_cmp(&other.walks_per_second.value)).map(|(place, _)| place)
}

/// The best schedule of each name, in the order of the trials.
pub fn best(trials: &[Trial]) -> Vec<(String, Schedule)> {
    trials.iter().filter(|trial| trial.is_best).map(|trial| (trial.name.clone(), trial.schedule.clone())).collect()
}

/// Head of [`markdown`].
pub const HEAD: &str = "| cell | name | settings | pool | Mwalks/s | best |
| --- | --- | --- | ---: | ---: | --- |
";

/// The trials as rows of a Markdown table, with `label` before each.
pub fn markdown(label: &str, trials: &[Trial]) -> String {
    let write = |trial: &Trial| {
        let rate = trial.walks_per_second;
        format!(
            "| {} | {} | `{}` | {} | {:.3} [{:.3}, {:.3}] | {} |\n",
            cell(label),
            cell(&trial.name),
            cell(&trial.schedule.to_string()),
            trial.schedule.pool_blocks.unwrap_or_default(),
            rate.value / 1e6,
            rate.low / 1e6,
            rate.high / 1e6,
            if trial.is_best { "yes" } else { "" },
        )
    };
    trials.iter().map(write).collect()
}

/// All trials (workload, place, trials) as CSV.
pub fn csv([workload, at]: [&str; 2], cells: &[(String, u32, Vec<Trial>)]) -> String {
    let mut out = format!(
        "# {workload}: what was walked\n# {at}: what varies from cell to cell\n# name: name of the schedule\n# schedule: with all its settings\n\
         # pool_blocks: blocks of the pool\n# walks_per_second, walks_per_second_low, walks_per_second_high: by the median of the runs, with \
         its 95 % interval\n# runs: runs that were timed\n# best: 1 for the fastest of its name, which the comparison takes\n\
         {workload},{at},name,schedule,pool_blocks,walks_per_second,walks_per_second_low,walks_per_second_high,runs,best\n"
    );
    for (workload, at, trials) in cells {
        for trial in trials {
            let (schedule, rate) = (trial.schedule.to_string(), trial.walks_per_second);
            let pool = trial.schedule.pool_blocks.unwrap_or_default();
            out += &format!(
                "{},{at},{},{},{pool},{},{},{},{},{}\n",
                field(workload),
                field(&trial.name),
                field(&schedule),
                rate.value,
                rate.low,
                rate.high,
                trial.runs,
                u8::from(trial.is_best)
            );
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use wavepool::{ImageTiles, Program, Scheduler};

    use super::*;

    const SETTINGS: &[(&str, &[&str])] = &[("threshold", &["0", "0.5"]), ("check_every", &["1", "2", "0"]), ("every", &["4", "8"])];

    /// Kills: a combination that is left out, tried twice, or tried on a schedule that does not read the key; a value that nobody reads.
    #[test]
    fn every_schedule_tries_what_it_reads() {
        let count = |name: &str| {
            let mut printed: Vec<String> = combinations(name, SETTINGS).expect(name).iter().map(|schedule| schedule.to_string()).collect();
            printed.sort();
            printed.dedup();
            printed.len()
        };
        assert_eq!(["block", "per-lane", "compaction", "never-full", "megakernel"].map(count), [4, 2, 2, 1, 1]);
        assert!(combinations("nobody", SETTINGS).is_err());
    }

    /// Kills: a best that is not the fastest, or of another name; sizes that are not tried; settings of the slower trial kept.
    #[test]
    fn the_fastest_settings_go_on_to_the_sizes() {
        crate::conformance::run(|gpu| {
            let program = Program::builder("walk").source("walk.wgsl", super::super::tests::WALK).stage("hop").build();
            let program = program.map_err(|error| error.to_string())?;
            let source = ImageTiles { width: 64, height: 32 };
            let grid = Grid { settings: SETTINGS, pools: &[4, 8] };
            let names = ["never", "block", "megakernel"];
            let trials = sweep(&source, &names, &grid, 2, 2, |schedule, instruments| -> Result<Scheduler, Error> {
                Scheduler::builder(&program, source).schedule(schedule).instruments(instruments).build_on(gpu)
            });
            let trials = trials.map_err(|error| error.to_string())?;
            let (settings, pools) = trials.split_at(4);
            assert!(settings.iter().all(|trial| trial.name == "block" && !trial.is_best && trial.runs == 2));
            let seen: Vec<_> = pools.iter().map(|trial| (trial.name.as_str(), trial.schedule.pool_blocks)).collect();
            assert_eq!(seen, names.iter().flat_map(|name| [(*name, Some(4)), (*name, Some(8))]).collect::<Vec<_>>());
            let quickest = fastest(settings, "block").map(|place| settings[place].schedule.to_string());
            assert!(pools.iter().filter(|trial| trial.name == "block").all(|trial| Some(trial.schedule.to_string()) == quickest));
            let best = best(&trials);
            assert_eq!(best.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), names);
            for trial in pools.iter().filter(|trial| trial.is_best) {
                let rivals = pools.iter().filter(|other| other.name == trial.name);
                assert!(rivals.clone().all(|other| other.walks_per_second.value <= trial.walks_per_second.value), "{}", trial.name);
            }
            let bars = |line: &str| line.matches('|').count();
            assert!(markdown("made up", &trials).lines().all(|line| bars(line) == bars(HEAD.lines().next().unwrap_or_default())));
            let csv = csv(["scene", "depth"], &[("made up".into(), 4, trials.clone())]);
            let rows: Vec<&str> = csv.lines().filter(|line| line.starts_with("made up,4,")).collect();
            assert_eq!((rows.len(), rows.iter().filter(|row| row.ends_with(",1")).count()), (trials.len(), names.len()));
            Ok(())
        });
    }
}
