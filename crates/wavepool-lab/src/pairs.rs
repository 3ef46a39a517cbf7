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
    }
}
