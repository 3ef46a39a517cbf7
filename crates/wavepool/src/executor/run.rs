//! The host's loop: record steps, submit, look at counters that lie two submissions back, stop when the last pass is resolved.

use std::{
    collections::VecDeque,
    ops::ControlFlow,
    time::{Duration, Instant},
};

use super::{
    Buffers, Execution, Progress, Report, Scheduler,
    kernels::scoped,
    readback::{self, Pending, Snapshot},
    sizes::Sizes,
};
use crate::{
    Error, Film, Result,
    control::{Control, arguments, counter_64, counters},
    plan::{Launch, Size},
};

/// Submissions queued before the host waits.
const QUEUED: usize = 2;
/// Steps per submission: few enough for a quick first answer, many enough that the host never matters.
const FEWEST_STEPS: u32 = 16;
const MOST_STEPS: u32 = 512;
/// What a submission should take.
const TARGET: Duration = Duration::from_millis(20);

impl Scheduler {
    /// Walks every item of samples `first..first + passes`; `observe` is called between submissions until it stops the run, after which
    /// the film holds the passes that were resolved by then.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Timeout`], [`Error::Limit`], [`Error::Conservation`].
    pub fn run_with(&mut self, first: u32, passes: u32, mut observe: impl FnMut(&Progress) -> ControlFlow<()>) -> Result<(Film, Report)> {
        let leaves = self.program.interface().result.clone();
        let pixels = self.source.pixels() as usize;
        if self.source.tiles() == 0 || passes == 0 {
            let film = Film::gather(&leaves, pixels, 0, &[], |_| None, 0);
            return Ok((film, Report { schedule: self.schedule.to_string(), ..Report::default() }));
        }
        let sizes = self.sizes(passes)?;
        let buffers = match self.buffers.take() {
            Some(buffers) if buffers.sizes == sizes => buffers,
            _ => Buffers::new(&self.device, &self.kernels, sizes)?,
        };
        let head = Control {
            work: self.source.parameters(),
            tiles: sizes.tiles,
            passes,
            first_sample: first,
            pool_blocks: sizes.pool_blocks,
            ring: sizes.ring,
            seed: self.seed,
            ..Control::default()
        };
        let begun = Instant::now();
        let (snapshot, submissions) = self.drive(&buffers, &head, begun, &mut observe)?;
        let elapsed = begun.elapsed();
        let film = self.read_film(&buffers, &snapshot)?;
        let report = self.report(&sizes, &snapshot, submissions, elapsed);
        self.buffers = Some(buffers);
        Ok((film, report))
    }

