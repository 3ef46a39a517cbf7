//! Many runs of one picture, to be run while the machine is busy: `cargo test -p wavepool-tests --test conformance stress:: -- --ignored`.

use std::time::Instant;

use wavepool::{ImageTiles, Instruments, Schedule};

use crate::subjects::flight_helmet;

const RUNS: u32 = 200;

/// Seen once: other bits from `persistent` on a busy machine. A film with fewer passes is told apart from one with other bits.
/// Kills: whatever of a megakernel depends on which work-group is given a processor.
#[test]
#[ignore = "takes minutes"]
fn whole_walks_have_the_same_bits_on_a_busy_machine() {
    let Some(subject) = flight_helmet() else { return };
    let run = |name: &str| {
        let schedule = name.parse::<Schedule>().expect("a schedule").with_pool_blocks(12).with_submission_steps(1);
        let begun = Instant::now();
        let (film, report) = subject.run(ImageTiles { width: 40, height: 56 }, 4, &schedule, Instruments::default());
        (film.hash(), report.passes, begun.elapsed())
    };
    let (expected, passes, _) = run("never");
    assert_eq!(passes, 4);
    let mut wrong = 0;
    for name in ["persistent", "megakernel", "megakernel-regen"] {
        let runs: Vec<_> = (0..RUNS).map(|_| run(name)).collect();
        let short = runs.iter().filter(|(_, passes, _)| *passes != 4).count();
        let other = runs.iter().filter(|(hash, passes, _)| *passes == 4 && *hash != expected).count();
        let slowest = runs.iter().map(|(.., took)| *took).max();
        eprintln!("{name}: {RUNS} runs, {other} with other bits, {short} with fewer passes, the slowest in {slowest:?}");
        wrong += other + short;
    }
    assert_eq!(wrong, 0);
}
