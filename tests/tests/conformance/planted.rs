//! Mistakes planted in the generated kernels: each is noticed, by the check that is there for it, and no run hangs on one.
//!
//! Key decision: the mistakes are replacements of text in kernels of a real run, so that the checks are tested where they stand.

use wavepool::{Error, ImageTiles, Instruments, LinearRange, Program, Resources, Schedule, Scheduler, shader::Fault, upload, wgpu};
use wavepool_tests::{
    device::{gpu, patient},
    moments::{Law, Sample},
    programs::{self, enclosure_with, waiting},
};

use crate::subjects::built_in;

const IMAGE: ImageTiles = ImageTiles { width: 40, height: 56 };
const SMALL: ImageTiles = ImageTiles { width: 40, height: 24 };

const fn fault(part: &'static str, find: &'static str, replace: &'static str) -> Fault {
    Fault { part, find, replace }
}

/// What goes wrong, how, and what the check says.
const FAULTS: [(&str, Fault, &str); 9] = [
    (
        "a lane that ends without being counted",
        fault("stages", "atomicSub(&wf_counters[wf_live_counter(wf_block)], 1u);", ""),
        "count other lanes than are alive",
    ),
    (
        "a lane that ends twice",
        fault(
            "stages",
            "atomicSub(&wf_counters[wf_live_counter(wf_block)], 1u);",
            "atomicAdd(&wf_counters[WF_FINISHED], 1u); atomicSub(&wf_counters[wf_live_counter(wf_block)], 1u);",
        ),
        "items begun, but",
    ),
    ("a lane that ends and walks on", fault("stages", "        wf_bank[wf_base] = 0u;\n", ""), "count other lanes than are alive"),
    ("a walk dropped with its block", fault("tick", "let goes_on = lanes > 0u;", "let goes_on = lanes > 1u;"), "items begun, but"),
    ("stragglers killed", fault("tick", "let goes_on = lanes > 0u;", "let goes_on = lanes >= 64u;"), "items begun, but"),
    (
        "a result left out",
        fault("stages", "wf_results[place] = wf_pass_index + 1u;", "if (wf_lane != 5u) { wf_results[place] = wf_pass_index + 1u; }"),
        "results",
    ),
    (
        "a tile handed to two blocks",
        fault("tick", "let place = assignment.z + rank;", "let place = assignment.z + rank - rank % 2u;"),
        "results",
    ),
    (
        "a live counter off by one",
        fault(
            "tick",
            "atomicStore(&wf_counters[wf_live_counter(block)], lanes + WF_ALL_DEAD);",
            "atomicStore(&wf_counters[wf_live_counter(block)], lanes + WF_ALL_DEAD + 1u);",
        ),
        "count other lanes than are alive",
    ),
    (
        "a pass resolved one tile early",
        fault("tick", "wf_control.words[WF_RING + oldest % ring] == 0u", "wf_control.words[WF_RING + oldest % ring] <= 1u"),
        "results",
    ),
];

fn with_faults(
    program: &Program,
    source: impl wavepool::policy::WorkSource + 'static,
    passes: u32,
    schedule: &Schedule,
    instruments: Instruments,
    faults: &[Fault],
) -> Result<(wavepool::Film, wavepool::Report), Error> {
    let gpu = gpu().expect("asked before");
    let lengths = upload(&gpu.device, "lengths", wavepool::bytemuck::cast_slice(&lengths()), wgpu::BufferUsages::STORAGE)?;
    let resources = Resources::new().buffer("lengths", &lengths);
    let builder = Scheduler::builder(program, source).schedule(schedule).resources(&resources).instruments(instruments);
    let builder = faults.iter().fold(builder, |builder, fault| builder.fault(*fault));
    builder.build_on(gpu)?.run_with(0, passes, patient())
}

/// For the program that reads how long its walks are.
fn lengths() -> Vec<u32> {
    let pixels = 40 * 56;
    std::iter::once(pixels).chain((0..4 * pixels).map(|walk| 1 + walk * 7 % 13)).collect()
}

/// Kills: the check that each fault of the list is named with, taken out of the audit or of the host's comparison.
#[test]
fn checked_mode_names_every_planted_fault() {
    if gpu().is_none() {
        return;
    }
    let schedule: Schedule = "block,threshold=0,check_every=1".parse().expect("a schedule");
    let schedule = schedule.with_pool_blocks(5);
    let program = waiting();
    with_faults(&program, IMAGE, 4, &schedule, Instruments::checked(), &[]).expect("nothing is planted");
    for (name, fault, says) in FAULTS {
        match with_faults(&program, IMAGE, 4, &schedule, Instruments::checked(), &[fault]) {
            Err(Error::Conservation(message)) => {
                eprintln!("{name}: {message}");
                assert!(message.contains(says), "{name}: {message}");
            }
            outcome => panic!("{name}: not noticed: {outcome:?}"),
        }
    }
}

