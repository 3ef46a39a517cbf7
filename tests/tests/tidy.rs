//! Tidiness as a test: the rules of the house that a program can check.
//!
//! Key decision: plain text scans over the files of the checkout, no parser. They are quick and explain themselves; the price is that a rule
//! can only see what is visible in a line or its neighbours.
//!
//! **Invariant:** every rule is a pure function from files to findings, tested on a planted fault besides the repository itself.

#[path = "tidy/rules.rs"]
mod rules;
#[path = "tidy/sources.rs"]
mod sources;

use sources::Sources;

/// Fails with one line per finding.
fn assert_clean(rule: impl Fn(&Sources) -> Vec<String>) {
    let sources = Sources::of_repository();
    assert!(sources.files.len() > 20, "the walk over the repository found {} files only", sources.files.len());
    let findings = rule(&sources);
    assert!(findings.is_empty(), "{} findings:\n  {}", findings.len(), findings.join("\n  "));
}

/// Asserts that a rule finds the fault in the first text, at the named place, and nothing in the second.
fn assert_kills(rule: impl Fn(&Sources) -> Vec<String>, path: &str, faulty: &str, place: &str, clean: &str) {
    let findings = rule(&Sources::planted(&[(path, faulty)]));
    assert!(findings.iter().any(|finding| finding.contains(place)), "{path}: fault not found at {place}: {findings:?}");
    let findings = rule(&Sources::planted(&[(path, clean)]));
    assert!(findings.is_empty(), "{path}: a clean file is accused: {findings:?}");
}

/// Kills: a Rust module without `//!`, a shader without a head comment.
#[test]
fn every_file_says_what_it_is() {
    assert_kills(rules::head_comments, "a/b.rs", "use std::fs;\n//! late\n", "a/b.rs:1", "//! What it is.\nuse std::fs;\n");
    assert_kills(rules::head_comments, "a/b.wgsl", "fn f() {}\n", "a/b.wgsl:1", "// What it is.\nfn f() {}\n");
    assert_clean(rules::head_comments);
}

/// Kills: a module that grew past 600 lines, a shader past 300.
#[test]
fn files_stay_small() {
    assert_kills(rules::sizes, "a/b.rs", &"\n".repeat(601), "a/b.rs", &"\n".repeat(600));
    assert_kills(rules::sizes, "a/b.wgsl", &"\n".repeat(301), "a/b.wgsl", &"\n".repeat(300));
    assert_clean(rules::sizes);
}

/// Kills: types and modules named after nothing (`SceneManager`, `utils.rs`), numbered variants, an entry point called `main`.
#[test]
fn names_say_something() {
    for (faulty, clean) in [
        ("\npub struct SceneManager;\n", "\npub struct SceneManaged;\n"),
        ("\nmod utils;\n", "\nmod utilisation;\n"),
        ("\n    pub(crate) enum MeshData {\n", "\n    pub(crate) enum Database {\n"),
        ("\ntrait TraceV2 {}\n", "\ntrait Trace2D {}\n"),
    ] {
        assert_kills(rules::names, "a/b.rs", faulty, "a/b.rs:2", clean);
    }
    let findings = rules::names(&Sources::planted(&[("a/scene_helpers.rs", "\n"), ("a/helpful.rs", "\n")]));
    assert_eq!(findings.len(), 1, "{findings:?}");
    assert_kills(rules::names, "a/b.wgsl", "//\nfn main() {}\n", "a/b.wgsl:2", "//\nfn main_axis() {}\n");
    assert_clean(rules::names);
}

/// Kills: notes to oneself, the same fact in two places under a plea, paths that exist on one machine only.
#[test]
fn words_that_are_banned() {
    for word in rules::BANNED_WORDS {
        assert_kills(rules::words, "a/b.rs", &format!("//!\n// {word}: later\n"), "a/b.rs:2", "//!\n// Done: now\n");
    }
    for path in rules::MACHINE_PATHS {
        let faulty = format!("\nlet path = \"{path}x/y\";\n");
        assert_kills(rules::words, "a/b.rs", &faulty, "a/b.rs:2", "\nlet path = \"network/home/x\";\n");
    }
    let plea = rules::PLEA.to_uppercase().replace(' ', "\t ");
    assert_kills(rules::words, "a/b.md", &format!("\nplease {plea} with x\n"), "a/b.md:2", "\nkeep it in synchrony\n");
    assert_clean(rules::words);
}

/// Kills: a hand-written loop over stages, which is what the library is there to generate.
#[test]
fn no_shader_schedules() {
    let faulty = "// A megakernel by hand.\nfn trace_all() {\n  loop {\n    if next_bounce(&path) == FINISH { break; }\n  }\n}\n";
    let clean =
        "// A stage.\nfn next_bounce(path: ptr<function, Path>) -> u32 {\n  for (var i = 0u; i < 4u; i++) {}\n  return FINISH;\n}\n";
    assert_kills(rules::schedules_in_shaders, "a/b.wgsl", faulty, "a/b.wgsl:4", clean);
    assert_clean(rules::schedules_in_shaders);
}

/// Kills: a test that nobody has seen fail, or whose fault is told by its neighbour's comment only.
#[test]
fn every_test_names_its_fault() {
    let faulty = "/// Kills: x.\n#[test]\nfn a() {}\n\n#[test]\nfn b() {}\n";
    let clean = "/// Kills: x.\n#[test]\nfn a() {}\n\n#[test]\nfn b() {\n    // Kills: y.\n}\n";
    assert_kills(rules::tests_name_faults, "a/b.rs", faulty, "a/b.rs:5", clean);
    let stolen = "#[test]\nfn a() {}\n\n/// Kills: x.\n#[test]\nfn b() {}\n";
    assert_kills(rules::tests_name_faults, "a/b.rs", stolen, "a/b.rs:1", clean);
    assert_clean(rules::tests_name_faults);
}

/// Kills: a command in the documents that xtask does not know.
#[test]
fn documented_commands_exist() {
    let xtask = ("crates/xtask/src/arguments.rs", "match word {\n  \"demo\" | \"setup\" => 1,\n}\n");
    let findings = rules::commands(&Sources::planted(&[xtask, ("README.md", "run `cargo xtask demo`\nthen `cargo xtask peers`\n")]));
    assert_eq!(findings.len(), 1, "{findings:?}");
    assert!(findings[0].starts_with("README.md:2"), "{findings:?}");
    assert_clean(rules::commands);
}

/// Kills: a package without a place on the map, a map that outgrew a reader's patience.
#[test]
fn the_map_is_complete_and_short() {
    let members = ("Cargo.toml", "[workspace]\nmembers = [\n    \"crates/a\",\n    \"b\",\n]\n");
    let findings = rules::code_map(&Sources::planted(&[members, ("ARCHITECTURE.md", "`crates/a` is there\n")]));
    assert_eq!(findings.len(), 1, "{findings:?}");
    assert!(findings[0].contains("`b`"), "{findings:?}");
    let long = format!("`crates/a` and `b`\n{}", "\n".repeat(200));
    assert_eq!(rules::code_map(&Sources::planted(&[members, ("ARCHITECTURE.md", &long)])).len(), 1);
    assert_clean(rules::code_map);
}
