//! What can go wrong, each naming the thing, the actual value and the limit.

use crate::shader::Diagnostic;

/// The result of everything fallible in this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can go wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A mistake in the user's WGSL; the text shows file, line and caret.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Shader(Vec<Diagnostic>),
    /// What the program declares about a field of its state does not fit the WGSL.
    #[error("field `{field}`: {problem}")]
    Field {
        /// The path of the field as declared.
        field: String,
        /// What is wrong with it, and what exists.
        problem: String,
    },
    /// A feature of a program has a name that conditions cannot ask for.
    #[error("feature `{name}`: {problem}")]
    Feature {
        /// As given to the builder.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A constant of a program cannot be declared in WGSL.
    #[error("constant `{name}`: {problem}")]
    Constant {
        /// As given to the builder.
        name: String,
        /// What is wrong with its name or its value.
        problem: String,
    },
    /// The schedule cannot be carried out as asked.
    #[error("schedule: {0}")]
    Schedule(String),
    /// A limit of the device or of the library is too small for what was asked.
    #[error("{what} needs {need} {unit}, the limit is {limit}; {advice}")]
    Limit {
        /// The thing that is too large.
        what: String,
        /// How much it needs.
        need: u64,
        /// How much there is.
        limit: u64,
        /// Of what.
        unit: &'static str,
        /// What to change.
        advice: String,
    },
    /// A resource that the WGSL declares was not provided, or the other way round.
    #[error("resource `{name}`: {problem}")]
    Resource {
        /// The name of the variable in the WGSL.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// No adapter fits.
    #[error("no GPU adapter found{0}; `cargo xtask setup` installs a software Vulkan driver on Debian and Ubuntu")]
    NoAdapter(String),
    /// The adapter refused to make a device.
    #[error("adapter `{adapter}` gives no device: {source}")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// Why.
        source: wgpu::RequestDeviceError,
    },
    /// The device reported an error while something was made or recorded.
    #[error("GPU error while {doing}: {source}")]
    Gpu {
        /// What was being done.
        doing: String,
        /// The device's own words.
        source: wgpu::Error,
    },
    /// The device went away, and with it what had not been read back.
    #[error("the GPU device was lost: {0}")]
    DeviceLost(String),
    /// The device did not finish within the time given.
    #[error("the GPU did not answer within {seconds} s while {doing}")]
    Timeout {
        /// What was waited for.
        doing: String,
        /// For how long.
        seconds: u64,
    },
    /// The ledger does not balance: a result is missing. This is a bug of the scheduler or of a policy.
    #[error("conservation violated: {0}")]
    Conservation(String),
}

impl Error {
    /// True when the device has no memory for what was asked.
    pub fn is_out_of_memory(&self) -> bool {
        matches!(self, Error::Gpu { source: wgpu::Error::OutOfMemory { .. }, .. })
    }
}
