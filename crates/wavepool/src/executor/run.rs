//! One run: record steps, submit, look at counters that lie two submissions back, stop when the last pass is resolved.
//!
//! Key decision: the host never decides anything about the work; it can be driven step by step by a debugger or left alone for thousands of
//! steps, and the device does the same.

mod audit;
mod outcome;

use std::{
    collections::VecDeque,
    ops::ControlFlow,
    time::{Duration, Instant},
};

use super::{
    Progress, Report, Scheduler,
    auto::FilmBase,
    buffers::Buffers,
    collect::Collector,
    kernels::scoped,
    readback::{self, Pending, Snapshot},
    sizes::RECORD_STEPS,
};
use crate::{
    Error, Film, Result,
    control::{Control, arguments, counters},
    plan::{Kernel, Launch, Size},
};

/// Submissions queued before the host waits.
const QUEUED: usize = 2;
/// Steps per submission: few enough for a quick first answer, many enough that the host never matters.
const FEWEST_STEPS: u32 = 16;
const MOST_STEPS: u32 = 512;
/// What a submission should take.
const TARGET: Duration = Duration::from_millis(20);

/// A launch for one bank, or for the only one.
#[derive(Clone, Debug)]
pub(super) struct Dispatch {
    pub(super) launch: Launch,
    pub(super) bank: u32,
}

/// A timed launch: which dispatch of a step, and in which step of the run, from 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Launched {
    pub(super) dispatch: usize,
    pub(super) step: u64,
}

/// A run under way, step by step. [`Scheduler::run_with`] is this without stopping.
#[derive(Debug)]
pub struct Run<'a> {
    pub(super) scheduler: &'a mut Scheduler,
    pub(super) buffers: Buffers,
    head: Control,
    opening: Vec<Dispatch>,
    pub(super) steps: Vec<Dispatch>,
    audit: Vec<Dispatch>,
    pending: VecDeque<Pending>,
    submissions: u32,
    /// Steps recorded so far.
    recorded: u64,
    is_open: bool,
    pub(super) latest: Option<Snapshot>,
    collector: Collector,
    notes: Vec<String>,
    begun: Instant,
    /// A film to add to.
    pub(super) base: Option<FilmBase>,
}

impl Scheduler {
    /// Walks every item of samples `first..first + passes`; `observe` is called between submissions until it stops the run, after which
    /// the film holds the passes that were resolved by then.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Timeout`], [`Error::Limit`], [`Error::Conservation`].
    pub fn run_with(&mut self, first: u32, passes: u32, observe: impl FnMut(&Progress) -> ControlFlow<()>) -> Result<(Film, Report)> {
        if let Some(mut auto) = self.auto.take() {
            check_samples(first, passes)?;
            let outcome = auto.run(self.seed, [first, passes], observe);
            self.auto = Some(auto);
            return outcome;
        }
        let mut run = self.begin(first, passes)?;
        run.drive(observe)?;
        run.finish()
    }

