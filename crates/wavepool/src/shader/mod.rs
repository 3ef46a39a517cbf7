//! From the user's WGSL to kernels: compose the modules, look into them with naga, generate the wrappers.
//!
//! Key decision: the user's text is never rewritten or mangled. Modules are concatenated, imports and removed parts are blanked with
//! spaces, and generated code goes before and after; so every message of naga maps back to the file, line and column the user wrote.
//!
//! **Invariant:** generated names begin with `wf_`; user modules may not use such names.

mod arrays;
mod compose;
mod condition;
mod constant;
mod diagnostic;
mod features;
mod gamble;
mod generate;
mod infer;
mod inspect;
mod items;
mod link;
mod persistent;
mod regenerating;
mod rules;
mod scan;
mod storage;

pub(crate) use arrays::{DeclaredArray, StateArray, find_arrays, plain_accessors};
pub use compose::SourceModule;
pub(crate) use compose::{Composition, GENERATED, Sources, compose};
pub use constant::Constant;
pub use diagnostic::Diagnostic;
pub(crate) use generate::header;
use generate::{Glue, kernels, tick_module};
pub use infer::{LeafSet, Summary, Written};
pub(crate) use infer::{analyse, join_alternatives, then};
pub(crate) use inspect::{Interface, Resource, ResourceKind, inspect};
pub(crate) use items::extra_counters;
pub use link::Fault;
pub(crate) use link::{Linked, link};
pub(crate) use scan::is_identifier;
