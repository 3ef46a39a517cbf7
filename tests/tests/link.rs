//! Programs without a device: what the library infers from WGSL, what it refuses and in which words, what it generates.
//!
//! **Invariant:** nothing here needs an adapter.

#[path = "link/diagnostics.rs"]
mod diagnostics;
#[path = "link/edges.rs"]
mod edges;
#[path = "link/fields.rs"]
mod fields;
#[path = "link/inference.rs"]
mod inference;
#[path = "link/kernels.rs"]
mod kernels;
