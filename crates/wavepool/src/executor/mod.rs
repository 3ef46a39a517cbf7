//! Turns a plan into wgpu commands: the only modules that see a device.
//!
//! Key decision: the device decides, the host records. Many steps go into one submission; launches past the end have no groups. The
//! host reads a small counter record two submissions behind and waits only as back-pressure.
//!
//! **Invariant:** every create call stands inside an error scope. **Invariant:** every wait has a time limit.

mod auto;
mod buffers;
mod cache;
mod collect;
mod kernels;
mod launch_cost;
mod readback;
mod resources;
mod run;
mod sizes;
mod snapshot;
mod stripped;
mod times;

use std::{sync::Arc, time::Duration};

pub use auto::Decision;
pub(crate) use cache::KernelCache;
pub use resources::{Resources, upload};
pub use run::Run;
pub use snapshot::{LaneState, PoolSnapshot, Value};
pub use stripped::{SchedulingCost, Took};

#[cfg(doc)]
use crate::Error;
use crate::{
    Film, GpuContext, Instruments, Program, Result, Schedule,
    control::TICK_LANES,
    layout::Layout,
    plan::Plan,
    policy::{OrderRule, WorkSource},
    profile::{Observed, Statistics},
    shader::{Fault, link},
};
use auto::Auto;
use buffers::Buffers;
use kernels::Kernels;
use sizes::{Demand, Sizes};

/// A program, a work source and a schedule, made ready on a device.
#[derive(Debug)]
pub struct Scheduler {
    device: wgpu::Device,
    queue: wgpu::Queue,
    program: Program,
    source: Arc<dyn WorkSource>,
    schedule: Schedule,
    layout: Layout,
    plan: Plan,
    kernels: Kernels,
    buffers: Option<Buffers>,
    wgsl: String,
    seed: u32,
    resources: Resources,
    instruments: Instruments,
    cache: KernelCache,
    faults: Vec<Fault>,
    /// Candidates of a schedule that picks one of several.
    auto: Option<Box<Auto>>,
}

/// Collects what a [`Scheduler`] may be given besides a program, a source and a device.
#[derive(Debug)]
pub struct SchedulerBuilder<'a> {
    program: &'a Program,
    source: Arc<dyn WorkSource>,
    schedule: Schedule,
    resources: Resources,
    instruments: Instruments,
    cache: KernelCache,
    faults: Vec<Fault>,
}

