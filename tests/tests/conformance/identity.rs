//! The same film from every schedule.

use std::{collections::BTreeSet, sync::Arc};

use wavepool::{
    Film, ImageTiles, Instruments, LinearRange, Program, Report, Schedule, Scheduler,
    policy::{
        BlockInPlace, DepthDecayed, DepthMax, DepthMean, Execution, LaneCompaction, LaunchScope, Morton, PerBlock, PerGroup, PerLane,
        Roulette, Statistic, WorkSource,
    },
    shader::Fault,
};
use wavepool_tests::{
    arrays,
    device::{gpu, patient, run},
    memory,
    programs::{collatz, collatz_steps, hops, unequal},
};

/// Executions that walk in one kernel.
const WHOLE_WALKS: [&str; 3] = ["megakernel", "persistent", "megakernel-regen"];

/// What must differ between the schedules of a comparison.
fn fingerprint(report: &Report) -> (u64, u64, u32, u64, u64) {
    (report.steps, report.launches, report.regenerations, report.block_steps, report.group_steps)
}

/// Roulette that lanes share draws otherwise where these come from several tiles: then only what keeps whole tiles.
fn schedules(roulette: Option<&dyn Roulette>, has_queue_key: bool) -> Vec<(String, Schedule)> {
    let mut all = vec![("never".to_owned(), Schedule::never()), ("never, small pool".to_owned(), Schedule::never().with_pool_blocks(3))];
    all.push(("never, full launches".to_owned(), Schedule::never_full()));
    all.push(("block, full launches".to_owned(), Schedule::block().with_launch(LaunchScope::AllBlocks).with_pool_blocks(4)));
    for pool in [1, 4, 500] {
        all.push((format!("block, {pool} blocks"), Schedule::block().with_pool_blocks(pool)));
    }
    for threshold in [0.0, 0.25, 0.5, 2.0] {
        let schedule = Schedule::block().with_regeneration(BlockInPlace::new(threshold, 1)).with_pool_blocks(4);
        all.push((format!("block, threshold {threshold}"), schedule));
    }
    for check_every in [1, 2, 3] {
        let schedule = Schedule::block().with_regeneration(BlockInPlace::new(0.25, check_every)).with_pool_blocks(6);
        all.push((format!("block, every {check_every}"), schedule));
    }
    all.push(("block, longest tiles first".to_owned(), Schedule::block().with_order(DepthMax).with_pool_blocks(4)));
    all.push(("never, longest mean first".to_owned(), Schedule::never().with_order(DepthMean).with_pool_blocks(3)));
    all.push(("block, decayed depths".to_owned(), Schedule::block().with_order(DepthDecayed).with_pool_blocks(7)));
    all.push(("block, lanes packed".to_owned(), Schedule::block().with_local(LaneCompaction::All).with_pool_blocks(4)));
    all.push(("block, along the curve".to_owned(), Schedule::block().with_order(Morton).with_pool_blocks(8)));
    all.push(("megakernel, along the curve".to_owned(), Schedule::megakernel().with_order(Morton).with_pool_blocks(3)));
    all.push(("never, passes apart".to_owned(), Schedule::never().with_ring(1)));
    if roulette.is_none_or(|roulette| !roulette.scope().is_shared()) {
        for (name, schedule) in [("per-lane", Schedule::per_lane()), ("compaction", Schedule::compaction())] {
            all.push((name.to_owned(), schedule.clone()));
            all.push((format!("{name}, small pool"), schedule.with_pool_blocks(3)));
        }
        if has_queue_key {
            all.push(("keyed".to_owned(), Schedule::keyed()));
            all.push(("keyed in banks".to_owned(), Schedule::keyed().with_pool_blocks(5).with_bank_blocks(2)));
        }
        all.push(("lanes take items".to_owned(), Schedule::megakernel_regen()));
        all.push(("lanes take items, three groups".to_owned(), Schedule::megakernel_regen().with_pool_blocks(3)));
        all.push(("per-lane, along the curve".to_owned(), Schedule::per_lane().with_order(Morton).with_pool_blocks(2)));
        all.push(("compaction in banks".to_owned(), Schedule::compaction().with_pool_blocks(5).with_bank_blocks(2)));
    }
    all.push(("megakernel".to_owned(), Schedule::megakernel()));
    all.push(("persistent".to_owned(), Schedule::persistent()));
    all.push(("persistent, two groups".to_owned(), Schedule::persistent().with_pool_blocks(2)));
    all.push(("persistent, passes apart".to_owned(), Schedule::persistent().with_pool_blocks(7).with_ring(1)));
    all.push(("megakernel, small launches".to_owned(), Schedule::megakernel().with_pool_blocks(2)));
    all
}

