//! Figures about scheduling on this device, called by `cargo xtask bench`.
//!
//! `core` prints the tick over 4096 blocks, the share of scheduling, the cost of pins and of the wrappers; `share` the second of these alone;
//! `depth-sort` what sorted tiles save, measured and predicted; `schedules` all schedules on the built-in scenes, counted and timed in turns, with
//! files and charts where `--out` says; `auto` how well it chooses.
//! A number without its device is none, so the adapter and the commit come first.

#[path = "bench/schedules.rs"]
mod schedules;

use std::{ops::ControlFlow, path::PathBuf, time::Instant};

use path_tracer::{Renderer, Settings, scene};
use wavepool::{
    GpuContext, ImageTiles, Instruments, LinearRange, Program, Schedule, Scheduler, Took, layout::Layout, policy::WorkSource,
    profile::Event, replay::replay,
};
use wavepool_lab::{
    clock::process_time,
    interval::median,
    pairs::{Pair, compare, median_of_ratios, ratio},
};
use wavepool_tests::programs;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let is_quick = words.iter().any(|word| word == "--quick");
    let out = words.iter().position(|word| word == "--out").and_then(|place| words.get(place + 1)).map(PathBuf::from);
    let gpu = GpuContext::headless()?;
    println!("adapter: {}\ncommit:  {}\n", gpu.facts, commit());
    match words.first().map(String::as_str) {
        Some("core") => core(&gpu, is_quick),
        Some("share") => share(&gpu, is_quick),
        Some("depth-sort") => depth_sort(&gpu, is_quick),
        Some("schedules") => schedules::schedules(&gpu, is_quick, out),
        Some("auto") => schedules::choosing(&gpu, is_quick),
        _ => Err("usage: bench core|share|depth-sort|schedules|auto [--quick] [--out FOLDER]".into()),
    }
}

fn commit() -> String {
    let output = std::process::Command::new("git").args(["describe", "--always", "--dirty"]).output();
    output.ok().and_then(|output| String::from_utf8(output.stdout).ok()).map_or_else(|| "unknown".into(), |text| text.trim().to_owned())
}

fn core(gpu: &GpuContext, is_quick: bool) -> Result<(), Failure> {
    tick(gpu, is_quick)?;
    wrappers(gpu, is_quick)?;
    pins(gpu, is_quick)?;
    share(gpu, is_quick)
}

/// The tick alone, over a pool whose blocks all live at first. The cases take turns, and the fastest round counts beside the slowest: the
/// speed of a shared machine wanders by more than the cases differ.
fn tick(gpu: &GpuContext, is_quick: bool) -> Result<(), Failure> {
    let rounds = if is_quick { 2 } else { 7 };
    println!("tick (medians over the steps of a run, device timestamps; fastest, median and slowest of {rounds} rounds)");
    let cases = [(128, "scanline"), (1024, "scanline"), (4096, "scanline"), (4096, "depth-max")];
    let mut medians = vec![Vec::new(); cases.len()];
    let mut launch = Vec::new();
    for _ in 0..rounds {
        for ((blocks, order), medians) in cases.into_iter().zip(&mut medians) {
            let schedule: Schedule = format!("block,order={order}").parse()?;
            let schedule = schedule.with_pool_blocks(blocks);
            let instruments = Instruments { times: true, ..Instruments::default() };
            let source = LinearRange { count: blocks * 256 * 2 };
            let program = programs::collatz();
            let builder = Scheduler::builder(&program, source).schedule(&schedule).instruments(instruments);
            let mut scheduler = builder.build_on(gpu)?;
            scheduler.run(1)?;
            let (_, report) = scheduler.run(2)?;
            let Some(times) = &report.observed.times else {
                println!("  this device has no timestamps");
                return Ok(());
            };
            let is_tick = |event: &&Event| event.kernel == "tick" && (1..report.steps).contains(&event.step);
            let ticks: Vec<f64> = times.events.iter().filter(is_tick).map(|event| event.duration_ns as f64 / 1e3).collect();
            medians.push(median(&ticks));
            launch.extend(scheduler.statistics(&report)?.launch_ns.map(|[_, direct]| direct as f64 / 1e3));
        }
    }
    let spread = |values: &[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        format!("{low:6.1}, {:6.1}, {:6.1} us", median(values), values.iter().copied().fold(0.0, f64::max))
    };
    println!("  a launch of one work-group that does nothing: {}", spread(&launch));
    for ((blocks, order), medians) in cases.iter().zip(&medians) {
        println!("  {blocks:5} blocks, {order:10} {}", spread(medians));
    }
    Ok(())
}

