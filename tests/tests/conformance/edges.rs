//! The edges of what can be asked: memory that is not there, numbers that run out, kernels that are refused on the way, devices of others;
//! and what can be seen of a run in between.

use std::ops::ControlFlow;

use path_tracer::{Renderer, Settings};
use wavepool::{
    Error, GpuContext, ImageTiles, Instruments, LinearRange, Program, Report, Schedule, Scheduler, Value, layout::Scalar, wgpu,
};
use wavepool_tests::{
    device::{gpu, level, patient, run, scheduler, skip},
    programs::{collatz, collatz_steps, heavy, hops, identity_sum, watched, weightless},
};

use crate::subjects::{Subject, built_in};

/// Kills: a wait without end, a panic, or a film made of what was lost, when the device goes in the middle of a run.
#[test]
fn a_device_lost_in_the_middle_is_an_error() {
    if gpu().is_none() {
        return;
    }
    let doomed = GpuContext::headless().expect("there is an adapter");
    let mut scheduler = scheduler(&doomed, &collatz(), LinearRange { count: 5000 }, &Schedule::block().with_pool_blocks(3));
    let mut run = scheduler.begin(0, 3).expect("a run");
    run.step(20).expect("it works while the device is there");
    doomed.device.destroy();
    let is_typed = |error: &Error| matches!(error, Error::DeviceLost(_) | Error::Gpu { .. });
    let error = run.step(20).expect_err("the device is gone");
    assert!(is_typed(&error), "{error}");
    let error = run.finish().expect_err("the device is gone");
    assert!(is_typed(&error), "{error}");
    // An observer takes it away between two submissions.
    let doomed = GpuContext::headless().expect("there is an adapter");
    let mut scheduler =
        wavepool_tests::device::scheduler(&doomed, &collatz(), LinearRange { count: 5000 }, &Schedule::block().with_pool_blocks(3));
    let outcome = scheduler.run_with(0, 50, |_| {
        doomed.device.destroy();
        ControlFlow::Continue(())
    });
    let error = outcome.expect_err("the device is gone");
    assert!(is_typed(&error), "{error}");
}

/// A device on the adapter of these tests, with the limits that WebGPU guarantees and nothing switched off.
fn borrowed(budget: Option<u8>) -> Option<(wgpu::Device, wgpu::Queue)> {
    let wanted = &gpu()?.facts.name;
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.flags = wgpu::InstanceFlags::default();
    descriptor.memory_budget_thresholds.for_resource_creation = budget;
    let adapters = pollster::block_on(wgpu::Instance::new(descriptor).enumerate_adapters(wgpu::Backends::PRIMARY));
    let adapter = adapters.into_iter().find(|adapter| adapter.get_info().name == *wanted)?;
    let limits = wgpu::Limits::default();
    assert_eq!(limits.max_storage_buffers_per_shader_stage, 8);
    let descriptor = wgpu::DeviceDescriptor { label: Some("borrowed"), required_limits: limits, ..Default::default() };
    pollster::block_on(adapter.request_device(&descriptor)).ok()
}

/// How a run ends on a device that may take so many percent of what memory there is.
enum Ending {
    /// Not even the smallest run fits.
    Refused,
    /// Nothing was refused.
    Whole,
    /// With a smaller pool.
    Shrunk(Box<Report>),
}

const ASKED: u32 = 6000;

fn run_within(percent: u8, program: &Program) -> Result<Ending, Error> {
    let Some((device, queue)) = borrowed(Some(percent)) else { return Ok(Ending::Refused) };
    wavepool::upload(&device, "probe", &[0; 1 << 16], wgpu::BufferUsages::STORAGE)?;
    let schedule = Schedule::block().with_pool_blocks(ASKED);
    let builder = Scheduler::builder(program, LinearRange { count: 1500 * 256 }).schedule(&schedule);
    let mut scheduler = builder.build(&device, &queue)?;
    let mut run = scheduler.begin(0, 4)?;
    run.step(1)?;
    let (_, report) = run.finish()?;
    Ok(if report.pool_blocks == ASKED { Ending::Whole } else { Ending::Shrunk(Box::new(report)) })
}

