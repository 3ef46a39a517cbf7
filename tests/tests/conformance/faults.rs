//! What goes wrong outside of the program: a device that goes away, a policy that misbehaves, sizes that cannot be.

use std::ops::ControlFlow;

use wavepool::{GpuContext, LinearRange, Schedule, policy::Regeneration};
use wavepool_tests::{
    device::{gpu, run, scheduler},
    programs::collatz,
};

/// Kills: a panic, or a wait without end, on a device that is gone.
#[test]
fn a_lost_device_is_an_error() {
    if gpu().is_none() {
        return;
    }
    // A device of its own: the others of this binary go on.
    let doomed = GpuContext::headless().expect("there is an adapter");
    let mut scheduler = scheduler(&doomed, &collatz(), LinearRange { count: 500 }, &Schedule::block());
    scheduler.run(1).expect("it works while the device is there");
    doomed.device.destroy();
    let message = scheduler.run(1).expect_err("the device is gone").to_string();
    assert!(message.contains("lost") || message.contains("GPU error"), "{message}");
}

#[derive(Debug)]
struct Refuse;

impl Regeneration for Refuse {
    fn name(&self) -> &str {
        "refuse"
    }

    fn wgsl(&self) -> String {
        "fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool { return false; }".into()
    }

    fn regenerate(&self, _live: u32, _dead: u32, _step: u32) -> bool {
        false
    }
}

/// Kills: a run that waits for ever on a policy that never says yes.
#[test]
fn a_policy_that_never_says_yes_ends_all_the_same() {
    let Some(gpu) = gpu() else { return };
    let source = LinearRange { count: 1000 };
    let (film, _) = run(gpu, &collatz(), source, 2, &Schedule::block().with_regeneration(Refuse).with_pool_blocks(2));
    let (expected, _) = run(gpu, &collatz(), source, 2, &Schedule::never());
    assert_eq!(film.hash(), expected.hash());
}

/// Kills: a pool that is quietly another one than was asked for.
#[test]
fn impossible_pools_are_refused() {
    let Some(gpu) = gpu() else { return };
    for (blocks, words) in [(0, "at least one block"), ((1 << 19) + 1, "at most 524288 blocks")] {
        let schedule = Schedule::block().with_pool_blocks(blocks);
        let mut scheduler = scheduler(gpu, &collatz(), LinearRange { count: 500 }, &schedule);
        let message = scheduler.run(1).expect_err("refused").to_string();
        assert!(message.contains(words), "{message}");
    }
}

/// Kills: an observer that is asked again after it has said stop.
#[test]
fn an_observer_that_stops_is_not_asked_again() {
    let Some(gpu) = gpu() else { return };
    let mut scheduler = scheduler(gpu, &collatz(), LinearRange { count: 3000 }, &Schedule::block().with_pool_blocks(2));
    let mut once = Some(());
    let outcome = scheduler.run_with(0, 50, |_| {
        once.take().expect("asked once");
        ControlFlow::Break(())
    });
    assert!(outcome.expect("a film").1.passes < 50);
}
