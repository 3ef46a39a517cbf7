//! One line that tests a policy: `conformance!(order spiral: Spiral)`.
//!
//! Key decision: a policy has two faces, and what can go wrong is that they disagree. So its decisions are taken twice, by the device and by
//! the replay, on programs whose walks have known lengths, and compared in every step and every tile; and the film must be that of the
//! plainest schedule, bit for bit.
//!
//! **Invariant:** a check that runs nothing fails; without an adapter it says so and counts as skipped, or fails under
//! `WAVEPOOL_NO_SKIP=1`.

use std::collections::BTreeSet;

use wavepool::{
    GpuContext, ImageTiles, Instruments, LinearRange, Program, Schedule, Scheduler,
    layout::BLOCK,
    policy::{OrderRule, Regeneration, Roulette, TileGrid, TileOrder, WorkSource},
    profile::Lengths,
    replay::{WalkLengths, replay_in_banks},
};

/// Declares a test of a policy: `conformance!(KIND NAME: POLICY)` with `order`, `regeneration` or `roulette` for `KIND`.
///
/// # Example
/// ```
/// use wavepool::policy::Scanline;
/// wavepool_lab::conformance!(order scanline_is_sound: Scanline);
/// ```
#[macro_export]
macro_rules! conformance {
    (order $name:ident: $policy:expr) => {
        // Kills: an order that visits a tile twice, or whose device face goes another way.
        #[test]
        fn $name() {
            $crate::conformance::run(|gpu| $crate::conformance::check_order(gpu, || $policy));
        }
    };
    (regeneration $name:ident: $policy:expr) => {
        // Kills: a regeneration whose device face decides otherwise than its host face.
        #[test]
        fn $name() {
            $crate::conformance::run(|gpu| $crate::conformance::check_regeneration(gpu, || $policy));
        }
    };
    (roulette $name:ident: $policy:expr) => {
        // Kills: a roulette that is biased, or whose device face draws otherwise than its host face.
        #[test]
        fn $name() {
            $crate::conformance::run(|_| $crate::conformance::check_roulette(&$policy));
        }
    };
}

/// Runs a check on the adapter of this machine.
///
/// # Panics
/// With the check's own words when it fails; when there is no adapter and `WAVEPOOL_NO_SKIP=1`.
pub fn run(check: impl FnOnce(&GpuContext) -> Result<(), String>) {
    match GpuContext::headless() {
        Ok(gpu) => check(&gpu).unwrap_or_else(|problem| panic!("{problem}")),
        Err(error) => {
            let is_strict = std::env::var_os("WAVEPOOL_NO_SKIP").is_some_and(|value| value == "1");
            assert!(!is_strict, "skips are forbidden here: {error}");
            eprintln!("skipped: {error}");
        }
    }
}

const WALK: &str = "
struct Walk { left: u32, sum: f32 }
fn generate(w: ptr<function, Walk>, item: Item) {
    (*w).left = wait_for(item.pixel, item.sample);
    (*w).sum = f32(item.pixel % 97u);
}
fn wait_for(pixel: u32, sample_index: u32) -> u32 {
    var h = (pixel * 0x9e3779b1u) ^ ((sample_index + 1u) * 0x85ebca6bu);
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    h ^= h >> 12u;
    return h % 4u + select(0u, (h >> 8u) % 60u, h % 157u == 0u) + (pixel / 256u) % 7u;
}
fn wait(w: ptr<function, Walk>) -> u32 {
    (*w).sum = (*w).sum * 0.75 + 0.1;
    if ((*w).left == 0u) { return FINISH; }
    (*w).left -= 1u;
    return CONTINUE;
}
fn finish(w: ptr<function, Walk>) -> f32 { return (*w).sum; }
";

/// Steps that a walk of [`WALK`] takes.
fn steps_of(pixel: u32, sample: u32) -> u32 {
    let mut h = pixel.wrapping_mul(0x9e37_79b1) ^ (sample + 1).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h ^= h >> 12;
    1 + h % 4 + if h.is_multiple_of(157) { (h >> 8) % 60 } else { 0 } + (pixel / 256) % 7
}

/// Pools that a policy meets: one block, few, as many as tiles, more than there is work.
const POOLS: [u32; 4] = [1, 3, 12, 200];
const PASSES: u32 = 4;

/// Runs a schedule on the device and in the replay, on images with partial tiles and on a range.
fn check_schedule(gpu: &GpuContext, make: &dyn Fn() -> Schedule) -> Result<(), String> {
    let program = Program::builder("conformance").source("walk.wgsl", WALK).stage("wait").build().map_err(|error| error.to_string())?;
    let instruments = Instruments { steps: true, ..Instruments::default() };
    let mut patterns = BTreeSet::new();
    for pool in POOLS {
        compare(gpu, &program, ImageTiles { width: 40, height: 56 }, make().with_pool_blocks(pool), instruments, &mut patterns)?;
        compare(
            gpu,
            &program,
            ImageTiles { width: 130, height: 20 },
            make().with_pool_blocks(pool).with_bank_blocks(2),
            instruments,
            &mut patterns,
        )?;
        compare(gpu, &program, LinearRange { count: 2100 }, make().with_pool_blocks(pool), instruments, &mut patterns)?;
    }
    if patterns.len() < POOLS.len() {
        return Err("the pools hardly made a difference: this check proves nothing".into());
    }
    Ok(())
}

