//! What scheduling costs: the same launches once more, without anything that decides.
//!
//! Key decision: what every tick leaves behind is kept, step by step. A stripped run launches the stages over these tables directly, with
//! known numbers of groups: no tick, no indirect arguments, no counters to look at. It does the same work on the same lanes in the same
//! order, and its film shows that it did. The share of scheduling is 1 - T(stripped) / T(full). On a software driver, whose threads belong
//! to the process, its processor time says the same with less noise than the clock on the wall; who can tell it lends a clock for it.

use std::time::{Duration, Instant};

use super::{Film, Scheduler, buffers::Buffers, kernels::scoped, readback, run::Dispatch};
use crate::{
    Error, Result,
    control::{MAX_GROUPS, arguments},
    plan::{Kernel, Size},
};

/// Steps per submission, in both kinds of run.
const STEPS: usize = 64;

/// How long something took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Took {
    /// By the clock on the wall.
    pub wall: Duration,
    /// By the clock that was lent; the processor time of the process, say.
    pub processor: Option<Duration>,
}

/// Measures something.
fn time<T>(clock: Clock<'_>, run: impl FnOnce() -> Result<T>) -> Result<(Took, T)> {
    let (begun, before) = (Instant::now(), clock());
    let made = run()?;
    let wall = begun.elapsed();
    let processor = clock().zip(before).map(|(after, before)| after.saturating_sub(before));
    Ok((Took { wall, processor }, made))
}

type Clock<'a> = &'a dyn Fn() -> Option<Duration>;

/// Times of runs with and without scheduling, in turns.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SchedulingCost {
    /// Runs as usual.
    pub full: Vec<Took>,
    /// The same launches without bookkeeping.
    pub stripped: Vec<Took>,
    /// Steps of each.
    pub steps: u64,
    /// Blocks of the pool.
    pub pool_blocks: u32,
    /// Live blocks in the mean over the steps.
    pub mean_live_blocks: f64,
}

impl SchedulingCost {
    /// `1 - T(stripped) / T(full)`, by medians of the times on the wall.
    pub fn share(&self) -> f64 {
        1.0 - median(&self.stripped).as_secs_f64() / median(&self.full).as_secs_f64().max(1e-12)
    }
}

fn median(times: &[Took]) -> Duration {
    let mut times: Vec<Duration> = times.iter().map(|took| took.wall).collect();
    times.sort_unstable();
    times.get(times.len() / 2).copied().unwrap_or_default()
}

/// What the ticks of a run have left behind.
struct Recording {
    /// Control buffers, one behind the other.
    controls: wgpu::Buffer,
    stride: u64,
    /// Arguments after each tick; the first belong to the opening one.
    arguments: Vec<Vec<u32>>,
    film: Film,
    steps: u64,
    mean_live_blocks: f64,
}

impl Scheduler {
    /// Measures what scheduling costs on `passes` passes: `rounds` runs of each kind, in turns, after one of each to warm up. `processor` is
    /// read before and after each run.
    ///
    /// **Cost:** memory for the tables of every step.
    ///
    /// # Errors
    /// Those of a run, [`Error::Schedule`] for anything but a wavefront, [`Error::Conservation`] when the stripped run does other work.
    pub fn scheduling_cost(&mut self, passes: u32, rounds: usize, processor: &dyn Fn() -> Option<Duration>) -> Result<SchedulingCost> {
        if !self.schedule.execution.is_wavefront() {
            let name = self.schedule.execution.name();
            return Err(Error::Schedule(format!("`{name}` has no ticks between its steps that could be stripped")));
        }
        let steps = self.run(passes)?.1.steps;
        let recording = self.record(passes, steps)?;
        let mut cost = SchedulingCost {
            full: Vec::new(),
            stripped: Vec::new(),
            steps: recording.steps,
            pool_blocks: 0,
            mean_live_blocks: recording.mean_live_blocks,
        };
        for round in 0..=rounds {
            let is_stripped_first = round % 2 == 1;
            let early = if is_stripped_first { Some(self.time_stripped(passes, &recording, processor)?) } else { None };
            let (full, pool_blocks) = self.time_full(passes, recording.steps, processor)?;
            let stripped = early.map_or_else(|| self.time_stripped(passes, &recording, processor), Ok)?;
            cost.pool_blocks = pool_blocks;
            if round > 0 {
                cost.full.push(full);
                cost.stripped.push(stripped);
            }
        }
        Ok(cost)
    }

