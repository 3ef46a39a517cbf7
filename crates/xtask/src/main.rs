//! `cargo xtask`: everything a person or a build machine does with this repository beyond plain cargo.
//!
//! Key decision: the standard library alone, so that the tool compiles in seconds and runs on a machine that has nothing yet but git,
//! a C linker and Rust. It asks the renderer itself whether a graphics adapter exists instead of guessing from files on disk.
//! The price is a small JSON reader of our own.
//!
//! **Invariant:** whatever decides (which commands to run, which anchors are missing) is a pure function with tests; whatever acts
//! only carries out such decisions.
//! **Invariant:** an existing system file is never edited, and nothing is installed without consent.

mod adapters;
mod anchors;
mod apt_sources;
mod arguments;
mod book;
mod checks;
mod demo;
mod driver;
mod json;
mod os_release;
mod peers;
mod process;
mod second_compiler;
mod setup;
mod steps;
mod swiftshader;

use std::process::ExitCode;

use arguments::{Invocation, USAGE};
use process::Failure;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments::parse(&arguments).and_then(carry_out) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Usage(what)) => {
            eprintln!("error: {what}\n\n{USAGE}");
            ExitCode::from(2)
        }
        Err(Failure::Step(what)) => {
            eprintln!("error: {what}");
            ExitCode::FAILURE
        }
    }
}

fn carry_out(invocation: Invocation) -> Result<(), Failure> {
    let root = process::repository_root()?;
    match invocation {
        Invocation::Usage => {
            println!("{USAGE}");
            Ok(())
        }
        Invocation::Setup { agreed } => setup::set_up(&root, agreed).map(|_| ()),
        Invocation::Demo { agreed } => demo::run(&root, agreed),
        Invocation::Test { agreed, full } => checks::run(&root, agreed, full),
        Invocation::Book => book::build(&root),
        Invocation::Peers { scenes, quick, only } => peers::run(&root, &scenes, quick, only),
        Invocation::Bench { what, quick, out } => {
            // Cargo starts it in the root of the repository; the folder is meant from where we are.
            let out = out.map(|folder| std::env::current_dir().map_or_else(|_| folder.clone().into(), |here| here.join(&folder)));
            let out = out.as_ref().map(|folder| folder.to_string_lossy());
            let mut words = vec!["run", "--quiet", "--package", "wavepool-tests", "--bin", "bench", "--", &what];
            words.extend(quick.then_some("--quick"));
            words.extend(out.iter().flat_map(|folder| ["--out", folder]));
            process::run(&mut process::cargo(&root, &words))
        }
    }
}
