//! Leaves that a kernel may not use are filled with garbage: nothing may change.

use wavepool::{ImageTiles, LinearRange, Program, Schedule, policy::WorkSource};
use wavepool_tests::{
    arrays, border,
    device::{gpu, run},
    memory, programs,
    traps::TRAPS,
};

/// A quiet NaN, and a pattern that is plainly wrong as an integer.
const POISONS: [u32; 2] = [0x7fc0_0000, 0xdead_beef];

fn assert_untouched(program: &Program, source: impl WorkSource + Copy + 'static, passes: u32, poisons: &[u32]) {
    let Some(gpu) = gpu() else { return };
    let schedule = Schedule::block().with_pool_blocks(3);
    let clean = run(gpu, program, source, passes, &Schedule::megakernel()).0;
    for &poison in poisons {
        let poisoned = run(gpu, program, source, passes, &schedule.clone().with_poison(poison)).0;
        assert_eq!(poisoned.hash(), clean.hash(), "{}: poison {poison:#x} shows", program.name());
    }
}

/// Kills: a leaf that is read but not loaded; a leaf that a new tile inherits from the block's last tile; poison in a plane that a leaf of
/// the new walk shares.
#[test]
fn poison_never_shows() {
    assert_untouched(&programs::collatz(), LinearRange { count: 1000 }, 2, &POISONS);
    assert_untouched(&programs::hops(), ImageTiles { width: 40, height: 24 }, 3, &POISONS);
    assert_untouched(&border::program(), ImageTiles { width: 33, height: 17 }, 2, &POISONS);
    assert_untouched(&memory::packed(), LinearRange { count: 1500 }, 2, &POISONS);
    assert_untouched(&arrays::packed_web(), LinearRange { count: 1500 }, 2, &POISONS);
    assert_untouched(&memory::relay(), LinearRange { count: 1500 }, 2, &POISONS);
    assert_untouched(&programs::enclosure(), LinearRange { count: 700 }, 2, &POISONS);
}

/// Kills: a read set of the inference that is too small in any of the traps, found by running them.
#[test]
fn poison_never_shows_in_traps() {
    for (index, trap) in TRAPS.iter().enumerate() {
        assert_untouched(&programs::trap(trap), LinearRange { count: 64 }, 3, &POISONS[index % 2..][..1]);
    }
}
