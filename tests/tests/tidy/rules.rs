//! The rules, each a pure function from files to findings of the form `path:line: what is wrong`.

use crate::sources::{File, Sources};

/// Notes to oneself. Written in halves, so that this list does not accuse itself.
pub(crate) const BANNED_WORDS: [&str; 5] =
    [concat!("TO", "DO"), concat!("FIX", "ME"), concat!("XX", "X"), concat!("to", "do!"), concat!("unimpl", "emented!")];
/// Beginnings of paths that lead somewhere on one machine only.
pub(crate) const MACHINE_PATHS: [&str; 5] =
    [concat!("/wo", "rk/"), concat!("/ho", "me/"), concat!("/ro", "ot/"), concat!("/Us", "ers/"), concat!("C:", "\\Users\\")];
/// The plea that marks one fact in two places.
pub(crate) const PLEA: &str = concat!("keep in ", "sync");

/// Last words of names that say nothing.
const EMPTY_NAMES: [&str; 9] = ["manager", "helper", "helpers", "util", "utils", "data", "info", "misc", "common"];
/// Names that a file format gives and that its readers know by them: these stay.
const FOREIGN_NAMES: [&str; 1] = ["TextureInfo"];
/// Words after which a name is declared.
const DECLARATIONS: [&str; 6] = ["struct", "enum", "trait", "type", "mod", "union"];

const MAX_RUST_LINES: usize = 600;
const MAX_WGSL_LINES: usize = 300;
const MAX_MAP_LINES: usize = 200;
/// How far from its attribute a test's comment may be.
const COMMENT_REACH: usize = 12;

/// Every module begins with what it is.
pub(crate) fn head_comments(sources: &Sources) -> Vec<String> {
    let lacks = |file: &&File| {
        let first = file.text.lines().next().unwrap_or_default();
        (file.is(".rs") && !first.starts_with("//!")) || (file.is(".wgsl") && !first.starts_with("//"))
    };
    sources.files.iter().filter(lacks).map(|file| format!("{}:1: does not begin with a comment that says what it is", file.path)).collect()
}

/// Files that are too long to be about one thing.
pub(crate) fn sizes(sources: &Sources) -> Vec<String> {
    let mut findings = Vec::new();
    for file in &sources.files {
        let limit = match () {
            () if file.is(".rs") => MAX_RUST_LINES,
            () if file.is(".wgsl") => MAX_WGSL_LINES,
            () => continue,
        };
        let lines = file.text.lines().count();
        if lines > limit {
            findings.push(format!("{}: {lines} lines, the limit is {limit}", file.path));
        }
    }
    findings
}

/// Names of types, modules, files and entry points.
pub(crate) fn names(sources: &Sources) -> Vec<String> {
    let mut findings = Vec::new();
    for file in sources.files.iter().filter(|file| file.is(".rs") || file.is(".wgsl")) {
        let stem = file.path.rsplit('/').next().and_then(|name| name.split('.').next()).unwrap_or_default();
        if says_nothing(stem) {
            findings.push(format!("{}: a file named `{stem}` says nothing", file.path));
        }
        for (number, line) in file.lines() {
            if let Some(name) = declared_name(line).filter(|name| says_nothing(name) && !FOREIGN_NAMES.contains(name)) {
                findings.push(format!("{}:{number}: the name `{name}` says nothing", file.path));
            }
            if file.is(".wgsl") && line.trim_start().starts_with("fn main(") {
                findings.push(format!("{}:{number}: an entry point is named after what it does, not `main`", file.path));
            }
        }
    }
    findings
}

/// The name that a line declares, if it declares a type or a module.
fn declared_name(line: &str) -> Option<&str> {
    let mut words = line.split_whitespace().skip_while(|word| word.starts_with("pub") || *word == "unsafe" || *word == "in");
    if !DECLARATIONS.contains(&words.next()?) {
        return None;
    }
    words.next()?.split(|c: char| !(c.is_alphanumeric() || c == '_')).next()
}

/// True when the last word of a camel-case or snake-case name is empty talk or a version.
fn says_nothing(name: &str) -> bool {
    let start = name.rfind(|c: char| c.is_uppercase() || c == '_').unwrap_or(0);
    let last = name[start..].trim_start_matches('_').to_lowercase();
    let is_version = last.strip_prefix('v').is_some_and(|digits| !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit()));
    (is_version && start > 0) || EMPTY_NAMES.contains(&last.as_str())
}

/// Words and paths that must not be committed anywhere.
pub(crate) fn words(sources: &Sources) -> Vec<String> {
    let mut findings = Vec::new();
    for file in &sources.files {
        for (number, line) in file.lines() {
            let folded = line.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
            let plea = folded.contains(PLEA) && !folded.contains(&format!("{PLEA}h"));
            let word = BANNED_WORDS.iter().find(|word| contains_word(line, word));
            let path = MACHINE_PATHS.iter().find(|path| begins_path(line, path));
            for what in plea.then_some(&PLEA).into_iter().chain(word).chain(path) {
                findings.push(format!("{}:{number}: contains `{what}`", file.path));
            }
        }
    }
    findings
}

