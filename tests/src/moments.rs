//! Mean and variance of a sample against a law that is known in closed form.
//!
//! Key decision: a check returns its verdict instead of asserting it, so that a test can also assert that a planted fault is rejected by
//! the very function that passes the sound program.

/// Two-sided normal quantile: a sound sample is rejected once in a million.
pub const FALSE_ALARM: f64 = 4.9;

/// What is known of a random variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Its mean.
    pub mean: f64,
    /// Its variance.
    pub variance: f64,
    /// Its fourth central moment.
    pub fourth: f64,
}

/// What was seen of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Independent draws.
    pub draws: f64,
    /// Their mean.
    pub mean: f64,
    /// Their variance.
    pub variance: f64,
}

impl Sample {
    /// From the draws themselves.
    pub fn of(draws: &[f64]) -> Self {
        let count = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / count;
        Sample { draws: count, mean, variance: draws.iter().map(|draw| (draw - mean).powi(2)).sum::<f64>() / (count - 1.0) }
    }

    /// From sums of the draws and of their squares.
    pub fn of_sums(draws: f64, sum: f64, squares: f64) -> Self {
        let mean = sum / draws;
        Sample { draws, mean, variance: (squares / draws - mean * mean) * draws / (draws - 1.0) }
    }
}

impl Law {
    /// A walk that sees 1 at every step, keeps `rho` of it, and survives each step with probability `p`, reweighted by `1 / p`:
    /// X = 1 + B rho/p X', B a coin of chance p. The moments follow from those below them; the variance is
    /// (1 + rho) / ((1 - rho)(1 - rho^2/p)) - 1/(1 - rho)^2. The k-th moment exists for rho^k < p^(k-1).
    pub fn of_enclosure(rho: f64, p: f64) -> Self {
        let decay = |k: i32| rho.powi(k) * p.powi(1 - k);
        let m1 = 1.0 / (1.0 - rho);
        let m2 = (1.0 + 2.0 * decay(1) * m1) / (1.0 - decay(2));
        let m3 = (1.0 + 3.0 * decay(1) * m1 + 3.0 * decay(2) * m2) / (1.0 - decay(3));
        let m4 = (1.0 + 4.0 * decay(1) * m1 + 6.0 * decay(2) * m2 + 4.0 * decay(3) * m3) / (1.0 - decay(4));
        let fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1 * m1 * m2 - 3.0 * m1.powi(4);
        Law { mean: m1, variance: m2 - m1 * m1, fourth }
    }

    /// Standard error of the variance of so many draws.
    fn variance_error(&self, draws: f64) -> f64 {
        ((self.fourth - self.variance.powi(2)) / draws).sqrt()
    }

    /// Is the mean of the sample that of the law? Judged by the sample's own spread, so that a wrong variance is no business of this
    /// check.
    ///
    /// # Errors
    /// Both means and z.
    pub fn check_mean(&self, sample: &Sample) -> Result<f64, String> {
        let z = (sample.mean - self.mean) / (sample.variance / sample.draws).sqrt();
        verdict("mean", sample.mean, self.mean, z)
    }

    /// Is the variance of the sample that of the law?
    ///
    /// # Errors
    /// Both variances and z.
    pub fn check_variance(&self, sample: &Sample) -> Result<f64, String> {
        verdict("variance", sample.variance, self.variance, (sample.variance - self.variance) / self.variance_error(sample.draws))
    }
}

fn verdict(what: &str, seen: f64, expected: f64, z: f64) -> Result<f64, String> {
    if z.abs() < FALSE_ALARM { Ok(z) } else { Err(format!("{what} {seen:.4}, expected {expected:.4}: z = {z:.1}")) }
}

/// Correlation of two lanes of a block, from the lanes of many blocks: the analysis of variance of Fisher, 1925. Identical lanes give 1,
/// independent ones 0 in the mean.
pub fn intraclass_correlation(blocks: &[Vec<f64>]) -> f64 {
    let lanes = blocks[0].len() as f64;
    let of_blocks: Vec<Sample> = blocks.iter().map(|block| Sample::of(block)).collect();
    let between = lanes * Sample::of(&of_blocks.iter().map(|block| block.mean).collect::<Vec<_>>()).variance;
    let within = of_blocks.iter().map(|block| block.variance).sum::<f64>() / blocks.len() as f64;
    (between - within) / (between + (lanes - 1.0) * within)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a moment with a wrong binomial; a mean or a fourth moment that is not central.
    #[test]
    fn the_moments_are_those_of_the_closed_form() {
        for (rho, p) in [(0.8, 0.85), (0.8, 0.9), (0.5, 0.9)] {
            let law = Law::of_enclosure(rho, p);
            let variance = (1.0 + rho) / ((1.0 - rho) * (1.0 - rho * rho / p)) - 1.0 / (1.0_f64 - rho).powi(2);
            assert!((law.variance / variance - 1.0).abs() < 1e-12);
            // The walk of n steps has the chance p^(n-1) (1-p) and sums a geometric series.
            let series = |power: i32| {
                let q: f64 = rho / p;
                let walk = |steps: i32| (1.0 - q.powi(steps)) / (1.0 - q) - law.mean;
                (1..2000).map(|steps| p.powi(steps - 1) * (1.0 - p) * walk(steps).powi(power)).sum::<f64>()
            };
            assert!(series(1).abs() < 1e-9 && (series(2) / law.variance - 1.0).abs() < 1e-9);
            assert!((series(4) / law.fourth - 1.0).abs() < 1e-9, "{} {}", series(4), law.fourth);
        }
    }

    /// Kills: a variance within blocks that counts the block's mean as zero; between and within exchanged.
    #[test]
    fn identical_lanes_correlate_fully() {
        let same: Vec<_> = (0..50).map(|block| vec![f64::from(block * block % 7); 8]).collect();
        assert!((intraclass_correlation(&same) - 1.0).abs() < 1e-12);
        let alike: Vec<_> = (0..50).map(|_| (0..8).map(f64::from).collect()).collect();
        assert!((intraclass_correlation(&alike) + 1.0 / 7.0).abs() < 1e-12, "lanes that differ in the same way in every block");
    }
}
