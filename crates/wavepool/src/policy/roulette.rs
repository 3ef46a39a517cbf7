//! How hopeless walks end.
//!
//! Key decision: the program says what a lane's chance of survival should be (`survival`) and how a survivor is compensated
//! (`reweight`); the policy only draws. The draw is keyed by (pixel, sample, step of the walk), never by lane or launch.

use std::fmt::Debug;

/// Decides which walks survive a step.
///
/// Must: return 0 with probability `1 - p` and `1 / p` otherwise, over uniform draws; give the same answer on both faces. The expected
/// value of the answer is then 1, which is what keeps the estimate unbiased.
pub trait Roulette: Debug + Send + Sync {
    /// One word, as in `--schedule`.
    fn name(&self) -> &str;

    /// WGSL that declares `fn wf_inverse_survival(p: f32, draw: u32) -> f32`: 0 ends the walk, anything else is handed to `reweight`
    /// unless it is 1.
    fn wgsl(&self) -> String;

    /// The same decision on the host.
    fn inverse_survival(&self, p: f32, draw: u32) -> f32;
}

/// Every lane draws for itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PerLane;

impl Roulette for PerLane {
    fn name(&self) -> &str {
        "lane"
    }

    fn wgsl(&self) -> String {
        "fn wf_inverse_survival(p: f32, draw: u32) -> f32 {\n    \
         if (p >= 1.0) { return 1.0; }\n    \
         if (f32(draw >> 8u) * 5.9604644775390625e-8 < p) { return 1.0 / p; }\n    \
         return 0.0;\n}\n"
            .into()
    }

    fn inverse_survival(&self, p: f32, draw: u32) -> f32 {
        if p >= 1.0 {
            1.0
        } else if (draw >> 8) as f32 * (1.0 / 16_777_216.0) < p {
            1.0 / p
        } else {
            0.0
        }
    }
}