/// Runs everything, asserts one hash and many fingerprints, returns the film.
fn compare(program: &Program, source: impl WorkSource + Copy + 'static, passes: u32) -> Option<Film> {
    compare_under(program, source, passes, Some(Arc::new(PerLane))).map(|(film, _)| film)
}

/// The same under a given roulette; also returns what the first schedule did.
fn compare_under(
    program: &Program,
    source: impl WorkSource + Copy + 'static,
    passes: u32,
    roulette: Option<Arc<dyn Roulette>>,
) -> Option<(Film, Report)> {
    let gpu = gpu()?;
    let mut films: Vec<(String, Film, Report)> = Vec::new();
    for (name, schedule) in schedules(roulette.as_deref(), program.has_queue_key()) {
        let schedule = schedule.with_roulette(roulette.clone());
        let (film, report) = run(gpu, program, source, passes, &schedule);
        assert!(film.samples().iter().all(|samples| *samples == passes), "{name}: samples are missing");
        assert_eq!(report.items_started, u64::from(source.pixels()) * u64::from(passes), "{name}: items started");
        films.push((name, film, report));
    }
    let (first, film, _) = &films[0];
    for (name, other, _) in &films[1..] {
        if other.hash() != film.hash() {
            let pixel =
                (0..film.pixels()).find(|&pixel| (0..film.leaves().len()).any(|leaf| film.sum(pixel, leaf) != other.sum(pixel, leaf)));
            panic!("{}: `{first}` and `{name}` differ, first in pixel {pixel:?}", program.name());
        }
    }
    let report = |wanted: &str| films.iter().find(|(name, ..)| name == wanted).map(|(.., report)| report).expect("a schedule of the list");
    let mut fingerprints: Vec<_> = films.iter().map(|(.., report)| fingerprint(report)).collect();
    fingerprints.sort_unstable();
    fingerprints.dedup();
    assert!(fingerprints.len() * 4 >= films.len() * 3, "the schedules hardly differ: {fingerprints:?}");
    assert!(report("block, 4 blocks").regenerations > 1 && report("block, 1 blocks").regenerations > 1);
    assert!(report("block, threshold 0").regenerations > report("block, threshold 2").regenerations);
    assert!(report("block, every 1").regenerations >= report("block, every 3").regenerations);
    assert!(report("never").steps < report("never, small pool").steps);
    assert!(report("never, passes apart").ring == 1 && report("never").ring > 1);
    assert!(report("never, passes apart").steps > report("never").steps);
    assert!(report("never").group_steps == report("never").block_steps && report("never").steps == report("never, full launches").steps);
    assert!(report("never, full launches").group_steps > report("never").group_steps);
    assert!(report("block, full launches").group_steps > report("block, 4 blocks").group_steps);
    assert!(report("megakernel").launches < report("megakernel, small launches").launches);
    assert!(report("persistent").launches < report("persistent, two groups").launches);
    assert!(report("persistent, two groups").group_steps < report("persistent, two groups").block_steps);
    assert_eq!(report("persistent, two groups").block_steps, report("megakernel").block_steps);
    assert!(report("megakernel").state_bytes == 0 && report("never").state_bytes > 0);
    let killed: Vec<u64> = films.iter().map(|(.., report)| report.items_killed).collect();
    assert!(killed.iter().all(|count| *count == killed[0]), "roulette killed unlike numbers: {killed:?}");
    films.into_iter().next().map(|(_, film, report)| (film, report))
}

/// Kills: a lane that walks on with the number of another; a pass resolved before its last tile; a pool that loses its last block.
#[test]
fn collatz_is_exact_under_every_schedule() {
    let Some(film) = compare(&collatz(), LinearRange { count: 2900 }, 3) else { return };
    for pixel in 0..film.pixels() {
        assert_eq!(film.sum(pixel, 0) as u64, 3 * collatz_steps(pixel as u64 + 1), "number {}", pixel + 1);
    }
}

