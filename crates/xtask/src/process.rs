//! Running other programs, and the two ways in which this tool can fail.

use std::{
    env, fmt,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// Why the tool gives up; decides the exit code.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    /// The command line makes no sense: exit code 2.
    Usage(String),
    /// Something that was asked for did not succeed: exit code 1.
    Step(String),
}

impl Failure {
    /// A failed step, told in one line.
    pub(crate) fn step(what: impl fmt::Display) -> Self {
        Self::Step(what.to_string())
    }
}

/// The folder of the workspace's `Cargo.toml`.
///
/// # Errors
/// When the tool runs outside cargo and outside the repository.
pub(crate) fn repository_root() -> Result<PathBuf, Failure> {
    // Cargo says at run time where the package lies; a path baked in at compile time would outlive a moved checkout.
    let start = env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).or_else(|| env::current_dir().ok());
    let found = start.as_deref().and_then(|start| start.ancestors().find(|folder| folder.join("crates/xtask/Cargo.toml").is_file()));
    found
        .map(Path::to_path_buf)
        .ok_or_else(|| Failure::step("this is not the wavepool repository: run `cargo xtask` inside a checkout of it"))
}

/// A call of the cargo that called us, in the repository's root.
pub(crate) fn cargo(root: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root).args(words);
    command
}

/// Runs a command with our terminal as its terminal.
///
/// # Errors
/// When the program cannot be started or ends without success.
pub(crate) fn run(command: &mut Command) -> Result<(), Failure> {
    let line = command_line(command);
    let status = command.status().map_err(|why| Failure::step(format!("`{line}` could not be started: {why}")))?;
    if status.success() { Ok(()) } else { Err(Failure::step(format!("`{line}` failed ({status})"))) }
}

/// Runs a command and returns what it wrote to its standard output; its standard error stays ours.
///
/// # Errors
/// When the program cannot be started, ends without success or writes something that is not UTF-8.
pub(crate) fn capture(command: &mut Command) -> Result<String, Failure> {
    let line = command_line(command);
    let output = command.stderr(Stdio::inherit()).output().map_err(|why| Failure::step(format!("`{line}` could not be started: {why}")))?;
    if !output.status.success() {
        return Err(Failure::step(format!("`{line}` failed ({})", output.status)));
    }
    String::from_utf8(output.stdout).map_err(|_| Failure::step(format!("`{line}` wrote something that is not UTF-8")))
}

/// True when the program runs and succeeds; what it writes is thrown away.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

/// True when a program of this name lies in one of the folders of `PATH`.
pub(crate) fn on_path(program: &str) -> bool {
    env::var_os("PATH").is_some_and(|path| env::split_paths(&path).any(|folder| folder.join(program).is_file()))
}

/// The command as a person would type it, the program without its folder.
fn command_line(command: &Command) -> String {
    let program = Path::new(command.get_program()).file_name().unwrap_or_default().to_string_lossy();
    let words = command.get_args().map(|word| word.to_string_lossy());
    std::iter::once(program).chain(words).collect::<Vec<_>>().join(" ")
}
