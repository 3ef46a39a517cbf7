//! How stages become kernels.

/// How stages become kernels. The stages are the same; only the generated wrappers differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Execution {
    /// One kernel per stage; the state lives in memory between them.
    #[default]
    Wavefront,
    /// One kernel that loops over the stages; the state lives in registers.
    Megakernel,
}
