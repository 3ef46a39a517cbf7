//! `cargo xtask test`: every check of the repository, in the order in which a mistake is cheapest to find.

use std::{env, path::Path, process::Command};

use crate::{
    anchors,
    process::{self, Failure, cargo},
    setup,
    steps::{Outcome, Steps},
    swiftshader,
};

/// Sets up and runs the checks; the first that fails ends it.
///
/// # Errors
/// Names the step that failed.
pub(crate) fn run(root: &Path, agreed: bool, full: bool) -> Result<(), Failure> {
    let mut steps = Steps::default();
    let result = run_steps(&mut steps, root, agreed, full);
    print!("\n{}", steps.summary());
    if result.is_ok() {
        println!("all checks passed");
    }
    result
}

fn run_steps(steps: &mut Steps, root: &Path, agreed: bool, full: bool) -> Result<(), Failure> {
    steps.run("format", || {
        component(root, "fmt", "rustfmt")?;
        passed(&mut cargo(root, &["fmt", "--all", "--check"]))
    })?;
    steps.run("book anchors", || {
        let count = anchors::check_book(root)?;
        println!("{count} includes, each with its anchor");
        Ok(Outcome::Passed)
    })?;
    steps.run("setup", || setup::set_up(root, agreed).map(|_| Outcome::Passed))?;
    let mut second_driver = None;
    steps.run("second driver", || {
        second_driver = swiftshader::find()?;
        match &second_driver {
            Some(path) => {
                println!("SwiftShader: {}", path.display());
                Ok(Outcome::Passed)
            }
            None => no_second_driver(env::var_os("WAVEPOOL_NO_SKIP").is_some_and(|value| value == "1")),
        }
    })?;
    steps.run("clippy", || {
        component(root, "clippy", "clippy")?;
        passed(&mut cargo(root, &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))
    })?;
    steps.run("docs", || passed(cargo(root, &["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings")))?;
    steps.run("tests", || {
        let mut tests = cargo(root, &["test", "--workspace"]);
        if let Some(path) = &second_driver {
            tests.env(swiftshader::VARIABLE, path);
        }
        if full {
            tests.env("WAVEPOOL_FULL", "1");
        }
        passed(&mut tests)
    })
}

fn passed(command: &mut Command) -> Result<Outcome, Failure> {
    process::run(command).map(|()| Outcome::Passed)
}

/// A cargo installed without rustup's default profile may lack these two.
fn component(root: &Path, subcommand: &str, name: &str) -> Result<(), Failure> {
    if process::succeeds(&mut cargo(root, &[subcommand, "--version"])) {
        return Ok(());
    }
    Err(Failure::step(format!("`cargo {subcommand}` is not installed: `rustup component add {name}` brings it")))
}

/// Strangers may go without; where skips are forbidden, this one is too.
fn no_second_driver(skips_fail: bool) -> Result<Outcome, Failure> {
    let why = "SwiftShader is not installed (Debian's package chromium carries it)";
    if skips_fail {
        return Err(Failure::step(format!("{why}, and WAVEPOOL_NO_SKIP=1 forbids to go on without")));
    }
    println!("skip: {why}: results are compared on one driver only");
    Ok(Outcome::Skipped("no SwiftShader".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a build machine that quietly tests one driver.
    #[test]
    fn a_forbidden_skip_is_a_failure() {
        assert!(matches!(no_second_driver(false), Ok(Outcome::Skipped(_))));
        assert!(no_second_driver(true).is_err());
    }
}