/// Kills: a packed field that passes its format in one execution only, or at another place; a cell written in part and stored whole
/// without having been loaded; a field that `reweight` writes and nobody packs; clamped values counted twice, or counted in garbage.
#[test]
fn packed_states_have_the_same_bits_under_every_schedule() {
    let Some(gpu) = gpu() else { return };
    let source = ImageTiles { width: 40, height: 56 };
    let Some(film) = compare(&memory::packed(), source, 3) else { return };
    assert_eq!(film.not_finite(), 0);
    let shared: [Arc<dyn Roulette>; 2] = [Arc::new(PerBlock(Statistic::Mean)), Arc::new(PerGroup::new(32).expect("a power of two"))];
    for roulette in shared {
        assert!(compare_under(&memory::packed(), source, 3, Some(roulette)).is_some_and(|(_, report)| report.items_killed > 0));
    }
    let clamped = |schedule: &Schedule| run(gpu, &memory::packed(), source, 3, schedule).1.storage_clamped;
    let counts = [
        Schedule::megakernel(),
        Schedule::megakernel_regen(),
        Schedule::persistent(),
        Schedule::never(),
        Schedule::block().with_pool_blocks(3).with_poison(0x7fc0_0000),
    ];
    let counts = counts.map(|schedule| clamped(&schedule));
    assert!(counts[0] > 500 && counts.iter().all(|count| *count == counts[0]), "clamped: {counts:?}");
}

/// Kills: an element that one execution pins or packs and another does not; an array that keeps what the tile before has stored; an
/// element stored in the planes of its neighbour, of another array, or of the leaves.
#[test]
fn arrays_have_the_same_bits_under_every_schedule() {
    let Some(gpu) = gpu() else { return };
    let source = ImageTiles { width: 40, height: 56 };
    for program in [arrays::web(), arrays::packed_web()] {
        let block: Arc<dyn Roulette> = Arc::new(PerBlock(Statistic::Max));
        for roulette in [Arc::new(PerLane), block] {
            let (film, report) = compare_under(&program, source, 3, Some(roulette)).expect("there is a device");
            assert!(report.items_killed > 0 && film.not_finite() == 0);
            let sum = |leaf: usize| (0..film.pixels()).map(|pixel| film.sum(pixel, leaf)).sum::<f64>();
            assert_eq!(sum(2), 0.0, "an element that nobody has written is not zero");
            assert!(sum(3) > 2.0 * film.pixels() as f64, "short walks prove little");
            assert_eq!(report.out_of_range, 0);
        }
        let clamped =
            [Schedule::megakernel(), Schedule::block().with_pool_blocks(3)].map(|schedule| run(gpu, &program, source, 3, &schedule).1);
        assert_eq!(clamped[0].storage_clamped, clamped[1].storage_clamped);
    }
}

/// `hops` has several stages, `unequal` one, which reads, clears and announces in the same kernel, with chances that differ within a group.
/// Kills: a group's word cleared while it is announced into, or never; a draw keyed by the block, or by the lane; a group of the tile before
/// in the same block; a word counted from the wrong end of the counters when the order is measured.
#[test]
fn groups_have_the_same_bits_under_every_schedule() {
    let source = ImageTiles { width: 40, height: 56 };
    let mut hashes = BTreeSet::new();
    for lanes in [2, 32, 256] {
        let group = || -> Option<Arc<dyn Roulette>> { Some(Arc::new(PerGroup::new(lanes).expect("a power of two"))) };
        let Some((film, report)) = compare_under(&hops(), source, 3, group()) else { return };
        assert!(report.items_killed > 0, "groups of {lanes}");
        hashes.insert(film.hash());
        let (_, report) = compare_under(&unequal(), source, 3, group()).expect("there is a device");
        assert_eq!(report.items_killed, report.items_started, "every walk is killed");
    }
    assert_eq!(hashes.len(), 3, "groups of other sizes draw alike");
}

/// Kills: a scheduler that starts with what the run before has left; a seed that changes nothing, or changes what it must not.
#[test]
fn a_scheduler_runs_twice_alike_and_obeys_its_seed() {
    let Some(gpu) = gpu() else { return };
    let source = ImageTiles { width: 33, height: 20 };
    for schedule in [
        Schedule::block().with_pool_blocks(4),
        Schedule::megakernel().with_pool_blocks(2),
        Schedule::persistent().with_pool_blocks(2),
        Schedule::megakernel_regen().with_pool_blocks(2),
    ] {
        let mut scheduler = wavepool_tests::device::scheduler(gpu, &hops(), source, &schedule);
        let mut hash = |passes: u32| scheduler.run(passes).map(|(film, _)| film.hash()).unwrap_or_else(|error| panic!("{error}"));
        let first = hash(3);
        let (other, again) = (hash(2), hash(3));
        assert_eq!(first, again, "{schedule}");
        assert_ne!(first, other, "{schedule}");
        scheduler.set_seed(1);
        let reseeded = scheduler.run(3).expect("runs").0.hash();
        assert_ne!(reseeded, first, "{schedule}: the seed does not reach the roulette");
        scheduler.set_seed(0);
        assert_eq!(scheduler.run(3).expect("runs").0.hash(), first, "{schedule}");
    }
}

