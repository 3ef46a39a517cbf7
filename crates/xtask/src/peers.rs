//! Other renderers' opinions: pictures and speed beside Mitsuba 3, pictures and the way from Blender beside Cycles.
//!
//! Key decision: the peer comes from the Python package index in exact versions into a folder below `target`, and nothing of it is needed to
//! build or test the project. Its LLVM backend loads the system's LLVM library, of which it needs version 17 or later: older ones cannot
//! compile what it generates for wide vectors.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::process::{self, Failure, cargo};

/// What is installed; Blender wants this numpy.
const PACKAGES: &str = "mitsuba==3.9.1 numpy==1.26.4 OpenEXR==3.5.3";
/// Blender as a module, which exists for one version of Python; without it that part is skipped.
const BLENDER: &str = "bpy==5.0.1";
/// What only one of the two has: scenes made in Blender; blends of several materials, and the clock.
const OF_CYCLES: [&str; 2] = ["from-blender", "matte-box-to-blender"];
const OF_MITSUBA: [&str; 2] = ["speed", "mixtures"];
/// Where the variable of Dr.Jit, Mitsuba's compiler, points when somebody has set it.
const LLVM: &str = "DRJIT_LIBLLVM_PATH";
/// Oldest LLVM that works.
const OLDEST: u32 = 17;
const LIBRARIES: [&str; 4] = ["/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64", "/usr/lib"];

/// With whom to compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Peer {
    Mitsuba,
    Cycles,
}

/// Compares the scenes, all when none is named, with one peer or with both.
///
/// # Errors
/// When nobody has something to do, Python or LLVM is missing, an installation fails, or a renderer does.
pub(crate) fn run(root: &Path, scenes: &[String], quick: bool, only: Option<Peer>) -> Result<(), Failure> {
    let [cycles, mitsuba] = [Peer::Cycles, Peer::Mitsuba].map(|peer| is_wanted(peer, scenes, only));
    if !cycles && !mitsuba {
        return Err(Failure::step(format!("{}: that is compared with the other renderer alone", scenes.join(" "))));
    }
    let folder = root.join("target/tools/peers");
    let python = install(&folder)?;
    process::run(&mut cargo(root, &["build", "--quiet", "--package", "path_tracer"]))?;
    let script = |name: &str| {
        let mut command = Command::new(&python);
        command.current_dir(root).env("PYTHONDONTWRITEBYTECODE", "1").arg(format!("crates/xtask/peers/{name}"));
        command.arg(root.join("target/debug/path-tracer")).arg(folder.join("scenes")).args(quick.then_some("--quick"));
        if let Some(assets) = env::var_os("WAVEPOOL_ASSETS") {
            command.arg("--assets").arg(assets);
        }
        command.args(scenes);
        command
    };
    if cycles {
        match process::succeeds(Command::new(&python).args(["-c", "import bpy"])) {
            true => process::run(&mut script("blender.py"))?,
            false => println!("skipped: Cycles: there is no {BLENDER} for this Python"),
        }
    }
    if mitsuba {
        let mut command = script("peers.py");
        if env::var_os(LLVM).is_none() {
            let names: Vec<PathBuf> =
                LIBRARIES.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten().map(|entry| entry.path()).collect();
            let newest = newest_llvm(&names).ok_or_else(|| {
                Failure::step(format!("no LLVM library of version {OLDEST} or later: install one (Debian: libllvm19) or name it in {LLVM}"))
            })?;
            command.env(LLVM, newest);
        }
        process::run(&mut command)?;
    }
    Ok(())
}

/// Whether a peer has something to do: nobody else was asked for, and some scene is not the other's alone.
fn is_wanted(peer: Peer, scenes: &[String], only: Option<Peer>) -> bool {
    let of_the_other: &[&str] = if peer == Peer::Cycles { &OF_MITSUBA } else { &OF_CYCLES };
    only.is_none_or(|only| only == peer) && (scenes.is_empty() || scenes.iter().any(|scene| !of_the_other.contains(&scene.as_str())))
}

