//! The schedule is predicted: from the lengths of the walks and the policies alone, every count, every step and every tile handed out.
//!
//! Key decision: lengths come from outside (a buffer that the test has made up, or a megakernel's run of the same scene), never from the
//! run that is predicted.

use std::time::Instant;

use wavepool::{
    ImageTiles, Instruments, Report, Resources, Schedule, Scheduler,
    policy::{PerBlock, PerGroup, PerLane, Statistic},
    replay::{Replay, WalkLengths, replay_in_banks},
    upload, wgpu,
};
use wavepool_tests::{
    device::{gpu, level, patient},
    programs::given,
    workloads::{Draws, Order, Portion, Workload},
};

use crate::subjects::{Subject, built_in, flight_helmet};

/// Threshold and interval of checks; `None` is `never`.
const POLICIES: [Option<(f32, u32)>; 5] = [None, Some((0.0, 1)), Some((0.25, 1)), Some((0.5, 2)), Some((2.0, 3))];

/// Items to lanes.
const PORTIONS: [Portion; 5] = [Portion::Lanes(1), Portion::Lanes(3), Portion::Packed(1), Portion::Packed(4), Portion::Packed(8)];

/// Workloads per policy and order.
fn workloads() -> u64 {
    match (is_full(), level()) {
        (true, _) => 200,
        (_, None) => 80,
        (_, Some(_)) => 5,
    }
}

fn is_full() -> bool {
    std::env::var_os("WAVEPOOL_FULL").is_some_and(|value| value == "1")
}

/// Everything that replay can know about a run, in a form that shows where two differ.
fn assert_predicted(report: &Report, seen: &Replay, stages: usize, lengths: &dyn WalkLengths, name: &str) {
    let steps = report.observed.steps.as_ref().expect("asked for");
    assert_eq!(steps.assignments, seen.assignments, "{name}: assignments");
    let of = |figure: fn(&wavepool::profile::StepRecord) -> u32| steps.steps.iter().map(figure).collect::<Vec<_>>();
    assert_eq!(of(|step| step.live_blocks), seen.live_blocks, "{name}: live blocks");
    assert_eq!(of(|step| step.live_lanes), seen.live_lanes, "{name}: live lanes");
    assert_eq!(of(|step| step.launched_blocks), seen.launched_blocks, "{name}: work-groups");
    let handed_out: Vec<u32> = of(|step| step.new_blocks).into_iter().filter(|new| *new > 0).collect();
    assert_eq!(handed_out, seen.regenerations, "{name}: blocks that start a tile, or lanes that start an item");
    assert_eq!(steps.resolved_after, seen.resolved_after, "{name}: passes resolved");
    let counted = (report.steps, u64::from(report.regenerations), report.block_steps, report.lane_steps);
    assert_eq!(counted, (seen.steps(), seen.regenerations.len() as u64, seen.block_steps(), seen.lane_steps()), "{name}: totals");
    let launches = seen.launches_in_banks(stages, report.pool_blocks.div_ceil(report.banks), lengths);
    assert_eq!(report.launches, launches, "{name}: launches in {} banks", report.banks);
    assert!(report.banks > 1 || launches == seen.launches(stages), "{name}: one bank");
}