/// Kills: results that are counted as there though nobody wrote them; a result of an earlier pass taken for one of this.
#[test]
fn lost_results_are_noticed_without_checked_mode() {
    if gpu().is_none() {
        return;
    }
    let schedule = Schedule::block().with_pool_blocks(5);
    for (name, fault, _) in
        FAULTS.iter().filter(|(name, ..)| ["a result", "a walk", "stragglers"].iter().any(|word| name.starts_with(word)))
    {
        let outcome = with_faults(&waiting(), IMAGE, 4, &schedule, Instruments::default(), &[*fault]);
        let message = outcome.expect_err(name).to_string();
        assert!(message.contains("items left no result"), "{name}: {message}");
    }
}

/// Without any conservation: what is dropped counts as zero. 399,360 walks know the mean to 0.08 %; a dropped last lane costs each block
/// about 0.7 %, dropped stragglers more.
/// Kills: a mean that passes although long walks are missing from it; the twin that nothing is planted in fails otherwise.
#[test]
fn the_mean_notices_dropped_walks_without_conservation() {
    if gpu().is_none() {
        return;
    }
    let in_blind = fault("resolve", "if (wf_results[result] != pass_index + 1u) {", "if (false) {");
    let law = Law::of_enclosure(f64::from(0.8_f32), f64::from(0.9_f32));
    let source = LinearRange { count: 78 * 256 };
    // All passes at once: a result that is missing is zero, not what an earlier pass has left.
    let schedule = Schedule::block().with_pool_blocks(78 * 20);
    let check = |faults: &[Fault]| {
        let (film, _) = with_faults(&enclosure_with(0.8, 0.9), source, 20, &schedule, Instruments::default(), faults).expect("runs");
        let total = |leaf: usize| (0..film.pixels()).map(|pixel| film.sum(pixel, leaf)).sum::<f64>();
        law.check_mean(&Sample::of_sums(20.0 * film.pixels() as f64, total(0), total(1)))
    };
    check(&[in_blind]).expect("nothing is dropped");
    for (name, fault, _) in FAULTS.iter().filter(|(name, ..)| name.starts_with("a walk") || name.starts_with("stragglers")) {
        let problem = check(&[in_blind, *fault]).expect_err(name);
        eprintln!("{name}: {problem}");
    }
}

/// A fault that is not planted proves nothing.
/// Kills: a replacement that is skipped because the text has changed.
#[test]
fn a_fault_that_fits_nowhere_is_an_error() {
    if gpu().is_none() {
        return;
    }
    let nowhere = fault("tick", "there is no such text", "");
    let message = with_faults(&waiting(), IMAGE, 1, &Schedule::block(), Instruments::default(), &[nowhere]).expect_err("refused");
    assert!(message.to_string().contains("no fault was planted"), "{message}");
}

/// Kills: an instrument that changes a result, a decision or a count; an audit that clears what the tick needs; submissions that nobody
/// looks at and that lose a counter.
#[test]
fn instruments_change_nothing() {
    let Some(_) = gpu() else { return };
    let counts = |report: &wavepool::Report| {
        let wavepool::Report { steps, launches, regenerations, block_steps, lane_steps, items_started, items_killed, .. } = *report;
        (steps, launches, regenerations, block_steps, lane_steps, items_started, items_killed, report.not_finite, report.counters.clone())
    };
    let ways = [
        Instruments::checked(),
        Instruments { look_after: 300, ..Instruments::default() },
        Instruments { markers: true, assertions: true, ..Instruments::default() },
        Instruments::statistics(),
    ];
    let packed = Schedule::compaction().with_pool_blocks(5).with_bank_blocks(2);
    for schedule in [Schedule::block().with_pool_blocks(5).with_bank_blocks(2), packed, Schedule::megakernel().with_pool_blocks(5)] {
        let schedule = schedule.with_submission_steps(7);
        for make in programs::all() {
            let program = make();
            let run = |instruments| {
                with_faults(&program, SMALL, 2, &schedule, instruments, &[])
                    .unwrap_or_else(|error| panic!("{}, {schedule}, {instruments:?}: {error}", program.name()))
            };
            let (film, report) = run(Instruments::default());
            for instruments in ways {
                let (other, seen) = run(instruments);
                assert_eq!(other.hash(), film.hash(), "{}, {schedule}, {instruments:?}", program.name());
                assert_eq!(counts(&seen), counts(&report), "{}, {schedule}, {instruments:?}", program.name());
                let blind = instruments.look_after > 0;
                assert!(!blind || seen.submissions > 40, "{} submissions before a look", seen.submissions);
            }
        }
    }
    let schedule = Schedule::block().with_pool_blocks(5).with_bank_blocks(2).with_submission_steps(7);
    let box_of_cornell = built_in("cornell-box");
    let (film, report) = box_of_cornell.run(SMALL, 2, &schedule, Instruments::default());
    for instruments in &ways[..2] {
        let (other, seen) = box_of_cornell.run(SMALL, 2, &schedule, *instruments);
        assert_eq!((other.hash(), counts(&seen)), (film.hash(), counts(&report)), "cornell-box, {schedule}, {instruments:?}");
    }
}
