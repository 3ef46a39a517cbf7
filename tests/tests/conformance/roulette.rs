//! Roulette is unbiased, its variance is the one that theory gives, and the lanes of a block that share a draw vary together as much as
//! they should. Faulty policies are rejected by the same statistics.

use std::sync::Arc;

use wavepool::{
    LinearRange, Program, Report, Schedule,
    policy::{PerBlock, PerGroup, PerLane, Roulette, Statistic},
};
use wavepool_tests::{
    device::{gpu, run, scheduler},
    moments::{FALSE_ALARM, Law, Sample, intraclass_correlation},
    programs::{enclosure_with, unequal},
};

const RHO: f32 = 0.8;
/// Items of a pass: 78 tiles.
const SOURCE: LinearRange = LinearRange { count: 78 * 256 };

/// Walks of an enclosure; each is a draw when its lane draws for itself.
fn walks_of_enclosure(program: &Program, schedule: &Schedule, passes: u32) -> Option<(Sample, Report)> {
    let gpu = gpu()?;
    let (film, report) = run(gpu, program, SOURCE, passes, schedule);
    let walks = film.pixels() as f64 * f64::from(passes);
    let total = |leaf: usize| (0..film.pixels()).map(|pixel| film.sum(pixel, leaf)).sum::<f64>();
    assert!(report.items_killed as f64 > 0.99 * walks, "roulette ended {} of {walks} walks", report.items_killed);
    assert_eq!(report.not_finite, 0);
    Some((Sample::of_sums(walks, total(0), total(1)), report))
}

/// The chance that the program of f32 numbers really has.
fn law_of(rho: f32, p: f32) -> Law {
    Law::of_enclosure(f64::from(rho), f64::from(p))
}

/// Closed form: mean 1/(1-rho); variance (1+rho)/((1-rho)(1-rho^2/p)) - 1/(1-rho)^2.
/// Power: 399,360 walks have a relative standard error of 0.08 % (p = 0.9) or 0.11 % (0.85) in the mean and 0.14 % or 0.22 % in the
/// variance; |z| < 4.9 has a false alarm in 1e-6 and misses a bias of 0.9 %, or a variance wrong by 1.8 %, once in a thousand. The draws
/// are fixed, so that the test passes or fails for good.
/// Kills: `reweight` with p instead of 1/p; survivors not reweighted; a draw used twice (`draw` of step 0 in every step); a
/// chance that is 2 % off but compensated.
#[test]
fn lane_roulette_has_the_mean_and_the_variance_of_theory() {
    for p in [0.85, 0.9] {
        let (program, law) = (enclosure_with(RHO, p), law_of(RHO, p));
        for schedule in [Schedule::block().with_pool_blocks(16), Schedule::megakernel()] {
            let Some((sample, _)) = walks_of_enclosure(&program, &schedule, 20) else { return };
            let (mean, variance) = (law.check_mean(&sample), law.check_variance(&sample));
            eprintln!("p = {p}, {schedule}: {sample:?}, z of mean {mean:.2?}, of variance {variance:.2?}");
            mean.and(variance).unwrap_or_else(|problem| panic!("p = {p}, {schedule}: {problem}"));
        }
    }
}

/// A coin for 256 walks whose chances are equal: the mean is the same, and the walks of a block differ in nothing. So a block is one draw
/// (intra-class correlation 1): 78 tiles times 200 passes are 15,600 draws, a standard error of 0.4 % in the mean and 0.7 % in the
/// variance; |z| < 4.9 misses a bias of 3.2 % once in a thousand.
/// Kills: a killed block whose walks leave no result; a block reweighted twice or in the wrong step; a draw
/// keyed by the block's place in the pool.
#[test]
fn block_roulette_has_the_mean_and_the_variance_of_theory() {
    let (program, law) = (enclosure_with(RHO, 0.9), law_of(RHO, 0.9));
    for statistic in [Statistic::Max, Statistic::Mean] {
        let schedule = Schedule::megakernel().with_roulette(Some(Arc::new(PerBlock(statistic))));
        let Some((sample, _)) = walks_of_enclosure(&program, &schedule, 200) else { return };
        let blocks = Sample { draws: sample.draws / 256.0, ..sample };
        let (mean, variance) = (law.check_mean(&blocks), law.check_variance(&blocks));
        eprintln!("{statistic:?}: {blocks:?}, z of mean {mean:.2?}, of variance {variance:.2?}");
        mean.and(variance).unwrap_or_else(|problem| panic!("{statistic:?}: {problem}"));
    }
}

