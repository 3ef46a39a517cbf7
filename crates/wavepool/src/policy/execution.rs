//! How stages become kernels.

/// How stages become kernels. The stages are the same; only the generated wrappers differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Execution {
    /// One kernel per stage; the state lives in memory between them.
    #[default]
    Wavefront,
    /// One kernel that loops over the stages; the state lives in registers. A work-group is a tile.
    Megakernel,
    /// The same loop in work-groups that stay: each takes tile after tile of a launch from an atomic counter.
    /// Source: Gupta, Stuart and Owens, *A study of persistent threads style GPU programming for GPGPU workloads*, 2012.
    Persistent,
    /// The same loop, in which a lane whose walk has ended takes the next item of the launch. No lanes walk a tile together.
    /// Source: Davidovic, Krivanek, Hasan and Slusallek, *Progressive light transport simulation on the GPU*, 2014.
    MegakernelRegen,
}

impl Execution {
    /// One word, as in `--schedule`.
    pub fn name(self) -> &'static str {
        match self {
            Execution::Wavefront => "wavefront",
            Execution::Megakernel => "megakernel",
            Execution::Persistent => "persistent",
            Execution::MegakernelRegen => "megakernel-regen",
        }
    }

    /// True when stages are kernels of their own, with the state in memory between them.
    pub fn is_wavefront(self) -> bool {
        self == Execution::Wavefront
    }

    /// Tiles per work-group of a launch that holds many walks: enough that groups which are done early find more, few enough that a launch
    /// stays short.
    pub(crate) fn tiles_per_group(self) -> u32 {
        match self {
            Execution::Persistent | Execution::MegakernelRegen => 4,
            _ => 1,
        }
    }
}