/// Lengths that are known, with keys of tiles that a run has kept.
struct Told<'a> {
    steps: &'a dyn WalkLengths,
    keys: Option<Lengths>,
}

impl WalkLengths for Told<'_> {
    fn of_tile(&self, pass_index: u32, tile: u32, lengths: &mut [u32; BLOCK as usize]) {
        self.steps.of_tile(pass_index, tile, lengths);
    }

    fn key_after(&self, passes: u32, tile: u32) -> u32 {
        self.keys.as_ref().map_or(0, |keys| keys.key_after(passes, tile))
    }
}

fn compare(
    gpu: &GpuContext,
    program: &Program,
    source: impl WorkSource + Copy + 'static,
    schedule: Schedule,
    instruments: Instruments,
    patterns: &mut BTreeSet<u64>,
) -> Result<(), String> {
    let name = format!("{schedule}, {:?} blocks, {source:?}", schedule.pool_blocks);
    let wrong = |what: String| format!("{name}: {what}");
    let run = |schedule: &Schedule, instruments: Instruments| {
        let builder = Scheduler::builder(program, source).schedule(schedule).instruments(instruments);
        let mut scheduler = builder.build_on(gpu).map_err(|error| wrong(error.to_string()))?;
        scheduler.run(PASSES).map_err(|error| wrong(error.to_string()))
    };
    let (film, report) = run(&schedule, instruments)?;
    let (plain, _) = run(&Schedule::never().with_roulette(schedule.roulette.clone()), instruments)?;
    if film.hash() != plain.hash() {
        return Err(wrong("the film is another one than under `never`".into()));
    }
    let steps = |pass_index: u32, tile: u32, lengths: &mut [u32; BLOCK as usize]| {
        for (index, length) in lengths.iter_mut().enumerate() {
            *length = source.pixel(tile, index as u32).map_or(0, |pixel| steps_of(pixel, pass_index));
        }
    };
    // What results say of tiles is asked of another schedule with the same order.
    let mut keys = None;
    if let OrderRule::Estimated(_) = schedule.order.rule() {
        let mut other = Schedule::never().with_roulette(schedule.roulette.clone()).with_pool_blocks(2);
        other.order = schedule.order.clone();
        keys = run(&other, Instruments { lengths: true, ..Instruments::default() })?.1.observed.lengths;
    }
    let lengths = Told { steps: &steps, keys };
    let blocks = [report.pool_blocks, report.pool_blocks.div_ceil(report.banks)];
    let expected = replay_in_banks(&schedule, &source, PASSES, blocks, report.ring, &lengths);
    let seen = report.observed.steps.as_ref().ok_or_else(|| wrong("the device wrote nothing down".into()))?;
    let live: Vec<u32> = seen.steps.iter().map(|step| step.live_blocks).collect();
    if let Some(step) = (0..live.len().max(expected.live_blocks.len())).find(|step| live.get(*step) != expected.live_blocks.get(*step)) {
        let (device, host) = (live.get(step), expected.live_blocks.get(step));
        return Err(wrong(format!("in step {} the device has {device:?} live blocks, the host {host:?}", step + 1)));
    }
    let lanes: Vec<u32> = seen.steps.iter().map(|step| step.live_lanes).collect();
    if let Some(step) = (0..lanes.len()).find(|step| lanes.get(*step) != expected.live_lanes.get(*step)) {
        let (device, host) = (lanes.get(step), expected.live_lanes.get(step));
        return Err(wrong(format!("in step {} the device has {device:?} live lanes, the host {host:?}", step + 1)));
    }
    let places = seen.assignments.iter().zip(&expected.assignments);
    if let Some((device, host)) = places.into_iter().find(|(device, host)| device != host) {
        return Err(wrong(format!("the device hands out {device:?}, the host {host:?}")));
    }
    if seen.assignments.len() != expected.assignments.len() {
        return Err(wrong(format!("{} tiles handed out, not {}", seen.assignments.len(), expected.assignments.len())));
    }
    patterns.insert(report.steps);
    Ok(())
}