/// Groups of 16 equal lanes are a draw each: 78 tiles times 50 passes are 62,400 draws, with a standard error of 0.2 % in the mean and
/// 0.35 % in the variance; |z| < 4.9 misses a bias of 1.6 % once in a thousand. Lanes 2i and 2i + 1 of a group correlate fully; the
/// correlation of the means of neighbouring groups has a standard error of 0.8 %.
/// Kills: survivors of a group weighted by another chance than they were drawn with; a draw used in two steps; groups that share a draw.
#[test]
fn group_roulette_has_the_mean_and_the_variance_of_theory() {
    let group: Arc<dyn Roulette> = Arc::new(PerGroup::new(16).expect("a power of two"));
    let (program, law) = (enclosure_with(RHO, 0.9), law_of(RHO, 0.9));
    for schedule in [Schedule::block().with_pool_blocks(16), Schedule::megakernel()] {
        let schedule = schedule.with_roulette(Some(group.clone()));
        let Some((sample, _)) = walks_of_enclosure(&program, &schedule, 50) else { return };
        let groups = Sample { draws: sample.draws / 16.0, ..sample };
        let (mean, variance) = (law.check_mean(&groups), law.check_variance(&groups));
        eprintln!("{schedule}: {groups:?}, z of mean {mean:.2?}, of variance {variance:.2?}");
        mean.and(variance).unwrap_or_else(|problem| panic!("{schedule}: {problem}"));
    }
    let blocks = walks_by_block(&program, &group, 3, 1000, 0).expect("there is a device");
    let groups: Vec<Vec<f64>> = blocks.iter().flat_map(|block| block.chunks(16).map(<[f64]>::to_vec)).collect();
    assert!((intraclass_correlation(&groups) - 1.0).abs() < 1e-9, "lanes of a group part");
    let of_blocks: Vec<Vec<f64>> = blocks.iter().map(|block| block.iter().step_by(16).copied().collect()).collect();
    let between = intraclass_correlation(&of_blocks);
    assert!(between.abs() < 0.02, "groups of a block correlate: {between}");
}

/// Kills: a maximum over part of the group; a group that includes lanes of its neighbour.
#[test]
fn no_survivor_of_a_group_is_heavier_than_its_bound() {
    let group: Arc<dyn Roulette> = Arc::new(PerGroup::new(8).expect("a power of two"));
    let Some(blocks) = walks_by_block(&unequal(), &group, 5, 1000, 1) else { return };
    let mut heaviest = 0.0;
    blocks.into_iter().flatten().for_each(|walk| heaviest = f64::max(heaviest, walk));
    assert!(heaviest <= 1.0 + 1e-6 && heaviest > 0.5, "the heaviest survivor carries {heaviest}");
}

/// One tile of 200 items, 56 lanes of the block empty; 3000 passes are as many draws. The mean over all 256 lanes would be a chance of
/// 0.70 instead of 0.9, with a variance 13 times as large.
/// Kills: a mean over dead lanes too.
#[test]
fn empty_lanes_do_not_lower_the_mean_of_a_block() {
    let Some(gpu) = gpu() else { return };
    let (items, passes) = (200, 3000);
    let schedule = Schedule::block().with_pool_blocks(60).with_roulette(Some(Arc::new(PerBlock(Statistic::Mean))));
    let (film, _) = run(gpu, &enclosure_with(RHO, 0.9), LinearRange { count: items }, passes, &schedule);
    let (sum, squares) = (film.sum(0, 0), film.sum(0, 1));
    assert!((0..items as usize).all(|item| film.sum(item, 0) == sum), "the lanes of a block are alike");
    let law = law_of(RHO, 0.9);
    let sample = Sample::of_sums(f64::from(passes), sum, squares);
    law.check_mean(&sample).and(law.check_variance(&sample)).unwrap_or_else(|problem| panic!("{problem}"));
}

/// What a leaf of every walk was, by block.
fn walks_by_block(program: &Program, roulette: &Arc<dyn Roulette>, seed: u32, tiles: u32, leaf: usize) -> Option<Vec<Vec<f64>>> {
    let gpu = gpu()?;
    let schedule = Schedule::megakernel().with_roulette(Some(roulette.clone()));
    let mut scheduler = scheduler(gpu, program, LinearRange { count: tiles * 256 }, &schedule);
    scheduler.set_seed(seed);
    let (film, report) = scheduler.run_with(seed, 1, |_| std::ops::ControlFlow::Continue(())).expect("runs");
    assert_eq!((report.passes, report.not_finite), (1, 0));
    Some((0..tiles as usize).map(|tile| (0..256).map(|lane| film.sum(tile * 256 + lane, leaf)).collect()).collect())
}

