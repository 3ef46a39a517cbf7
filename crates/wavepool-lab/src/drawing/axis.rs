//! Axes: from values to places, with ticks at round numbers.
//!
//! Key decision: an axis ends at ticks, so that every place on it lies between two that have a number.
//!
//! **Invariant:** an axis is never empty, and places of finite values are finite.

/// How values become places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AxisScale {
    /// Equal differences are equal distances; begins at zero.
    Linear,
    /// Equal ratios are equal distances; ticks at 1, 2 and 5 times powers of ten.
    Log,
    /// The same with ticks at powers of two.
    Log2,
}

/// A range of values under a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    label: String,
    scale: AxisScale,
    low: f64,
    high: f64,
}

/// Ticks of a linear axis, at most.
const MOST_TICKS: f64 = 6.0;

impl Axis {
    /// An axis that covers `values`; those that have no place on it (not finite, or not positive where ratios count) are passed over.
    pub fn covering(label: &str, scale: AxisScale, values: impl IntoIterator<Item = f64>) -> Self {
        let has_place = |value: &f64| value.is_finite() && (scale == AxisScale::Linear || *value >= f64::MIN_POSITIVE);
        let (low, high) =
            values.into_iter().filter(has_place).fold((f64::MAX, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if low > high { (1.0, 1.0) } else { (low, high) };
        let (low, high) = match scale {
            AxisScale::Linear => (0.0, if high > 0.0 { (high / step(high)).ceil() * step(high) } else { 1.0 }),
            _ => {
                let (low, high) = (rung(scale, low, false), rung(scale, high, true));
                if low < high { (low, high) } else { (rung(scale, low * 0.99, false), rung(scale, high * 1.01, true)) }
            }
        };
        Axis { label: label.to_owned(), scale, low, high }
    }

    /// Its name, with the unit.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Where a value lies, 0 at the lower end and 1 at the upper; `None` where it has no place.
    pub fn place(&self, value: f64) -> Option<f64> {
        let share = match self.scale {
            AxisScale::Linear => (value - self.low) / (self.high - self.low),
            _ => (value / self.low).log2() / (self.high / self.low).log2(),
        };
        Some(share).filter(|share| share.is_finite())
    }

    /// Values with a line of their own, and what is written there.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        match self.scale {
            AxisScale::Linear => {
                let step = step(self.high);
                let decimals = decimals(step);
                (0..=(self.high / step).round() as u32)
                    .map(|index| f64::from(index) * step)
                    .map(|tick| (tick, format!("{tick:.decimals$}")))
                    .collect()
            }
            scale => {
                let (first, last) = (index_of(scale, self.low).round() as i32, index_of(scale, self.high).round() as i32);
                // Powers of ten alone where there are many of them.
                let is_wide = scale == AxisScale::Log && last - first > 9;
                let chosen = (first..=last).filter(|index| !is_wide || index.rem_euclid(3) == 0);
                let written = |index: i32| {
                    let tick = value_at(scale, index);
                    // A power of two below 1 has as many digits as it has halvings.
                    let digits = if scale == AxisScale::Log2 { (-index).clamp(0, 12) as usize } else { decimals(tick) };
                    (tick, format!("{tick:.digits$}"))
                };
                chosen.map(written).collect()
            }
        }
    }
}

/// A round distance that divides `0..=high` into few parts.
fn step(high: f64) -> f64 {
    let least = high / MOST_TICKS;
    let power = 10_f64.powi(least.log10().floor().clamp(-300.0, 300.0) as i32);
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(power * 10.0)
}

/// Digits behind the point that a round number needs.
fn decimals(round: f64) -> usize {
    if round > 0.0 { (-(round * (1.0 + 1e-9)).log10().floor()).clamp(0.0, 12.0) as usize } else { 0 }
}

/// The ladder of ticks: rung `index` of it. Of [`AxisScale::Log`] every third is a power of ten.
fn value_at(scale: AxisScale, index: i32) -> f64 {
    match scale {
        AxisScale::Log2 => 2_f64.powi(index),
        _ => [1.0, 2.0, 5.0][index.rem_euclid(3) as usize] * 10_f64.powi(index.div_euclid(3)),
    }
}

