//! Tint, the WGSL compiler of Chrome, reads every kernel of the repository.
//!
//! The compiler inside wgpu accepts what the specification forbids, above all barriers that not every invocation reaches; such a kernel
//! works on one machine and hangs on another. Tint comes as an npm package (Dawn for Node) and needs no GPU on its null backend.
//! It is a check and no dependency: it is installed below `target`, and without Node the check is skipped.

use std::{fs, path::Path, process::Command};

use crate::process::{self, Failure, cargo};

/// Windows knows npm as a script.
const NPM: &str = if cfg!(windows) { "npm.cmd" } else { "npm" };
/// The package's description, its exact versions, and the program that compiles a folder.
const FILES: [&str; 3] = ["package.json", LOCK, "check.mjs"];
const LOCK: &str = "package-lock.json";
/// Which lock file the installed packages come from. Inside their folder, so that both vanish together.
const INSTALLED: &str = "node_modules/installed-lock.json";

/// What the check needs and this machine lacks.
pub(crate) fn missing_program() -> Option<&'static str> {
    ["node", NPM].into_iter().find(|program| !process::succeeds(Command::new(program).arg("--version")))
}

/// Installs Tint into `target/second_compiler` unless it is there, writes all kernels beside it and compiles them.
///
/// # Errors
/// A failed installation, a kernel that cannot be generated, or one that Tint refuses; the complaints have been printed then.
pub(crate) fn check(root: &Path) -> Result<(), Failure> {
    let folder = root.join("target/second_compiler");
    let failed = |what: &str, why: std::io::Error| Failure::step(format!("{what}: {why}"));
    fs::create_dir_all(&folder).map_err(|why| failed("target/second_compiler", why))?;
    for file in FILES {
        fs::copy(root.join("tests/second_compiler").join(file), folder.join(file)).map_err(|why| failed(file, why))?;
    }
    let wanted = fs::read_to_string(folder.join(LOCK)).map_err(|why| failed(LOCK, why))?;
    if must_install(fs::read_to_string(folder.join(INSTALLED)).ok().as_deref(), &wanted) {
        // The package's own script only matters for files that a browser has downloaded.
        process::run(Command::new(NPM).current_dir(&folder).args(["ci", "--ignore-scripts", "--no-audit", "--no-fund"]))?;
        fs::write(folder.join(INSTALLED), wanted).map_err(|why| failed(INSTALLED, why))?;
    }
    // Kernels of an older checkout must not be judged.
    let kernels = "target/second_compiler/kernels";
    match fs::remove_dir_all(root.join(kernels)) {
        Err(why) if why.kind() != std::io::ErrorKind::NotFound => return Err(failed(kernels, why)),
        _ => {}
    }
    process::run(&mut cargo(root, &["run", "--quiet", "--package", "wavepool-tests", "--bin", "dump_kernels", "--", kernels]))?;
    process::run(Command::new("node").current_dir(root).args(["target/second_compiler/check.mjs", kernels]))
}

/// True unless exactly these versions are there.
fn must_install(installed: Option<&str>, wanted: &str) -> bool {
    installed != Some(wanted)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a new version in the lock file that is never installed, or an installation in every run.
    #[test]
    fn the_lock_file_decides() {
        assert!(must_install(None, "1"));
        assert!(must_install(Some("1"), "2"));
        assert!(!must_install(Some("2"), "2"));
    }

    /// Kills: a lock file that lags behind the description, or that names a registry which only one network can reach.
    #[test]
    fn the_lock_file_is_that_of_the_description() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/second_compiler");
        let text = |file: &str| fs::read_to_string(folder.join(file)).expect("the file is in the repository");
        let description = text("package.json");
        let version = description.lines().find(|line| line.contains("\"webgpu\":")).expect("the package is named").trim();
        assert!(!version.contains(['^', '~', '*']), "{version} is not one version");
        let lock = text(LOCK);
        assert!(lock.contains(version) && lock.contains("\"integrity\": \"sha512-"), "{version}");
        assert!(!lock.contains("\"resolved\""), "npm needs no address for what has a checksum");
    }
}
