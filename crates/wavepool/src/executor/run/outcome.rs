//! What a run leaves: the film, and an account of what was done.

use std::time::Duration;

use super::Run;
use crate::{
    Error, Film, Report, Result, Scheduler,
    control::{Control, counter_64, counters},
    executor::{readback, sizes::Sizes},
    plan::Size,
    policy::Execution,
    profile::Lengths,
};

impl Run<'_> {
    /// The film of what is resolved, and what was done.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Timeout`], [`Error::Conservation`].
    pub fn finish(mut self) -> Result<(Film, Report)> {
        self.receive_all()?;
        let elapsed = self.begun.elapsed();
        let film = self.read_film()?;
        let mut report = self.report(elapsed);
        report.observed = std::mem::take(&mut self.collector).finish();
        let Run { scheduler, buffers, head, .. } = self;
        if scheduler.instruments.lengths {
            let sizes = &buffers.sizes;
            let (from, count) = (sizes.length_place(), u64::from(report.passes) * sizes.places());
            let (device, queue, results) = (&scheduler.device, &scheduler.queue, &buffers.results);
            let words = readback::read_through(&buffers.reader, device, queue, results, from, count, "reading the lengths")?;
            report.observed.lengths = Some(Lengths::new(head.tiles, words));
        }
        scheduler.buffers = Some(buffers);
        Ok((film, report))
    }

    fn read_film(&self) -> Result<Film> {
        let Some(snapshot) = &self.latest else {
            let (leaves, pixels) = (&self.scheduler.program.interface().result, self.scheduler.source.pixels() as usize);
            return Ok(Film::gather(leaves, pixels, 0, &[], |_| None, 0));
        };
        let missing = snapshot.total(counters::MISSING);
        if missing > 0 {
            return Err(Error::Conservation(format!("{missing} items left no result")));
        }
        self.gather_film(snapshot.control.resolved)
    }

    /// What the device has of the film, `resolved` samples per pixel.
    pub(in crate::executor) fn gather_film(&self, resolved: u32) -> Result<Film> {
        let Scheduler { device, queue, program, source, .. } = &*self.scheduler;
        let (leaves, pixels) = (&program.interface().result, source.pixels() as usize);
        let film = &self.buffers.film;
        let words = readback::read_through(&self.buffers.reader, device, queue, film, 0, film.size() / 4, "reading the film")?;
        let pixel_of = |place: usize| source.pixel((place / 256) as u32, (place % 256) as u32);
        let not_finite = self.latest.as_ref().map_or(0, |snapshot| snapshot.total(counters::NOT_FINITE));
        let film = Film::gather(leaves, pixels, self.buffers.sizes.places() as usize, &words, pixel_of, not_finite);
        match film.samples().iter().position(|samples| *samples != resolved) {
            Some(pixel) => Err(Error::Conservation(format!("pixel {pixel} has {} samples, not {resolved}", film.samples()[pixel]))),
            None => Ok(film),
        }
    }

    /// The megakernel counts whole passes.
    pub(super) fn items_started(&self, control: &Control) -> u64 {
        match self.scheduler.schedule.execution {
            Execution::Megakernel => u64::from(control.resolved) * u64::from(self.scheduler.source.pixels()),
            Execution::Wavefront => counter_64(control.items_started),
        }
    }

    fn report(&self, elapsed: Duration) -> Report {
        let Scheduler { plan, schedule, program, .. } = &*self.scheduler;
        let sizes: &Sizes = &self.buffers.sizes;
        let mut report = Report { schedule: schedule.to_string(), ..Report::default() };
        let Some(snapshot) = &self.latest else { return report };
        let control = &snapshot.control;
        let (steps, banked) = (u64::from(control.step), u64::from(control.bank_steps));
        let is_mega = schedule.execution == Execution::Megakernel;
        let per_bank = plan
            .step
            .iter()
            .filter(|launch| matches!(launch.size, Size::LiveBlocks | Size::FilledBlocks | Size::PackedLanes | Size::Queues))
            .count() as u64;
        let stage_launches = per_bank * if is_mega { steps } else { banked };
        report.steps = steps;
        report.launches = 1 + steps + stage_launches + u64::from(control.bank_regenerations) + u64::from(control.resolved);
        report.regenerations = control.regenerations;
        report.block_steps = counter_64(control.block_steps);
        report.group_steps = counter_64(control.group_steps);
        report.lane_steps = counter_64(control.lane_steps);
        report.items_started = self.items_started(control);
        report.items_killed = counter_64(control.items_killed) + snapshot.total(counters::KILLED);
        report.not_finite = snapshot.total(counters::NOT_FINITE);
        report.storage_clamped = snapshot.total(counters::STORAGE_CLAMPED);
        report.out_of_range = snapshot.total(counters::OUT_OF_RANGE);
        report.passes = control.resolved;
        report.pool_blocks = sizes.pool_blocks;
        report.banks = sizes.banks;
        report.ring = sizes.ring;
        report.state_bytes = sizes.state_bytes();
        report.memory = self.buffers.memory();
        report.submissions = self.submissions;
        report.notes = self.notes.clone();
        for (slot, (gauge, is_called)) in (counters::NAMED..).zip(program.gauges()) {
            let entry = (gauge.name.clone(), snapshot.total(slot));
            match (is_called, gauge.is_assertion) {
                (false, _) => {}
                (true, false) => report.counters.push(entry),
                (true, true) if self.scheduler.instruments.has_assertions() => report.assertions.push(entry),
                (true, true) => {}
            }
        }
        report.elapsed = elapsed;
        report
    }
}
