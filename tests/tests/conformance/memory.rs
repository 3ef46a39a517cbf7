//! Where the state lies reaches no bit; in which form it lies reaches as many as it says.

use wavepool::{
    ImageTiles, LinearRange, Schedule,
    layout::Storage,
    policy::{BlockInPlace, RouletteScope, Statistic},
};
use wavepool_tests::{
    arrays,
    device::{gpu, run},
    memory,
};

/// Kills: two values that are needed at the same border in one plane; a value loaded after the plane has got its next owner, among them
/// what walks that finish or are killed with their block read late.
#[test]
fn shared_planes_change_no_bit() {
    let Some(gpu) = gpu() else { return };
    let source = ImageTiles { width: 40, height: 40 };
    let (shared, apart) = (memory::relay(), memory::relay_with(|builder| builder.share_planes(false)));
    for scope in [None, Some(RouletteScope::Lane), Some(RouletteScope::Block(Statistic::Max))] {
        let layout = shared.layout(scope);
        assert_eq!(apart.layout(scope).planes(), layout.planes_unshared());
        assert!(layout.planes() + 4 <= layout.planes_unshared(), "hardly anything is shared:\n{}", layout.table());
        assert!(layout.planes() >= layout.planes_at_least());
    }
    let mut hashes = Vec::new();
    for roulette in ["none", "lane", "block-max", "group:32"] {
        let lane: Schedule = format!("block,roulette={roulette}").parse().expect("a schedule");
        let often = lane.clone().with_regeneration(BlockInPlace::new(0.1, 1)).with_pool_blocks(3);
        let film = |program, schedule: &Schedule| run(gpu, program, source, 3, schedule).0;
        let mega = Schedule::megakernel().with_roulette(lane.roulette.clone());
        let expected = film(&shared, &mega);
        for schedule in [&lane, &often, &often.clone().with_poison(0x7fc0_0000)] {
            for program in [&shared, &apart] {
                assert_eq!(film(program, schedule).hash(), expected.hash(), "{schedule}, roulette {roulette}");
            }
        }
        hashes.push(expected.hash());
    }
    hashes.dedup();
    assert_eq!(hashes.len(), 4, "roulette decides nothing");
}

const PACKED: [Storage; 3] = [Storage::UnitVector, Storage::HalfPair, Storage::Rgb9e5];

/// Kills: a word whose value changes when it is stored again: a rim or a corner of the octahedron's square with two names, a sign of zero,
/// an infinity of a half, a shared exponent that is larger than it must be, a rounding that creeps.
#[test]
fn stored_values_stay_as_they_are() {
    let Some(gpu) = gpu() else { return };
    for storage in PACKED {
        let program = memory::words_there_and_back(storage, 64);
        let (film, report) = run(gpu, &program, LinearRange { count: 1 << 16 }, 1, &Schedule::never());
        let wrong: f64 = (0..film.pixels()).map(|pixel| film.sum(pixel, 0)).sum();
        let tried: f64 = (0..film.pixels()).map(|pixel| film.sum(pixel, 1)).sum();
        assert_eq!((wrong, tried), (0.0, f64::from(70 << 16)), "{}: {}", storage.name(), gpu.facts);
        assert_eq!(report.storage_clamped, 0, "{}", storage.name());
    }
}

/// Kills: truncation instead of rounding; a grid point beside the nearest; an exponent that is off by one; a sign lost.
#[test]
fn formats_are_as_exact_as_they_say() {
    let Some(gpu) = gpu() else { return };
    for (storage, bound) in PACKED.into_iter().zip([5e-5, 1.0 / 2048.0, 1.0 / 511.0]) {
        let (film, report) = run(gpu, &memory::accuracy(storage), LinearRange { count: 200_000 }, 1, &Schedule::never());
        let mut worst = 0.0_f64;
        for pixel in 0..film.pixels() {
            let [x, y, z, a, b, c] = [0, 1, 2, 3, 4, 5].map(|leaf| film.sum(pixel, leaf));
            let size = x.hypot(y).hypot(z);
            let error = match storage {
                Storage::UnitVector => {
                    let cross = [y * c - z * b, z * a - x * c, x * b - y * a];
                    let sine = cross[0].hypot(cross[1]).hypot(cross[2]) / (size * a.hypot(b).hypot(c));
                    assert!(x * a + y * b + z * c > 0.0 && (a.hypot(b).hypot(c) - 1.0).abs() < 1e-6);
                    sine
                }
                // Below 2^-14, and with shared exponents below 2^-16, the error is what it is there.
                Storage::HalfPair => {
                    [(x, a), (y, b)].map(|(x, a)| (x - a).abs() / x.abs().max(2.0_f64.powi(-14))).into_iter().fold(0.0, f64::max)
                }
                _ => (x - a).abs().max((y - b).abs()).max((z - c).abs()) / x.max(y).max(z).max(2.0_f64.powi(-16)),
            };
            worst = worst.max(error);
        }
        eprintln!("{}: largest error {worst:.3e}, bound {bound:.3e}", storage.name());
        assert!(worst <= bound && worst > bound * 0.6, "{}: {worst:e}, bound {bound:e}", storage.name());
        assert_eq!(report.storage_clamped, 0, "{}", storage.name());
    }
}

/// Kills: an index that is clamped or wraps into another place, in any execution; accesses beyond the end that nobody counts.
#[test]
fn places_that_do_not_exist_are_counted() {
    let Some(gpu) = gpu() else { return };
    for schedule in [Schedule::never(), Schedule::block().with_pool_blocks(2), Schedule::megakernel()] {
        let (film, report) = run(gpu, &arrays::out_of_range(), LinearRange { count: 1000 }, 3, &schedule);
        assert_eq!(report.out_of_range, 4 * 3000, "{schedule}");
        for pixel in 0..film.pixels() {
            assert_eq!([0, 1, 2].map(|leaf| film.sum(pixel, leaf)), [3.0 * pixel as f64, 0.0, 0.0], "{schedule}");
        }
    }
}
