//! The WGSL of wavepool, as text: kernels of the scheduler, pure math without bindings, and the stages of the path tracer.
//!
//! Key decision: every shader is a plain file that editors understand; the build script lists the folders, so a new module is one
//! new file and no list. Modules import each other with `import package::folder::file::{name};`.

/// One WGSL file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Module {
    /// What an `import` calls it, without the package: `math::random`.
    pub path: &'static str,
    /// The file, relative to the repository, for messages.
    pub file: &'static str,
    /// Its text.
    pub text: &'static str,
}

include!(concat!(env!("OUT_DIR"), "/modules.rs"));