    /// Prepares a run of samples `first..first + passes` without starting it.
    ///
    /// # Errors
    /// [`Error::Limit`] when something does not fit, [`Error::Gpu`] when there is no memory even for the smallest pool.
    pub fn begin(&mut self, first: u32, passes: u32) -> Result<Run<'_>> {
        self.begin_within(first, passes, passes)
    }

    /// The same with buffers as for a run of `whole` passes, of which this one is a portion.
    pub(super) fn begin_within(&mut self, first: u32, passes: u32, whole: u32) -> Result<Run<'_>> {
        if self.auto.is_some() {
            return Err(Error::Schedule("a run step by step needs one schedule; `auto` changes its own between passes".into()));
        }
        check_samples(first, passes)?;
        let mut notes = Vec::new();
        let buffers = self.allocate(whole.max(passes), &mut notes)?;
        let sizes = buffers.sizes;
        let head = Control {
            work: self.source.parameters(),
            tiles: sizes.tiles,
            passes,
            first_sample: first,
            pool_blocks: sizes.pool_blocks,
            ring: sizes.ring,
            seed: self.seed,
            banks: sizes.banks,
            bank_blocks: sizes.bank_blocks,
            record: sizes.record_steps,
            pass_items: self.source.items(),
            ..Control::default()
        };
        let expand = |launches: &[Launch]| -> Vec<Dispatch> {
            let banks = |launch: &Launch| if launch.kernel.is_per_bank() { sizes.banks } else { 1 };
            launches.iter().flat_map(|launch| (0..banks(launch)).map(|bank| Dispatch { launch: launch.clone(), bank })).collect()
        };
        let (opening, steps, audit) = (expand(&self.plan.opening), expand(&self.plan.step), expand(&self.plan.audit));
        Ok(Run {
            scheduler: self,
            buffers,
            head,
            opening,
            steps,
            audit,
            pending: VecDeque::new(),
            submissions: 0,
            recorded: 0,
            is_open: false,
            latest: None,
            collector: Collector::default(),
            notes,
            begun: Instant::now(),
            base: None,
        })
    }

    /// The buffers of the run before when they fit, else new ones; a device without memory for the pool gets a smaller one.
    pub(super) fn allocate(&mut self, passes: u32, notes: &mut Vec<String>) -> Result<Buffers> {
        let mut sizes = self.sizes(passes, None)?;
        let asked = sizes.pool_blocks;
        loop {
            match self.buffers.take() {
                Some(buffers) if buffers.sizes == sizes => return Ok(buffers),
                _ => {}
            }
            match Buffers::new(&self.device, &self.queue, &self.kernels, sizes, &self.instruments) {
                Err(error) if error.is_out_of_memory() && sizes.pool_blocks > 1 => {
                    let smaller = sizes.pool_blocks / 2;
                    sizes = self.sizes(passes, Some(smaller))?;
                }
                outcome => {
                    if sizes.pool_blocks < asked {
                        notes.push(format!("the device has no memory for a pool of {asked} blocks; it has {} now", sizes.pool_blocks));
                    }
                    return outcome;
                }
            }
        }
    }
}

fn check_samples(first: u32, passes: u32) -> Result<()> {
    match first.checked_add(passes) {
        Some(_) => Ok(()),
        None => Err(Error::Limit {
            what: format!("a run of {passes} samples from sample {first} on"),
            need: u64::from(first) + u64::from(passes),
            limit: u64::from(u32::MAX),
            unit: "sample numbers",
            advice: "begin at a smaller number".into(),
        }),
    }
}

