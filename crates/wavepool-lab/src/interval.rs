//! Medians, and intervals by resampling.
//!
//! **Source:** Efron and Tibshirani, *An Introduction to the Bootstrap*, 1993, chapter 13 (percentile intervals).

/// A value with the ends of its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The estimate itself.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// True when `value` lies in the interval.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// The middle one; the mean of the two in the middle when there is none. Zero for nothing.
pub fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        count if count % 2 == 1 => values[count / 2],
        count => (values[count / 2 - 1] + values[count / 2]) / 2.0,
    }
}

/// Resamplings of an interval.
const DRAWS: usize = 2000;

/// The 95 % interval of `statistic` over resampled `items`; the draws are fixed, so that equal data give equal intervals.
pub fn bootstrap<T: Clone>(items: &[T], statistic: impl Fn(&[T]) -> f64) -> Interval {
    let value = statistic(items);
    if items.is_empty() {
        return Interval { value, low: value, high: value };
    }
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut draws: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let sample: Vec<T> = items
                .iter()
                .map(|_| {
                    // xorshift64*, Vigna 2016.
                    state ^= state >> 12;
                    state ^= state << 25;
                    state ^= state >> 27;
                    let word = state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32;
                    items[((word * items.len() as u64) >> 32) as usize].clone()
                })
                .collect();
            statistic(&sample)
        })
        .collect();
    draws.sort_by(f64::total_cmp);
    let at = |share: f64| draws[((DRAWS - 1) as f64 * share).round() as usize];
    Interval { value, low: at(0.025), high: at(0.975) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: an interval that leaves out the value it belongs to, or that does not shrink with more data.
    #[test]
    fn intervals_cover_and_shrink() {
        let values = |count: usize| (0..count).map(|i| ((i * 7919) % 101) as f64).collect::<Vec<_>>();
        let mean = |items: &[f64]| items.iter().sum::<f64>() / items.len() as f64;
        let (few, many) = (bootstrap(&values(20), mean), bootstrap(&values(2000), mean));
        assert!(few.contains(few.value) && many.contains(50.0), "{few:?} {many:?}");
        // The standard deviation is 29.2: 1.96 / sqrt(2000) of it is 1.28.
        assert!((many.high - many.low) / 2.0 < 1.6 && few.high - few.low > many.high - many.low, "{many:?}");
    }

    /// Kills: a median that is the upper of the two in the middle.
    #[test]
    fn medians() {
        assert_eq!((median(&[]), median(&[3.0]), median(&[4.0, 1.0]), median(&[9.0, 1.0, 2.0])), (0.0, 3.0, 2.5, 2.0));
    }
}
