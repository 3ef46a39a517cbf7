//! Orders by results: what the device keeps of a tile is what the films say.

use wavepool::{ImageTiles, Instruments, Program, Schedule, Scheduler};
use wavepool_tests::device::{gpu, patient};

/// Results whose spread differs from tile to tile, in small integers, so that films can be subtracted without rounding. The second leaf
/// counts as well, the third is no float; odd tiles have a mean of their own.
fn noise() -> Program {
    let wgsl = "
import wavepool::math::random::pcg4d;
struct Walk { key: vec2u, tile: u32, left: u32 }
struct Outcome { noise: f32, tilt: f32, count: u32 }
fn generate(w: ptr<function, Walk>, item: Item) {
    (*w).key = vec2u(item.pixel, item.sample);
    (*w).tile = item.tile;
    (*w).left = 1u + (item.pixel + item.sample) % 5u;
}
fn wait(w: ptr<function, Walk>) -> u32 {
    (*w).left -= 1u;
    return select(CONTINUE, FINISH, (*w).left == 0u);
}
fn finish(w: ptr<function, Walk>) -> Outcome {
    let words = pcg4d(vec4u((*w).key, 3u, 5u));
    let spread = 1u << ((*w).tile * 7u % 10u);
    return Outcome(f32((words.x % 8u) * spread), f32((*w).tile % 2u * 512u + words.y % 2u), words.z);
}
";
    let program = Program::builder("noise").source("noise.wgsl", wgsl).stage("wait").build();
    program.unwrap_or_else(|error| panic!("{error}"))
}

const IMAGE: ImageTiles = ImageTiles { width: 70, height: 40 };
const PASSES: u32 = 8;

/// Kills: a mean that forgets a pass, a pass counted from 0, a leaf or an item left out of the sum, a key before or after its time, an order
/// that puts the quiet tiles first or stands still.
#[test]
fn keys_are_the_variances_that_films_show() {
    let Some(gpu) = gpu() else { return };
    let program = noise();
    let schedule = "block,threshold=0.25,check_every=1,order=error".parse::<Schedule>().expect("a schedule").with_pool_blocks(4);
    let instruments = Instruments { steps: true, lengths: true, ..Instruments::default() };
    let run = |passes: u32| {
        let builder = Scheduler::builder(&program, IMAGE).schedule(&schedule).instruments(instruments);
        let outcome = builder.build_on(gpu).and_then(|mut scheduler| scheduler.run_with(0, passes, patient()));
        outcome.unwrap_or_else(|error| panic!("{error}"))
    };
    let films: Vec<_> = (0..=PASSES).map(|passes| run(passes).0).collect();
    let (_, report) = run(PASSES);
    let lengths = report.observed.lengths.expect("asked for");
    let tiles = lengths.tiles();
    assert_eq!((tiles, lengths.keys().len() as u32), (15, 15 * PASSES));

    // Sums of the tiles by pass, from the films; their squared deviations.
    let source: &dyn wavepool::policy::WorkSource = &IMAGE;
    let sum = |film: &wavepool::Film, tile: u32| -> f64 {
        (0..256).filter_map(|place| source.pixel(tile, place)).map(|pixel| film.sum(pixel as usize, 0) + film.sum(pixel as usize, 1)).sum()
    };
    let squares = |tile: u32, passes: u32| -> f64 {
        let sums: Vec<f64> = (1..=passes as usize).map(|pass| sum(&films[pass], tile) - sum(&films[pass - 1], tile)).collect();
        let mean = sums.iter().sum::<f64>() / f64::from(passes);
        sums.iter().map(|sum| (sum - mean) * (sum - mean)).sum()
    };
    for passes in 1..=PASSES {
        for tile in 0..tiles {
            let key = lengths.keys()[((passes - 1) * tiles + tile) as usize];
            let exact = (squares(tile, passes) as f32).to_bits() >> 21;
            // Rounding may carry a value over the edge of its step.
            assert!(key.abs_diff(exact) <= 1, "tile {tile} after {passes} passes: key {key}, from the films {exact}");
        }
    }

    // The last pass is handed out by what was known when the one before it ended.
    let steps = report.observed.steps.expect("asked for");
    let order: Vec<u32> = steps.assignments.iter().filter(|given| given.pass_index == PASSES - 1).map(|given| given.tile).collect();
    let known = (2..PASSES).find(|passes| {
        let key = |tile: &u32| std::cmp::Reverse(lengths.keys()[((passes - 1) * tiles + tile) as usize]);
        order.is_sorted_by_key(key)
    });
    assert!(known.is_some_and(|passes| passes + 4 >= PASSES), "order {order:?} follows what was known after {known:?} passes");
    assert!(!order.is_sorted());
}
