//! Which stages pack the live lanes of a work-group to its front while they run.
//!
//! Key decision: nothing is moved but numbers. The first invocations of a work-group take the live lanes of its block, through work-group
//! memory, and read and write the state where it lies; lanes know their item by their place in the block, so no bit depends on it. What is
//! given up: two more barriers in such a stage, and loads that may leave gaps.
//! Sources: Wald, *Active thread compaction for GPU path tracing*, 2011; Frolov and Galaktionov, *Low overhead path regeneration*, 2016, who
//! do so in stages that trace rays alone.

use std::fmt;

/// The stages that do so.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LaneCompaction {
    /// None of them.
    #[default]
    None,
    /// All of them.
    All,
    /// Those of these names; a name that is no stage is an error.
    Stages(Vec<String>),
}

impl LaneCompaction {
    /// `none`, `all`, or names of stages with `+` between them; `None` where a name is empty.
    pub fn named(text: &str) -> Option<Self> {
        match text {
            "none" => Some(LaneCompaction::None),
            "all" => Some(LaneCompaction::All),
            names => {
                let names: Vec<String> = names.split('+').map(|name| name.trim().to_owned()).collect();
                names.iter().all(|name| !name.is_empty()).then_some(LaneCompaction::Stages(names))
            }
        }
    }

    /// True when a stage packs its lanes.
    pub fn packs(&self, stage: &str) -> bool {
        match self {
            LaneCompaction::None => false,
            LaneCompaction::All => true,
            LaneCompaction::Stages(names) => names.iter().any(|name| name == stage),
        }
    }
}

impl fmt::Display for LaneCompaction {
    /// As [`named`](Self::named) reads it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LaneCompaction::None => f.write_str("none"),
            LaneCompaction::All => f.write_str("all"),
            LaneCompaction::Stages(names) => f.write_str(&names.join("+")),
        }
    }
}
