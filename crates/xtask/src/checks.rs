//! `cargo xtask test`: every check of the repository, in the order in which a mistake is cheapest to find.

use std::{env, path::Path, process::Command};

use crate::{
    anchors,
    process::{self, Failure, cargo},
    second_compiler, setup,
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
            None => go_without(
                "SwiftShader",
                "not installed (Debian's package chromium carries it)",
                "results are compared on one driver only",
                skips_fail(),
            ),
        }
    })?;
    steps.run("clippy", || {
        component(root, "clippy", "clippy")?;
        passed(&mut cargo(root, &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))
    })?;
    steps.run("docs", || passed(cargo(root, &["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings")))?;
    if full {
        steps.run("second compiler", || match second_compiler::missing_program() {
            None => second_compiler::check(root).map(|()| Outcome::Passed),
            Some(program) => go_without(program, "not on the PATH", "no second compiler reads the kernels", skips_fail()),
        })?;
    }
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

/// True where a skipped check counts as failed.
fn skips_fail() -> bool {
    env::var_os("WAVEPOOL_NO_SKIP").is_some_and(|value| value == "1")
}

/// Strangers may go without what is missing; where skips are forbidden, this one is too.
fn go_without(what: &str, why: &str, consequence: &str, skips_fail: bool) -> Result<Outcome, Failure> {
    if skips_fail {
        return Err(Failure::step(format!("{what} is {why}, and WAVEPOOL_NO_SKIP=1 forbids to go on without")));
    }
    println!("skip: {what} is {why}: {consequence}");
    Ok(Outcome::Skipped(format!("no {what}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a build machine that quietly tests one driver, or shows its kernels to one compiler.
    #[test]
    fn a_forbidden_skip_is_a_failure() {
        let missing = |skips_fail| go_without("SwiftShader", "not installed", "one driver only", skips_fail);
        assert_eq!(missing(false), Ok(Outcome::Skipped("no SwiftShader".into())));
        assert!(matches!(missing(true), Err(Failure::Step(why)) if why.contains("SwiftShader is not installed")));
    }
}