/// Kills: samples numbered from zero in every run: two halves would not make the whole.
#[test]
fn a_run_can_begin_at_any_sample() {
    let Some(gpu) = gpu() else { return };
    let program = wavepool_tests::programs::identity_sum();
    for schedule in [Schedule::block().with_pool_blocks(2), Schedule::megakernel(), Schedule::persistent(), Schedule::megakernel_regen()] {
        let mut scheduler = wavepool_tests::device::scheduler(gpu, &program, LinearRange { count: 300 }, &schedule);
        let (film, report) = scheduler.run_with(7, 4, |_| std::ops::ControlFlow::Continue(())).expect("runs");
        assert_eq!(report.passes, 4);
        for pixel in 0..300 {
            assert_eq!(film.sum(pixel, 3), f64::from(7 + 8 + 9 + 10));
            assert_eq!(film.sum(pixel, 2), 4.0 * pixel as f64);
        }
    }
}

/// Kills: a run that cannot be stopped, that stops with unequal sample counts, or whose film is not that of the passes it tells.
#[test]
fn a_stopped_run_keeps_whole_passes() {
    let Some(gpu) = gpu() else { return };
    let source = ImageTiles { width: 64, height: 48 };
    let program = hops();
    let asked = 2000;
    for schedule in [
        Schedule::block().with_pool_blocks(5),
        Schedule::never().with_pool_blocks(7),
        Schedule::megakernel(),
        Schedule::persistent().with_pool_blocks(3),
        Schedule::megakernel_regen().with_pool_blocks(3),
    ] {
        let mut scheduler = wavepool_tests::device::scheduler(gpu, &program, source, &schedule);
        let mut seen = 0;
        let (film, report) = scheduler
            .run_with(0, asked, |progress| {
                seen = progress.passes_done;
                assert_eq!(progress.passes, asked);
                if progress.passes_done >= 2 { std::ops::ControlFlow::Break(()) } else { std::ops::ControlFlow::Continue(()) }
            })
            .unwrap_or_else(|error| panic!("{schedule}: {error}"));
        assert!(report.passes >= 2 && report.passes < asked, "{schedule}: {} passes", report.passes);
        assert!(report.passes >= seen);
        assert!(film.samples().iter().all(|samples| *samples == report.passes), "{schedule}");
        let (whole, _) = scheduler.run(report.passes).expect("runs");
        assert_eq!(whole.hash(), film.hash(), "{schedule}: a stopped run of {} passes is not a whole one", report.passes);
    }
}

/// Checked mode counts results again after every launch.
/// Kills: a tile that no work-group takes (planted here); steps of a walk counted from the wrong one; a slot of the ring that is reused
/// before it is resolved; a ledger out of balance between two launches.
#[test]
fn whole_walks_are_counted_like_those_of_a_wavefront() {
    let Some(gpu) = gpu() else { return };
    let source = ImageTiles { width: 40, height: 56 };
    let instruments = Instruments { lengths: true, checked: true, ..Instruments::default() };
    let run = |schedule: &Schedule, fault: Option<Fault>| {
        let program = hops();
        let builder = Scheduler::builder(&program, source).schedule(schedule).instruments(instruments);
        let builder = fault.into_iter().fold(builder, |builder, fault| builder.fault(fault));
        builder.build(&gpu.device, &gpu.queue).and_then(|mut scheduler| scheduler.run_with(0, 5, patient()))
    };
    let (film, report) = run(&Schedule::never(), None).expect("runs");
    for schedule in WHOLE_WALKS.map(|name| name.parse::<Schedule>().expect("a schedule")) {
        for blocks in [1, 4, 200] {
            let schedule = schedule.clone().with_pool_blocks(blocks);
            let (other, seen) = run(&schedule, None).unwrap_or_else(|error| panic!("{schedule}, {blocks} groups: {error}"));
            assert_eq!(other.hash(), film.hash(), "{schedule}");
            assert!(seen.observed.lengths.is_some() && seen.observed.lengths == report.observed.lengths, "{schedule}: lengths");
            assert_eq!((seen.items_killed, seen.block_steps), (report.items_killed, 5 * u64::from(source.tiles())));
        }
        let fault =
            Fault { part: "stages", find: "atomicAdd(&wf_counters[WF_TAKEN], 1u)", replace: "atomicAdd(&wf_counters[WF_TAKEN], 2u)" };
        if schedule.execution != Execution::Megakernel {
            let message = run(&schedule, Some(fault)).expect_err("every second one is left out").to_string();
            assert!(message.contains("conservation"), "{message}");
        }
    }
}
