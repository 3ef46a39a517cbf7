//! What a run leaves: the film, and an account of what was done.

use std::time::Duration;

use super::Run;
use crate::{
    Error, Film, Report, Result, Scheduler,
    control::{Control, counter_64, counters},
    executor::{auto::FilmBase, readback, sizes::Sizes},
    plan::Size,
    policy::OrderRule,
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
        Ok((film, self.account(elapsed)?))
    }

    /// The film of what is resolved so far; the run goes on as if nobody had looked.
    ///
    /// # Errors
    /// As [`finish`](Self::finish).
    pub fn film(&mut self) -> Result<Film> {
        self.receive_all()?;
        self.read_film()
    }

    /// The same as [`finish`](Self::finish) without looking at the film, which stays on the device for another run to add to.
    pub(in crate::executor) fn close(mut self) -> Result<(Report, FilmBase)> {
        self.receive_all()?;
        let elapsed = self.begun.elapsed();
        self.check_results()?;
        let film = FilmBase {
            film: self.buffers.film.clone(),
            passes: self.passes_in_film(self.latest.as_ref().map_or(0, |snapshot| snapshot.control.resolved)),
            not_finite: self.not_finite(),
        };
        Ok((self.account(elapsed)?, film))
    }

    fn account(mut self, elapsed: Duration) -> Result<Report> {
        let mut report = self.report(elapsed);
        report.observed = std::mem::take(&mut self.collector).finish();
        let Run { scheduler, buffers, head, .. } = self;
        if scheduler.instruments.lengths {
            let sizes = &buffers.sizes;
            let (from, count) = (sizes.length_place(), u64::from(report.passes) * sizes.places());
            let (device, queue, results) = (&scheduler.device, &scheduler.queue, &buffers.results);
            let words = readback::read_through(&buffers.reader, device, queue, results, from, count, "reading the lengths")?;
            let mut keys = Vec::new();
            if matches!(scheduler.schedule.order.rule(), OrderRule::Estimated(_)) {
                let (from, count) = (from + u64::from(head.passes) * sizes.places(), u64::from(report.passes) * u64::from(head.tiles));
                keys = readback::read_through(&buffers.reader, device, queue, results, from, count, "reading the keys of tiles")?;
            }
            report.observed.lengths = Some(Lengths::new(head.tiles, words, keys));
        }
        scheduler.buffers = Some(buffers);
        Ok(report)
    }

    fn passes_in_film(&self, resolved: u32) -> u32 {
        self.base.as_ref().map_or(0, |base| base.passes) + resolved
    }

    fn not_finite(&self) -> u64 {
        let before = self.base.as_ref().map_or(0, |base| base.not_finite);
        before + self.latest.as_ref().map_or(0, |snapshot| snapshot.total(counters::NOT_FINITE))
    }

    fn check_results(&self) -> Result<()> {
        match self.latest.as_ref().map_or(0, |snapshot| snapshot.total(counters::MISSING)) {
            0 => Ok(()),
            missing => Err(Error::Conservation(format!("{missing} items left no result"))),
        }
    }

    fn read_film(&self) -> Result<Film> {
        self.check_results()?;
        match &self.latest {
            Some(snapshot) => self.gather_film(snapshot.control.resolved),
            None => Ok(self.scheduler.empty_film()),
        }
    }

    /// What the device has of the film, `resolved` samples per pixel by this run.
    pub(in crate::executor) fn gather_film(&self, resolved: u32) -> Result<Film> {
        let base = FilmBase { film: self.buffers.film.clone(), passes: self.passes_in_film(resolved), not_finite: self.not_finite() };
        self.scheduler.gather(&base, &self.buffers.reader)
    }

    /// Without a pool whole passes are counted.
    pub(super) fn items_started(&self, control: &Control) -> u64 {
        if self.scheduler.schedule.execution.is_wavefront() {
            return counter_64(control.items_started);
        }
        u64::from(control.resolved) * u64::from(self.scheduler.source.items())
    }

    fn report(&self, elapsed: Duration) -> Report {
        let Scheduler { plan, schedule, program, .. } = &*self.scheduler;
        let sizes: &Sizes = &self.buffers.sizes;
        let mut report = Report { schedule: schedule.to_string(), ..Report::default() };
        let Some(snapshot) = &self.latest else { return report };
        let control = &snapshot.control;
        let (steps, banked) = (u64::from(control.step), u64::from(control.bank_steps));
        let per_bank = plan
            .step
            .iter()
            .filter(|launch| matches!(launch.size, Size::LiveBlocks | Size::FilledBlocks | Size::PackedLanes | Size::Queues))
            .count() as u64;
        let stage_launches = per_bank * if schedule.execution.is_wavefront() { banked } else { steps };
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

impl Scheduler {
    /// A film that runs have left on the device.
    pub(in crate::executor) fn read_film(&self, base: &FilmBase) -> Result<Film> {
        let reader = readback::reader(&self.device, base.film.size())?;
        self.gather(base, &reader)
    }

    /// A film of no samples.
    pub(in crate::executor) fn empty_film(&self) -> Film {
        Film::gather(&self.program.interface().result, self.source.pixels() as usize, 0, &[], |_| None, 0)
    }

    fn gather(&self, base: &FilmBase, reader: &wgpu::Buffer) -> Result<Film> {
        let Scheduler { device, queue, program, source, .. } = self;
        let (leaves, pixels) = (&program.interface().result, source.pixels() as usize);
        let words = readback::read_through(reader, device, queue, &base.film, 0, base.film.size() / 4, "reading the film")?;
        let pixel_of = |place: usize| source.pixel((place / 256) as u32, (place % 256) as u32);
        let film = Film::gather(leaves, pixels, source.tiles() as usize * 256, &words, pixel_of, base.not_finite);
        let wanted = base.passes;
        // A source may leave out pixels, which then have no sample.
        let mut has_item = vec![source.items() == source.pixels(); pixels];
        if source.items() != source.pixels() {
            for pixel in (0..source.tiles() as usize * 256).filter_map(pixel_of) {
                if let Some(has_item) = has_item.get_mut(pixel as usize) {
                    *has_item = true;
                }
            }
        }
        match film.samples().iter().zip(&has_item).position(|(samples, has_item)| *samples != if *has_item { wanted } else { 0 }) {
            Some(pixel) => Err(Error::Conservation(format!("pixel {pixel} has {} samples, not {wanted}", film.samples()[pixel]))),
            None => Ok(film),
        }
    }
}
