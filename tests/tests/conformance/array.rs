//! The same bits from every combination of settings: a pairwise covering array over scenes, policies, sizes and drivers.
//!
//! Key decision: each row is compared with a plain run of its scene on the same level of devices, in a process of that level's own. The rows of all
//! levels run in checked mode too, which counts lanes and results after every step, on the first level, whose kernels compile soonest, and
//! those of another driver there as well. With `WAVEPOOL_FULL=1` every level runs its rows in checked mode, and rows of the full product follow, taken at a
//! stride that is prime to every number of levels, as many as time allows.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    time::{Duration, Instant},
};

use wavepool::{
    ImageTiles, Instruments, Report, Schedule,
    policy::{
        BlockInPlace, KeyedQueues, LaneCompaction, LaneInPlace, LaunchScope, NeverRegenerate, ORDERS, OrderRule, PerBlock, PerLane,
        Roulette, RouletteScope, Statistic, StreamCompaction,
    },
};
use wavepool_tests::{
    covering::{Factor, factor, pairwise, product},
    device::{gpu, level, levels},
};

use crate::subjects::{SUBJECTS, Subject};

const IMAGE: ImageTiles = ImageTiles { width: 40, height: 56 };
const SAMPLES: u32 = 4;
const THRESHOLDS: [f32; 4] = [0.0, 0.25, 0.5, 2.0];
const CHECK_EVERY: [u32; 3] = [1, 2, 3];
/// One block, few, one for each of the 12 tiles, and more.
const POOLS: [u32; 4] = [1, 5, 12, 40];
const BANKS: [Option<u32>; 3] = [Some(1), Some(2), None];
const SUBMISSIONS: [Option<u32>; 3] = [Some(1), Some(7), None];
/// A full product stops after this long on a level: with four levels within half an hour, two arrays at a time.
const FULL: Duration = Duration::from_secs(300);

/// The settings; of devices there are as many levels as are found here.
fn factors(levels: usize) -> [Factor; 11] {
    [
        factor("scene", SUBJECTS.len()),
        factor("execution", 5),
        factor("order", ORDERS.len()),
        factor("regeneration", 5),
        factor("threshold", THRESHOLDS.len()),
        factor("check_every", CHECK_EVERY.len()),
        factor("pool", POOLS.len()),
        factor("bank", BANKS.len()),
        factor("submission", SUBMISSIONS.len()),
        factor("local", 2),
        factor("level", levels),
    ]
}

/// Executions 0 and 1 are wavefronts, over live blocks and with full launches. The others, whole walks in one kernel, measure no order,
/// regenerate nothing and have no banks; `never` (regeneration 0) has no threshold. Items to lanes (2 in place, 3 packed, 4 keyed) have
/// none either, and no tile that could be measured; packed lanes are not launched by block. Local packing (1) is for stages that are
/// launched over blocks.
fn is_allowed(row: &[usize]) -> bool {
    let is_formula = matches!((ORDERS[row[2]].make)().rule(), OrderRule::Formula(_));
    let execution = row[1] < 2 || (is_formula && row[3] == 0 && row[7] == 2 && row[9] == 0);
    execution
        && match row[3] {
            0 => row[4] == 0 && row[5] == 0,
            1 => true,
            2 => row[4] == 0 && is_formula,
            regeneration => {
                row[4] == 0 && is_formula && row[1] == 0 && row[9] == 0 && (regeneration == 3 || (row[5] == 0 && has_queue_key(row[0])))
            }
        }
}

/// Scenes with a kind of work to order walks by.
fn has_queue_key(scene: usize) -> bool {
    !["collatz", "border"].contains(&SUBJECTS[scene].0)
}

/// Roulette by block needs whole tiles in blocks.
fn keeps_tiles(row: &[usize]) -> bool {
    row[3] < 2
}

fn schedule_of(row: &[usize]) -> Schedule {
    let mut schedule = match row[1] {
        0 => Schedule::block(),
        1 => Schedule::block().with_launch(LaunchScope::AllBlocks),
        2 => Schedule::megakernel(),
        3 => Schedule::persistent(),
        _ => Schedule::megakernel_regen(),
    };
    schedule.order = (ORDERS[row[2]].make)();
    schedule = match row[3] {
        0 => schedule.with_regeneration(NeverRegenerate),
        1 => schedule.with_regeneration(BlockInPlace::new(THRESHOLDS[row[4]], CHECK_EVERY[row[5]])),
        2 => schedule.with_regeneration(LaneInPlace::new(CHECK_EVERY[row[5]])),
        3 => schedule.with_regeneration(StreamCompaction::new(CHECK_EVERY[row[5]])),
        _ => schedule.with_regeneration(KeyedQueues),
    };
    schedule.bank_blocks = BANKS[row[7]];
    schedule.submission_steps = SUBMISSIONS[row[8]];
    schedule.local = if row[9] == 1 { LaneCompaction::All } else { LaneCompaction::None };
    schedule.with_pool_blocks(POOLS[row[6]])
}

