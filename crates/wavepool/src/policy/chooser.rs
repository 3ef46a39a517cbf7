//! Which of several schedules does the next passes, from what each has taken so far.
//!
//! Key decision: measured, not modelled. Every candidate does one pass to begin with, a real one whose results count; then the fastest goes
//! on, in portions that double. Readings are noisy, and noise adds time: a lower reading is believed at once, a higher one for a small part.
//! Whoever is close is measured a second time at once. Later everybody else is, between portions, who has earned it: all others together may
//! cost a fiftieth of the passes that are done, so those far behind wait longer. A mistake is mended, in whichever direction, and costs little meanwhile. After a change of mind portions
//! are short again. The rule of the literature (regenerate only when fewer groups are active than the device holds at once) is what such
//! measurements come to. When passes take more than twice or less than half of what they should, the work has changed: all others are
//! measured again.
//! Source of the rule: Frolov and Galaktionov, *Low overhead path regeneration*, 2016.
//!
//! **Invariant:** a decision depends on the times given and on nothing else; it never changes a result.

use std::fmt::Write as _;

/// Passes of the first portion after all candidates have been measured.
const FIRST_PORTION: u32 = 4;
/// Whoever has been measured once and takes less than this times as long as the fastest is measured again at once, in more passes the closer it
/// is: at most as many as the first portion has.
const CLOSE: f64 = 2.0;
/// What measuring all others again may cost, as a part of what is done.
const LOOK_COST: f64 = 0.02;
/// And the most passes that one of them takes, as a part of those done since its last time.
const LONGEST_LOOK: f64 = 0.1;
/// How much a reading counts that is higher than what is known: the second one, and every later one.
const DOUBT: [f64; 2] = [0.5, 0.1];
/// A portion that takes more than this times what was expected, or less than what was expected over this, means that the work has changed.
const DRIFT: f64 = 2.0;