    /// Runs once and keeps the control buffer and the arguments of every step.
    fn record(&mut self, passes: u32, steps: u64) -> Result<Recording> {
        let mut run = self.begin(0, passes)?;
        let control_bytes = run.buffers.control.size();
        let stride = control_bytes.next_multiple_of(u64::from(run.scheduler.device.limits().min_storage_buffer_offset_alignment));
        let argument_bytes = run.buffers.arguments.size();
        let entries = steps + 1;
        let device = run.scheduler.device.clone();
        let limit = device.limits().max_buffer_size;
        if stride * entries > limit {
            let what = format!("the tables of {steps} steps");
            return Err(Error::Limit { what, need: stride * entries, limit, unit: "bytes", advice: "measure fewer passes".into() });
        }
        let buffer = |label: &str, size: u64| {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
            scoped(&device, &format!("allocating {size} bytes of {label}"), || {
                device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
            })
        };
        let (controls, arguments) =
            (buffer("tables of all steps", stride * entries)?, buffer("arguments of all steps", argument_bytes * entries)?);
        for step in 0..entries {
            if step == 0 {
                run.open()?;
            } else {
                run.step(1)?;
            }
            let queue = &run.scheduler.queue;
            scoped(&device, "keeping the tables of a step", || {
                let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("keep tables") });
                encoder.copy_buffer_to_buffer(&run.buffers.control, 0, &controls, step * stride, control_bytes);
                encoder.copy_buffer_to_buffer(&run.buffers.arguments, 0, &arguments, step * argument_bytes, argument_bytes);
                queue.submit([encoder.finish()]);
            })?;
        }
        let words = readback::read_words(&device, &run.scheduler.queue, &arguments, 0, arguments.size() / 4, "reading the arguments")?;
        let arguments = words.chunks(argument_bytes as usize / 4).map(<[u32]>::to_vec).collect();
        let (film, report) = run.finish()?;
        let mean_live_blocks = report.block_steps as f64 / report.steps.max(1) as f64;
        Ok(Recording { controls, stride, arguments, film, steps, mean_live_blocks })
    }

    /// A run as usual of exactly so many steps, looked at once at its end.
    fn time_full(&mut self, passes: u32, steps: u64, clock: Clock<'_>) -> Result<(Took, u32)> {
        let mut run = self.begin(0, passes)?;
        let (elapsed, ()) = time(clock, || run.step_blindly(steps, STEPS as u32))?;
        let (_, report) = run.finish()?;
        if report.passes != passes {
            return Err(Error::Conservation(format!("{steps} steps did {} of {passes} passes", report.passes)));
        }
        Ok((elapsed, report.pool_blocks))
    }

    /// The launches of a recording, nothing else.
    fn time_stripped(&mut self, passes: u32, recording: &Recording, clock: Clock<'_>) -> Result<Took> {
        let mut run = self.begin(0, passes)?;
        run.open()?;
        let steps = std::mem::take(&mut run.steps);
        let groups = stripped_groups(&run.scheduler.device, run.scheduler, &run.buffers, recording)?;
        let Scheduler { device, queue, kernels, .. } = &*run.scheduler;
        let (elapsed, _) = time(clock, || {
            for first in (0..recording.steps as usize).step_by(STEPS) {
                let last = (first + STEPS).min(recording.steps as usize);
                scoped(device, "recording steps", || {
                    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("stripped") });
                    {
                        let mut pass =
                            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("stripped"), timestamp_writes: None });
                        kernels.program_groups.iter().for_each(|(group, bind_group)| pass.set_bind_group(*group, bind_group, &[]));
                        for step in first..last {
                            for dispatch in &steps {
                                let Some((groups_x, after)) = stripped_size(dispatch, step, recording) else { continue };
                                let Some(kernel) = kernels.get(&dispatch.launch.kernel) else { continue };
                                pass.set_pipeline(&kernel.pipeline);
                                let tables = &groups[step + usize::from(after)];
                                pass.set_bind_group(0, if after { &tables.resolve } else { &tables.stages[dispatch.bank as usize] }, &[]);
                                pass.dispatch_workgroups(groups_x.min(MAX_GROUPS), groups_x.div_ceil(MAX_GROUPS), 1);
                            }
                        }
                    }
                    queue.submit([encoder.finish()]);
                })?;
            }
            readback::read_words(device, queue, &run.buffers.film, 0, 1, "waiting for stripped steps")
        })?;
        let film = run.gather_film(passes)?;
        if film.hash() != recording.film.hash() {
            return Err(Error::Conservation("the stripped run did other work than the recorded one".into()));
        }
        run.give_back();
        Ok(elapsed)
    }
}

/// Groups of a launch in a step, and whether it sees the tables after the step's tick; `None` for launches that are stripped or empty.
fn stripped_size(dispatch: &Dispatch, step: usize, recording: &Recording) -> Option<(u32, bool)> {
    let of_bank = |offset: u32| arguments::BANKS + arguments::PER_BANK * dispatch.bank + offset;
    let (after, place) = match (&dispatch.launch.kernel, dispatch.launch.size) {
        (Kernel::Tick, _) => return None,
        (_, Size::NewBlocks) => (false, of_bank(arguments::GENERATE)),
        (_, Size::LiveBlocks | Size::FilledBlocks | Size::PackedLanes) => (false, of_bank(arguments::STAGE)),
        (_, Size::Queues) => (false, of_bank(arguments::QUEUES)),
        (_, Size::FinishedTiles) => (true, arguments::RESOLVE),
        _ => return None,
    };
    let arguments = recording.arguments.get(step + usize::from(after))?;
    let [x, y] = [arguments[place as usize], arguments[place as usize + 1]];
    // Folded arguments round up; the kernels drop what is too much.
    Some((if y > 1 { MAX_GROUPS * y } else { x * y }, after)).filter(|(groups, _)| *groups > 0)
}

struct StepGroups {
    stages: Vec<wgpu::BindGroup>,
    resolve: wgpu::BindGroup,
}

/// Bind groups over the tables of every step.
fn stripped_groups(device: &wgpu::Device, scheduler: &Scheduler, buffers: &Buffers, recording: &Recording) -> Result<Vec<StepGroups>> {
    let size = std::num::NonZeroU64::new(buffers.control.size());
    let entries = recording.arguments.len() as u64;
    (0..entries)
        .map(|step| {
            let tables =
                wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: &recording.controls, offset: step * recording.stride, size });
            let stages = (0..buffers.sizes.banks).map(|bank| buffers.stage_group(device, &scheduler.kernels, tables.clone(), bank));
            Ok(StepGroups {
                stages: stages.collect::<Result<_>>()?,
                resolve: buffers.resolve_group(device, &scheduler.kernels, tables.clone())?,
            })
        })
        .collect()
}
