//! `path-tracer`: scenes to images on the command line.
//!
//! Exit codes: 0 done, 1 something could not be read, rendered or written or a check failed, 2 wrong usage, 3 some of
//! many scenes are not shown (`sheet`), 130 stopped by Ctrl-C. Errors are one line on stderr; results go to stdout, progress to stderr.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("path-tracer: {failure}");
            ExitCode::from(failure.exit_code())
        }
    }
}
