//! What to do on a machine without a graphics adapter: which commands install a software Vulkan driver, and whether they may run.
//!
//! Key decision: [`decide`] is a pure function from a [`Situation`] to a [`Decision`]; the module `setup` finds out the situation and
//! carries out the decision. So every distribution is tested on every machine.
//!
//! **Invariant:** nothing runs without consent: an answer on the terminal, `--yes`, or `CI=true`.
//! **Invariant:** no existing file is edited. A source list is only ever added, as a new file of our own name.

use std::fmt;

use crate::{apt_sources::Source, os_release::OsRelease};

/// Debian 12 ships Mesa 22.3, whose software driver is several times slower than that of the backports.
const BACKPORTS_SUITE: &str = "bookworm-backports";
/// The file we add when no source offers the backports.
const BACKPORTS_FILE: &str = "/etc/apt/sources.list.d/wavepool-backports.sources";
const DEBIAN_MIRROR: &str = "http://deb.debian.org/debian";
const DEBIAN_KEYRING: &str = "/usr/share/keyrings/debian-archive-keyring.gpg";
/// The driver, and the loader that finds it.
const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];

/// Everything the decision depends on.
#[derive(Clone, Debug)]
pub(crate) struct Situation {
    /// `linux`, `macos`, `windows`, ... as Rust names it.
    pub(crate) system: &'static str,
    /// The distribution, on Linux.
    pub(crate) release: OsRelease,
    /// The switched-on sources of apt, where there is apt.
    pub(crate) sources: Vec<Source>,
    /// We are the superuser already.
    pub(crate) root: bool,
    /// `sudo` is installed.
    pub(crate) sudo: bool,
    /// A person sits at the terminal and can answer.
    pub(crate) interactive: bool,
    /// `--yes` or `CI=true`.
    pub(crate) agreed: bool,
}

/// One command, ready to run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Task {
    /// Program and arguments.
    pub(crate) words: Vec<String>,
    /// What the program reads from its standard input.
    pub(crate) stdin: Option<String>,
    /// A failure is reported and the next task is tried.
    pub(crate) may_fail: bool,
}

/// What to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Decision {
    /// Run these at once.
    Install(Vec<Task>),
    /// Show these, ask, and run them if the answer is yes.
    AskThenInstall(Vec<Task>),
    /// Show these and fail, for the reason given.
    Refuse { tasks: Vec<Task>, why: &'static str },
    /// There is no recipe for this system: show the advice and fail.
    ByHand(String),
}

/// The decision for a machine on which no adapter was found.
pub(crate) fn decide(situation: &Situation) -> Decision {
    let Some(backports) = recipe(situation) else {
        return Decision::ByHand(advice(situation));
    };
    let tasks = apt_tasks(situation, backports);
    if !situation.root && !situation.sudo {
        return Decision::Refuse {
            tasks,
            why: "installing a driver takes root or sudo, and neither is here: run the commands above as root",
        };
    }
    match (situation.agreed, situation.interactive) {
        (true, _) => Decision::Install(tasks),
        (false, true) => Decision::AskThenInstall(tasks),
        (false, false) => Decision::Refuse { tasks, why: "nobody is at the terminal to ask: run the commands above, or pass --yes" },
    }
}

/// Whether this system is one we can install on, and if so, whether its driver comes from the backports.
fn recipe(situation: &Situation) -> Option<bool> {
    let release = &situation.release;
    if situation.system != "linux" {
        return None;
    }
    match (release.id.as_str(), release.major) {
        ("debian", Some(12)) => Some(true),
        ("debian", Some(major)) if major < 12 => None,
        // Testing and unstable carry no version; derivatives carry versions of their own.
        _ if release.descends_from("debian") || release.descends_from("ubuntu") => Some(false),
        _ => None,
    }
}

fn apt_tasks(situation: &Situation, backports: bool) -> Vec<Task> {
    let as_root: &[&str] = match situation {
        Situation { root: true, .. } | Situation { sudo: false, .. } => &[],
        // Without a terminal a question for the password would hang.
        Situation { interactive: false, agreed: true, .. } => &["sudo", "-n"],
        _ => &["sudo"],
    };
    let task =
        |words: &[&str]| Task { words: as_root.iter().chain(words).map(|word| (*word).to_owned()).collect(), stdin: None, may_fail: false };
    let mut tasks = Vec::new();
    if backports && !situation.sources.iter().any(|source| source.suite == BACKPORTS_SUITE) {
        tasks.push(Task { stdin: Some(backports_source(&situation.sources)), ..task(&["tee", BACKPORTS_FILE]) });
    }
    // One stale source of a third party fails the update as a whole although ours was read; the installation tells.
    tasks.push(Task { may_fail: true, ..task(&["apt-get", "update"]) });
    let mut install = vec!["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "install", "--yes", "--no-install-recommends"];
    // A freshly started machine often updates itself at that very moment.
    install.extend(["-o", "DPkg::Lock::Timeout=300"]);
    if backports {
        install.extend(["-t", BACKPORTS_SUITE]);
    }
    install.extend(PACKAGES);
    tasks.push(task(&install));
    tasks
}

/// The backports of the mirror that this machine already uses.
fn backports_source(sources: &[Source]) -> String {
    let mirror = sources.iter().find(|source| source.suite == "bookworm").map_or(DEBIAN_MIRROR, |source| &source.uri);
    format!("Types: deb\nURIs: {mirror}\nSuites: {BACKPORTS_SUITE}\nComponents: main\nSigned-By: {DEBIAN_KEYRING}\n")
}

fn advice(situation: &Situation) -> String {
    let release = &situation.release;
    let how = match situation.system {
        "macos" => "Metal is part of macOS; a virtual machine without a graphics adapter cannot run this",
        "windows" => "install your graphics card's driver (Windows' own software adapter WARP is found without one)",
        "linux" if release.descends_from("fedora") => "sudo dnf install mesa-vulkan-drivers vulkan-loader",
        "linux" if release.descends_from("arch") => "sudo pacman -S vulkan-swrast vulkan-icd-loader",
        "linux" if release.descends_from("suse") || release.id.starts_with("opensuse") => "sudo zypper install libvulkan_lvp libvulkan1",
        "linux" if release.id == "alpine" => "apk add mesa-vulkan-swrast vulkan-loader",
        _ => "install a Vulkan driver: that of your graphics card, or Mesa's software driver lavapipe (Mesa 23 or newer)",
    };
    let name = if release.pretty_name.is_empty() { situation.system } else { &release.pretty_name };
    format!("no graphics adapter was found, and there is no recipe for {name}. Do this by hand, then try again:\n  {how}")
}

/// The task as a line for a shell.
impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(stdin) = &self.stdin {
            write!(f, "printf '{}' | ", stdin.replace('\n', "\\n"))?;
        }
        f.write_str(&self.words.join(" "))
    }
}

#[cfg(test)]
#[path = "driver_tests.rs"]
mod tests;
