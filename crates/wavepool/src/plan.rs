//! The schedule as data: which kernels a step launches, in which order, and who says how many groups.
//!
//! **Invariant:** a plan holds no device object; printing it is a complete description of what the executor records.

use std::fmt;

use crate::policy::{Execution, Grain, LaunchScope};

/// Who knows the number of work-groups.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Size {
    /// Fixed.
    Groups(u32),
    /// Blocks that start a tile in this step, or whose lanes start items or are listed anew, as the tick has written.
    NewBlocks,
    /// Live blocks, as the tick has written.
    LiveBlocks,
    /// Blocks of the current fill, dead or alive, as the tick has written.
    FilledBlocks,
    /// Lists of lanes, as the tick has written.
    PackedLanes,
    /// One where there are lanes, as the tick has written.
    Queues,
    /// All tiles when a pass is complete, else none.
    FinishedTiles,
    /// All tiles, or all blocks of a bank.
    All,
}

/// What a dispatch runs.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kernel {
    /// Starts tiles in newly assigned blocks.
    Generate,
    /// One stage of the program.
    Stage(String),
    /// Lays out the queues of a bank by key.
    Queues,
    /// Lists the lanes of a bank by key.
    Enqueue,
    /// All stages in a loop, a tile per work-group.
    Megakernel,
    /// All stages in a loop, in work-groups that take tile after tile.
    Persistent,
    /// All stages in a loop, in which lanes take item after item.
    MegakernelRegen,
    /// Decides what runs next.
    Tick,
    /// The tick of whole walks in one kernel.
    Advance,
    /// Adds a finished pass to the film.
    Resolve,
    /// Checked mode: counts the live lanes of a bank again.
    AuditLanes,
    /// Checked mode: counts the results of unresolved passes again.
    AuditResults,
}

impl Kernel {
    /// True for kernels that see one bank at a time: they are launched once for each.
    pub fn is_per_bank(&self) -> bool {
        matches!(self, Kernel::Generate | Kernel::Stage(_) | Kernel::Queues | Kernel::Enqueue | Kernel::AuditLanes)
    }

    /// The entry point in the generated WGSL.
    pub fn entry_point(&self) -> String {
        match self {
            Kernel::Stage(name) => format!("wf_stage_{name}"),
            Kernel::Queues => "wf_queues_of_bank".into(),
            kernel => format!("wf_{kernel}"),
        }
    }
}

impl fmt::Display for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Kernel::Generate => "generate",
            Kernel::Stage(name) => name,
            Kernel::Queues => "queues",
            Kernel::Enqueue => "enqueue",
            Kernel::Megakernel => "megakernel",
            Kernel::Persistent => "persistent",
            Kernel::MegakernelRegen => "megakernel_regen",
            Kernel::Tick => "tick",
            Kernel::Advance => "advance",
            Kernel::Resolve => "resolve",
            Kernel::AuditLanes => "audit_lanes",
            Kernel::AuditResults => "audit_results",
        })
    }
}

/// One dispatch.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Launch {
    /// What runs.
    pub kernel: Kernel,
    /// Number of groups.
    pub size: Size,
}

/// What is launched once, and what is launched per step until all passes are resolved.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Plan {
    /// Before the first step.
    pub opening: Vec<Launch>,
    /// Every step.
    pub step: Vec<Launch>,
    /// In checked mode, between the stages of a step and its tick.
    pub audit: Vec<Launch>,
}

impl Plan {
    /// The plan of an execution for the given stages, checked or not.
    pub fn new<'a>(
        execution: Execution,
        scope: LaunchScope,
        grain: Grain,
        stages: impl Iterator<Item = &'a str>,
        is_checked: bool,
    ) -> Self {
        let launch = |kernel, size| Launch { kernel, size };
        let resolve = launch(Kernel::Resolve, Size::FinishedTiles);
        let mut audit = Vec::new();
        if is_checked && execution.is_wavefront() {
            audit.push(launch(Kernel::AuditLanes, Size::All));
        }
        if is_checked {
            audit.push(launch(Kernel::AuditResults, Size::All));
        }
        let whole_walks = match execution {
            Execution::Wavefront => {
                let tick = launch(Kernel::Tick, Size::Groups(1));
                let mut step = vec![launch(Kernel::Generate, Size::NewBlocks)];
                let size = match (grain, scope) {
                    (Grain::PackedLanes | Grain::KeyedLanes, _) => Size::PackedLanes,
                    (_, LaunchScope::LiveBlocks) => Size::LiveBlocks,
                    (_, LaunchScope::AllBlocks) => Size::FilledBlocks,
                };
                step.extend(stages.map(|stage| launch(Kernel::Stage(stage.to_owned()), size)));
                if grain == Grain::KeyedLanes {
                    // Behind `generate` and the first stage.
                    step.splice(2..2, [launch(Kernel::Queues, Size::Queues), launch(Kernel::Enqueue, size)]);
                }
                step.extend([tick.clone(), resolve]);
                return Plan { opening: vec![tick], step, audit };
            }
            Execution::Megakernel => Kernel::Megakernel,
            Execution::Persistent => Kernel::Persistent,
            Execution::MegakernelRegen => Kernel::MegakernelRegen,
        };
        let advance = launch(Kernel::Advance, Size::Groups(1));
        Plan { opening: vec![advance.clone()], step: vec![launch(whole_walks, Size::LiveBlocks), advance, resolve], audit }
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |f: &mut fmt::Formatter<'_>, when: &str, launches: &[Launch]| {
            let launches: Vec<String> = launches
                .iter()
                .map(|launch| match launch.size {
                    Size::Groups(groups) => format!("{} x{groups}", launch.kernel),
                    size => format!("{} x{size:?}", launch.kernel),
                })
                .collect();
            writeln!(f, "{when}: {}", launches.join(" -> "))
        };
        line(f, "once", &self.opening)?;
        line(f, "step", &self.step)?;
        if self.audit.is_empty() { Ok(()) } else { line(f, "audit, before the tick", &self.audit) }
    }
}
