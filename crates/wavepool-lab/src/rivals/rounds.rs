//! How often rivals take their turns.

use std::time::{Duration, Instant};

/// How many rounds a comparison may take: so many at least, more while there is time, and so many at most.
///
/// # Example
/// ```
/// use std::time::Duration;
/// use wavepool_lab::rivals::Rounds;
/// let patient = Rounds { least: 3, most: 31, budget: Duration::from_secs(20) };
/// assert_eq!((patient.least, Rounds::from(5).most), (3, 5));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rounds {
    /// Rounds that are taken however long they take.
    pub least: usize,
    /// Rounds that are never exceeded.
    pub most: usize,
    /// No round begins that would end later than this, if it took as long as those before.
    pub budget: Duration,
}

impl From<usize> for Rounds {
    /// Exactly so many.
    fn from(rounds: usize) -> Self {
        Rounds { least: rounds, most: rounds, budget: Duration::ZERO }
    }
}

impl Rounds {
    /// True when another round may begin, `done` rounds and `spent` after the first began.
    fn goes_on(&self, done: usize, spent: Duration) -> bool {
        let round = spent / done.max(1) as u32;
        done < self.least || (done < self.most && spent + round <= self.budget)
    }

    /// Gives each of `count` rivals a turn in every round, forwards and backwards by turns.
    ///
    /// # Errors
    /// The first of `turn`.
    pub(super) fn take<E>(&self, count: usize, mut turn: impl FnMut(usize) -> Result<(), E>) -> Result<(), E> {
        let begun = Instant::now();
        let mut done = 0;
        while self.goes_on(done, begun.elapsed()) {
            for place in 0..count {
                turn(if done.is_multiple_of(2) { place } else { count - 1 - place })?;
            }
            done += 1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a budget that cuts into the rounds that must be, one that is ignored, a round begun that cannot end in time.
    #[test]
    fn a_budget_buys_rounds_between_two_bounds() {
        let rounds = Rounds { least: 3, most: 9, budget: Duration::from_secs(10) };
        let told = |seconds: u64| (0..20).take_while(|done| rounds.goes_on(*done, Duration::from_secs(seconds * *done as u64))).count();
        assert_eq!((told(0), told(1), told(2), told(3), told(100)), (9, 9, 5, 3, 3));
        let exact = Rounds::from(4);
        assert!(exact.goes_on(3, Duration::MAX / 2) && !exact.goes_on(4, Duration::ZERO));
    }

    /// Kills: rounds that always favour the same rival.
    #[test]
    fn rounds_go_forwards_and_backwards() {
        let mut order = Vec::new();
        Rounds::from(3)
            .take(3, |index| {
                order.push(index);
                Ok::<_, ()>(())
            })
            .expect("no errors");
        assert_eq!(order, [0, 1, 2, 2, 1, 0, 0, 1, 2]);
        assert_eq!(Rounds::from(3).take(3, |index| if index == 2 { Err(index) } else { Ok(()) }), Err(2));
    }
}
