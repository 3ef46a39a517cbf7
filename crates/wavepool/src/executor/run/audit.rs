//! Checked mode: after every step, lanes and results are counted again and compared with what the counters claim.
//!
//! **Invariant:** items begun are those ended by the program, those ended by roulette and those in flight.

use super::{Dispatch, Launched, Run};
use crate::{
    Error, Result,
    control::{counter_64, counters},
    plan::Kernel,
};

impl Run<'_> {
    /// One step in two submissions, with an audit between the stages and the tick.
    pub(super) fn checked_step(&mut self) -> Result<()> {
        if self.is_done() {
            return Ok(());
        }
        let opening = self.opening.clone();
        let steps = self.steps.clone();
        let audit = self.audit.clone();
        let tick = steps.iter().position(|dispatch| matches!(dispatch.launch.kernel, Kernel::Tick | Kernel::Advance)).unwrap_or(0);
        let step = self.recorded + 1;
        let part = |run: &mut Self, list: &[&Dispatch]| -> Result<()> {
            let launched: Vec<Launched> = list.iter().map(|_| Launched { dispatch: 0, step }).collect();
            let submission = run.encode(list, &launched, true)?;
            run.is_open = true;
            run.after_submission(submission, Vec::new(), true);
            run.receive_all()
        };
        if !self.is_open {
            part(self, &opening.iter().collect::<Vec<_>>())?;
        }
        part(self, &steps[..tick].iter().chain(&audit).collect::<Vec<_>>())?;
        self.recorded = step;
        self.verify()?;
        part(self, &steps[tick..].iter().collect::<Vec<_>>())
    }

    /// Items begun are those ended by the program, those ended by roulette and those in flight; results are there for the first two.
    fn verify(&self) -> Result<()> {
        let Some(snapshot) = &self.latest else { return Ok(()) };
        let control = &snapshot.control;
        let audited = |slot: u32| u64::from(snapshot.counters[slot as usize]);
        let is_wavefront = self.scheduler.schedule.execution.is_wavefront();
        let killed = snapshot.total(counters::KILLED) + counter_64(control.items_killed) + audited(counters::AUDIT_KILLED);
        let finished = snapshot.total(counters::FINISHED);
        let alive = audited(counters::AUDIT_ALIVE);
        let resolved = u64::from(control.resolved) * u64::from(self.scheduler.source.items());
        let results = resolved + audited(counters::AUDIT_DONE);
        let started = if is_wavefront { counter_64(control.items_started) } else { results };
        let wrong = |what: String| Err(Error::Conservation(format!("step {}: {what}", self.recorded)));
        match () {
            () if audited(counters::AUDIT_MISMATCH) > 0 => {
                wrong(format!("{} blocks count other lanes than are alive", audited(counters::AUDIT_MISMATCH)))
            }
            () if started != finished + killed + alive => {
                wrong(format!("{started} items begun, but {finished} finished, {killed} killed and {alive} in flight"))
            }
            () if results != finished + killed => wrong(format!("{finished} items finished, {killed} killed, but {results} results")),
            () => Ok(()),
        }
    }
}
