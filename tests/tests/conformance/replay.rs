//! The device does what the policies say: its counters equal those of the schedule re-enacted on the CPU.

use wavepool::{
    Film, ImageTiles, LinearRange, Program, Report, Schedule,
    policy::{BlockInPlace, DepthDecayed, DepthMax, DepthMean, LaneInPlace, LaunchScope, Morton, StreamCompaction, WorkSource},
    replay::{Replay, replay_in_banks},
};
use wavepool_tests::{
    device::{gpu, run},
    programs::{collatz, collatz_steps, waiting, waiting_steps},
};

/// Runs, re-enacts with the lengths that `steps` gives per pixel and sample, and compares.
fn compare(
    program: &Program,
    source: impl WorkSource + Copy + 'static,
    passes: u32,
    schedule: &Schedule,
    steps: impl Fn(u32, u32) -> u32,
) -> Option<(Film, Report, Replay)> {
    let gpu = gpu()?;
    let (film, report) = run(gpu, program, source, passes, schedule);
    let lengths = |pass_index: u32, tile: u32, lengths: &mut [u32; 256]| {
        for (index, length) in lengths.iter_mut().enumerate() {
            *length = source.pixel(tile, index as u32).map_or(0, |pixel| steps(pixel, pass_index));
        }
    };
    let banks = [report.pool_blocks, schedule.bank_blocks.unwrap_or(report.pool_blocks)];
    let seen = replay_in_banks(schedule, &source, passes, banks, report.ring, &lengths);
    let name = format!("{}, {source:?}, {passes} passes, {schedule}, {} blocks", program.name(), report.pool_blocks);
    assert_eq!(report.steps, seen.steps(), "{name}: steps");
    assert_eq!(report.block_steps, seen.block_steps(), "{name}: live blocks");
    assert_eq!(report.group_steps, seen.group_steps(), "{name}: groups");
    assert_eq!(report.lane_steps, seen.lane_steps(), "{name}: live lanes");
    assert_eq!(report.regenerations as usize, seen.regenerations.len(), "{name}: regenerations");
    if !schedule.regeneration.grain().is_by_lane() {
        assert_eq!(seen.assignments.len() as u32, source.tiles() * passes, "{name}: tiles");
    }
    let stages = program.stages().count();
    assert_eq!(report.launches, seen.launches_in_banks(stages, banks[1], &lengths), "{name}: launches");
    assert_eq!(seen.occupancy.useful, seen.lane_steps(), "{name}: useful lane-steps");
    Some((film, report, seen))
}

/// Kills: a tick that asks the policy too early or too late, a threshold compared the other way, a block retired a step late, tiles
/// handed out beyond the result ring, a fill that shrinks before the pool is empty or does not grow, a counter that forgets the last step.
#[test]
fn the_device_counts_what_the_policies_say() {
    // Numbers up to 159,486 stay below 2^32 on their way, so that 32 bits and 64 bits agree. The stage that finds the walk at 1 is a step
    // too.
    let steps = |pixel: u32, _: u32| collatz_steps(u64::from(pixel) + 1) as u32 + 1;
    let block = |threshold, check_every| Schedule::block().with_regeneration(BlockInPlace::new(threshold, check_every));
    for (count, passes, pool, schedule) in [
        (1, 1, 1, Schedule::never()),
        (2900, 3, 4, Schedule::never()),
        (2900, 3, 4, Schedule::never_full()),
        (2900, 9, 500, Schedule::never_full()),
        (2900, 4, 7, block(0.25, 1).with_launch(LaunchScope::AllBlocks)),
        (2900, 4, 13, block(2.0, 3).with_launch(LaunchScope::AllBlocks)),
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
        if compare(&collatz(), source, passes, &schedule, steps).is_none() {
            return;
        }
    }
}