/// A stage that does next to nothing, with more and more state to move.
fn mover(leaves: u32) -> Result<Program, wavepool::Error> {
    let members: String = (0..leaves).map(|leaf| format!("v{leaf}: u32, ")).collect();
    let moves: String = (0..leaves).map(|leaf| format!("    (*w).v{leaf} += 1u;\n")).collect();
    let sum: String = (0..leaves).map(|leaf| format!(" + (*w).v{leaf}")).collect();
    let wgsl = format!(
        "struct Walk {{ left: u32, {members} }}
        fn generate(w: ptr<function, Walk>, item: Item) {{ (*w).left = 50u; }}
        fn hop(w: ptr<function, Walk>) -> u32 {{
            {moves}    (*w).left -= 1u;
            if ((*w).left == 0u) {{ return FINISH; }}
            return CONTINUE;
        }}
        fn finish(w: ptr<function, Walk>) -> u32 {{ return (*w).left{sum}; }}"
    );
    Program::builder("mover").source("mover.wgsl", wgsl).stage("hop").build()
}

/// What a wrapper costs by itself: nanoseconds per lane and step against the bytes it moves.
fn wrappers(gpu: &GpuContext, is_quick: bool) -> Result<(), Failure> {
    println!("\nwrappers (all lanes live, device timestamps; the stage adds 1 to every leaf)");
    let blocks = if is_quick { 128 } else { 1024 };
    for leaves in [0, 4, 16, 32] {
        let program = mover(leaves)?;
        let source = LinearRange { count: blocks * 256 };
        let instruments = Instruments { times: true, ..Instruments::default() };
        let schedule = Schedule::block().with_pool_blocks(blocks);
        let builder = Scheduler::builder(&program, source).schedule(&schedule).instruments(instruments);
        let mut scheduler = builder.build_on(gpu)?;
        let layout: Layout = scheduler.layout().clone();
        scheduler.run(1)?;
        let (_, report) = scheduler.run(2)?;
        let Some(times) = &report.observed.times else { return Ok(()) };
        let each = |kernel: &str, lanes: u64| {
            let sum: u64 = times.kernels.iter().filter(|entry| entry.kernel == kernel).map(|entry| entry.nanoseconds).sum();
            sum as f64 / lanes.max(1) as f64
        };
        let (read, written) = layout.kernels[0].bytes();
        let results = u64::from(report.passes) * u64::from(source.count);
        println!(
            "  {:3} bytes read, {:3} written: stage {:6.2} ns per lane-step; generate {:6.2}, resolve {:6.2} ns per item",
            read,
            written,
            each("hop", report.lane_steps),
            each("generate", results),
            each("resolve", results)
        );
    }
    Ok(())
}

/// Pins on against pins off, under wavefront and megakernel.
fn pins(gpu: &GpuContext, is_quick: bool) -> Result<(), Failure> {
    println!("\npins (time with over time without, ratio of medians, 95 % interval over ABBA pairs)");
    let rounds = if is_quick { 5 } else { 15 };
    let scene = scene::builtin("cornell-box").ok_or("the scene is built in")?;
    for schedule in ["block", "megakernel"] {
        let renderer = |pins: bool| -> Result<Renderer, Failure> {
            let mut settings = Settings::new(128, 128, if is_quick { 2 } else { 4 });
            settings.schedule = schedule.parse::<Schedule>()?.with_pins(pins);
            Ok(Renderer::new(gpu, &scene, &settings)?)
        };
        let (mut with, mut without) = (renderer(true)?, renderer(false)?);
        let timed = |renderer: &mut Renderer| -> Result<f64, Failure> {
            let begun = Instant::now();
            renderer.render(|_| ControlFlow::Continue(()))?;
            Ok(begun.elapsed().as_secs_f64())
        };
        let spread = ratio(&compare(rounds, || timed(&mut with), || timed(&mut without))?);
        println!("  cornell-box, {schedule:10} {:.3} [{:.3}, {:.3}], {rounds} pairs", spread.value, spread.low, spread.high);
    }
    Ok(())
}