/// Checks a tile order: every tile once per pass, both faces alike, the same film.
///
/// # Errors
/// What is wrong, in words.
pub fn check_order<O: TileOrder + 'static>(gpu: &GpuContext, make: impl Fn() -> O) -> Result<(), String> {
    let order = make();
    if let OrderRule::Formula(formula) = order.rule() {
        for (width, height) in [(16, 16), (40, 56), (130, 20), (500, 300), (16, 900)] {
            let grid = TileGrid::of(&ImageTiles { width, height });
            for pass_index in 0..3 {
                let tiles: BTreeSet<u32> = (0..grid.tiles()).map(|position| formula.tile_at(pass_index, position, grid)).collect();
                if tiles.len() != grid.tiles() as usize || tiles.last() >= Some(&grid.tiles()) {
                    let count = grid.tiles();
                    return Err(format!("order `{}`: pass {pass_index} of {count} tiles visits {} of them", order.name(), tiles.len()));
                }
            }
        }
    }
    check_schedule(gpu, &|| Schedule::block().with_order(make()))
}

/// Checks a regeneration: both faces decide alike, the same film.
///
/// # Errors
/// What is wrong, in words.
pub fn check_regeneration<R: Regeneration + 'static>(gpu: &GpuContext, make: impl Fn() -> R) -> Result<(), String> {
    check_schedule(gpu, &|| Schedule::block().with_regeneration(make()))
}

/// Checks that a roulette is unbiased: over uniform draws its answer has the mean 1 for every chance.
///
/// # Errors
/// What is wrong, in words.
pub fn check_roulette(roulette: &dyn Roulette) -> Result<(), String> {
    const DRAWS: u32 = 1 << 16;
    for chance in [1.0, 0.999, 0.75, 0.5, 0.1, 0.01] {
        let sum: f64 = (0..DRAWS).map(|draw| f64::from(roulette.inverse_survival(chance, draw << 16))).sum();
        let mean = sum / f64::from(DRAWS);
        // Evenly spaced draws leave an error of one draw's weight.
        if (mean - 1.0).abs() > 2.0 / f64::from(chance) / f64::from(DRAWS) {
            return Err(format!("roulette `{}`: the mean over all draws is {mean} at a chance of {chance}, not 1", roulette.name()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use wavepool::policy::{BlockInPlace, DepthMean, Hilbert, LaneInPlace, Morton, PerLane, StreamCompaction, TileError, TileFormula};

    use super::*;

    conformance!(order morton_is_sound: Morton);
    conformance!(order a_curve_without_jumps_is_sound: Hilbert);
    conformance!(order sorted_tiles_are_sound: DepthMean);
    conformance!(order tiles_by_error_are_sound: TileError);
    conformance!(regeneration the_paper_s_rule_is_sound: BlockInPlace::default());
    conformance!(regeneration lanes_in_place_are_sound: LaneInPlace::new(2));
    conformance!(regeneration packed_lanes_are_sound: StreamCompaction::default());
    conformance!(roulette a_lane_s_draw_is_sound: PerLane);

    /// An order that is right on the host, and another one on the device.
    #[derive(Clone, Copy, Debug)]
    struct TwoFaced;

    impl TileOrder for TwoFaced {
        fn name(&self) -> &str {
            "two-faced"
        }

        fn rule(&self) -> OrderRule<'_> {
            OrderRule::Formula(self)
        }
    }

    impl TileFormula for TwoFaced {
        fn wgsl(&self) -> String {
            "fn wf_tile_at(pass_index: u32, position: u32) -> u32 { return wf_control.tiles - 1u - position; }".into()
        }

        fn tile_at(&self, _pass_index: u32, position: u32, _grid: TileGrid) -> u32 {
            position
        }
    }

    #[derive(Debug)]
    struct Lenient;

    impl Regeneration for Lenient {
        fn name(&self) -> &str {
            "lenient"
        }

        fn wgsl(&self) -> String {
            "fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool { return true; }".into()
        }

        fn regenerate(&self, live: u32, dead: u32, _step: u32) -> bool {
            live == 0 || dead > 1
        }
    }

    #[derive(Debug)]
    struct Heavy;

    impl Roulette for Heavy {
        fn name(&self) -> &str {
            "heavy"
        }

        fn wgsl(&self) -> String {
            "fn wf_inverse_survival(p: f32, draw: u32) -> f32 { return 1.0; }".into()
        }

        fn inverse_survival(&self, p: f32, draw: u32) -> f32 {
            1.01 * PerLane.inverse_survival(p, draw)
        }
    }

    /// Kills: a check that passes whatever the policy does.
    #[test]
    fn faulty_policies_are_refused() {
        assert!(check_roulette(&Heavy).expect_err("biased").contains("not 1"));
        run(|gpu| {
            let words = check_order(gpu, || TwoFaced).expect_err("two faces");
            assert!(words.contains("the device hands out") || words.contains("live lanes"), "{words}");
            let words = check_regeneration(gpu, || Lenient).expect_err("two faces");
            assert!(words.contains("live blocks") || words.contains("hands out"), "{words}");
            Ok(())
        });
    }
}
