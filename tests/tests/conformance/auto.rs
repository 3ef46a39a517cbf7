//! A schedule that picks one of several: the same bits while it changes its mind, and a log that can be re-enacted.

use wavepool::{Error, ImageTiles, Instruments, Schedule, Scheduler, policy::WorkSource, replay::replay};
use wavepool_tests::{
    device::{gpu, patient, run},
    programs::{hops, waiting, waiting_steps},
};

const IMAGE: ImageTiles = ImageTiles { width: 40, height: 56 };
const PASSES: u32 = 21;

/// Every kind of candidate, so that most portions are done by another one.
fn candidates() -> Vec<Schedule> {
    ["megakernel", "block,threshold=0.25", "keyed", "never", "per-lane", "compaction,every=2", "never-full"]
        .map(|text| text.parse::<Schedule>().expect("a schedule").with_pool_blocks(5))
        .to_vec()
}

/// Kills: a film that begins anew with each portion, or that misses the sums of the one before; sample numbers that begin again; a pool that
/// is not the one asked for; a seed that reaches one candidate only; counters of one portion taken for the whole.
#[test]
fn auto_keeps_the_bits_while_it_changes_its_mind() {
    let Some(gpu) = gpu() else { return };
    let program = hops();
    let (expected, plain) = run(gpu, &program, IMAGE, PASSES, &Schedule::never());
    let schedule = Schedule::of_candidates(candidates()).with_pool_blocks(5);
    let mut scheduler = Scheduler::builder(&program, IMAGE).schedule(&schedule).build_on(gpu).expect("builds");
    for round in 0..2 {
        let (film, report) = scheduler.run_with(0, PASSES, patient()).expect("runs");
        assert_eq!(film.hash(), expected.hash(), "round {round}: {:#?}", report.decisions);
        assert_eq!((report.passes, report.items_killed), (PASSES, plain.items_killed));
        assert_eq!(report.decisions.iter().map(|decision| decision.passes).sum::<u32>(), PASSES);
        let names: std::collections::BTreeSet<_> = report.decisions.iter().map(|decision| &decision.schedule).collect();
        assert!(round > 0 || names.len() == 7, "not all of them were tried: {names:?}");
        assert!(report.decisions.iter().all(|decision| decision.pool_blocks <= 5 && !decision.reason.is_empty()));
    }
    scheduler.set_seed(5);
    let (film, _) = scheduler.run_with(0, PASSES, patient()).expect("runs");
    assert_ne!(film.hash(), expected.hash(), "another seed gives other draws");
    let (film, report) = scheduler.run(0).expect("runs");
    assert_eq!((film.pixels(), report.passes), (expected.pixels(), 0));
}

/// Kills: a portion that is not what its entry in the log says.
#[test]
fn auto_is_re_enacted_from_its_log() {
    let Some(gpu) = gpu() else { return };
    let program = waiting();
    let candidates = candidates().into_iter().filter(|candidate| !candidate.to_string().starts_with("keyed")).collect();
    let schedule = Schedule::of_candidates(candidates).with_pool_blocks(5);
    let mut scheduler = Scheduler::builder(&program, IMAGE).schedule(&schedule).build_on(gpu).expect("builds");
    let (film, report) = scheduler.run_with(0, PASSES, patient()).expect("runs");
    let expected = |pixel: u32| (0..PASSES).map(|sample| f64::from(waiting_steps(pixel, sample))).sum::<f64>();
    assert!((0..IMAGE.pixels()).all(|pixel| film.sum(pixel as usize, 0) == expected(pixel)));
    let mut replayed = 0;
    for decision in &report.decisions {
        let schedule: Schedule = decision.schedule.parse().expect("a printed schedule");
        if decision.schedule.starts_with("megakernel") {
            assert_eq!(decision.steps, u64::from(IMAGE.tiles().div_ceil(decision.pool_blocks) * decision.passes));
            continue;
        }
        let lengths = |pass: u32, tile: u32, lengths: &mut [u32; 256]| {
            for (index, length) in lengths.iter_mut().enumerate() {
                let steps = |pixel| waiting_steps(pixel, decision.first_pass + pass);
                *length = IMAGE.pixel(tile, index as u32).map_or(0, steps);
            }
        };
        let seen = replay(&schedule, &IMAGE, decision.passes, decision.pool_blocks, decision.ring, &lengths);
        assert_eq!((decision.steps, decision.launches), (seen.steps(), seen.launches(1)), "{decision:?}");
        replayed += 1;
    }
    assert!(replayed >= 5, "{:#?}", report.decisions);
    assert_eq!(report.steps, report.decisions.iter().map(|decision| decision.steps).sum::<u64>());
}

/// Kills: a candidate that cannot do what is asked and ends the whole; instruments that see one portion and say nothing of the others; a
/// refusal without a reason; a stop that is not obeyed.
#[test]
fn auto_leaves_out_what_cannot_be_and_stops_when_told() {
    let Some(gpu) = gpu() else { return };
    let program = hops();
    let build = |schedule: &Schedule, instruments| {
        Scheduler::builder(&program, IMAGE).schedule(schedule).instruments(instruments).build_on(gpu).map(|_| ())
    };
    let sorted: Schedule = "auto,order=depth-max".parse().expect("a schedule");
    let (_, report) = run(gpu, &program, IMAGE, 5, &sorted);
    assert!(report.notes.iter().any(|note| note.starts_with("auto leaves out `megakernel")), "{:?}", report.notes);
    assert!(report.decisions.iter().all(|decision| !decision.schedule.starts_with("megakernel")));
    assert!(program.check(&IMAGE, &sorted).is_ok() && program.wgsl(&IMAGE, &sorted).is_err());
    let watched = build(&Schedule::auto(), Instruments { steps: true, ..Instruments::default() });
    assert!(matches!(watched, Err(Error::Schedule(message)) if message.contains("watch one schedule")));
    let hopeless = Schedule::of_candidates(vec![Schedule::megakernel()]).with_order(wavepool::policy::DepthMax);
    assert!(program.check(&IMAGE, &hopeless).is_err());
    assert!(matches!(build(&hopeless, Instruments::default()), Err(Error::Schedule(message)) if message.contains("depth-max")));
    let mut scheduler = Scheduler::builder(&program, IMAGE).schedule(&Schedule::auto()).build_on(gpu).expect("builds");
    assert!(matches!(scheduler.begin(0, 1), Err(Error::Schedule(message)) if message.contains("step by step")));
    let (film, report) = scheduler
        .run_with(0, 1000, |progress| {
            assert!(progress.passes == 1000);
            if progress.passes_done >= 2 { std::ops::ControlFlow::Break(()) } else { std::ops::ControlFlow::Continue(()) }
        })
        .expect("runs");
    assert!(report.passes >= 2 && report.passes < 1000 && film.samples().iter().all(|samples| *samples == report.passes));
}