/// Kills: an item handed out twice or to a lane that lives; a list with gaps, or made anew too rarely; items of a pass counted in the slot of
/// another; a fill or a bank that counts lanes which do not run.
#[test]
fn the_device_hands_out_items_as_the_policies_say() {
    let lane = |every| Schedule::per_lane().with_regeneration(LaneInPlace::new(every));
    let packed = |every| Schedule::compaction().with_regeneration(StreamCompaction::new(every));
    let mut work = std::collections::BTreeSet::new();
    for (width, height, passes, pool, schedule) in [
        (16, 16, 1, 1, lane(1)),
        (40, 56, 4, 1, lane(1)),
        (40, 56, 4, 1, packed(1)),
        (40, 56, 4, 5, lane(1)),
        (40, 56, 4, 5, lane(3)),
        (40, 56, 4, 5, lane(2).with_launch(LaunchScope::AllBlocks)),
        (40, 56, 4, 5, packed(1)),
        (40, 56, 4, 5, packed(4)),
        (40, 56, 4, 5, packed(4).with_bank_blocks(2)),
        (40, 56, 4, 5, lane(1).with_bank_blocks(2).with_order(Morton)),
        (40, 56, 5, 40, lane(1)),
        (40, 56, 5, 40, packed(8).with_bank_blocks(7)),
        (150, 70, 5, 9, packed(4).with_order(Morton)),
        (150, 70, 3, 9, packed(4).with_ring(1)),
        (150, 70, 3, 9, lane(1).with_ring(1)),
        (1, 300, 70, 3, packed(2)),
    ] {
        let schedule = schedule.with_pool_blocks(pool);
        let Some((film, report, _)) = compare(&waiting(), ImageTiles { width, height }, passes, &schedule, waiting_steps) else { return };
        let expected = |pixel: u32| (0..passes).map(|sample| f64::from(waiting_steps(pixel, sample))).sum::<f64>();
        assert!((0..width * height).all(|pixel| film.sum(pixel as usize, 0) == expected(pixel)), "{schedule}");
        work.insert((report.steps, report.group_steps, report.launches));
    }
    assert!(work.len() >= 14, "the schedules hardly differ: {work:?}");
}

/// The lengths of a pass say little about the next, several passes of a tile run at once, and the tiles lie in a grid with partial tiles
/// at two edges.
/// Kills: a curve with rows and columns exchanged on one face; a decayed key measured against what ends in the same tick, or that decays
/// twice while the tile runs; a key that forgets the passes in flight.
#[test]
fn the_device_follows_every_order_of_tiles() {
    let block = |threshold, check_every| Schedule::block().with_regeneration(BlockInPlace::new(threshold, check_every));
    let mut work = Vec::new();
    for (width, height, passes, pool, schedule) in [
        (150, 70, 5, 7, block(0.0, 1)),
        (150, 70, 5, 7, block(0.0, 1).with_order(Morton)),
        (70, 150, 5, 7, block(0.0, 1).with_order(Morton)),
        (20, 300, 4, 5, Schedule::never().with_order(Morton)),
        (150, 70, 5, 7, block(0.0, 1).with_order(DepthMax)),
        (150, 70, 5, 7, block(0.0, 1).with_order(DepthMean)),
        (150, 70, 5, 7, block(0.0, 1).with_order(DepthDecayed)),
        // Small images in pools with room for more than a pass: here it matters what was known when a tile began.
        (48, 48, 20, 10, block(0.25, 1).with_order(DepthDecayed)),
        (48, 48, 12, 7, block(0.25, 1).with_order(DepthDecayed)),
        (40, 60, 12, 25, block(0.5, 2).with_order(DepthDecayed)),
        (40, 60, 12, 100, block(0.25, 1).with_order(DepthDecayed)),
        (300, 300, 4, 30, block(0.5, 2).with_order(DepthDecayed)),
        (150, 70, 6, 9, Schedule::never().with_order(DepthDecayed).with_ring(1)),
    ] {
        let schedule = schedule.with_pool_blocks(pool);
        let Some((film, report, _)) = compare(&waiting(), ImageTiles { width, height }, passes, &schedule, waiting_steps) else { return };
        let expected = |pixel: u32| (0..passes).map(|sample| f64::from(waiting_steps(pixel, sample))).sum::<f64>();
        assert!((0..width * height).all(|pixel| film.sum(pixel as usize, 0) == expected(pixel)), "{schedule}");
        work.push((width, passes, report.steps, report.block_steps));
    }
    let first = work.iter().filter(|(width, passes, ..)| (*width, *passes) == (150, 5)).collect::<std::collections::BTreeSet<_>>();
    assert!(first.len() >= 4, "the orders hardly differ: {work:?}");
}