impl SchedulerBuilder<'_> {
    /// The schedule; [`Schedule::block`] unless said otherwise.
    pub fn schedule(mut self, schedule: &Schedule) -> Self {
        self.schedule = schedule.clone();
        self
    }

    /// Every binding the program uses, by name.
    pub fn resources(mut self, resources: &Resources) -> Self {
        self.resources = resources.clone();
        self
    }

    /// What to observe.
    pub fn instruments(mut self, instruments: Instruments) -> Self {
        self.instruments = instruments;
        self
    }

    /// For tests: puts a mistake into generated text.
    #[doc(hidden)]
    pub fn fault(mut self, fault: Fault) -> Self {
        self.faults.push(fault);
        self
    }

    /// As [`build`](Self::build), on a context, whose kernels are not compiled again.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn build_on(mut self, gpu: &GpuContext) -> Result<Scheduler> {
        self.cache = gpu.kernels.clone();
        self.build(&gpu.device, &gpu.queue)
    }

    /// Generates and compiles the kernels.
    ///
    /// # Errors
    /// [`Error::Shader`], [`Error::Schedule`], [`Error::Resource`], [`Error::Gpu`] when the device refuses something, [`Error::Limit`] when a
    /// limit is too small.
    pub fn build(self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Scheduler> {
        if !self.schedule.candidates.is_empty() {
            return auto::build(self, device, queue);
        }
        let SchedulerBuilder { program, source, mut schedule, resources, instruments, cache, faults } = self;
        // A program that does not say how likely a walk survives has no roulette, whatever the schedule offers.
        schedule.roulette = schedule.roulette.filter(|_| program.has_roulette());
        let linked = link(program, source.as_ref(), &schedule, &instruments, tick_lanes(device), &faults)?;
        let plan = Plan::new(schedule.execution, schedule.launch, schedule.grain(), program.stages(), instruments.checked);
        let kernels = Kernels::new(device, program, &plan, &linked, &resources, &cache)?;
        Ok(Scheduler {
            device: device.clone(),
            queue: queue.clone(),
            program: program.clone(),
            source,
            schedule,
            layout: linked.layout,
            plan,
            kernels,
            buffers: None,
            wgsl: linked.stages.text,
            seed: 0,
            resources,
            instruments,
            cache,
            faults,
            auto: None,
        })
    }
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
    /// Ticks that handed out work.
    pub regenerations: u32,
    /// Sum of live blocks over the steps; where whole walks are launched: tiles.
    pub block_steps: u64,
    /// Work-groups that each stage was launched with, summed over the steps. More than `block_steps` with full launches, which launch dead
    /// blocks too; fewer where work-groups take several tiles.
    pub group_steps: u64,
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
    /// Buffers that the state of the pool is spread over.
    pub banks: u32,
    /// Passes whose results were kept at once.
    pub ring: u32,
    /// Bytes of lane state.
    pub state_bytes: u64,
    /// Bytes of every kind of buffer, by name.
    pub memory: Vec<(&'static str, u64)>,
    /// Sums of the program's counters, those that something calls.
    pub counters: Vec<(String, u64)>,
    /// How often each of the program's assertions did not hold; empty when they are off.
    pub assertions: Vec<(String, u64)>,
    /// Of a schedule that picks one of several: who did which passes, and why.
    pub decisions: Vec<Decision>,
    /// What was done otherwise than asked, one line each.
    pub notes: Vec<String>,
    /// What instruments have seen.
    pub observed: Observed,
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
        Self::builder(program, source).schedule(schedule).resources(resources).build(device, queue)
    }

    /// Everything that can be chosen.
    pub fn builder(program: &Program, source: impl WorkSource + 'static) -> SchedulerBuilder<'_> {
        SchedulerBuilder {
            program,
            source: Arc::new(source),
            schedule: Schedule::default(),
            resources: Resources::new(),
            instruments: Instruments::default(),
            cache: KernelCache::default(),
            faults: Vec::new(),
        }
    }

    /// Takes another text of the program. Whatever is wrong with it leaves the scheduler as it was, with the kernels it has.
    ///
    /// # Errors
    /// As [`SchedulerBuilder::build`].
    pub fn reload(&mut self, program: &Program) -> Result<()> {
        if let Some(auto) = &mut self.auto {
            auto.reload(program)?;
        }
        let mut schedule = self.schedule.clone();
        schedule.roulette = schedule.roulette.filter(|_| program.has_roulette());
        let linked = link(program, self.source.as_ref(), &schedule, &self.instruments, tick_lanes(&self.device), &self.faults)?;
        let plan = Plan::new(schedule.execution, schedule.launch, schedule.grain(), program.stages(), self.instruments.checked);
        let kernels = Kernels::new(&self.device, program, &plan, &linked, &self.resources, &self.cache)?;
        self.program = program.clone();
        self.layout = linked.layout;
        self.wgsl = linked.stages.text;
        (self.plan, self.kernels, self.buffers) = (plan, kernels, None);
        Ok(())
    }

    /// Statistics of a run of this scheduler.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Timeout`]: with [`Instruments::times`] the cost of a launch is measured.
    pub fn statistics(&self, report: &Report) -> Result<Statistics> {
        let launch_ns = if self.instruments.times { launch_cost::measure(&self.device, &self.queue)? } else { None };
        let info = self.device.adapter_info();
        let device = format!("{} ({}, {} {})", info.name, info.backend, info.driver, info.driver_info);
        Ok(Statistics::new(self.program.name(), device, &self.layout, report, launch_ns))
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

    /// How large everything is; `blocks` takes precedence over what the schedule says.
    fn sizes(&self, passes: u32, blocks: Option<u32>) -> Result<Sizes> {
        let limits = self.device.limits();
        Sizes::choose(&Demand {
            execution: self.schedule.execution,
            pool_blocks: blocks.or(self.schedule.pool_blocks),
            bank_blocks: self.schedule.bank_blocks,
            keeps_lengths: self.instruments.lengths,
            records: self.instruments.steps,
            default_blocks: default_pool_blocks(&self.device),
            ring: self.schedule.ring,
            tiles: self.source.tiles(),
            passes,
            stride: self.layout.stride(),
            result: &self.program.interface().result,
            order_words: self.schedule.order.rule().words_per_tile(),
            is_estimated: matches!(self.schedule.order.rule(), OrderRule::Estimated(_)),
            grain: self.schedule.grain(),
            scope: self.schedule.roulette.as_ref().map(|roulette| roulette.scope()),
            pass_items: self.source.items(),
            binding: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        })
    }
}

/// Blocks when the schedule does not say: a million lanes fill a large GPU; a software driver runs a few groups at a time and gains
/// from state that stays in its caches.
fn default_pool_blocks(device: &wgpu::Device) -> u32 {
    if device.adapter_info().device_type == wgpu::DeviceType::Cpu { 128 } else { 4096 }
}

/// Invocations of the tick: a CPU runs them a few at a time, and again from one barrier to the next.
fn tick_lanes(device: &wgpu::Device) -> u32 {
    if device.adapter_info().device_type == wgpu::DeviceType::Cpu { TICK_LANES / 2 } else { TICK_LANES }
}
