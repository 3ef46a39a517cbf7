//! `path-tracer scenes`: what can be rendered without a file.

use path_tracer::scene::BUILTIN;

use super::{Failure, say};

pub(crate) fn run() -> Result<(), Failure> {
    let width = BUILTIN.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    BUILTIN.iter().for_each(|(name, line)| say(format_args!("{name:width$}  {line}")));
    Ok(())
}