impl Run<'_> {
    /// How far it is, as of the last look at the counters.
    pub fn progress(&self) -> Progress {
        let control = self.latest.as_ref().map_or(self.head, |snapshot| snapshot.control);
        Progress {
            passes_done: control.resolved,
            passes: self.head.passes,
            items_started: self.items_started(&control),
            elapsed: self.begun.elapsed(),
        }
    }

    /// True when all passes are in the film.
    pub fn is_done(&self) -> bool {
        let nothing = self.head.tiles == 0 || self.head.passes == 0;
        nothing || self.latest.as_ref().is_some_and(|snapshot| snapshot.control.resolved == self.head.passes)
    }

    /// Steps recorded so far; those past the end do nothing.
    pub fn steps(&self) -> u64 {
        self.recorded
    }

    /// Does `steps` more steps and waits for them.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Timeout`]; in checked mode [`Error::Conservation`].
    pub fn step(&mut self, steps: u32) -> Result<Progress> {
        if self.scheduler.instruments.checked {
            for _ in 0..steps {
                self.checked_step()?;
            }
            return Ok(self.progress());
        }
        let mut left = if self.head.tiles == 0 { 0 } else { steps };
        while left > 0 {
            let now = left.min(self.most_steps());
            self.submit(now, true)?;
            left -= now;
            self.receive_all()?;
        }
        Ok(self.progress())
    }

    /// The tick before the first step, alone.
    pub(super) fn open(&mut self) -> Result<()> {
        self.submit(0, true)?;
        self.receive_all()
    }

    /// Does exactly `steps` steps, `each` per submission, and looks once at the end.
    pub(super) fn step_blindly(&mut self, steps: u64, each: u32) -> Result<()> {
        let mut left = steps;
        while left > 0 {
            let now = left.min(u64::from(each)) as u32;
            left -= u64::from(now);
            self.submit(now, left == 0)?;
        }
        self.receive_all()
    }

    /// Leaves the buffers to the next run.
    pub(super) fn give_back(self) {
        self.scheduler.buffers = Some(self.buffers);
    }

    /// Submits until the device says that all passes are resolved, or `observe`, which is asked between submissions, stops. Nothing is
    /// lost by stopping; the next call goes on.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn drive(&mut self, mut observe: impl FnMut(&Progress) -> ControlFlow<()>) -> Result<()> {
        let fixed = self.scheduler.schedule.submission_steps;
        let mut steps = fixed.unwrap_or(1);
        let mut last_answer = Instant::now();
        let mut is_stopped = self.is_done();
        let look_after = u64::from(self.scheduler.instruments.look_after);
        while !is_stopped && self.can_go_blind() && self.recorded < look_after {
            self.submit(fixed.unwrap_or(FEWEST_STEPS).min(self.most_steps()), false)?;
        }
        loop {
            if self.scheduler.instruments.checked {
                if is_stopped {
                    return Ok(());
                }
                self.checked_step()?;
            } else {
                while !is_stopped && self.pending.len() < QUEUED {
                    self.submit(steps.min(self.most_steps()), true)?;
                }
                if !self.receive()? {
                    return Ok(());
                }
            }
            if !is_stopped {
                is_stopped = observe(&self.progress()).is_break() || self.is_done();
            }
            // Steer towards the target time, doubling or halving at most.
            let took = last_answer.elapsed();
            last_answer = Instant::now();
            if fixed.is_some() {
                continue;
            }
            if took < TARGET / 2 {
                steps = (steps * 2).min(MOST_STEPS);
            } else if took > TARGET * 2 {
                steps /= 2;
            }
            // A step of whole walks may be as much as a watchdog allows.
            let fewest = if self.scheduler.schedule.execution.is_wavefront() { FEWEST_STEPS } else { 1 };
            steps = steps.max(if self.submissions > 2 { fewest } else { 1 });
        }
    }

    /// Steps that one submission can hold, because of what instruments keep of it.
    fn most_steps(&self) -> u32 {
        let record = if self.buffers.sizes.record_steps > 0 { RECORD_STEPS - 1 } else { u32::MAX };
        let clock = self
            .buffers
            .clock
            .as_ref()
            .map_or(u32::MAX, |clock| (clock.most_launches() - self.opening.len() as u32) / self.steps.len().max(1) as u32);
        record.min(clock).max(1)
    }

    /// True when nothing is lost by not looking.
    fn can_go_blind(&self) -> bool {
        let instruments = &self.scheduler.instruments;
        !instruments.checked && !instruments.steps && !instruments.times
    }

    /// Records and submits `steps` steps; `look` asks for the counters behind them.
    fn submit(&mut self, steps: u32, look: bool) -> Result<()> {
        let opening = if self.is_open { Vec::new() } else { self.opening.clone() };
        let numbered = |step: u64| move |dispatch: usize| Launched { dispatch, step };
        let mut launched: Vec<Launched> = (0..opening.len()).map(|index| numbered(0)(self.steps.len() + index)).collect();
        let mut list: Vec<&Dispatch> = opening.iter().collect();
        for step in 1..=u64::from(steps) {
            list.extend(&self.steps);
            launched.extend((0..self.steps.len()).map(numbered(self.recorded + step)));
        }
        let submission = self.encode(&list, &launched, look)?;
        self.recorded += u64::from(steps);
        self.is_open = true;
        self.after_submission(submission, launched, look);
        Ok(())
    }

    fn after_submission(&mut self, submission: wgpu::SubmissionIndex, launches: Vec<Launched>, look: bool) {
        let slot = self.submissions as usize % self.buffers.staging.len();
        self.submissions += 1;
        if look {
            let mapped = self.buffers.staging[slot].request();
            self.pending.push_back(Pending { slot, submission, mapped, launches });
        }
    }

    fn encode(&self, list: &[&Dispatch], launched: &[Launched], look: bool) -> Result<wgpu::SubmissionIndex> {
        let Scheduler { device, queue, program, instruments, .. } = &*self.scheduler;
        let buffers = &self.buffers;
        let slot = self.submissions as usize % buffers.staging.len();
        let clock = buffers.clock.as_ref().filter(|_| look);
        scoped(device, "recording steps", || {
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(program.name()) });
            if !self.is_open {
                buffers.reset(queue, &mut encoder, &self.head, self.base.as_ref().map(|base| &base.film));
            }
            if buffers.sizes.record_steps > 0 {
                let place = std::mem::offset_of!(Control, record_steps) as u64;
                encoder.clear_buffer(&buffers.control, place, Some(8));
            }
            if list.iter().any(|dispatch| matches!(dispatch.launch.kernel, Kernel::AuditResults)) {
                let words = u64::from(counters::AFTER_AUDIT - counters::AUDIT_ALIVE);
                encoder.clear_buffer(&buffers.counters, u64::from(counters::AUDIT_ALIVE) * 4, Some(words * 4));
            }
            match clock.filter(|clock| !clock.is_inside_passes) {
                Some(clock) => {
                    for (index, dispatch) in list.iter().enumerate() {
                        let writes = Some(clock.around(index as u32));
                        let mut pass = self.begin_pass(&mut encoder, writes);
                        self.dispatch(&mut pass, dispatch, &launched[index], instruments.markers);
                    }
                }
                None => {
                    let mut pass = self.begin_pass(&mut encoder, None);
                    clock.inspect(|clock| clock.mark(&mut pass, 0));
                    for (index, dispatch) in list.iter().enumerate() {
                        self.dispatch(&mut pass, dispatch, &launched[index], instruments.markers);
                        clock.inspect(|clock| clock.mark(&mut pass, index as u32 + 1));
                    }
                }
            }
            if look {
                let timed = clock.map(|clock| (clock, list.len() as u32));
                buffers.staging[slot].record(&mut encoder, &buffers.control, &buffers.counters, &buffers.record, timed);
            }
            queue.submit([encoder.finish()])
        })
    }

    fn begin_pass<'p>(
        &self,
        encoder: &'p mut wgpu::CommandEncoder,
        timestamp_writes: Option<wgpu::ComputePassTimestampWrites<'_>>,
    ) -> wgpu::ComputePass<'p> {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("steps"), timestamp_writes });
        for (group, bind_group) in &self.scheduler.kernels.program_groups {
            pass.set_bind_group(*group, bind_group, &[]);
        }
        pass
    }

    fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, dispatch: &Dispatch, launched: &Launched, has_marker: bool) {
        let Dispatch { launch, bank } = dispatch;
        let Some(kernel) = self.scheduler.kernels.get(&launch.kernel) else { return };
        if has_marker {
            pass.push_debug_group(&format!("step {} / {}", launched.step, launch.kernel));
        }
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, self.buffers.group(kernel.class, *bank), &[]);
        let of_bank = |offset: u32| arguments::BANKS + arguments::PER_BANK * bank + offset;
        let sizes = &self.buffers.sizes;
        match launch.size {
            Size::Groups(groups) => pass.dispatch_workgroups(groups, 1, 1),
            Size::All => {
                let groups = if launch.kernel.is_per_bank() { sizes.blocks_of(*bank) } else { sizes.tiles };
                let most = crate::control::MAX_GROUPS;
                pass.dispatch_workgroups(groups.min(most), groups.div_ceil(most), 1);
            }
            size => {
                let offset = match size {
                    Size::NewBlocks => of_bank(arguments::GENERATE),
                    Size::LiveBlocks | Size::FilledBlocks | Size::PackedLanes => of_bank(arguments::STAGE),
                    Size::Queues => of_bank(arguments::QUEUES),
                    _ => arguments::RESOLVE,
                };
                pass.dispatch_workgroups_indirect(&self.buffers.arguments, u64::from(offset) * 4);
            }
        }
        if has_marker {
            pass.pop_debug_group();
        }
    }

    /// Waits for the oldest look; false when none is under way.
    fn receive(&mut self) -> Result<bool> {
        let Some(oldest) = self.pending.pop_front() else { return Ok(false) };
        readback::wait(&self.scheduler.device, &oldest.submission, &oldest.mapped, "running steps")?;
        let snapshot = self.buffers.staging[oldest.slot].read()?;
        if self.buffers.sizes.record_steps > 0 {
            self.collector.add_record(&snapshot, self.buffers.sizes.record_steps);
        }
        if let Some(clock) = &self.buffers.clock {
            let timed = clock.read(&snapshot.marks, oldest.launches.len());
            let name = |dispatch: usize| {
                let dispatch = self.steps.get(dispatch).or_else(|| self.opening.get(dispatch - self.steps.len()));
                dispatch.map_or_else(String::new, |dispatch| dispatch.launch.kernel.to_string())
            };
            self.collector.add_times(&timed, &oldest.launches, name);
        }
        self.latest = Some(snapshot);
        Ok(true)
    }

    pub(super) fn receive_all(&mut self) -> Result<()> {
        while self.receive()? {}
        Ok(())
    }
}