/// The rung at or below a value, with a part of one where the value lies between.
fn index_of(scale: AxisScale, value: f64) -> f64 {
    match scale {
        AxisScale::Log2 => value.log2(),
        _ => {
            let power = (value.log10() + 1e-9).floor();
            let rest = value / 10_f64.powf(power);
            let whole = [1.0, 2.0, 5.0].iter().filter(|factor| rest >= **factor * (1.0 - 1e-9)).count().max(1) - 1;
            let is_between = rest > [1.0, 2.0, 5.0][whole] * (1.0 + 1e-9);
            power * 3.0 + whole as f64 + if is_between { 0.5 } else { 0.0 }
        }
    }
}

/// The nearest tick at or beyond a value.
fn rung(scale: AxisScale, value: f64, is_above: bool) -> f64 {
    let index = index_of(scale, value);
    value_at(scale, if is_above { (index - 1e-9).ceil() } else { (index + 1e-9).floor() } as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().map(|(_, words)| words).collect()
    }

    /// Kills: an axis that does not reach its values, ticks at other numbers than they say, digits too few or too many.
    #[test]
    fn ticks_are_round_and_cover_the_values() {
        let log = |values: &[f64]| written(&Axis::covering("", AxisScale::Log, values.iter().copied()));
        assert_eq!(log(&[0.06, 3.1]), ["0.05", "0.1", "0.2", "0.5", "1", "2", "5"]);
        assert_eq!(log(&[1.0, 10.0]), ["1", "2", "5", "10"]);
        assert_eq!(log(&[0.0002, 90.0]), ["0.001", "0.01", "0.1", "1", "10", "100"]);
        assert_eq!(log(&[3.0]), ["2", "5"]);
        assert_eq!(log(&[1000.0]), ["500", "1000", "2000"]);
        let log2 = |values: &[f64]| written(&Axis::covering("", AxisScale::Log2, values.iter().copied()));
        assert_eq!(log2(&[2.0, 20.0, 128.0]), ["2", "4", "8", "16", "32", "64", "128"]);
        assert_eq!(log2(&[0.3, 1.0]), ["0.25", "0.5", "1"]);
        let linear = |high: f64| written(&Axis::covering("", AxisScale::Linear, [0.1 * high, high]));
        assert_eq!(linear(100.0), ["0", "20", "40", "60", "80", "100"]);
        assert_eq!(linear(0.9), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(linear(7.0), ["0", "2", "4", "6", "8"]);
    }

    /// Kills: a place outside of the axis, an axis upside down, distances that are not those of the scale; NaN for no values, equal values,
    /// or values that have no logarithm.
    #[test]
    fn values_have_places() {
        let axis = Axis::covering("depth", AxisScale::Log2, [2.0, 128.0]);
        assert_eq!((axis.place(2.0), axis.place(16.0), axis.place(128.0)), (Some(0.0), Some(0.5), Some(1.0)));
        assert_eq!([axis.place(0.0), axis.place(-1.0), axis.place(f64::NAN), axis.place(f64::INFINITY)], [None; 4]);
        let axis = Axis::covering("", AxisScale::Linear, [30.0, 80.0]);
        assert_eq!((axis.place(0.0), axis.place(40.0), axis.place(80.0)), (Some(0.0), Some(0.5), Some(1.0)));
        for scale in [AxisScale::Linear, AxisScale::Log, AxisScale::Log2] {
            for values in [&[][..], &[0.0], &[f64::NAN, -1.0], &[4.0, 4.0], &[1e-12, 1e12], &[f64::INFINITY, 3.0], &[1.0]] {
                let axis = Axis::covering("", scale, values.iter().copied());
                let ticks = axis.ticks();
                assert!(ticks.len() >= 2 && ticks.len() < 90, "{scale:?} {values:?}: {ticks:?}");
                assert!(ticks.iter().all(|(tick, words)| axis.place(*tick).is_some() && !words.contains("NaN")), "{scale:?} {values:?}");
                for value in values.iter().filter(|value| value.is_finite() && **value > 0.0) {
                    assert!(axis.place(*value).is_some_and(|place| (-1e-9..=1.0 + 1e-9).contains(&place)), "{scale:?} {values:?}: {value}");
                }
            }
        }
    }
}
