//! Why a scene cannot be packed for the GPU.
//!
//! **Invariant:** every message is one line that names the thing, its value and the limit.

/// Why a scene cannot be packed for the GPU.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A table grew beyond what one binding may hold.
    #[error("{what} take {bytes} bytes, one binding holds {limit}")]
    TooLarge {
        /// The table.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The largest possible.
        limit: u64,
    },
    /// More of something than its index can count.
    #[error("the scene has {count} {what}, the limit is {limit}")]
    TooMany {
        /// What there is too much of.
        what: &'static str,
        /// How many.
        count: u64,
        /// The most there may be.
        limit: u64,
    },
    /// The hierarchy is deeper than the kernel's stack.
    #[error("the bounding volume hierarchy is {depth} deep, the traversal stack holds {limit}")]
    TooDeep {
        /// Levels.
        depth: u32,
        /// Levels that fit.
        limit: u32,
    },
    /// An index of the scene leads nowhere.
    #[error("{what} {index} refers to {target} {value}, there are {count}")]
    Dangling {
        /// What holds the index.
        what: &'static str,
        /// Which one.
        index: usize,
        /// What it should lead to.
        target: &'static str,
        /// The index.
        value: u32,
        /// How many there are.
        count: usize,
    },
    /// A number that is not finite, or out of the range of `f32` once the scene is normalised.
    #[error("{what} {index}: {value} is out of range")]
    OutOfRange {
        /// What holds the number.
        what: &'static str,
        /// Which one.
        index: usize,
        /// The number as text.
        value: String,
    },
    /// An image without texels.
    #[error("{what} `{name}` is {width} x {height} and has {texels} texels")]
    BadImage {
        /// Image or environment.
        what: &'static str,
        /// Its name.
        name: String,
        /// Texels.
        width: u32,
        /// Texels.
        height: u32,
        /// Entries it holds.
        texels: usize,
    },
    /// A layer that there is not.
    #[error("there is no layer `{name}`; layers are {}, or all, or none", super::LayerRequest::NAMES.join(", "))]
    UnknownLayer {
        /// As it was written.
        name: String,
    },
}