/// The Python of a virtual environment that has the packages.
fn install(folder: &Path) -> Result<PathBuf, Failure> {
    let failed = |what: &str, why: std::io::Error| Failure::step(format!("{what}: {why}"));
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let mark = folder.join("installed");
    if fs::read_to_string(&mark).is_ok_and(|installed| installed == PACKAGES) {
        return Ok(python);
    }
    fs::create_dir_all(folder).map_err(|why| failed("target/tools/peers", why))?;
    process::run(Command::new(if cfg!(windows) { "python" } else { "python3" }).args(["-m", "venv"]).arg(folder))?;
    process::run(Command::new(&python).args(["-m", "pip", "install", "--quiet"]).args(PACKAGES.split(' ')))?;
    if let Err(why) = process::run(Command::new(&python).args(["-m", "pip", "install", "--quiet", BLENDER])) {
        println!("without Blender: {why:?}");
    }
    fs::write(&mark, PACKAGES).map_err(|why| failed("installed", why))?;
    Ok(python)
}

/// The newest LLVM library that is new enough.
fn newest_llvm(names: &[PathBuf]) -> Option<&PathBuf> {
    let version = |path: &&PathBuf| llvm_version(path.file_name()?.to_str()?);
    let usable = names.iter().filter(|path| version(path).is_some_and(|version| version >= OLDEST));
    usable.max_by_key(|path| version(path))
}

/// `libLLVM.so.19.1` and `libLLVM-19.so.1` are both version 19.
fn llvm_version(name: &str) -> Option<u32> {
    let rest = name.strip_prefix("libLLVM")?;
    let number = rest.strip_prefix(".so.").or_else(|| rest.strip_prefix('-').filter(|rest| rest.contains(".so")))?;
    number.split('.').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a scene of one peer that the other is started for, a peer that runs although the other alone was asked for, a command
    /// that does nothing and says nothing.
    #[test]
    fn a_peer_runs_when_it_has_something_to_do() {
        let wanted = |scenes: &[&str], only| {
            let scenes: Vec<String> = scenes.iter().map(ToString::to_string).collect();
            (is_wanted(Peer::Mitsuba, &scenes, only), is_wanted(Peer::Cycles, &scenes, only))
        };
        assert_eq!(wanted(&[], None), (true, true));
        assert_eq!(wanted(&["row"], None), (true, true));
        assert_eq!(wanted(&["speed"], None), (true, false));
        assert_eq!(wanted(&["from-blender"], None), (false, true));
        assert_eq!(wanted(&["from-blender", "row"], None), (true, true));
        assert_eq!(wanted(&["row"], Some(Peer::Cycles)), (false, true));
        assert_eq!(wanted(&["speed"], Some(Peer::Cycles)), (false, false));
        let refused = run(Path::new("no-such-folder"), &[String::from("speed")], true, Some(Peer::Cycles));
        assert!(refused.is_err_and(|failure| format!("{failure:?}").contains("speed: that is compared with the other renderer alone")));
    }

    /// Kills: a version read from another library, an old one preferred, a number compared as text.
    #[test]
    fn the_newest_usable_llvm_is_taken() {
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let names = paths(&["/usr/lib/libLLVM-15.so.1", "/usr/lib/libLLVM.so.19.1", "/usr/lib/libLLVM-17.so", "/usr/lib/libLLVMSupport.a"]);
        assert_eq!(newest_llvm(&names), Some(&names[1]));
        assert_eq!(newest_llvm(&paths(&["/usr/lib/libLLVM-9.so.1", "/usr/lib/libLLVM-16.so.1", "/usr/lib/libLTO.so.19"])), None);
        assert_eq!((llvm_version("libLLVM-20.so"), llvm_version("libLLVM.so"), llvm_version("libLLVM-C.so")), (Some(20), None, None));
    }
}