/// Chooses among candidates, numbered from 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Chooser {
    /// Seconds per pass, as far as measured.
    seconds: Vec<Option<f64>>,
    /// Passes done when each was measured last.
    measured_at: Vec<u64>,
    /// How often each has been measured.
    looks: Vec<u32>,
    done: u64,
    portion: u32,
    /// Passes of the portion that the fastest has done; a run may end within it.
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
        let (seconds, measured_at, looks) = (vec![None; candidates], vec![0; candidates], vec![0; candidates]);
        Chooser { seconds, measured_at, looks, done: 0, portion: FIRST_PORTION, of_portion: 0 }
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
        let look = |(other, candidate): (f64, usize)| {
            let passes = self.passes_of_a_look(candidate, other / seconds)?;
            let reason = format!("{:.0} % behind the fastest: measured again", (other / seconds - 1.0) * 100.0);
            Some(Choosing { candidate, passes: passes.min(left), reason })
        };
        if let Some(choice) = ranked[1..].iter().copied().find_map(look) {
            return Some(choice);
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
        self.looks[candidate] = self.looks[candidate].saturating_add(1);
        let fastest = self.fastest();
        let before = self.seconds[candidate].replace(now)?;
        if now > before * DRIFT || now < before / DRIFT {
            let others = |other: &usize| *other != candidate;
            (0..self.seconds.len()).filter(others).for_each(|other| (self.seconds[other], self.looks[other]) = (None, 0));
            (self.portion, self.of_portion) = (FIRST_PORTION, 0);
            return Some(format!("a pass takes {:.3} ms instead of {:.3} ms: the others are measured again", now * 1e3, before * 1e3));
        }
        let weight = if self.looks[candidate] == 2 { DOUBT[0] } else { DOUBT[1] };
        self.seconds[candidate] = Some(if now < before { now } else { before + (now - before) * weight });
        if self.fastest() != fastest {
            (self.portion, self.of_portion) = (FIRST_PORTION, 0);
            return None;
        }
        if Some(candidate) != fastest {
            return None;
        }
        self.of_portion = self.of_portion.saturating_add(passes);
        if self.of_portion >= self.portion {
            (self.portion, self.of_portion) = (self.portion.saturating_mul(2), 0);
        }
        None
    }

    /// For how many passes somebody is measured again who takes `ratio` times as long as the fastest; `None` when it is not the time for it.
    fn passes_of_a_look(&self, candidate: usize, ratio: f64) -> Option<u32> {
        // Whoever waits starts and ends within a look, the fastest seldom does: the closer they are, the longer they must run to be told apart.
        let fewest = (1.0 / (ratio - 1.0)).clamp(1.0, f64::from(FIRST_PORTION));
        if self.looks[candidate] < 2 && ratio < CLOSE {
            return Some(fewest as u32);
        }
        let earned = LOOK_COST / (self.seconds.len() - 1).max(1) as f64;
        let since = (self.done - self.measured_at[candidate]) as f64;
        let passes = (earned * since / (ratio - 1.0)).min(LONGEST_LOOK * since);
        (self.of_portion == 0 && passes >= 1.0).then_some(passes as u32)
    }

    /// The first of the fastest, when all have been measured.
    fn fastest(&self) -> Option<usize> {
        let known: Option<Vec<f64>> = self.seconds.iter().copied().collect();
        known?.into_iter().enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(candidate, _)| candidate)
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
        let slower: Vec<usize> = (0..noisy.len()).filter(|pass| noisy[*pass] == 1).collect();
        // The first two looks, and three more, for which a fiftieth pays; never a portion.
        assert_eq!(slower.len(), 5, "{slower:?}");
        assert!(slower[2..].windows(3).all(|looks| looks[2] - looks[0] > 2), "{slower:?}");
    }

    /// Kills: a lucky first reading that is believed for good; a second look that costs more than it can win.
    #[test]
    fn a_mistake_is_mended() {
        let mut chooser = Chooser::new(3);
        let lucky = |candidate: usize, pass: u32| if candidate == 0 && pass == 0 { 0.9 } else { [1.1, 1.0, 3.0][candidate] };
        let done = who(400, &mut chooser, lucky);
        assert!(done[20..].iter().filter(|candidate| **candidate == 1).count() > 300, "{done:?}");
        assert!(done.iter().filter(|candidate| **candidate == 2).count() <= 3, "{done:?}");
        let took: f64 = (0..).zip(&done).map(|(pass, candidate)| lucky(*candidate, pass)).sum();
        assert!(took < 400.0 * 1.03, "{took}");
        // In many short runs too.
        let mut chooser = Chooser::new(2);
        let short: Vec<usize> = (0..60).flat_map(|_| who(6, &mut chooser, |candidate, _| [1.1, 1.0][candidate])).collect();
        // Together they cost 2.2 passes of 360.
        assert_eq!(short.iter().filter(|candidate| **candidate == 0).count(), 22, "{short:?}");
    }

    /// Kills: looks that cost more than their share, a share for each of the others instead of one for all.
    #[test]
    fn looking_again_costs_a_fiftieth() {
        let seconds = [1.0, 1.02, 1.3, 2.5, 4.0];
        let done = who(20_000, &mut Chooser::new(5), |candidate, _| seconds[candidate]);
        let cost: f64 = done.iter().map(|candidate| seconds[*candidate] - 1.0).sum();
        assert!(cost < 0.02 * 20_000.0, "{cost}");
        assert!((1..5).all(|other| done.iter().filter(|candidate| **candidate == other).count() > 2), "somebody is never looked at again");
    }

    /// Kills: the fastest given up for good after one reading while the machine was busy, whether that is its first one, a short one, or one of a long
    /// portion; a slower one kept because it is not close enough to be looked at again.
    #[test]
    fn bad_luck_is_mended_in_short_runs() {
        // Of a whole first run there is nothing to compare with for a while.
        for (unlucky_run, factor, bound) in [(0, 1.9, 1.04), (1, 1.7, 1.03), (9, 1.7, 1.03), (30, 1.9, 1.03)] {
            let (mut chooser, mut took, mut done) = (Chooser::new(3), 0.0, Vec::new());
            for run in 0..100 {
                let busy = |candidate: usize| if run == unlucky_run && candidate == 1 { factor } else { 1.0 };
                let seconds = |candidate: usize, _: u32| [1.2, 1.0, 3.0][candidate] * busy(candidate);
                let portion = who(6, &mut chooser, seconds);
                took += portion.iter().map(|candidate| [1.2, 1.0, 3.0][*candidate]).sum::<f64>();
                done.extend(portion);
            }
            assert!(took < 600.0 * bound, "busy in run {unlucky_run}: {took}, {done:?}");
        }
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
