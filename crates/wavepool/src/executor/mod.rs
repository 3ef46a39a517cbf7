//! Turns a plan into wgpu commands: the only modules that see a device.
//!
//! Key decision: the device decides, the host records. Many steps go into one submission; launches past the end have no groups. The
//! host reads a small counter record two submissions behind and waits only as back-pressure.
//!
//! **Invariant:** every create call stands inside an error scope. **Invariant:** every wait has a time limit.

mod buffers;
mod kernels;
mod readback;
mod resources;
mod run;

use std::time::Duration;

pub use resources::{Resources, upload};

use crate::{
    Error, Film, Program, Result, Schedule,
    layout::Layout,
    plan::Plan,
    policy::{Execution, WorkSource},
    shader::{Linked, link},
};
use buffers::Buffers;
use kernels::Kernels;

/// A program, a work source and a schedule, made ready on a device.
#[derive(Debug)]
pub struct Scheduler {
    device: wgpu::Device,
    queue: wgpu::Queue,
    program: Program,
    source: Box<dyn WorkSource>,
    schedule: Schedule,
    layout: Layout,
    plan: Plan,
    kernels: Kernels,
    buffers: Option<Buffers>,
    wgsl: String,
    seed: u32,
}

/// How far a run is.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// Passes whose results are in the film.
    pub passes_done: u32,
    /// Passes asked for.
    pub passes: u32,
    /// Items begun so far.
    pub items_started: u64,
    /// Since the run began.
    pub elapsed: Duration,
}

/// What a run did, from the device's own counters.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// The schedule, printed.
    pub schedule: String,
    /// Steps in which a block was live.
    pub steps: u64,
    /// Dispatches with at least one group: stages, generate, ticks and resolves of those steps.
    pub launches: u64,
    /// Ticks that handed out tiles.
    pub regenerations: u32,
    /// Sum of live blocks over the steps; of the megakernel: tiles launched.
    pub block_steps: u64,
    /// Sum over the steps of lanes alive when the step began; zero for the megakernel, which does not count.
    pub lane_steps: u64,
    /// Items begun.
    pub items_started: u64,
    /// Items ended by roulette.
    pub items_killed: u64,
    /// Results that were NaN or infinite, counted with value zero.
    pub not_finite: u64,
    /// Passes in the film.
    pub passes: u32,
    /// Blocks of the pool.
    pub pool_blocks: u32,
    /// Passes whose results were kept at once.
    pub ring: u32,
    /// Bytes of lane state.
    pub state_bytes: u64,
    /// Submissions to the queue.
    pub submissions: u32,
    /// Wall-clock time from the first submission to the last counter.
    pub elapsed: Duration,
}

impl Scheduler {
    /// Generates and compiles the kernels for a program that needs no resources.
    ///
    /// # Errors
    /// [`Error::Gpu`] when the device refuses something, [`Error::Limit`] when a limit is too small.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        program: &Program,
        source: impl WorkSource + 'static,
        schedule: &Schedule,
    ) -> Result<Self> {
        Self::with_resources(device, queue, program, source, schedule, &Resources::new())
    }

    /// Generates and compiles the kernels; `resources` provides every binding the program uses, by name.
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`Error::Resource`].
    pub fn with_resources(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        program: &Program,
        source: impl WorkSource + 'static,
        schedule: &Schedule,
        resources: &Resources,
    ) -> Result<Self> {
        let source: Box<dyn WorkSource> = Box::new(source);
        // A program that does not say how likely a walk survives has no roulette, whatever the schedule offers.
        let mut schedule = schedule.clone();
        schedule.roulette = schedule.roulette.filter(|_| program.has_roulette());
        let Linked { stages, tick, resolve, layout } = link(program, source.as_ref(), &schedule)?;
        let plan = Plan::new(schedule.execution, program.stages());
        let kernels = Kernels::new(device, program, &plan, &stages.text, &tick, &resolve, resources)?;
        Ok(Scheduler {
            device: device.clone(),
            queue: queue.clone(),
            program: program.clone(),
            source,
            schedule,
            layout,
            plan,
            kernels,
            buffers: None,
            wgsl: stages.text,
            seed: 0,
        })
    }

    /// Keys the draws of roulette; another seed gives other, equally good draws.
    pub fn set_seed(&mut self, seed: u32) {
        self.seed = seed;
    }

    /// The launches of a step.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// What is kept where.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The composed WGSL of all stage kernels, for reading.
    pub fn wgsl(&self) -> &str {
        &self.wgsl
    }

    /// Walks every item of samples `0..passes` and returns the film.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Timeout`], [`Error::Limit`], [`Error::Conservation`].
    pub fn run(&mut self, passes: u32) -> Result<(Film, Report)> {
        self.run_with(0, passes, |_| std::ops::ControlFlow::Continue(()))
    }

    fn pool(&self, passes: u32) -> Result<(u32, u32)> {
        let limits = self.device.limits();
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let tiles = self.source.tiles();
        let useful = (u64::from(tiles) * u64::from(passes)).min(u64::from(u32::MAX)) as u32;
        let block_bytes = u64::from(self.layout.stride()) * 4;
        let state = |blocks: u32| if self.schedule.execution == Execution::Megakernel { 0 } else { u64::from(blocks) * block_bytes };
        let fitting = match self.schedule.execution {
            Execution::Megakernel => u32::MAX,
            Execution::Wavefront => (binding / block_bytes).min(u64::from(u32::MAX)) as u32,
        };
        let blocks = match self.schedule.pool_blocks {
            Some(blocks) => blocks.clamp(1, MAX_POOL_BLOCKS).min(useful),
            None => default_pool_blocks(&self.device).min(useful).min(fitting),
        };
        if state(blocks) > binding {
            return Err(Error::Limit {
                what: format!("the state of {blocks} blocks"),
                need: state(blocks),
                limit: binding,
                unit: "bytes",
                advice: format!("ask for at most {fitting} blocks"),
            });
        }
        let result_bytes = u64::from(tiles) * 1024 * (self.program.interface().result.len() as u64 + 1);
        let rings = (binding / result_bytes.max(1)).min(64) as u32;
        if rings == 0 {
            return Err(Error::Limit {
                what: format!("the results of one pass over {tiles} tiles"),
                need: result_bytes,
                limit: binding,
                unit: "bytes",
                advice: "render fewer pixels at a time".into(),
            });
        }
        let wanted = match self.schedule.execution {
            Execution::Wavefront => 2 + blocks.div_ceil(tiles.max(1)),
            Execution::Megakernel => 1,
        };
        Ok((blocks, wanted.min(passes).min(rings).max(1)))
    }
}

/// Blocks when the schedule does not say: a million lanes fill a large GPU; a software driver runs a few groups at a time and gains
/// from state that stays in its caches.
fn default_pool_blocks(device: &wgpu::Device) -> u32 {
    if device.adapter_info().device_type == wgpu::DeviceType::Cpu { 128 } else { 4096 }
}

/// The threshold arithmetic of the tick is exact up to here.
const MAX_POOL_BLOCKS: u32 = 1 << 19;
