//! Which of several schedules does the next passes, from what each has taken so far.
//!
//! Key decision: measured, not modelled. Every candidate does one pass to begin with, a real one whose results count; then the fastest goes
//! on, in portions that double. A single pass is a noisy reading: whoever is close to the fastest is measured again now and then, for an
//! eighth of a portion, so that a mistake is mended and costs little meanwhile. The rule of the literature (regenerate only when fewer groups
//! are active than the device holds at once) is what such measurements come to. When passes take more than twice or less than half of what
//! they should, the work has changed: all others are measured again.
//! Source of the rule: Frolov and Galaktionov, *Low overhead path regeneration*, 2016.
//!
//! **Invariant:** a decision depends on the times given and on nothing else; it never changes a result.

use std::fmt::Write as _;

/// Passes of the first portion after all candidates have been measured.
const FIRST_PORTION: u32 = 4;
/// A candidate is close to the fastest when it takes less than this times as long.
const CLOSE: f64 = 1.25;
/// Part of a portion that somebody close does when measured again.
const SECOND_LOOK: u32 = 8;
/// A portion that takes more than this times what was expected, or less than what was expected over this, means that the work has changed.
const DRIFT: f64 = 2.0;

/// Chooses among candidates, numbered from 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Chooser {
    /// Seconds per pass, as far as measured.
    seconds: Vec<Option<f64>>,
    /// Passes done when each was measured last.
    measured_at: Vec<u64>,
    done: u64,
    portion: u32,
    /// Passes of the portion that are done; a run may end within it.
    of_portion: u32,
}

/// What to do next.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Choosing {
    /// Which candidate.
    pub candidate: usize,
    /// How many passes it does before the next question.
    pub passes: u32,
    /// In a sentence.
    pub reason: String,
}

impl Chooser {
    /// Knows nothing about so many candidates.
    pub fn new(candidates: usize) -> Self {
        Chooser { seconds: vec![None; candidates], measured_at: vec![0; candidates], done: 0, portion: FIRST_PORTION, of_portion: 0 }
    }

    /// Seconds that a pass takes under each candidate, as far as measured.
    pub fn seconds(&self) -> &[Option<f64>] {
        &self.seconds
    }

    /// Who does the next of `left` passes; `None` when nothing is left, or there is nobody.
    pub fn next(&self, left: u32) -> Option<Choosing> {
        if left == 0 {
            return None;
        }
        if let Some(candidate) = self.seconds.iter().position(Option::is_none) {
            return Some(Choosing { candidate, passes: 1, reason: "not measured yet".into() });
        }
        let mut ranked: Vec<(f64, usize)> =
            self.seconds.iter().enumerate().filter_map(|(candidate, seconds)| seconds.map(|seconds| (seconds, candidate))).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (seconds, fastest) = *ranked.first()?;
        let is_due = |candidate: usize| self.done - self.measured_at[candidate] >= u64::from(self.portion);
        let close = ranked[1..].iter().take_while(|(other, _)| *other < seconds * CLOSE);
        if let Some((other, candidate)) = close.copied().find(|(_, candidate)| is_due(*candidate)) {
            let (more, passes) = ((other / seconds - 1.0) * 100.0, (self.portion / SECOND_LOOK).clamp(1, left));
            return Some(Choosing { candidate, passes, reason: format!("within {more:.0} % of the fastest: measured again") });
        }
        let mut reason = format!("{:.3} ms a pass", seconds * 1e3);
        if let Some((next, _)) = ranked.get(1) {
            let _ = write!(reason, ", the next best {:.3} ms", next * 1e3);
        }
        Some(Choosing { candidate: fastest, passes: self.portion.min(left), reason })
    }

