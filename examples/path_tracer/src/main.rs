//! `path-tracer`: scenes to images on the command line.
//!
//! Exit codes: 0 done, 1 something could not be read, rendered or written or a check failed, 2 wrong usage, 130 stopped by Ctrl-C; of
//! `sheet` the number of scenes that are not shown. Errors are one line on stderr; results go to stdout, progress to stderr.

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