/// For each of 35 policies 80 workloads, which is 400 per rule of regeneration over tiles and 160 over lanes (1000 with `WAVEPOOL_FULL=1`), 5 of
/// each on further levels of devices.
/// Kills: a tick that asks too early or compares the other way; a block retired a step late; tiles beyond the ring; a key of a running
/// tile that ignores its age; the last step of a submission lost by the record; a length that counts from the wrong birth.
#[test]
fn made_up_workloads_are_predicted_exactly() {
    let Some(gpu) = gpu() else { return };
    let program = given();
    let (begun, mut runs) = (Instant::now(), 0);
    let instruments = Instruments { steps: true, lengths: true, ..Instruments::default() };
    let by_tile = POLICIES.iter().flat_map(|policy| Order::ALL.map(|order| (*policy, None, order, 1)));
    let formulas = Order::ALL.into_iter().filter(|order| !order.is_measured());
    let by_lane = PORTIONS.iter().flat_map(|portion| formulas.clone().map(|order| (None, Some(*portion), order, 2)));
    for (policy, portion, order, times) in by_tile.chain(by_lane) {
        for number in 0..workloads() * if is_full() { times } else { 1 } {
            let mut workload = Workload::draw(number, order, policy.is_some());
            (workload.block, workload.portion) = (policy, portion);
            let draws = &mut Draws(number << 3);
            // A launch without groups is not free: few banks, and few walks of a thousand steps.
            let bank = draws.one_of(&[None, Some(1), Some(2), Some(4)]).map(|banks| workload.pool.div_ceil(banks));
            let submission = draws.one_of(&[None, Some(1), Some(7)]);
            if number % 50 > 0 {
                workload.shorten(40);
            }
            let mut schedule = workload.schedule().with_pool_blocks(workload.pool).with_ring(workload.ring);
            (schedule.bank_blocks, schedule.submission_steps) = (bank, submission);
            let name = format!("{}, banks of {bank:?}, submissions of {submission:?}", workload.name());
            let words = workload.words();
            let buffer = upload(&gpu.device, "lengths", wavepool::bytemuck::cast_slice(&words), wgpu::BufferUsages::STORAGE);
            let resources = Resources::new().buffer("lengths", &buffer.unwrap_or_else(|error| panic!("{name}: {error}")));
            let builder = Scheduler::builder(&program, workload.source).schedule(&schedule).resources(&resources).instruments(instruments);
            let scheduler = builder.build_on(gpu);
            let outcome = scheduler.and_then(|mut scheduler| scheduler.run_with(0, workload.passes, patient()));
            let (_, report) = outcome.unwrap_or_else(|error| panic!("{name}: {error}"));
            let lengths = |pass: u32, tile: u32, lengths: &mut [u32; 256]| *lengths = *workload.lengths(pass, tile);
            let in_bank = report.pool_blocks.div_ceil(report.banks);
            let seen = workload.replay_in_banks(report.pool_blocks, in_bank, report.ring);
            assert_predicted(&report, &seen, 1, &lengths, &name);
            let kept = report.observed.lengths.as_ref().expect("asked for");
            let given = (0..workload.passes).flat_map(|pass| (0..workload.tiles()).map(move |tile| (pass, tile)));
            let given = given.flat_map(|(pass, tile)| workload.lengths(pass, tile).iter());
            assert!(kept.words().iter().eq(given), "{name}: lengths");
            runs += 1;
        }
    }
    eprintln!("{runs} workloads in {:.1} s on {}", begun.elapsed().as_secs_f64(), gpu.facts);
}

const IMAGE: ImageTiles = ImageTiles { width: 40, height: 56 };
const SAMPLES: u32 = 4;

