//! A run under several schedules, one after the other: `auto`.
//!
//! Key decision: each candidate is a scheduler of its own, and the film goes from one to the next between passes. Passes are resolved in order and
//! give the same bits under every candidate, so the film is the same whatever is chosen when; only the time it takes depends on that. What
//! is given up: a pass of one candidate does not overlap with those of the next, and a change of mind copies the film; large pools are allocated
//! anew, small ones are kept.
//!
//! **Invariant:** changing one's mind changes no bit.

use std::ops::ControlFlow;

use super::{Progress, Report, Scheduler, SchedulerBuilder, buffers::Buffers};
use crate::{Error, Film, Instruments, Result, Schedule, policy::Chooser};

/// Bytes that candidates may hold while another one runs.
const IDLE_BYTES: u64 = 256 << 20;

/// What the film holds before a run adds to it.
#[derive(Clone, Debug)]
pub(super) struct FilmBase {
    pub(super) film: wgpu::Buffer,
    pub(super) passes: u32,
    pub(super) not_finite: u64,
}

/// One portion of a run.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Decision {
    /// First pass of it.
    pub first_pass: u32,
    /// Passes done.
    pub passes: u32,
    /// Under which schedule, printed.
    pub schedule: String,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Why this one.
    pub reason: String,
    /// Of this portion, as in [`Report`]: what a replay needs, and what it finds.
    pub pool_blocks: u32,
    /// Passes whose results were kept at once.
    pub ring: u32,
    /// Steps.
    pub steps: u64,
    /// Launches.
    pub launches: u64,
}

/// Candidates, ready to run, and what is known of them.
#[derive(Debug)]
pub(super) struct Auto {
    candidates: Vec<Scheduler>,
    /// The schedule, printed.
    name: String,
    chooser: Chooser,
    is_warm: Vec<bool>,
    /// Candidates that cannot do what is asked, with the reason.
    notes: Vec<String>,
}

/// Builds a scheduler with candidates; for the rest (layout, plan, text) it is the first of them.
pub(super) fn build(builder: SchedulerBuilder<'_>, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Scheduler> {
    let auto = Auto::new(&builder, (device, queue))?;
    let Some(first) = auto.candidates.first() else {
        return Err(Error::Schedule("`auto` has no candidate".into()));
    };
    let mut scheduler = builder.with_schedule(first.schedule.clone()).build(device, queue)?;
    scheduler.auto = Some(Box::new(auto));
    Ok(scheduler)
}

impl Auto {
    /// Builds what can be built; `builder` carries everything but the schedule.
    pub(super) fn new(builder: &SchedulerBuilder<'_>, gpu: (&wgpu::Device, &wgpu::Queue)) -> Result<Self> {
        let watched = Instruments { assertions: false, markers: false, ..builder.instruments };
        if watched != Instruments::default() {
            return Err(Error::Schedule("instruments watch one schedule; `auto` changes its own between passes".into()));
        }
        let mut auto = Auto {
            candidates: Vec::new(),
            name: builder.schedule.to_string(),
            chooser: Chooser::new(0),
            is_warm: Vec::new(),
            notes: Vec::new(),
        };
        let mut refusal = None;
        for candidate in builder.schedule.candidates_as_asked() {
            let printed = candidate.to_string();
            match builder.with_schedule(candidate).build(gpu.0, gpu.1) {
                Ok(scheduler) => auto.candidates.push(scheduler),
                Err(Error::Schedule(reason)) => {
                    auto.notes.push(format!("auto leaves out `{printed}`: {reason}"));
                    refusal = Some(Error::Schedule(reason));
                }
                Err(error) => return Err(error),
            }
        }
        if let (true, Some(refusal)) = (auto.candidates.is_empty(), refusal) {
            return Err(refusal);
        }
        auto.chooser = Chooser::new(auto.candidates.len());
        auto.is_warm = vec![false; auto.candidates.len()];
        Ok(auto)
    }

    /// Takes another text of the program; what was known of the candidates is forgotten.
    pub(super) fn reload(&mut self, program: &crate::Program) -> Result<()> {
        self.candidates.iter_mut().try_for_each(|candidate| candidate.reload(program))?;
        self.chooser = Chooser::new(self.candidates.len());
        self.is_warm.fill(false);
        Ok(())
    }

    /// Reserves what the next candidate needs for a run of so many passes. What others hold is freed when it is much, or when both do not fit;
    /// what is little stays for their next turn. The film is kept by whoever did the last passes.
    fn make_room(&mut self, next: usize, passes: u32) -> Result<()> {
        let others = || self.candidates.iter().enumerate().filter(|(other, _)| *other != next);
        let idle: u64 = others().filter_map(|(_, other)| other.buffers.as_ref()).map(Buffers::bytes).sum();
        if idle > IDLE_BYTES {
            self.free_all_but(next);
        } else if idle > 0 {
            let mut notes = Vec::new();
            let buffers = self.candidates[next].allocate(passes, &mut notes)?;
            if notes.is_empty() {
                self.candidates[next].buffers = Some(buffers);
            } else {
                // A smaller pool than it asked for: the run asks again, alone.
                self.free_all_but(next);
            }
        }
        Ok(())
    }