    /// Submits until the device says that all passes are resolved, or `observe` stops.
    fn drive(
        &self,
        buffers: &Buffers,
        head: &Control,
        begun: Instant,
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<(Snapshot, u32)> {
        let mut pending: VecDeque<Pending> = VecDeque::new();
        let mut steps = 1;
        let mut submissions = 0_u32;
        let mut last_answer = Instant::now();
        let mut latest = None;
        let mut stopped = false;
        loop {
            while !stopped && pending.len() < QUEUED {
                let slot = submissions as usize % buffers.staging.len();
                let submission = self.submit(buffers, (submissions == 0).then_some(head), steps, slot)?;
                let mapped = buffers.staging[slot].request();
                pending.push_back(Pending { slot, submission, mapped });
                submissions += 1;
            }
            let Some(oldest) = pending.pop_front() else { break };
            readback::wait(&self.device, &oldest.submission, &oldest.mapped, "running steps")?;
            let snapshot = buffers.staging[oldest.slot].read()?;
            let progress = Progress {
                passes_done: snapshot.control.resolved,
                passes: head.passes,
                items_started: self.items_started(&snapshot.control),
                elapsed: begun.elapsed(),
            };
            if !stopped {
                stopped = observe(&progress).is_break() || snapshot.control.resolved == head.passes;
            }
            // Steer towards the target time, doubling or halving at most.
            let took = last_answer.elapsed();
            last_answer = Instant::now();
            if took < TARGET / 2 {
                steps = (steps * 2).min(MOST_STEPS);
            } else if took > TARGET * 2 {
                steps /= 2;
            }
            // A step of the megakernel is many whole walks; one may be as much as a watchdog allows.
            let fewest = if self.schedule.execution == Execution::Megakernel { 1 } else { FEWEST_STEPS };
            steps = steps.max(if submissions > 2 { fewest } else { 1 });
            latest = Some(snapshot);
        }
        latest.map(|snapshot| (snapshot, submissions)).ok_or_else(|| Error::Conservation("nothing was submitted".into()))
    }

    fn submit(&self, buffers: &Buffers, opening: Option<&Control>, steps: u32, slot: usize) -> Result<wgpu::SubmissionIndex> {
        scoped(&self.device, "recording steps", || {
            let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(self.program.name()) });
            if let Some(head) = opening {
                buffers.reset(&self.queue, &mut encoder, head);
            }
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("steps"), timestamp_writes: None });
                for (group, bind_group) in &self.kernels.program_groups {
                    pass.set_bind_group(*group, bind_group, &[]);
                }
                if opening.is_some() {
                    self.plan.opening.iter().for_each(|launch| self.dispatch(&mut pass, buffers, launch));
                }
                for _ in 0..steps {
                    self.plan.step.iter().for_each(|launch| self.dispatch(&mut pass, buffers, launch));
                }
            }
            buffers.staging[slot].record(&mut encoder, &buffers.control, &buffers.counters);
            self.queue.submit([encoder.finish()])
        })
    }

    fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, buffers: &Buffers, launch: &Launch) {
        let Some(kernel) = self.kernels.get(&launch.kernel) else { return };
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, buffers.group(kernel.class), &[]);
        let offset = match launch.size {
            Size::Groups(groups) => return pass.dispatch_workgroups(groups, 1, 1),
            Size::NewBlocks => arguments::GENERATE,
            Size::LiveBlocks => arguments::STAGE,
            Size::FinishedTiles => arguments::RESOLVE,
        };
        pass.dispatch_workgroups_indirect(&buffers.arguments, u64::from(offset) * 4);
    }

    fn read_film(&self, buffers: &Buffers, snapshot: &Snapshot) -> Result<Film> {
        let missing = snapshot.counters[counters::MISSING as usize];
        if missing > 0 {
            return Err(Error::Conservation(format!("{missing} items left no result")));
        }
        let words = readback::read_words(&self.device, &self.queue, &buffers.film, "reading the film")?;
        let pixels = self.source.pixels() as usize;
        let pixel_of = |place: usize| self.source.pixel((place / 256) as u32, (place % 256) as u32);
        let not_finite = u64::from(snapshot.counters[counters::NOT_FINITE as usize]);
        let film = Film::gather(&self.program.interface().result, pixels, buffers.sizes.places() as usize, &words, pixel_of, not_finite);
        let resolved = snapshot.control.resolved;
        match film.samples().iter().position(|samples| *samples != resolved) {
            Some(pixel) => Err(Error::Conservation(format!("pixel {pixel} has {} samples, not {resolved}", film.samples()[pixel]))),
            None => Ok(film),
        }
    }

    /// The megakernel counts whole passes.
    fn items_started(&self, control: &Control) -> u64 {
        match self.schedule.execution {
            Execution::Megakernel => u64::from(control.resolved) * u64::from(self.source.pixels()),
            Execution::Wavefront => counter_64(control.items_started),
        }
    }

    fn report(&self, sizes: &Sizes, snapshot: &Snapshot, submissions: u32, elapsed: Duration) -> Report {
        let control = &snapshot.control;
        let steps = u64::from(control.step);
        let per_step = self.plan.step.iter().filter(|launch| matches!(launch.size, Size::LiveBlocks | Size::Groups(_))).count() as u64;
        let is_mega = self.schedule.execution == Execution::Megakernel;
        Report {
            schedule: self.schedule.to_string(),
            steps,
            launches: 1 + steps * per_step + u64::from(control.regenerations) + u64::from(control.resolved),
            regenerations: control.regenerations,
            block_steps: counter_64(control.block_steps),
            lane_steps: counter_64(control.lane_steps),
            items_started: self.items_started(control),
            items_killed: counter_64(control.items_killed) + u64::from(snapshot.counters[counters::KILLED as usize]),
            not_finite: u64::from(snapshot.counters[counters::NOT_FINITE as usize]),
            storage_clamped: u64::from(snapshot.counters[counters::STORAGE_CLAMPED as usize]),
            out_of_range: u64::from(snapshot.counters[counters::OUT_OF_RANGE as usize]),
            passes: control.resolved,
            pool_blocks: sizes.pool_blocks,
            ring: sizes.ring,
            state_bytes: if is_mega { 0 } else { sizes.bank_words * 4 },
            submissions,
            elapsed,
        }
    }
}