/// Mean over the blocks of the product of neighbours' deviations, over the variance: the correlation of two lanes.
fn correlation_of_neighbours(blocks: &[Vec<f64>], mean: f64) -> f64 {
    let products = blocks.iter().flat_map(|block| block.chunks(2)).map(|pair| (pair[0] - mean) * (pair[1] - mean));
    let squares = blocks.iter().flatten().map(|walk| (walk - mean).powi(2)).sum::<f64>();
    products.sum::<f64>() / (squares / 2.0)
}

/// Lanes with different, random chances that share a draw: the mean of a block of m lanes varies 1 + (m-1) ICC times as much as the mean
/// of m independent lanes. The correlation comes from pairs of lanes of one run, the ratio from means of blocks of a run with other draws
/// and other walks; 3000 blocks each know the ratio to about 5 %, and 25 % are allowed. Without shared draws the correlation is 0 and the
/// ratio 1.
/// Kills: a block's draw taken by each lane; a block drawn with one chance and reweighted with another (biased: the mean of the blocks is
/// 1/(1-0.65) under every policy).
#[test]
fn lanes_of_a_block_vary_together_as_the_theory_of_clusters_says() {
    let program = unequal();
    let mean = 1.0 / (1.0 - 0.65);
    let policies: [(Arc<dyn Roulette>, bool); 3] =
        [(Arc::new(PerLane), false), (Arc::new(PerBlock(Statistic::Max)), true), (Arc::new(PerBlock(Statistic::Mean)), true)];
    for (roulette, is_shared) in policies {
        let blocks = |seed: u32| walks_by_block(&program, &roulette, seed, 3000, 0);
        let (Some(one), Some(other)) = (blocks(1), blocks(2)) else { return };
        let pairs = correlation_of_neighbours(&one, mean);
        let lanes = Sample::of(&other.concat());
        let means = Sample::of(&other.iter().map(|block| Sample::of(block).mean).collect::<Vec<_>>());
        let z = (means.mean - mean) / (means.variance / means.draws).sqrt();
        let ratio = means.variance / (lanes.variance / 256.0);
        let expected = 1.0 + 255.0 * pairs;
        let analysed = intraclass_correlation(&other);
        let name = roulette.name();
        eprintln!(
            "{name}: ICC {pairs:.4} by pairs, {analysed:.4} by blocks; variance ratio {ratio:.2}, expected {expected:.2}; z = {z:.2}"
        );
        assert!(z.abs() < FALSE_ALARM, "{name}: mean {}, expected {mean}, z = {z}", means.mean);
        if is_shared {
            assert!((ratio / expected - 1.0).abs() < 0.25, "{name}: the variance ratio is {ratio}, expected {expected}");
            assert!((pairs - analysed).abs() < 0.1 && ratio > 20.0, "{name}: {pairs} by pairs, {analysed} by blocks");
        } else {
            // 384,000 pairs: a standard error of 0.0016; 3000 blocks: of 2.6 %.
            assert!(pairs.abs() < 0.01 && (ratio - 1.0).abs() < 0.13, "{name}: ICC {pairs}, ratio {ratio}");
        }
    }
}

/// Lanes of a block that are alike in everything.
/// Kills: lanes of a block that part although they share chance and draw; a correlation that cannot reach 1.
#[test]
fn equal_lanes_of_a_block_correlate_fully() {
    let roulette: Arc<dyn Roulette> = Arc::new(PerBlock(Statistic::Max));
    let Some(blocks) = walks_by_block(&enclosure_with(RHO, 0.9), &roulette, 3, 500, 0) else { return };
    assert!((intraclass_correlation(&blocks) - 1.0).abs() < 1e-9);
    assert!((correlation_of_neighbours(&blocks, Sample::of(&blocks.concat()).mean) - 1.0).abs() < 1e-9);
}

