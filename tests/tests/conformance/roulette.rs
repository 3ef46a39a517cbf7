//! Roulette is unbiased, and its variance is the one that theory gives.

use std::sync::Arc;

use wavepool::{
    LinearRange, Schedule,
    policy::{PerBlock, Statistic},
};
use wavepool_tests::{
    device::{gpu, run},
    programs::enclosure,
};

/// Constants of the program `enclosure`.
const RHO: f64 = 0.8;
const P: f64 = 0.9;

/// Mean, variance of one walk, and number of walks.
fn measure(schedule: &Schedule, passes: u32) -> Option<(f64, f64, f64)> {
    let gpu = gpu()?;
    let (film, report) = run(gpu, &enclosure(), LinearRange { count: 78 * 256 }, passes, schedule);
    let walks = film.pixels() as f64 * f64::from(passes);
    let total = |leaf: usize| (0..film.pixels()).map(|pixel| film.sum(pixel, leaf)).sum::<f64>() / walks;
    assert!(report.items_killed as f64 > 0.99 * walks, "roulette ended {} of {walks} walks", report.items_killed);
    assert_eq!(report.not_finite, 0);
    let mean = total(0);
    Some((mean, total(1) - mean * mean, walks))
}

/// Closed form: mean 1/(1-rho); variance (1+rho)/((1-rho)(1-rho^2/p)) - 1/(1-rho)^2.
/// Power: 400,000 walks have a standard error of 0.0060 at mean 5; |z| < 4.9 has a false alarm in 1e-6 and misses a bias of 0.8 %
/// (0.04, z = 6.7) in 4 % of runs. The draws are fixed, so that the test passes or fails for good.
/// Kills: `reweight` with p instead of 1/p; survivors not reweighted; a draw used twice (`draw` of step 0 in every step); p compared
/// with `<=` after rounding up.
#[test]
fn roulette_is_unbiased() {
    let expected = 1.0 / (1.0 - RHO);
    let variance = (1.0 + RHO) / ((1.0 - RHO) * (1.0 - RHO * RHO / P)) - expected * expected;
    for schedule in [Schedule::block().with_pool_blocks(16), Schedule::megakernel()] {
        let Some((mean, spread, walks)) = measure(&schedule, 20) else { return };
        let z = (mean - expected) / (variance / walks).sqrt();
        eprintln!("{schedule}: mean {mean:.4} (expected {expected}), z = {z:.2}, variance {spread:.3} (expected {variance:.3})");
        assert!(z.abs() < 4.9, "mean {mean}, expected {expected}, z = {z}");
        // The fourth moment exists for p > rho^(4/3) = 0.743; its relative error at 400,000 walks is below 3 %.
        assert!((spread / variance - 1.0).abs() < 0.15, "variance {spread}, expected {variance}");
    }
}

/// A coin for 256 walks whose chances are equal: the mean is the same, and the walks of a block differ in nothing. So the mean of a block
/// has the variance of one walk (intra-class correlation 1): 78 tiles times 200 passes are 15,600 independent draws, a standard error of
/// 0.020 at mean 5; |z| < 4.9 misses a bias of 3 % (0.15, z = 7.5) in 1 % of runs.
/// Kills: a killed block whose walks leave no result; a block reweighted twice or in the wrong step; a mean over dead lanes too; a draw
/// keyed by the block's place in the pool.
#[test]
fn block_roulette_is_unbiased() {
    let expected = 1.0 / (1.0 - RHO);
    let variance = (1.0 + RHO) / ((1.0 - RHO) * (1.0 - RHO * RHO / P)) - expected * expected;
    for statistic in [Statistic::Max, Statistic::Mean] {
        let schedule = Schedule::megakernel().with_roulette(Some(Arc::new(PerBlock(statistic))));
        let Some((mean, spread, walks)) = measure(&schedule, 200) else { return };
        let z = (mean - expected) / (variance / (walks / 256.0)).sqrt();
        eprintln!("{statistic:?}: mean {mean:.4} (expected {expected}), z = {z:.2}, variance {spread:.3} (expected {variance:.3})");
        assert!(z.abs() < 4.9, "{statistic:?}: mean {mean}, expected {expected}, z = {z}");
        assert!((spread / variance - 1.0).abs() < 0.3, "{statistic:?}: variance {spread}, expected {variance}");
    }
}