    fn free_all_but(&mut self, next: usize) {
        let others = self.candidates.iter_mut().enumerate().filter(|(other, _)| *other != next);
        others.for_each(|(_, other)| other.buffers = None);
    }

    /// As [`Scheduler::run_with`].
    pub(super) fn run(
        &mut self,
        seed: u32,
        [first, passes]: [u32; 2],
        mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<(Film, Report)> {
        let mut whole = Report { schedule: self.name.clone(), notes: self.notes.clone(), ..Report::default() };
        let mut base: Option<FilmBase> = None;
        let mut is_stopped = false;
        while let Some(choice) = self.chooser.next(passes - whole.passes).filter(|_| !is_stopped) {
            self.make_room(choice.candidate, passes)?;
            let scheduler = &mut self.candidates[choice.candidate];
            scheduler.seed = seed;
            if !std::mem::replace(&mut self.is_warm[choice.candidate], true) {
                scheduler.warm_up(passes)?;
            }
            let (done, items, elapsed) = (whole.passes, whole.items_started, whole.elapsed);
            let mut run = scheduler.begin_within(first + done, choice.passes, passes)?;
            run.base = base.take();
            run.drive(|progress| {
                let progress = Progress {
                    passes_done: done + progress.passes_done,
                    passes,
                    items_started: items + progress.items_started,
                    elapsed: elapsed + progress.elapsed,
                };
                let answer = observe(&progress);
                is_stopped |= answer.is_break();
                answer
            })?;
            let (report, film) = run.close()?;
            let mut reason = choice.reason;
            if report.passes == choice.passes {
                let change = self.chooser.learn(choice.candidate, report.passes, report.elapsed.as_secs_f64());
                reason.extend(change.map(|change| format!("; {change}")));
            }
            whole.decisions.push(Decision {
                first_pass: done,
                passes: report.passes,
                schedule: report.schedule.clone(),
                seconds: report.elapsed.as_secs_f64(),
                reason,
                pool_blocks: report.pool_blocks,
                ring: report.ring,
                steps: report.steps,
                launches: report.launches,
            });
            whole.absorb(report);
            base = Some(film);
        }
        let film = match base {
            Some(base) => self.candidates[0].read_film(&base)?,
            None => self.candidates[0].empty_film(),
        };
        Ok((film, whole))
    }
}

impl Scheduler {
    /// Launches every kernel once without work, so that a driver that compiles at the first launch has done so; with the buffers of a run of
    /// so many passes.
    fn warm_up(&mut self, passes: u32) -> Result<()> {
        let mut run = self.begin_within(0, 0, passes)?;
        run.open()?;
        run.step_blindly(1, 1)?;
        run.give_back();
        Ok(())
    }
}

impl<'a> SchedulerBuilder<'a> {
    /// The same for one of several candidates.
    fn with_schedule(&self, schedule: Schedule) -> SchedulerBuilder<'a> {
        SchedulerBuilder {
            program: self.program,
            source: self.source.clone(),
            schedule,
            resources: self.resources.clone(),
            instruments: self.instruments,
            cache: self.cache.clone(),
            faults: self.faults.clone(),
        }
    }
}

impl Report {
    /// Adds what another portion of the run did; sizes are those of the latest.
    fn absorb(&mut self, other: Report) {
        self.steps += other.steps;
        self.launches += other.launches;
        self.regenerations += other.regenerations;
        self.block_steps += other.block_steps;
        self.group_steps += other.group_steps;
        self.lane_steps += other.lane_steps;
        self.items_started += other.items_started;
        self.items_killed += other.items_killed;
        self.not_finite += other.not_finite;
        self.storage_clamped += other.storage_clamped;
        self.out_of_range += other.out_of_range;
        self.passes += other.passes;
        self.submissions += other.submissions;
        self.elapsed += other.elapsed;
        for (mine, others) in [(&mut self.counters, other.counters), (&mut self.assertions, other.assertions)] {
            for (name, count) in others {
                match mine.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, sum)) => *sum += count,
                    None => mine.push((name, count)),
                }
            }
        }
        (self.pool_blocks, self.banks, self.ring) = (other.pool_blocks, other.banks, other.ring);
        (self.state_bytes, self.memory) = (other.state_bytes, other.memory);
        self.notes.extend(other.notes);
    }
}