/// The driver is told to refuse memory beyond some percent of what there is; the percentage is raised until the smallest run fits. What
/// others take and give back meanwhile can spoil a round, so there are several.
/// Kills: a pool that does not fit and ends the run; a smaller pool that nobody is told of.
#[test]
fn a_device_without_memory_gets_a_smaller_pool() {
    let wgsl = "struct Walk { rows: array<vec4f, 64> }
        fn generate(w: ptr<function, Walk>, item: Item) { (*w).rows[item.pixel % 64u] = vec4f(1.0); }
        fn stop(w: ptr<function, Walk>) -> u32 { return FINISH; }
        fn finish(w: ptr<function, Walk>) -> f32 {
            var sum = 0.0;
            for (var row = 0u; row < 64u; row++) { sum += (*w).rows[row].x; }
            return sum;
        }";
    let program = Program::builder("large").source("large.wgsl", wgsl).stage("stop").build().expect("valid");
    if gpu().is_none() {
        return;
    }
    for round in 0..8 {
        for percent in 1..98 {
            match run_within(percent, &program) {
                // There was no memory for what the smallest run needs, and the error says so.
                Err(error) if error.is_out_of_memory() => {}
                Err(error) => panic!("{percent} %: {error}"),
                Ok(Ending::Refused) => {}
                // SwiftShader does not count its memory, and is the second driver wherever skips are forbidden.
                Ok(Ending::Whole) if level().is_some() => return eprintln!("this driver does not count its memory"),
                Ok(Ending::Whole) => break,
                Ok(Ending::Shrunk(report)) => {
                    eprintln!("round {round}, {percent} %: {} blocks; {:?}", report.pool_blocks, report.notes);
                    assert!(report.notes.iter().any(|note| note.contains("6000 blocks")), "{:?}", report.notes);
                    return;
                }
            }
        }
    }
    skip("the driver does not count its memory");
}

/// Kills: kernels or a layout half replaced when a reload fails; a reload that changes nothing.
#[test]
fn a_failed_reload_keeps_the_old_kernels() {
    let Some(gpu) = gpu() else { return };
    let text = include_str!("../../../examples/collatz/src/collatz.wgsl");
    let variant = |find: &str, replace: &str| {
        assert!(text.contains(find), "{find}");
        Program::builder("collatz").source("collatz.wgsl", text.replace(find, replace)).stage("step").build()
    };
    for schedule in [Schedule::block().with_pool_blocks(3), Schedule::megakernel()] {
        let mut scheduler = scheduler(gpu, &collatz(), LinearRange { count: 1000 }, &schedule);
        let before = scheduler.run(2).expect("runs").0.hash();
        // What is wrong in itself never becomes a program; the message has a place.
        let message = variant("n / 2u", "n / 2.5").expect_err("refused").to_string();
        assert!(message.contains("collatz.wgsl:") && message.contains('^'), "{message}");
        // What is wrong on this scheduler is refused by it.
        let needs_more = variant("struct Walk", "@group(1) @binding(0) var<storage, read> table: array<u32>;\nstruct Walk")
            .and_then(|_| variant("n / 2u, ", "n / table[0], "));
        let needs_more = match needs_more {
            Ok(program) => program,
            Err(_) => Program::builder("collatz")
                .source(
                    "collatz.wgsl",
                    text.replace("n / 2u", "n / table[0]")
                        .replace("struct Walk", "@group(1) @binding(0) var<storage, read> table: array<u32>;\nstruct Walk"),
                )
                .stage("step")
                .build()
                .expect("valid in itself"),
        };
        let error = scheduler.reload(&needs_more).expect_err("no table was given");
        assert!(matches!(&error, Error::Resource { name, .. } if name == "table"), "{error}");
        assert_eq!(scheduler.run(2).expect("runs on").0.hash(), before, "{schedule}");
        scheduler.reload(&variant("+= 1u", "+= 2u").expect("valid")).expect("a sound program");
        let doubled = scheduler.run(2).expect("runs").0;
        assert!((0..1000).all(|pixel| doubled.sum(pixel, 0) as u64 == 4 * collatz_steps(pixel as u64 + 1)), "{schedule}");
        scheduler.reload(&collatz()).expect("the first one again");
        assert_eq!(scheduler.run(2).expect("runs").0.hash(), before, "{schedule}");
    }
}

/// Kills: a bank of no bytes, an offset that outgrows its plane, the last row of an array that is left out of the layout.
#[test]
fn states_of_nothing_and_of_a_kilobyte() {
    let Some(gpu) = gpu() else { return };
    assert_eq!(heavy().layout(None).leaves.len(), 257);
    for (program, expected) in [(weightless as fn() -> Program, 7.0 * 2.0), (heavy, 2.0 * 8.0)] {
        let program = program();
        let source = LinearRange { count: 1500 };
        let mut hashes = Vec::new();
        for bank in [1, 2, 3, 100] {
            let (film, report) = run(gpu, &program, source, 2, &Schedule::block().with_pool_blocks(5).with_bank_blocks(bank));
            assert_eq!(report.banks, 5_u32.div_ceil(bank));
            hashes.push(film.hash());
            assert!((0..1500).all(|pixel| film.sum(pixel, film.leaves().len().min(2) - 1) == expected), "{}", program.name());
        }
        hashes.push(run(gpu, &program, source, 2, &Schedule::megakernel()).0.hash());
        assert!(hashes.windows(2).all(|pair| pair[0] == pair[1]), "{}: {hashes:?}", program.name());
    }
}

