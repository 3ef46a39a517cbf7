//! Sizes at which an off-by-one shows: tiles that are empty, full, just over; one pass and more than a cascade level; values that
//! overflow; launches that need two dimensions.

use wavepool::{ImageTiles, LinearRange, Program, Schedule};
use wavepool_tests::{
    device::{gpu, run},
    programs::{collatz_steps, identity_sum, not_finite},
};

fn schedules() -> [Schedule; 6] {
    let persistent = Schedule::persistent().with_pool_blocks(1);
    [
        Schedule::never(),
        Schedule::never_full(),
        Schedule::block().with_pool_blocks(2),
        Schedule::megakernel(),
        Schedule::megakernel_regen(),
        persistent,
    ]
}

/// Kills: a pass without items that never ends; a last tile with one item, or without its last item.
#[test]
fn ranges_around_a_tile() {
    let Some(gpu) = gpu() else { return };
    let program = wavepool_tests::programs::collatz();
    for schedule in schedules() {
        let mut hashes = Vec::new();
        for count in [0, 1, 255, 256, 257] {
            for passes in [0, 1, 2] {
                let (film, report) = run(gpu, &program, LinearRange { count }, passes, &schedule);
                assert_eq!(film.pixels(), count as usize);
                assert_eq!(report.items_started, u64::from(count * passes), "{schedule}, {count} items, {passes} passes");
                for pixel in 0..film.pixels() {
                    assert_eq!(film.samples()[pixel], passes);
                    assert_eq!(film.sum(pixel, 0) as u64, u64::from(passes) * collatz_steps(pixel as u64 + 1));
                }
                hashes.push(film.hash());
            }
        }
        hashes.sort_unstable();
        hashes.dedup();
        assert_eq!(hashes.len(), 13, "{schedule}: films of other sizes share a hash");
    }
}

/// Kills: pixels of partial tiles counted from the wrong row or column; tiles of an image one pixel wide.
#[test]
fn images_around_a_tile() {
    let Some(gpu) = gpu() else { return };
    for schedule in schedules() {
        for (width, height) in [(1, 1), (16, 16), (17, 33), (1, 40), (300, 1), (0, 5)] {
            let (film, report) = run(gpu, &identity_sum(), ImageTiles { width, height }, 2, &schedule);
            assert_eq!(film.pixels() as u32, width * height);
            assert_eq!(report.items_started, u64::from(2 * width * height));
            for pixel in 0..film.pixels() {
                assert_eq!((film.samples()[pixel], film.sum(pixel, 2)), (2, 2.0 * pixel as f64), "{schedule}: {width}x{height}");
            }
        }
    }
}

/// A sum of 256 equal terms in one f32 is off by 2e-6 (0.1: 25.6 in steps of 2^-19), and the cascade keeps it there; without levels
/// 4096 terms are off by 3.9e-5.
/// Kills: one f32 for the whole sum; a level that is added but not cleared; a carry lost between the words of an integer.
#[test]
fn sums_of_many_passes_are_exact_enough() {
    let Some(gpu) = gpu() else { return };
    for passes in [300, 4096] {
        let mut hashes = Vec::new();
        for schedule in [Schedule::never(), Schedule::block().with_pool_blocks(40), Schedule::megakernel()] {
            let (film, _) = run(gpu, &identity_sum(), LinearRange { count: 257 }, passes, &schedule);
            for pixel in 0..film.pixels() {
                let exact = f64::from(passes) * f64::from(0.1_f32);
                assert!((film.sum(pixel, 0) / exact - 1.0).abs() < 4e-6, "{schedule}: {} instead of {exact}", film.sum(pixel, 0));
                assert_eq!(film.sum(pixel, 1), f64::from(passes) * f64::from(0xffff_fff0_u32), "{schedule}: the carry");
                assert_eq!(film.sum(pixel, 3), f64::from((passes - 1) * passes / 2));
            }
            hashes.push(film.hash());
        }
        assert!(hashes.windows(2).all(|pair| pair[0] == pair[1]));
    }
}

/// Kills: a NaN that reaches the sum, an infinity that is not counted, a sample that is not counted because its value is lost.
#[test]
fn results_that_are_not_finite_are_counted() {
    let Some(gpu) = gpu() else { return };
    for schedule in schedules() {
        let (film, report) = run(gpu, &not_finite(), LinearRange { count: 500 }, 4, &schedule);
        let bad = (0..500_u64).map(|pixel| match pixel {
            _ if pixel % 11 == 0 => 4,
            _ if pixel % 7 == 0 => 2,
            _ => 0,
        });
        assert_eq!(report.not_finite, bad.sum::<u64>(), "{schedule}");
        assert_eq!(film.not_finite(), report.not_finite);
        for pixel in 0..500 {
            assert_eq!((film.sum(pixel, 0), film.sum(pixel, 1), film.samples()[pixel]), (0.0, 6.0, 4), "{schedule}, pixel {pixel}");
        }
    }
}

/// A launch of more than 65,535 work-groups is folded into two dimensions. 64 passes of 1024 tiles make 65,536 blocks live at once, the
/// last of them alone in the second row; state and results fill a binding of 128 MiB exactly.
/// Kills: arguments of one dimension only; a slot computed without the second dimension; a fold that launches too few groups.
#[test]
fn launches_beyond_one_dimension() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "struct Walk { n: u32 }
        fn generate(w: ptr<function, Walk>, item: Item) { (*w).n = item.pixel; }
        fn stop(w: ptr<function, Walk>) -> u32 { return FINISH; }
        fn finish(w: ptr<function, Walk>) -> u32 { return (*w).n ^ 0x5555u; }";
    let program = Program::builder("wide").source("wide.wgsl", wgsl).stage("stop").build().expect("valid");
    let source = LinearRange { count: 1024 * 256 };
    let (film, report) = run(gpu, &program, source, 64, &Schedule::block().with_pool_blocks(65_536));
    assert_eq!((report.pool_blocks, report.ring, report.regenerations, report.steps), (65_536, 64, 1, 1));
    assert_eq!(report.block_steps, 65_536);
    assert!((0..film.pixels()).all(|pixel| film.sum(pixel, 0) == 64.0 * f64::from(pixel as u32 ^ 0x5555)));
}
