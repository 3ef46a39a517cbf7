//! `cargo xtask setup`: makes sure that the renderer finds a graphics adapter.
//!
//! Key decision: only the renderer can say whether an adapter is usable, so it is built first and asked, before and after an
//! installation. What to install is decided in `driver`; this module looks and acts.

use std::{
    env, fs,
    io::{self, BufRead as _, IsTerminal as _, Write as _},
    path::Path,
    process::{Command, Stdio},
};

use crate::{
    adapters::{self, Adapter},
    apt_sources::{self, Source},
    driver::{self, Decision, Situation, Task},
    os_release::OsRelease,
    process::{self, Failure},
};

/// Builds the renderer, and installs a software driver if it finds no adapter and we may. Returns the adapters, at least one.
///
/// # Errors
/// When there is no adapter and none could be installed; the commands to type by hand have been printed then.
pub(crate) fn set_up(root: &Path, agreed: bool) -> Result<Vec<Adapter>, Failure> {
    process::run(&mut process::cargo(root, &["build", "--package", "path_tracer"]))?;
    let mut found = adapters::ask(root)?;
    if found.is_empty() {
        println!("no graphics adapter was found; a software Vulkan driver will do");
        install(agreed)?;
        found = adapters::ask(root)?;
    }
    if found.is_empty() {
        return Err(Failure::step("a driver was installed, and still the renderer finds no graphics adapter"));
    }
    for adapter in &found {
        println!("adapter: {}", adapter.label());
    }
    if found.iter().all(Adapter::is_slow_software) {
        println!("hint: this is the software driver of Mesa 22 or older, several times slower than that of Mesa 25;");
        println!("hint: on Debian 12, `apt-get install -t bookworm-backports mesa-vulkan-drivers` brings the newer one");
    }
    Ok(found)
}

fn install(agreed: bool) -> Result<(), Failure> {
    let situation = look_around(agreed);
    match driver::decide(&situation) {
        Decision::Install(tasks) => carry_out(&tasks),
        Decision::AskThenInstall(tasks) => {
            show(&tasks);
            if ask("run these commands? [y/N] ")? {
                carry_out(&tasks)
            } else {
                Err(Failure::step("no driver was installed, as you wished"))
            }
        }
        Decision::Refuse { tasks, why } => {
            show(&tasks);
            Err(Failure::step(why))
        }
        Decision::ByHand(advice) => Err(Failure::step(advice)),
    }
}

fn look_around(agreed: bool) -> Situation {
    let release = fs::read_to_string("/etc/os-release").or_else(|_| fs::read_to_string("/usr/lib/os-release")).unwrap_or_default();
    let user = Command::new("id").arg("-u").output().map(|output| output.stdout).unwrap_or_default();
    Situation {
        system: env::consts::OS,
        release: OsRelease::parse(&release),
        sources: read_sources(Path::new("/etc/apt")),
        root: user.trim_ascii() == b"0",
        sudo: process::on_path("sudo"),
        interactive: io::stdin().is_terminal(),
        agreed: agreed || env::var_os("CI").is_some_and(|value| value == "true"),
    }
}

/// All sources that apt would read; what is unreadable counts as absent, and apt itself will complain about it.
fn read_sources(folder: &Path) -> Vec<Source> {
    let main = fs::read_to_string(folder.join("sources.list")).unwrap_or_default();
    let mut sources = apt_sources::parse_list(&main);
    let entries = fs::read_dir(folder.join("sources.list.d")).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        let text = fs::read_to_string(&path).unwrap_or_default();
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("list") => sources.extend(apt_sources::parse_list(&text)),
            Some("sources") => sources.extend(apt_sources::parse_deb822(&text)),
            _ => {}
        }
    }
    sources
}

fn show(tasks: &[Task]) {
    println!("these commands install one:");
    for task in tasks {
        println!("  {task}");
    }
}

fn ask(question: &str) -> Result<bool, Failure> {
    print!("{question}");
    io::stdout().flush().map_err(Failure::step)?;
    let mut answer = String::new();
    io::stdin().lock().read_line(&mut answer).map_err(Failure::step)?;
    Ok(matches!(answer.trim(), "y" | "Y" | "yes"))
}

fn carry_out(tasks: &[Task]) -> Result<(), Failure> {
    for task in tasks {
        println!("$ {task}");
        match run(task) {
            Err(Failure::Step(why)) if task.may_fail => println!("warning: {why}; trying to go on"),
            result => result?,
        }
    }
    Ok(())
}

fn run(task: &Task) -> Result<(), Failure> {
    let Some((program, arguments)) = task.words.split_first() else { return Ok(()) };
    let mut command = Command::new(program);
    command.args(arguments);
    let Some(text) = &task.stdin else { return process::run(&mut command) };
    let failed = |why: io::Error| Failure::step(format!("`{task}` failed: {why}"));
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).spawn().map_err(failed)?;
    if let Some(mut stdin) = child.stdin.take() {
        stdin.write_all(text.as_bytes()).map_err(failed)?;
    }
    let status = child.wait().map_err(failed)?;
    if status.success() { Ok(()) } else { Err(Failure::step(format!("`{task}` failed ({status})"))) }
}
