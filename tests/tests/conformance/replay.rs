//! The device does what the policies say: its counters equal those of the schedule re-enacted on the CPU.

use wavepool::{
    LinearRange, Schedule,
    policy::{BlockInPlace, DepthMax, DepthMean, WorkSource as _},
    replay::replay,
};
use wavepool_tests::{
    device::{gpu, run},
    programs::{collatz, collatz_steps},
};

/// Kills: a tick that asks the policy too early or too late, a threshold compared the other way, a block retired a step late, tiles
/// handed out beyond the result ring, a counter that forgets the last step.
#[test]
fn the_device_counts_what_the_policies_say() {
    let Some(gpu) = gpu() else { return };
    // Numbers up to 159,486 stay below 2^32 on their way, so that 32 bits and 64 bits agree. The stage that finds the walk at 1 is a step too.
    let lengths = |source: LinearRange| {
        move |_: u32, tile: u32, lengths: &mut [u32; 256]| {
            for (index, length) in lengths.iter_mut().enumerate() {
                *length = source.pixel(tile, index as u32).map_or(0, |pixel| collatz_steps(u64::from(pixel) + 1) as u32 + 1);
            }
        }
    };
    let block = |threshold, check_every| Schedule::block().with_regeneration(BlockInPlace::new(threshold, check_every));
    for (count, passes, pool, schedule) in [
        (1, 1, 1, Schedule::never()),
        (2900, 3, 4, Schedule::never()),
        (2900, 3, 1, block(0.5, 2)),
        (2900, 4, 5, block(0.0, 1)),
        (2900, 4, 7, block(0.5, 2)),
        (5000, 2, 13, block(2.0, 3)),
        (600, 9, 500, block(0.25, 1)),
        (9000, 6, 9, block(0.5, 2).with_order(DepthMax)),
        (9000, 6, 13, block(0.0, 1).with_order(DepthMean)),
        (3000, 8, 40, block(0.25, 1).with_order(DepthMax)),
        (90_000, 2, 64, block(0.5, 2).with_order(DepthMax)),
        (9000, 3, 10, Schedule::never().with_order(DepthMax)),
    ] {
        let source = LinearRange { count };
        let schedule = schedule.with_pool_blocks(pool);
        let (_, report) = run(gpu, &collatz(), source, passes, &schedule);
        let seen = replay(&schedule, &source, passes, report.pool_blocks, report.ring, &lengths(source));
        let name = format!("{count} items, {passes} passes, {schedule}, {pool} blocks");
        assert_eq!(report.steps, seen.steps(), "{name}: steps");
        assert_eq!(report.block_steps, seen.block_steps(), "{name}: live blocks");
        assert_eq!(report.lane_steps, seen.lane_steps(), "{name}: live lanes");
        assert_eq!(report.regenerations as usize, seen.regenerations.len(), "{name}: regenerations");
        assert_eq!(seen.assignments.len() as u32, source.tiles() * passes, "{name}: tiles");
        assert_eq!(seen.occupancy.useful, seen.lane_steps(), "{name}: useful lane-steps");
    }
}