/// 1 - T(same launches recorded, bookkeeping stripped) / T.
fn share(gpu: &GpuContext, is_quick: bool) -> Result<(), Failure> {
    println!("\nscheduling share (1 - stripped / full, ratio of medians, 95 % interval over pairs)");
    let scene = scene::builtin("cornell-box").ok_or("the scene is built in")?;
    for (schedule, rounds) in [("block", 31), ("block,order=depth-max", 31)] {
        let (side, blocks, rounds) = if is_quick { (512, 256, 3) } else { (1024, 1024, rounds) };
        let mut settings = Settings::new(side, side, 1);
        settings.schedule = schedule.parse::<Schedule>()?.with_pool_blocks(blocks);
        let mut renderer = Renderer::new(gpu, &scene, &settings)?;
        let cost = renderer.scheduler_mut().scheduling_cost(1, rounds, &process_time)?;
        println!(
            "  cornell-box {side}x{side}, 1 sample, {blocks} blocks, {schedule}: {} steps, {:.0} live blocks in the mean, {rounds} pairs",
            cost.steps, cost.mean_live_blocks
        );
        type Side = fn(&Took) -> Option<f64>;
        let clocks: [(&str, Side); 2] =
            [("wall", |took| Some(took.wall.as_secs_f64())), ("processor", |took| took.processor.map(|time| time.as_secs_f64()))];
        for (clock, seconds) in clocks {
            let pairs: Option<Vec<Pair>> = cost
                .full
                .iter()
                .zip(&cost.stripped)
                .map(|(full, stripped)| Some(Pair { first: seconds(stripped)?, second: seconds(full)? }))
                .collect();
            let Some(pairs) = pairs else { continue };
            let [spread, paired] = [ratio(&pairs), median_of_ratios(&pairs)]
                .map(|spread| [spread.value, spread.high, spread.low].map(|at| (1.0 - at) * 100.0));
            println!(
                "    {clock:9} {:5.2} % [{:.2}, {:.2}] by medians, {:5.2} % [{:.2}, {:.2}] by pairs",
                spread[0], spread[1], spread[2], paired[0], paired[1], paired[2]
            );
        }
    }
    Ok(())
}

/// Launches of passes 2 to 8 of 8 passes of one sample, sorted against scanline: as the device counts them, and as replay predicts them
/// from the lengths that a megakernel has seen.
fn depth_sort(gpu: &GpuContext, is_quick: bool) -> Result<(), Failure> {
    let (side, passes) = (if is_quick { 128 } else { 256 }, 8);
    println!(
        "launches of passes 2 to {passes}, {side}x{side}, depth 64, a pool of a quarter of the tiles (predicted = measured unless shown)"
    );
    println!("| scene | passes | T, C | roulette | scanline | depth-max | depth-mean | depth-decayed | best |");
    println!("| --- | --- | --- | --- | ---: | ---: | ---: | ---: | ---: |");
    for name in ["cornell-box", "mirror-corridor", "corridor"] {
        let scene = scene::builtin(name).ok_or("the scene is built in")?;
        // Without roulette every walk in the corridor is as long as it may be.
        let roulettes: &[&str] = if name == "cornell-box" { &["lane", "none"] } else { &["lane"] };
        for roulette in roulettes {
            let source = ImageTiles { width: side, height: side };
            let pool = source.tiles() / 4;
            let run = |schedule: &Schedule, samples: u32, lengths: bool| -> Result<wavepool::Report, Failure> {
                let mut settings = Settings::new(side, side, samples);
                settings.depth = 64;
                settings.schedule = schedule.clone();
                settings.instruments.lengths = lengths;
                let mut renderer = Renderer::new(gpu, &scene, &settings)?;
                Ok(renderer.render(|_| ControlFlow::Continue(()))?.report)
            };
            let megakernel: Schedule = format!("megakernel,roulette={roulette}").parse()?;
            let lengths = run(&megakernel, passes, true)?.observed.lengths.ok_or("the lengths were asked for")?;
            for (ring, overlap) in [("", "overlap"), (",ring=1", "apart")] {
                for policy in ["threshold=0.5,check_every=2", "threshold=0,check_every=1"] {
                    let mut row = Vec::new();
                    for order in ["scanline", "depth-max", "depth-mean", "depth-decayed"] {
                        let schedule: Schedule = format!("block,{policy},order={order},roulette={roulette}{ring}").parse()?;
                        let schedule = schedule.with_pool_blocks(pool);
                        let (all, first) = (run(&schedule, passes, false)?, run(&schedule, 1, false)?);
                        let predicted = |passes: u32, report: &wavepool::Report| {
                            let seen = replay(&schedule, &source, passes, report.pool_blocks, report.ring, &lengths);
                            let stages = Renderer::program(&scene).map_or(0, |program| program.stages().count() as u64);
                            1 + seen.steps() * (1 + stages) + seen.regenerations.len() as u64 + u64::from(passes)
                        };
                        row.push((all.launches - first.launches, predicted(passes, &all) - predicted(1, &first)));
                    }
                    let best = row[1..].iter().map(|(measured, _)| *measured).min().unwrap_or(0) as f64;
                    let cells: Vec<String> = row
                        .iter()
                        .map(|(measured, predicted)| match measured == predicted {
                            true => measured.to_string(),
                            false => format!("{measured} (predicted {predicted})"),
                        })
                        .collect();
                    let change = (best / row[0].0 as f64 - 1.0) * 100.0;
                    let policy = policy.replace("threshold=", "").replace("check_every=", " ");
                    println!("| `{name}` | {overlap} | {policy} | {roulette} | {} | {change:+.1} % |", cells.join(" | "));
                }
            }
        }
    }
    Ok(())
}