/// A lane that would survive with what it carries, at most 1, carries at most 1 when it survives with the largest of its block's chances.
/// The rounding of a division and a product is allowed. The mean of the chances has no such bound.
/// Kills: a maximum over dead lanes or over part of the block that is too small; a chance that is not the largest; survivors that are
/// weighted by another chance than they were drawn with.
#[test]
fn no_survivor_is_heavier_than_its_bound() {
    let heaviest = |statistic: Statistic| {
        let blocks = walks_by_block(&unequal(), &(Arc::new(PerBlock(statistic)) as Arc<dyn Roulette>), 5, 2000, 1)?;
        Some(blocks.into_iter().flatten().fold(0.0, f64::max))
    };
    let (Some(by_max), Some(by_mean)) = (heaviest(Statistic::Max), heaviest(Statistic::Mean)) else { return };
    eprintln!("heaviest survivor: {by_max} by maximum, {by_mean} by mean");
    assert!(by_max <= 1.0 + 1e-6, "a survivor carries {by_max}");
    assert!(by_mean > 1.5, "the mean should let lanes grow, or the bound is no bound: {by_mean}");
}

/// A policy with a planted fault; only the weight or the chance differs from the sound one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Faulty {
    /// No fault.
    Sound,
    /// Survivors weigh 1 / p^2.
    DividesTwice,
    /// Survivors weigh 1.
    DoesNotDivide,
    /// Survives with p / 2 and weighs 2 / p: unbiased, and noisier than it says.
    HalvesTheChance,
}

impl Roulette for Faulty {
    fn name(&self) -> &str {
        "faulty"
    }

    fn wgsl(&self) -> String {
        let (chance, weight) = match self {
            Faulty::Sound => ("p", "1.0 / p"),
            Faulty::DividesTwice => ("p", "1.0 / (p * p)"),
            // Not 1.0: a weight of one means that nothing is handed to `reweight`, where this program adds up.
            Faulty::DoesNotDivide => ("p", "1.0000001"),
            Faulty::HalvesTheChance => ("0.5 * p", "2.0 / p"),
        };
        format!(
            "fn wf_inverse_survival(p: f32, draw: u32) -> f32 {{\n    \
             return select(0.0, {weight}, f32(draw >> 8u) * 5.9604644775390625e-8 < {chance});\n}}\n"
        )
    }

    fn inverse_survival(&self, p: f32, draw: u32) -> f32 {
        let (chance, weight) = match self {
            Faulty::Sound => (p, 1.0 / p),
            Faulty::DividesTwice => (p, 1.0 / (p * p)),
            Faulty::DoesNotDivide => (p, 1.000_000_1),
            Faulty::HalvesTheChance => (0.5 * p, 2.0 / p),
        };
        if (draw >> 8) as f32 * (1.0 / 16_777_216.0) < chance { weight } else { 0.0 }
    }
}

/// What the two checks say of a policy, with rho = 0.5 and p = 0.9: there the variance is finite with half the chance too.
fn verdicts(roulette: Faulty) -> Option<(Result<f64, String>, Result<f64, String>)> {
    let schedule = Schedule::megakernel().with_roulette(Some(Arc::new(roulette)));
    let (sample, _) = walks_of_enclosure(&enclosure_with(0.5, 0.9), &schedule, 20)?;
    let law = law_of(0.5, 0.9);
    let (mean, variance) = (law.check_mean(&sample), law.check_variance(&sample));
    eprintln!("{roulette:?}: mean {mean:.2?}, variance {variance:.2?}");
    Some((mean, variance))
}

/// Kills: checks that reject what is sound, which would make the next three tests worthless.
#[test]
fn a_sound_policy_of_ones_own_passes_both_checks() {
    let Some((mean, variance)) = verdicts(Faulty::Sound) else { return };
    mean.and(variance).unwrap_or_else(|problem| panic!("{problem}"));
}

/// Kills: a check of the mean that passes survivors weighted by 1/p^2.
#[test]
fn planted_weight_of_one_over_p_squared_dies_by_the_mean() {
    let Some((mean, _)) = verdicts(Faulty::DividesTwice) else { return };
    mean.expect_err("survivors weigh 1/p^2");
}

/// Kills: a check of the mean that passes survivors which were never reweighted.
#[test]
fn planted_weight_of_one_dies_by_the_mean() {
    let Some((mean, _)) = verdicts(Faulty::DoesNotDivide) else { return };
    mean.expect_err("survivors weigh 1");
}

/// Kills: a check of the variance that passes a chance of p/2 with the weight 2/p, which no check of the mean can see.
#[test]
fn planted_half_chance_is_unbiased_and_dies_by_the_variance() {
    let Some((mean, variance)) = verdicts(Faulty::HalvesTheChance) else { return };
    mean.unwrap_or_else(|problem| panic!("it is unbiased: {problem}"));
    variance.expect_err("the variance is 18 times too large");
}
