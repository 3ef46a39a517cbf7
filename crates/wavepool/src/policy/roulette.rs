//! How hopeless walks end.
//!
//! Key decision: the program says what a lane's chance of survival should be (`survival`) and how a survivor is compensated
//! (`reweight`); the policy draws, and says for whom. A lane's draw is keyed by (pixel, sample, step of the walk), a block's by (tile,
//! sample, step), neither by lane or launch. Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, which kills whole
//! blocks and gives no formula.

use std::{fmt::Debug, sync::Arc};

use super::Choice;
use crate::{Error, Result, layout::BLOCK};

/// Who shares a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RouletteScope {
    /// Nobody.
    Lane,
    /// All lanes of a block: it dies as a whole, one step after the draw. What their chances are condensed to.
    Block(Statistic),
    /// Lanes that stand side by side, so many of them: a power of two from 2 to 256. They draw with the largest of their chances, and die
    /// together, one step after the draw.
    Group(u32),
}

impl RouletteScope {
    /// True when lanes share a draw: they are killed at the beginning of the step behind it.
    pub fn is_shared(self) -> bool {
        !matches!(self, RouletteScope::Lane)
    }

    /// Words of counters that a block needs for its groups: for each the chances of this step, of the one before and of the next.
    pub(crate) fn words_per_block(self) -> u32 {
        match self {
            RouletteScope::Group(lanes) => 3 * (BLOCK / lanes),
            _ => 0,
        }
    }
}

/// How the chances of a block's live lanes become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Statistic {
    /// The largest: no survivor is weighted by more than its own chance would have.
    Max,
    /// The mean, in 65536ths: kills more, and lets bright lanes grow.
    Mean,
}

/// Decides which walks survive a step.
///
/// Must: return 0 with probability `1 - p` and `1 / p` otherwise, over uniform draws; give the same answer on both faces. The expected
/// value of the answer is then 1, which is what keeps the estimate unbiased.
pub trait Roulette: Debug + Send + Sync {
    /// One word, as in `--schedule`.
    fn name(&self) -> &str;

    /// Who shares a draw.
    fn scope(&self) -> RouletteScope {
        RouletteScope::Lane
    }

    /// WGSL that declares `fn wf_inverse_survival(p: f32, draw: u32) -> f32`: 0 ends the walk, anything else is handed to `reweight`
    /// unless it is 1.
    fn wgsl(&self) -> String;

    /// The same decision on the host.
    fn inverse_survival(&self, p: f32, draw: u32) -> f32;
}

/// The library's roulettes, as `roulette=` names them; they need a program that declares `survival`.
pub const ROULETTES: &[Choice<Option<Arc<dyn Roulette>>>] = &[
    Choice { name: "none", about: "walks end by themselves", make: || None },
    Choice { name: "lane", about: "every lane draws for itself", make: || Some(Arc::new(PerLane)) },
    Choice {
        name: "group:32",
        about: "32 lanes side by side draw once, with the largest of their chances; any power of two from 2 to 256",
        make: || PerGroup::named("group:32").map(|group| Arc::new(group) as Arc<dyn Roulette>),
    },
    Choice {
        name: "block-max",
        about: "a block draws once, with the largest chance of its lanes: no survivor weighs more than it would alone",
        make: || Some(Arc::new(PerBlock(Statistic::Max))),
    },
    Choice {
        name: "block-mean",
        about: "a block draws once, with the mean chance of its lanes: kills more, bright lanes may grow",
        make: || Some(Arc::new(PerBlock(Statistic::Mean))),
    },
];

/// Every lane draws for itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PerLane;

impl Roulette for PerLane {
    fn name(&self) -> &str {
        "lane"
    }

    fn wgsl(&self) -> String {
        SURVIVE.into()
    }

    fn inverse_survival(&self, p: f32, draw: u32) -> f32 {
        survive(p, draw)
    }
}

/// All lanes of a block share a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PerBlock(pub Statistic);

impl Roulette for PerBlock {
    fn name(&self) -> &str {
        match self.0 {
            Statistic::Max => "block-max",
            Statistic::Mean => "block-mean",
        }
    }

    fn scope(&self) -> RouletteScope {
        RouletteScope::Block(self.0)
    }

    fn wgsl(&self) -> String {
        SURVIVE.into()
    }

    fn inverse_survival(&self, p: f32, draw: u32) -> f32 {
        survive(p, draw)
    }
}

/// Groups of lanes that stand side by side share a draw: roulette per warp, without asking how wide the device's are.
/// Source: Novak, Havran and Dachsbacher, *Path regeneration for interactive path tracing*, 2010.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PerGroup {
    lanes: u32,
    name: &'static str,
}

impl PerGroup {
    const SIZES: [PerGroup; 8] = [
        PerGroup { lanes: 2, name: "group:2" },
        PerGroup { lanes: 4, name: "group:4" },
        PerGroup { lanes: 8, name: "group:8" },
        PerGroup { lanes: 16, name: "group:16" },
        PerGroup { lanes: 32, name: "group:32" },
        PerGroup { lanes: 64, name: "group:64" },
        PerGroup { lanes: 128, name: "group:128" },
        PerGroup { lanes: 256, name: "group:256" },
    ];

    /// Groups of so many lanes: a power of two from 2 to 256.
    ///
    /// # Errors
    /// [`Error::Schedule`] for any other number.
    pub fn new(lanes: u32) -> Result<Self> {
        let found = PerGroup::SIZES.into_iter().find(|group| group.lanes == lanes);
        found.ok_or_else(|| Error::Schedule(format!("a group of {lanes} lanes: allowed is a power of two from 2 to 256")))
    }

    /// The roulette that `roulette=` names, `group:32` for example.
    pub fn named(name: &str) -> Option<Self> {
        PerGroup::SIZES.into_iter().find(|group| group.name == name)
    }

    /// Lanes of a group.
    pub fn lanes(&self) -> u32 {
        self.lanes
    }
}

impl Roulette for PerGroup {
    fn name(&self) -> &str {
        self.name
    }

    fn scope(&self) -> RouletteScope {
        RouletteScope::Group(self.lanes)
    }

    fn wgsl(&self) -> String {
        SURVIVE.into()
    }

    fn inverse_survival(&self, p: f32, draw: u32) -> f32 {
        survive(p, draw)
    }
}

const SURVIVE: &str = "fn wf_inverse_survival(p: f32, draw: u32) -> f32 {
    if (p >= 1.0) { return 1.0; }
    if (f32(draw >> 8u) * 5.9604644775390625e-8 < p) { return 1.0 / p; }
    return 0.0;
}
";

fn survive(p: f32, draw: u32) -> f32 {
    if p >= 1.0 {
        1.0
    } else if (draw >> 8) as f32 * (1.0 / 16_777_216.0) < p {
        1.0 / p
    } else {
        0.0
    }
}
