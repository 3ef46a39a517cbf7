//! Two things timed in turns.

use crate::interval::{Interval, bootstrap, median};

/// Seconds of two runs that stood side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Of the first.
    pub first: f64,
    /// Of the second.
    pub second: f64,
}

/// How much longer the first takes than the second: the ratio of medians, with its 95 % interval over the pairs.
pub fn ratio(pairs: &[Pair]) -> Interval {
    bootstrap(pairs, |pairs| {
        let of = |side: fn(&Pair) -> f64| median(&pairs.iter().map(side).collect::<Vec<_>>());
        of(|pair| pair.first) / of(|pair| pair.second).max(f64::MIN_POSITIVE)
    })
}

/// The median over the pairs of how much longer the first takes than the second, with its 95 % interval. Where the speed of the machine
/// wanders from pair to pair, it says more than [`ratio`].
pub fn median_of_ratios(pairs: &[Pair]) -> Interval {
    bootstrap(pairs, |pairs| median(&pairs.iter().map(|pair| pair.first / pair.second.max(f64::MIN_POSITIVE)).collect::<Vec<_>>()))
}

/// Runs both `rounds` times, ABBA, after one of each to warm up. Each returns its own seconds.
///
/// # Errors
/// The first error of either.
pub fn compare<E>(
    rounds: usize,
    mut first: impl FnMut() -> Result<f64, E>,
    mut second: impl FnMut() -> Result<f64, E>,
) -> Result<Vec<Pair>, E> {
    first()?;
    second()?;
    (0..rounds)
        .map(|round| {
            if round % 2 == 0 {
                Ok(Pair { first: first()?, second: second()? })
            } else {
                let second = second()?;
                Ok(Pair { first: first()?, second })
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a ratio upside down; an order that always favours the same side; a warm-up that counts.
    #[test]
    fn turns_alternate_and_the_ratio_is_first_over_second() {
        let order = std::cell::RefCell::new(String::new());
        let run = |name: char, seconds: f64| {
            order.borrow_mut().push(name);
            Ok::<_, ()>(seconds)
        };
        let pairs = compare(3, || run('a', 3.0), || run('b', 2.0)).expect("no errors");
        assert_eq!(*order.borrow(), "ababbaab");
        assert_eq!(ratio(&pairs), Interval { value: 1.5, low: 1.5, high: 1.5 });
        // A machine that became ten times slower between the two runs of a pair, and stayed so.
        let pairs = [(3.0, 2.0), (3.0, 20.0), (30.0, 20.0)].map(|(first, second)| Pair { first, second });
        assert_eq!((median_of_ratios(&pairs).value, ratio(&pairs).value), (1.5, 0.15));
    }
}