/// What tells what a run did: steps, launches, groups, regenerations, and which tile went where when.
type Fingerprint = (u64, u64, u64, u32, u32, Vec<(u32, u32, u32)>);

fn fingerprint(report: &Report) -> Fingerprint {
    let assigned = report.observed.steps.iter().flat_map(|steps| &steps.assignments);
    let assigned = assigned.map(|assignment| (assignment.step, assignment.block, assignment.tile)).collect();
    (report.steps, report.launches, report.group_steps, report.regenerations, report.submissions, assigned)
}

/// Runs rows one after the other and compares each with the plain run of its scene.
struct Comparison {
    roulette: Arc<dyn Roulette>,
    /// By scene, when it is there.
    subjects: Vec<Option<Subject>>,
    baselines: BTreeMap<usize, (u64, u64)>,
    seen: BTreeMap<usize, BTreeSet<Fingerprint>>,
    rows: usize,
}

impl Comparison {
    fn new(roulette: Arc<dyn Roulette>) -> Self {
        let subjects = SUBJECTS.iter().map(|(_, make)| make()).collect();
        Comparison { roulette, subjects, baselines: BTreeMap::new(), seen: BTreeMap::new(), rows: 0 }
    }

    /// In checked mode, or as people run it, or both.
    fn run(&mut self, row: &[usize], [is_plain, is_checked]: [bool; 2]) {
        let Some(subject) = &self.subjects[row[0]] else { return };
        let name = SUBJECTS[row[0]].0;
        let (expected, killed) = *self.baselines.entry(row[0]).or_insert_with(|| {
            let schedule = Schedule::never().with_roulette(Some(self.roulette.clone()));
            let (film, report) = subject.run(IMAGE, SAMPLES, &schedule, Instruments { steps: true, ..Instruments::default() });
            assert_eq!(film.not_finite(), 0, "{name}");
            let lit = (0..film.pixels()).filter(|pixel| film.sum(*pixel, 0) > 0.0).count();
            assert!(lit * 2 > film.pixels(), "{name}: a black picture proves nothing");
            self.seen.entry(row[0]).or_default().insert(fingerprint(&report));
            assert!(report.items_killed > 0 || name != "hops", "roulette killed nothing");
            (film.hash(), report.items_killed)
        });
        let schedule = schedule_of(row).with_roulette(Some(self.roulette.clone()));
        let instruments = [is_plain.then(Instruments::default), is_checked.then(Instruments::checked)];
        let mut counted = Vec::new();
        for instruments in instruments.into_iter().flatten() {
            let what = format!("{name}: {schedule}, row {row:?}, checked: {}", instruments.checked);
            let (film, report) = subject.run(IMAGE, SAMPLES, &schedule, Instruments { steps: true, ..instruments });
            assert_eq!(film.hash(), expected, "{what}, has other bits than `never`");
            assert_eq!(report.items_killed, killed, "{what}: roulette killed unlike numbers");
            assert!(film.samples().iter().all(|samples| *samples == SAMPLES));
            counted.push((report.steps, report.launches, report.group_steps, report.regenerations));
            if counted.len() == 1 {
                self.seen.entry(row[0]).or_default().insert(fingerprint(&report));
            }
        }
        assert!(counted.windows(2).all(|two| two[0] == two[1]), "{name}: {schedule}, row {row:?}: checked mode changes the schedule");
        self.rows += 1;
    }

    /// Runs that did something that no other did.
    fn different(&self) -> usize {
        self.seen.values().map(BTreeSet::len).sum()
    }

    /// Every scene has seen schedules that do different things.
    fn check(&self, what: &str) {
        let runs = self.different();
        eprintln!("{what}: {} rows, {} scenes, {runs} different schedules", self.rows, self.seen.len());
        assert!(runs * 10 >= (self.rows + self.seen.len()) * 8, "{what}: only {runs} of {} schedules differ", self.rows);
        assert!(self.seen.values().all(|seen| seen.len() > 1), "{what}: a scene has seen one schedule only");
    }
}

