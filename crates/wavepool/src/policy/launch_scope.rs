//! Which blocks a stage is launched over.
//!
//! Key decision: full launches cover the blocks of the current *fill*: the pool's first blocks, up to the last that has held a tile since
//! the pool was empty. Tiles go to the lowest dead blocks, so that the number of these blocks is the largest number of blocks that lived at once.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, whose baseline launches everything until all is dead.
//!
//! **Invariant:** both scopes walk the same lanes in the same steps; a dead block is left after one read.

use super::Choice;

/// The scopes, as `launch=` names them.
pub const LAUNCHES: &[Choice<LaunchScope>] = &[
    Choice { name: "live", about: "stages are launched over the list of live blocks", make: || LaunchScope::LiveBlocks },
    Choice { name: "full", about: "stages are launched over all blocks, dead ones included", make: || LaunchScope::AllBlocks },
];

/// Which blocks a stage is launched over, in every step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LaunchScope {
    /// The list of live blocks that the tick writes.
    #[default]
    LiveBlocks,
    /// All blocks of the current fill, dead ones included, by their own number.
    AllBlocks,
}

impl LaunchScope {
    /// One word, as in `--schedule`.
    pub fn name(self) -> &'static str {
        match self {
            LaunchScope::LiveBlocks => "live",
            LaunchScope::AllBlocks => "full",
        }
    }

    /// Blocks to launch when `live` live and the fill has `filled`.
    pub fn launched(self, live: u32, filled: u32) -> u32 {
        match self {
            LaunchScope::LiveBlocks => live,
            LaunchScope::AllBlocks => filled,
        }
    }

    /// WGSL of the tick that declares `fn wf_launched(live: u32, filled: u32) -> u32`, the same decision.
    pub(crate) fn tick_wgsl(self) -> &'static str {
        match self {
            LaunchScope::LiveBlocks => "fn wf_launched(live: u32, filled: u32) -> u32 { return live; }\n",
            LaunchScope::AllBlocks => "fn wf_launched(live: u32, filled: u32) -> u32 { return filled; }\n",
        }
    }

    /// WGSL at the head of a stage that declares `wf_block` for a work-group, or leaves.
    pub(crate) fn stage_wgsl(self) -> &'static str {
        match self {
            LaunchScope::LiveBlocks => {
                "let wf_slot = wf_bank_live(wf_bank_of.x) + wf_group.x + wf_group.y * WF_MAX_GROUPS;\n    \
                 if (wf_slot >= wf_bank_live(wf_bank_of.x + 1u)) { return; }\n    \
                 let wf_block = wf_live_block(wf_slot);\n    "
            }
            LaunchScope::AllBlocks => {
                "let wf_slot = wf_group.x + wf_group.y * WF_MAX_GROUPS;\n    \
                 let wf_block = wf_bank_of.y + wf_slot;\n    \
                 if (wf_slot >= wf_control.bank_blocks || wf_block >= wf_control.filled_blocks) { return; }\n    "
            }
        }
    }
}