fn contains_word(line: &str, word: &str) -> bool {
    line.match_indices(word).any(|(start, _)| {
        let outside = |c: Option<char>| c.is_none_or(|c| !(c.is_alphanumeric() || c == '_'));
        outside(line[..start].chars().next_back()) && (word.ends_with('!') || outside(line[start + word.len()..].chars().next()))
    })
}

/// True when an absolute path begins here; `network/home/` has a folder before it and is none.
fn begins_path(line: &str, path: &str) -> bool {
    line.match_indices(path)
        .any(|(start, _)| line[..start].chars().next_back().is_none_or(|c| !(c.is_alphanumeric() || "._-}~>)".contains(c))))
}

/// Shaders that loop and call the functions which only generated code may call.
pub(crate) fn schedules_in_shaders(sources: &Sources) -> Vec<String> {
    let mut findings = Vec::new();
    for file in sources.files.iter().filter(|file| file.is(".wgsl")) {
        let code = || file.lines().map(|(number, line)| (number, line.split("//").next().unwrap_or_default()));
        let loops = code().any(|(_, line)| ["loop", "for", "while"].iter().any(|word| contains_word(line, word)));
        if !loops {
            continue;
        }
        for (number, line) in code().filter(|(_, line)| !line.trim_start().starts_with("fn ")) {
            for call in ["generate(", "next_bounce(", "finish("] {
                let called = line
                    .match_indices(call)
                    .any(|(start, _)| line[..start].chars().next_back().is_none_or(|c| !(c.is_alphanumeric() || c == '_')));
                if called {
                    findings
                        .push(format!("{}:{number}: calls `{call})` in a file with a loop; loops over stages are generated", file.path));
                }
            }
        }
    }
    findings
}

/// Every test tells, close by, which planted fault it kills.
pub(crate) fn tests_name_faults(sources: &Sources) -> Vec<String> {
    let mut findings = Vec::new();
    for file in sources.files.iter().filter(|file| file.is(".rs")) {
        let lines: Vec<&str> = file.text.lines().map(str::trim).collect();
        for (index, _) in lines.iter().enumerate().filter(|(_, line)| **line == "#[test]") {
            // A neighbour's comment does not count: upwards the test ends where the item before it ends, downwards at the next test.
            let above = lines[..index].iter().rev().take(COMMENT_REACH).take_while(|line| line.starts_with("//") || line.starts_with("#["));
            let below = lines[index + 1..].iter().take(COMMENT_REACH).take_while(|line| **line != "#[test]" && !line.starts_with("///"));
            if !above.chain(below).any(|line| line.starts_with("//") && line.contains("Kills")) {
                findings.push(format!("{}:{}: no comment says what this test `Kills`", file.path, index + 1));
            }
        }
    }
    findings
}

/// Each `cargo xtask WORD` in a document or script is a command of xtask.
pub(crate) fn commands(sources: &Sources) -> Vec<String> {
    let known = sources.text_of("crates/xtask/src/arguments.rs");
    let mut findings = Vec::new();
    for file in sources.files.iter().filter(|file| file.is(".md") || file.is(".ci/run")) {
        for (number, line) in file.lines() {
            for (start, call) in line.match_indices("cargo xtask ") {
                let word: String = line[start + call.len()..].chars().take_while(char::is_ascii_alphanumeric).collect();
                if !word.is_empty() && !known.contains(&format!("\"{word}\"")) {
                    findings.push(format!("{}:{number}: xtask has no command `{word}`", file.path));
                }
            }
        }
    }
    findings
}

/// ARCHITECTURE.md is short and names every package of the workspace.
pub(crate) fn code_map(sources: &Sources) -> Vec<String> {
    let map = sources.text_of("ARCHITECTURE.md");
    let manifest = sources.text_of("Cargo.toml");
    let members = manifest.split_once("members = [").and_then(|(_, rest)| rest.split_once(']')).map_or("", |(members, _)| members);
    let members: Vec<&str> = members.split('"').skip(1).step_by(2).collect();
    let mut findings = Vec::new();
    if members.is_empty() {
        findings.push("Cargo.toml: no list of workspace members".to_owned());
    }
    for member in members.iter().filter(|member| !map.contains(&format!("`{member}`"))) {
        findings.push(format!("ARCHITECTURE.md: the code map lacks `{member}`"));
    }
    let lines = map.lines().count();
    if lines >= MAX_MAP_LINES {
        findings.push(format!("ARCHITECTURE.md: {lines} lines, it must stay under {MAX_MAP_LINES}"));
    }
    findings
}