/// Runs the rows of this level, or starts a process for each level.
fn on_every_level(test: &str, roulettes: &[Arc<dyn Roulette>]) {
    let levels = levels();
    let Some(here) = level() else {
        return levels.iter().enumerate().for_each(|(index, level)| level.run_again_as(index, levels.len(), &["--exact", test]));
    };
    if gpu().is_none() {
        return;
    }
    let (index, count) = wavepool_tests::device::place_among_levels();
    let mut baselines = BTreeSet::new();
    for roulette in roulettes {
        let what = format!("{here}, roulette {}", roulette.name());
        let mut factors = factors(count);
        // The last execution shares no draw.
        factors[1].levels -= usize::from(roulette.scope() != RouletteScope::Lane);
        let mut comparison = Comparison::new(roulette.clone());
        let is_by_lane = roulette.scope() == RouletteScope::Lane;
        let is_allowed = |row: &[usize]| is_allowed(row) && (is_by_lane || keeps_tiles(row));
        let rows = pairwise(&factors, is_allowed);
        let is_full = std::env::var_os("WAVEPOOL_FULL").is_some_and(|value| value == "1");
        for row in rows.iter().filter(|row| index == 0 || row[10] == index) {
            comparison.run(row, [row[10] == index, index == 0 || is_full || !here.starts_with("lavapipe")]);
        }
        comparison.check(&what);
        if is_full {
            full(&what, &factors[..10], &is_allowed, &mut comparison, FULL / roulettes.len() as u32);
        }
        // Scene 1 has roulette; the statistics decide differently there.
        baselines.insert(comparison.baselines[&1]);
    }
    assert_eq!(baselines.len(), roulettes.len(), "policies of roulette that change nothing");
}

/// Rows of the product of all settings but the device, at a stride that visits every row once, until the time is over. In the product many
/// settings come to the same: a pool for all tiles leaves nothing to a threshold. So it must add to what the array has shown, no more.
fn full(what: &str, factors: &[Factor], is_allowed: &dyn Fn(&[usize]) -> bool, comparison: &mut Comparison, time: Duration) {
    let rows: Vec<Vec<usize>> = product(factors).filter(|row| is_allowed(row)).collect();
    let (begun, before) = (Instant::now(), comparison.different());
    let stride = (rows.len() / 2 + 1..).find(|stride| greatest_common_divisor(*stride, rows.len()) == 1).unwrap_or(1);
    let mut done = 0;
    while done < rows.len() && begun.elapsed() < time {
        comparison.run(&rows[done * stride % rows.len()], [true, false]);
        done += 1;
    }
    let different = comparison.different();
    eprintln!("{what}, full product: {done} of {} rows, {} more different schedules", rows.len(), different - before);
    assert!(different > before, "{what}: {done} rows of the product, and no schedule that the array had not");
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// Kills: a pin left out between two stages; a random number keyed by lane, block or bank; a path that keeps the state of the tile before;
/// a bank whose blocks are counted from the wrong one; a submission that loses its last step.
#[test]
fn every_pair_of_settings_gives_the_same_bits() {
    on_every_level("array::every_pair_of_settings_gives_the_same_bits", &[Arc::new(PerLane)]);
}

/// Kills: a block's draw keyed by its place in the pool or by the step of the run; a chance that depends on the order of the lanes; lanes
/// of the megakernel that leave the group before its draw; a verdict of a block in another bank.
#[test]
fn every_pair_of_settings_keeps_block_roulette() {
    let roulettes: [Arc<dyn Roulette>; 2] = [Arc::new(PerBlock(Statistic::Max)), Arc::new(PerBlock(Statistic::Mean))];
    on_every_level("array::every_pair_of_settings_keeps_block_roulette", &roulettes);
}

/// Kills: a combination that means nothing and is run in silence.
#[test]
fn a_megakernel_with_an_order_that_sorts_is_refused() {
    let factors = factors(1);
    let sorts = |row: &Vec<usize>| !matches!((ORDERS[row[2]].make)().rule(), OrderRule::Formula(_));
    for row in product(&factors).filter(|row| row[1] >= 2 && sorts(row)).step_by(997) {
        let program = wavepool_tests::programs::collatz();
        let message = program.check(&IMAGE, &schedule_of(&row)).expect_err("refused").to_string();
        assert!(
            ["megakernel", "persistent"].iter().any(|name| message.contains(name)) && message.contains(ORDERS[row[2]].name),
            "{message}"
        );
    }
}