    /// Learns that `passes` passes of a candidate took so many seconds; says so when the work has changed.
    pub fn learn(&mut self, candidate: usize, passes: u32, seconds: f64) -> Option<String> {
        if passes == 0 || candidate >= self.seconds.len() {
            return None;
        }
        let now = seconds / f64::from(passes);
        self.done += u64::from(passes);
        self.measured_at[candidate] = self.done;
        let before = self.seconds[candidate].replace(now)?;
        if now > before * DRIFT || now < before / DRIFT {
            self.seconds.iter_mut().enumerate().filter(|(other, _)| *other != candidate).for_each(|(_, seconds)| *seconds = None);
            (self.portion, self.of_portion) = (FIRST_PORTION, 0);
            return Some(format!("a pass takes {:.3} ms instead of {:.3} ms: the others are measured again", now * 1e3, before * 1e3));
        }
        // A single reading is noisy; the latest counts for half.
        self.seconds[candidate] = Some((before + now) / 2.0);
        self.of_portion = self.of_portion.saturating_add(passes);
        if self.of_portion >= self.portion {
            (self.portion, self.of_portion) = (self.portion.saturating_mul(2), 0);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs `passes` passes under candidates that take these times, which may change with the pass; returns who did each pass.
    fn who(passes: u32, chooser: &mut Chooser, seconds: impl Fn(usize, u32) -> f64) -> Vec<usize> {
        let mut done = Vec::new();
        while let Some(choice) = chooser.next(passes - done.len() as u32) {
            let from = done.len() as u32;
            let took = (from..from + choice.passes).map(|pass| seconds(choice.candidate, pass)).sum();
            done.extend(vec![choice.candidate; choice.passes as usize]);
            chooser.learn(choice.candidate, choice.passes, took);
        }
        done
    }

    /// Kills: a candidate that is never tried, or tried again without a reason; the slowest chosen; passes lost or done twice.
    #[test]
    fn every_candidate_is_tried_once_and_the_fastest_goes_on() {
        let mut chooser = Chooser::new(3);
        let done = who(100, &mut chooser, |candidate, _| [3.0, 1.0, 2.0][candidate]);
        assert_eq!(done[..3], [0, 1, 2]);
        assert!(done[3..].iter().all(|candidate| *candidate == 1) && done.len() == 100);
        // A second run knows already.
        assert!(who(5, &mut chooser, |candidate, _| [3.0, 1.0, 2.0][candidate]).iter().all(|candidate| *candidate == 1));
    }

    /// Kills: a choice that is never made again; one that is made again on every flutter.
    #[test]
    fn a_change_of_the_work_is_noticed_and_noise_is_not() {
        let mut chooser = Chooser::new(2);
        let done = who(400, &mut chooser, |candidate, pass| if pass < 100 { [1.0, 2.0][candidate] } else { [9.0, 2.0][candidate] });
        assert_eq!(done[50], 0);
        assert_eq!(done[390], 1, "{done:?}");
        let mut chooser = Chooser::new(2);
        let noisy = who(400, &mut chooser, |candidate, pass| [1.0, 1.9][candidate] * (1.0 + 0.3 * f64::from(pass % 3)));
        assert_eq!(noisy.iter().filter(|candidate| **candidate == 1).count(), 1);
    }

    /// Kills: a lucky first reading that is believed for good; a second look that costs more than it can win.
    #[test]
    fn a_mistake_is_mended() {
        let mut chooser = Chooser::new(3);
        let lucky = |candidate: usize, pass: u32| if candidate == 0 && pass == 0 { 0.9 } else { [1.1, 1.0, 3.0][candidate] };
        let done = who(400, &mut chooser, lucky);
        assert!(done[20..].iter().filter(|candidate| **candidate == 1).count() > 300, "{done:?}");
        assert!(done.iter().filter(|candidate| **candidate == 2).count() == 1);
        let took: f64 = (0..).zip(&done).map(|(pass, candidate)| lucky(*candidate, pass)).sum();
        assert!(took < 400.0 * 1.03, "{took}");
        // In many short runs too.
        let mut chooser = Chooser::new(2);
        let short: Vec<usize> = (0..60).flat_map(|_| who(6, &mut chooser, |candidate, _| [1.1, 1.0][candidate])).collect();
        assert!(short.iter().filter(|candidate| **candidate == 0).count() < 20, "{short:?}");
    }

    /// Kills: a panic, or an endless loop, where there is nothing to choose or nothing to do.
    #[test]
    fn nothing_is_no_choice() {
        assert_eq!(Chooser::new(2).next(0), None);
        assert_eq!(Chooser::new(0).next(5), None);
        assert_eq!(Chooser::new(1).learn(7, 1, 1.0), None);
        assert_eq!(who(3, &mut Chooser::new(5), |_, _| 1.0), [0, 1, 2]);
    }
}
