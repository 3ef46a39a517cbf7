//! The command line of `cargo xtask`, as data.

use crate::{peers::Peer, process::Failure};

/// Printed on request and after every mistake in usage.
pub(crate) const USAGE: &str = "\
usage: cargo xtask COMMAND

  demo  [--yes]           set up, render a built-in scene, say where the picture is
  test  [--full] [--yes]  set up, then format, clippy, docs, book anchors and all tests
  bench WHAT [--quick]    figures of this device: core (tick, share, pins, wrappers), share alone, depth-sort (launches saved),
                          schedules (all of them, counted, timed, swept for their best settings and taken apart),
                          auto (how well it chooses)
        [--out FOLDER]    of schedules: write tables (CSV, Markdown) and charts (SVG) there
  peers [SCENE ...]       compare pictures with Mitsuba 3 and Cycles, and speed with Mitsuba (installed below target/tools)
        [--quick]         fewer runs
        [--only PEER]     with `mitsuba` or `cycles` alone
  book                    build the tutorial into book/book
  setup [--yes]           make sure that a Vulkan, Metal or Direct3D adapter exists

  --yes   install what is missing without asking (as does CI=true)
  --full  run the slow tests and the second WGSL compiler too";

/// One request, fully understood.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Invocation {
    /// Print the usage and succeed.
    Usage,
    /// Make sure that an adapter exists.
    Setup { agreed: bool },
    /// Render a built-in scene.
    Demo { agreed: bool },
    /// Run every check of the repository.
    Test { agreed: bool, full: bool },
    /// Compare with other renderers.
    Peers { scenes: Vec<String>, quick: bool, only: Option<Peer> },
    /// Build the tutorial.
    Book,
    /// Measure something on this device.
    Bench { what: String, quick: bool, out: Option<String> },
}

/// What can be measured.
const BENCHES: [&str; 5] = ["core", "share", "depth-sort", "schedules", "auto"];

/// Reads the words after `cargo xtask`.
///
/// # Errors
/// A [`Failure::Usage`] that names the word nobody understands.
pub(crate) fn parse(words: &[String]) -> Result<Invocation, Failure> {
    let Some((command, options)) = words.split_first() else {
        return Err(Failure::Usage("a command is missing".into()));
    };
    let allowed: &[&str] = match command.as_str() {
        "setup" | "demo" => &["--yes"],
        "test" => &["--yes", "--full"],
        "book" => &[],
        "bench" => return bench(options),
        "peers" => return peers(options),
        "help" | "--help" | "-h" => return Ok(Invocation::Usage),
        other => return Err(Failure::Usage(format!("there is no command `{other}`"))),
    };
    if let Some(stranger) = options.iter().find(|option| !allowed.contains(&option.as_str())) {
        return Err(Failure::Usage(format!("`{command}` knows no option `{stranger}`")));
    }
    let has = |name: &str| options.iter().any(|option| option == name);
    let agreed = has("--yes");
    Ok(match command.as_str() {
        "setup" => Invocation::Setup { agreed },
        "demo" => Invocation::Demo { agreed },
        "test" => Invocation::Test { agreed, full: has("--full") },
        _ => Invocation::Book,
    })
}

/// The words after `peers`.
fn peers(words: &[String]) -> Result<Invocation, Failure> {
    let (mut scenes, mut quick, mut only) = (Vec::new(), false, None);
    let mut words = words.iter();
    while let Some(word) = words.next() {
        match word.as_str() {
            "--quick" => quick = true,
            "--only" => {
                only = Some(match words.next().map(String::as_str) {
                    Some("mitsuba") => Peer::Mitsuba,
                    Some("cycles") => Peer::Cycles,
                    other => {
                        let found = other.map_or_else(|| "nothing".into(), |other| format!("`{other}`"));
                        return Err(Failure::Usage(format!("`--only` takes `mitsuba` or `cycles`, found {found}")));
                    }
                });
            }
            option if option.starts_with('-') => return Err(Failure::Usage(format!("`peers` knows no option `{option}`"))),
            scene => scenes.push(scene.to_owned()),
        }
    }
    Ok(Invocation::Peers { scenes, quick, only })
}

/// The words after `bench`.
fn bench(words: &[String]) -> Result<Invocation, Failure> {
    let known = || BENCHES.join(", ");
    let Some(what) = words.first().filter(|what| BENCHES.contains(&what.as_str())) else {
        return Err(Failure::Usage(format!("`bench` measures one of: {}", known())));
    };
    let (mut quick, mut out) = (false, None);
    let mut options = words[1..].iter();
    while let Some(option) = options.next() {
        match option.as_str() {
            "--quick" => quick = true,
            "--out" if what != "schedules" => {
                return Err(Failure::Usage(format!("`bench {what}` writes no files: `--out` belongs to `schedules`")));
            }
            "--out" => {
                let folder = options.next().filter(|folder| !folder.starts_with("--"));
                out = Some(folder.ok_or_else(|| Failure::Usage("`--out` needs a folder".into()))?.clone());
            }
            stranger => return Err(Failure::Usage(format!("`bench` knows no option `{stranger}`"))),
        }
    }
    Ok(Invocation::Bench { what: what.clone(), quick, out })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_line(line: &str) -> Result<Invocation, Failure> {
        parse(&line.split_whitespace().map(String::from).collect::<Vec<_>>())
    }

    /// Kills: an option that is accepted but not passed on, and `--full` leaking into commands that have no use for it.
    #[test]
    fn options_reach_their_command() {
        assert_eq!(parse_line("demo"), Ok(Invocation::Demo { agreed: false }));
        assert_eq!(parse_line("demo --yes"), Ok(Invocation::Demo { agreed: true }));
        assert_eq!(parse_line("setup --yes"), Ok(Invocation::Setup { agreed: true }));
        assert_eq!(parse_line("test --full"), Ok(Invocation::Test { agreed: false, full: true }));
        assert_eq!(parse_line("test --yes --full"), Ok(Invocation::Test { agreed: true, full: true }));
        assert_eq!(parse_line("book"), Ok(Invocation::Book));
        assert_eq!(parse_line("bench core --quick"), Ok(Invocation::Bench { what: "core".into(), quick: true, out: None }));
        assert_eq!(parse_line("peers"), Ok(Invocation::Peers { scenes: Vec::new(), quick: false, only: None }));
        let one = |only| Ok(Invocation::Peers { scenes: vec!["row".into()], quick: true, only });
        assert_eq!(parse_line("peers row --quick"), one(None));
        assert_eq!(parse_line("peers --quick --only cycles row"), one(Some(Peer::Cycles)));
        let schedules = |quick| Ok(Invocation::Bench { what: "schedules".into(), quick, out: Some("figures".into()) });
        assert_eq!(parse_line("bench schedules --out figures"), schedules(false));
        assert_eq!(parse_line("bench schedules --out figures --quick"), schedules(true));
        assert!(matches!(parse_line("demo --full"), Err(Failure::Usage(why)) if why.contains("--full")));
    }

    /// Kills: a misspelt command or option that is silently ignored.
    #[test]
    fn strangers_are_usage_errors() {
        let of_bench =
            ["bench", "bench cores", "bench core --fast", "bench core --out x", "bench schedules --out", "bench schedules --out --quick"];
        for line in ["", "tset", "test --ful", "book --yes", "peers --fast", "peers --only", "peers --only lux"].into_iter().chain(of_bench)
        {
            assert!(matches!(parse_line(line), Err(Failure::Usage(_))), "{line:?} was accepted");
        }
    }
}
