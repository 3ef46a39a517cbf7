//! When dead blocks receive new tiles.
//!
//! Key decision: the tick asks one yes-or-no question per step; which block gets which tile is never a policy's business, it follows
//! from the order of the blocks. The tick asks only when the queue holds tiles and some block is dead.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, the threshold rule.

use std::fmt::Debug;

/// Decides in which steps dead blocks receive new tiles.
///
/// Must: give the same answer on both faces; use nothing but the arguments. May: answer yes at any time. Unspecified: how many steps pass
/// between two questions. When no block lives nobody is asked: tiles are handed out.
pub trait Regeneration: Debug + Send + Sync {
    /// One word, as in `--schedule`.
    fn name(&self) -> &str;

    /// The name with its settings, as in `--schedule`.
    fn spec(&self) -> String {
        self.name().to_owned()
    }

    /// WGSL that declares `fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool`: blocks that live, blocks that do not, steps
    /// done so far.
    fn wgsl(&self) -> String;

    /// The same decision on the host.
    fn regenerate(&self, live: u32, dead: u32, step: u32) -> bool;
}

/// A new pass begins only when the pool has run empty; live blocks alone are launched meanwhile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NeverRegenerate;

impl Regeneration for NeverRegenerate {
    fn name(&self) -> &str {
        "never"
    }

    fn wgsl(&self) -> String {
        "fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool { return live == 0u; }\n".into()
    }

    fn regenerate(&self, live: u32, _dead: u32, _step: u32) -> bool {
        live == 0
    }
}

/// Block-in-place: dead blocks take the next tiles when enough of them wait, asked every few steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockInPlace {
    threshold_256: u32,
    check_every: u32,
}

impl BlockInPlace {
    /// Regenerates when dead blocks exceed `threshold` times the live ones (0 to 15, rounded to 1/256), asked in every
    /// `check_every`-th step (at least 1). Values beyond these bounds are refused by [`Schedule`](crate::Schedule) parsing and
    /// brought to the nearest bound here.
    pub fn new(threshold: f32, check_every: u32) -> Self {
        let threshold = if threshold.is_finite() { threshold.clamp(0.0, 15.0) } else { 15.0 };
        BlockInPlace { threshold_256: (threshold * 256.0).round() as u32, check_every: check_every.max(1) }
    }

    /// Dead blocks per live block that must wait.
    pub fn threshold(&self) -> f32 {
        self.threshold_256 as f32 / 256.0
    }

    /// Steps between two questions.
    pub fn check_every(&self) -> u32 {
        self.check_every
    }
}

impl Default for BlockInPlace {
    /// Half of the live blocks, every second step: the paper's values.
    fn default() -> Self {
        BlockInPlace::new(0.5, 2)
    }
}

impl Regeneration for BlockInPlace {
    fn name(&self) -> &str {
        "block"
    }

    fn spec(&self) -> String {
        format!("block,threshold={},check_every={}", self.threshold(), self.check_every)
    }

    fn wgsl(&self) -> String {
        format!(
            "fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool {{\n    \
             return live == 0u || (step % {}u == 0u && dead * 256u > live * {}u);\n}}\n",
            self.check_every, self.threshold_256
        )
    }

    fn regenerate(&self, live: u32, dead: u32, step: u32) -> bool {
        live == 0 || (step.is_multiple_of(self.check_every) && dead.wrapping_mul(256) > live.wrapping_mul(self.threshold_256))
    }
}