/// Kills: sample numbers that wrap around in silence; a last sample that is left out for fear of it.
#[test]
fn sample_numbers_end_where_32_bits_end() {
    let Some(gpu) = gpu() else { return };
    for schedule in [Schedule::block().with_pool_blocks(2), Schedule::megakernel()] {
        let mut scheduler = scheduler(gpu, &identity_sum(), LinearRange { count: 300 }, &schedule);
        let (film, _) = scheduler.run_with(u32::MAX - 4, 4, patient()).expect("the last samples");
        let last = (u32::MAX - 4..u32::MAX).map(f64::from).sum::<f64>();
        assert!((0..300).all(|pixel| film.sum(pixel, 3) == last), "{schedule}");
        let error = scheduler.run_with(u32::MAX - 3, 4, patient()).expect_err("one too many");
        assert!(matches!(error, Error::Limit { .. }), "{error}");
    }
}

/// Kills: a buffer more than WebGPU guarantees; arguments of an indirect launch that its validation refuses or clears.
#[test]
fn a_device_with_default_limits_and_checks_gives_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let Some((device, queue)) = borrowed(None) else { return skip("the adapter gives no second device") };
    let lent = GpuContext::borrow(&device, &queue);
    let image = ImageTiles { width: 40, height: 56 };
    let program = hops();
    let expected = run(gpu, &program, image, 3, &Schedule::never()).0.hash();
    for schedule in [
        "never",
        "block,threshold=0,check_every=1",
        "block,order=depth-max",
        "block,local=all",
        "per-lane",
        "compaction",
        "keyed",
        "megakernel",
        "megakernel-regen",
        "persistent",
    ] {
        let schedule = schedule.parse::<Schedule>().expect("a schedule").with_pool_blocks(5).with_bank_blocks(2);
        let builder = Scheduler::builder(&program, image).schedule(&schedule);
        let outcome = builder.build_on(&lent).and_then(|mut scheduler| scheduler.run_with(0, 3, patient()));
        let (film, _) = outcome.unwrap_or_else(|error| panic!("{schedule}: {error}"));
        assert_eq!(film.hash(), expected, "{schedule}");
    }
    let Subject::Scene(scene) = built_in("mirror-corridor") else { panic!("a scene") };
    let settings = Settings::new(24, 20, 2);
    let ours = Renderer::new(gpu, &scene, &settings).and_then(|mut renderer| renderer.render(patient())).expect("renders");
    let theirs = Renderer::new(&lent, &scene, &settings).and_then(|mut renderer| renderer.render(patient()));
    assert_eq!(theirs.expect("renders").film.hash(), ours.film.hash());
}

/// Kills: a count that depends on the execution, a count of finished lanes that run on, an assertion evaluated for one lane of a block;
/// an uncalled gauge that is reported.
#[test]
fn counters_and_assertions_are_exact() {
    let Some(gpu) = gpu() else { return };
    let program = watched();
    let (count, passes) = (2900_u64, 3);
    let mut steps = 0;
    let mut odd = 0;
    for pixel in 0..count {
        steps += collatz_steps(pixel + 1) + 1;
        let mut n = pixel + 1;
        while n != 1 {
            odd += 2 * (n % 2);
            n = if n % 2 == 1 { 3 * n + 1 } else { n / 2 };
        }
    }
    let times = |value: u64| value * passes;
    let apart = (1..=count).filter(|number| number % 3 == 0).count() as u64;
    for text in
        ["never", "block", "block,threshold=0,check_every=1,order=depth-mean", "per-lane", "compaction", "megakernel", "megakernel-regen"]
    {
        let schedule = text.parse::<Schedule>().expect("a schedule").with_pool_blocks(5).with_bank_blocks(2);
        for assertions in [false, true] {
            let instruments = Instruments { assertions, ..Instruments::default() };
            let builder = Scheduler::builder(&program, LinearRange { count: count as u32 }).schedule(&schedule).instruments(instruments);
            let mut scheduler = builder.build_on(gpu).expect("builds");
            let (_, report) = scheduler.run_with(0, passes as u32, patient()).expect("runs");
            assert_eq!(report.counters, [("steps".to_owned(), times(steps)), ("odd".to_owned(), times(odd))], "{schedule}");
            let expected = [("begins_apart".to_owned(), times(apart)), ("positive".to_owned(), 0)];
            assert_eq!(report.assertions, if assertions { &expected[..] } else { &[] }, "{schedule}");
        }
    }
}

