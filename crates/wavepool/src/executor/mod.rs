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
mod sizes;

use std::time::Duration;

pub use resources::{Resources, upload};

#[cfg(doc)]
use crate::Error;
use crate::{
    Film, Program, Result, Schedule,
    layout::Layout,
    plan::Plan,
    policy::{Execution, OrderRule, WorkSource},
    shader::{Linked, link},
};
use buffers::Buffers;
use kernels::Kernels;
use sizes::{Demand, Sizes};

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
    /// Values that a storage format changed by more than rounding.
    pub storage_clamped: u64,
    /// Accesses to arrays of the state beyond their end.
    pub out_of_range: u64,
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

    fn sizes(&self, passes: u32) -> Result<Sizes> {
        let limits = self.device.limits();
        Sizes::choose(&Demand {
            execution: self.schedule.execution,
            pool_blocks: self.schedule.pool_blocks,
            default_blocks: default_pool_blocks(&self.device),
            tiles: self.source.tiles(),
            passes,
            stride: self.layout.stride(),
            result: &self.program.interface().result,
            is_order_measured: matches!(self.schedule.order.rule(), OrderRule::Measured(_)),
            binding: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        })
    }
}

/// Blocks when the schedule does not say: a million lanes fill a large GPU; a software driver runs a few groups at a time and gains
/// from state that stays in its caches.
fn default_pool_blocks(device: &wgpu::Device) -> u32 {
    if device.adapter_info().device_type == wgpu::DeviceType::Cpu { 128 } else { 4096 }
}
