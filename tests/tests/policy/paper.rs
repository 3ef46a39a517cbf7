//! The worked example of the paper, with depths made for it.

use wavepool::{
    LinearRange, Schedule,
    policy::{BlockInPlace, DepthMax},
    replay::{Replay, replay},
};

/// The queue of the example, deepest tile first.
const QUEUE: [u32; 16] = [0xF, 0xE, 0xA, 0xB, 6, 7, 9, 5, 0xD, 3, 2, 1, 0, 4, 8, 0xC];

/// The table: who begins in which step, as the blocks then are; X is a dead block.
const TABLE: [(u32, &str); 5] = [(1, "FEAB6795"), (3, "FEAB67D3"), (5, "FE2B10D3"), (7, "FE2B48D3"), (9, "FE2BCXD3")];

/// The tiles in the blocks in a step, counted from the first step of the last pass.
fn blocks_in(seen: &Replay, begin: u32, step: u32, depth: impl Fn(u32) -> u32) -> String {
    let mut blocks = vec!['X'; 8];
    for given in seen.assignments.iter().filter(|given| given.pass_index == 2) {
        let birth = given.step - begin;
        if (birth..birth + depth(given.tile)).contains(&step) {
            blocks[given.block as usize] = char::from_digit(given.tile, 16).expect("16 tiles").to_ascii_uppercase();
        }
    }
    blocks.into_iter().collect()
}

/// 8 blocks, 16 tiles, no threshold. Two passes teach the queue, one after the other; the third has depths of its own, as passes have.
/// Kills: a queue sorted the other way or by the number of the tile; a dead block that takes a tile of another block's turn; a tile handed
/// out a step late.
#[test]
fn the_worked_example_of_the_paper() {
    let learnt = |tile: u32| 40 - 2 * QUEUE.iter().position(|queued| *queued == tile).expect("16 tiles") as u32;
    let depth = |tile: u32| match tile {
        9 | 5 => 2,
        0xA | 6 | 7 => 4,
        0 | 1 | 4 | 8 => 2,
        _ => 12,
    };
    let schedule = Schedule::block().with_regeneration(BlockInPlace::new(0.0, 1)).with_order(DepthMax);
    let lengths =
        |pass_index: u32, tile: u32, lengths: &mut [u32; 256]| lengths.fill(if pass_index < 2 { learnt(tile) } else { depth(tile) });
    let seen = replay(&schedule, &LinearRange { count: 16 * 256 }, 3, 8, 1, &lengths);
    let last: Vec<_> = seen.assignments.iter().filter(|given| given.pass_index == 2).collect();
    assert_eq!(last.iter().map(|given| given.tile).collect::<Vec<_>>(), QUEUE);
    let begin = last[0].step - 1;
    for (step, row) in TABLE {
        assert_eq!(blocks_in(&seen, begin, step, depth), row, "step {step}");
        assert!(last.iter().any(|given| given.step - begin == step), "nothing begins in step {step}");
    }
    assert_eq!(last.iter().filter(|given| given.step - begin > 9).count(), 0);
}