/// Kills: a snapshot of the wrong lane or bank, of a step before or after, of what a dead lane has left; a type that is lost.
#[test]
fn snapshots_show_what_the_next_step_will_find() {
    let Some(gpu) = gpu() else { return };
    let schedule = Schedule::never().with_pool_blocks(4).with_bank_blocks(3);
    for instruments in [Instruments::default(), Instruments::checked()] {
        let builder =
            Scheduler::builder(&collatz(), LinearRange { count: 1000 }).schedule(&schedule).instruments(instruments).build_on(gpu);
        let mut scheduler = builder.expect("builds");
        let mut run = scheduler.begin(5, 1).expect("a run");
        let mut done = 0;
        for steps in [1, 2, 4, 10] {
            run.step(steps).expect("steps");
            done += steps;
            let shot = run.snapshot(0..1025).expect("a snapshot");
            let fields: Vec<_> = shot.fields.iter().map(|field| (field.path.as_str(), field.scalar)).collect();
            assert_eq!(fields, [(".number", Scalar::U32), (".steps", Scalar::U32)]);
            assert_eq!(shot.lanes.len(), 1024, "lanes beyond the pool are left out");
            for lane in &shot.lanes {
                let mut number = u64::from(lane.lane) + 1;
                let length = collatz_steps(number);
                let lives = lane.lane < 1000 && length + 1 > u64::from(done);
                assert_eq!(lane.is_alive, lives, "after {done} steps: {lane:?}");
                (0..done.min(length as u32)).for_each(|_| number = if number % 2 == 1 { 3 * number + 1 } else { number / 2 });
                let expected = lives.then_some([Value::U32(number as u32), Value::U32(done)]);
                assert_eq!(lane.values, expected.map_or([None, None], |values| values.map(Some)), "after {done} steps: {lane:?}");
                assert!(!lives || (lane.steps == done && lane.pixel == Some(lane.lane) && lane.sample == 5), "{lane:?}");
            }
            let text = shot.to_string();
            assert!(text.contains("number: u32") && text.lines().count() == 2 + 1024, "{}", &text[..200]);
        }
    }
}

/// Where lanes receive items, a lane shows the item that it walks, whichever that is: the program keeps who it is in its state.
/// Kills: a lane taken for a place of its block's tile, or of the list; the birth of the block in place of that of the lane.
#[test]
fn snapshots_show_the_items_of_lanes() {
    let Some(gpu) = gpu() else { return };
    let image = ImageTiles { width: 40, height: 56 };
    for schedule in [Schedule::per_lane(), Schedule::compaction().with_bank_blocks(2)] {
        let schedule = schedule.with_pool_blocks(3);
        let mut scheduler = scheduler(gpu, &hops(), image, &schedule);
        let mut run = scheduler.begin(5, 3).expect("a run");
        run.step(11).expect("steps");
        let shot = run.snapshot(0..3 * 256).expect("a snapshot");
        let key = shot.fields.iter().position(|field| field.path == ".key.x").expect("a field");
        let alive: Vec<_> = shot.lanes.iter().filter(|lane| lane.is_alive).collect();
        for lane in &alive {
            let expected = lane.pixel.map(Value::U32);
            assert!(lane.values[key] == expected && lane.values[key + 1] == Some(Value::U32(lane.sample)), "{schedule}: {lane:?}");
            assert!(lane.steps >= 1 && lane.steps <= shot.step, "{schedule}: {lane:?}");
        }
        let tiles: std::collections::BTreeSet<_> = alive.iter().filter(|lane| lane.block == 1).map(|lane| lane.tile).collect();
        let ages: std::collections::BTreeSet<_> = alive.iter().map(|lane| lane.steps).collect();
        assert!(alive.len() > 100 && tiles.len() > 1 && ages.len() > 2, "{schedule}: {tiles:?}, {ages:?}: this shows nothing");
    }
}

/// Kills: launches of lists or queues that a stripped run leaves out, or counts by the arguments of another step.
#[test]
fn stripped_runs_do_the_same_work() {
    let Some(gpu) = gpu() else { return };
    for text in ["block", "never-full", "per-lane", "compaction", "keyed", "block,order=depth-max,local=all"] {
        let schedule = text.parse::<Schedule>().expect("a schedule").with_pool_blocks(5).with_bank_blocks(2);
        let mut scheduler = scheduler(gpu, &hops(), ImageTiles { width: 40, height: 56 }, &schedule);
        let cost = scheduler.scheduling_cost(3, 1, &|| None).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert!(cost.full.len() == 1 && cost.stripped.len() == 1 && cost.steps > 3, "{text}: {cost:?}");
    }
}