/// Takes the lengths of a megakernel's walks and predicts wavefronts with them.
fn predict(name: &str, subject: &Subject) {
    let lengths_only = Instruments { lengths: true, ..Instruments::default() };
    let observed = Instruments { steps: true, lengths: true, ..Instruments::default() };
    let by_block = |statistic| Some(std::sync::Arc::new(PerBlock(statistic)) as std::sync::Arc<dyn wavepool::policy::Roulette>);
    let group = PerGroup::new(32).expect("a power of two");
    let roulettes = [
        Some(std::sync::Arc::new(PerLane) as _),
        by_block(Statistic::Max),
        by_block(Statistic::Mean),
        Some(std::sync::Arc::new(group) as _),
    ];
    for (number, roulette) in roulettes.into_iter().enumerate() {
        let megakernel = Schedule::megakernel().with_roulette(roulette.clone());
        let (_, report) = subject.run(IMAGE, SAMPLES, &megakernel, lengths_only);
        let lengths = report.observed.lengths.expect("asked for");
        let longest = lengths.words().iter().max().copied().unwrap_or(0);
        assert!(longest > 4, "{name}: walks of {longest} steps predict nothing");
        for (text, pool) in [
            ("never", 5),
            ("block,threshold=0,check_every=1", 3),
            ("block,threshold=0.25,check_every=2,order=morton", 7),
            ("block,threshold=0.5,check_every=1,order=depth-max", 5),
            ("never,order=depth-mean", 9),
            ("block,order=depth-decayed", 40),
            ("per-lane", 5),
            ("compaction,order=morton", 3),
            ("keyed", 4),
        ] {
            let schedule = text.parse::<Schedule>().expect("a schedule").with_pool_blocks(pool).with_roulette(roulette.clone());
            // Roulette that is shared by lanes draws otherwise where these come from several tiles.
            let is_shared = roulette.as_ref().is_some_and(|roulette| roulette.scope().is_shared());
            if is_shared && schedule.regeneration.grain().is_by_lane() {
                continue;
            }
            let (_, report) = subject.run(IMAGE, SAMPLES, &schedule, observed);
            let what = format!("{name}, {schedule}, {pool} blocks");
            let blocks = [report.pool_blocks, report.pool_blocks];
            let seen = replay_in_banks(&schedule, &IMAGE, SAMPLES, blocks, report.ring, &lengths);
            assert_eq!(report.observed.lengths.as_ref(), Some(&lengths), "{what}: lengths of the walks");
            assert_predicted(&report, &seen, subject.stages(), &lengths, &what);
        }
        if number == 0 {
            predict_from_results(name, subject, lengths.words());
        }
    }
}

/// What results say of tiles is asked of one schedule, must be what another one sees, and predicts that.
fn predict_from_results(name: &str, subject: &Subject, words: &[u32]) {
    let observed = Instruments { steps: true, lengths: true, ..Instruments::default() };
    let run = |text: &str, pool: u32| {
        let schedule = text.parse::<Schedule>().expect("a schedule").with_pool_blocks(pool);
        let schedule = schedule.with_roulette(Some(std::sync::Arc::new(PerLane)));
        let (_, report) = subject.run(IMAGE, SAMPLES, &schedule, observed);
        (schedule, report)
    };
    let told = run("never,order=error", 6).1.observed.lengths.expect("asked for");
    assert_eq!(told.words(), words, "{name}: lengths of the walks");
    let last: std::collections::BTreeSet<u32> = told.keys().iter().rev().take(told.tiles() as usize).copied().collect();
    assert!(last.len() > 3, "{name}: keys {last:?} order nothing");
    let (schedule, report) = run("block,threshold=0.25,check_every=1,order=error", 3);
    let what = format!("{name}, {schedule}");
    assert_eq!(report.observed.lengths.as_ref(), Some(&told), "{what}: lengths of the walks, keys of the tiles");
    let seen = replay_in_banks(&schedule, &IMAGE, SAMPLES, [report.pool_blocks, report.pool_blocks], report.ring, &told);
    assert_predicted(&report, &seen, subject.stages(), &told, &what);
}

/// Kills: a walk that takes another step in the wavefront than in the megakernel; a block that obeys its draw a step early or late; a
/// megakernel that counts steps from 0.
#[test]
fn built_in_scenes_are_predicted_from_the_megakernel() {
    if gpu().is_some() && level().is_none() {
        ["cornell-box", "mirror-corridor"].iter().for_each(|name| predict(name, &built_in(name)));
    }
}

/// Kills: a stage whose walks end elsewhere when textures, alpha and a panorama are looked up.
#[test]
fn a_real_file_is_predicted_from_the_megakernel() {
    if gpu().is_some() && level().is_none() {
        flight_helmet().iter().for_each(|helmet| predict("FlightHelmet", helmet));
    }
}
