//! Mistakes at the edges: of a file, of a character, of what is used, of what fits.

use wavepool::Program;

const SOUND: &str = "struct Walk { left: u32 }
fn generate(w: ptr<function, Walk>, item: Item) { (*w).left = item.pixel; }
fn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }
fn finish(w: ptr<function, Walk>) -> u32 { return (*w).left; }
";

fn refused(files: &[(&'static str, String)]) -> String {
    let builder = files.iter().fold(Program::builder("edge"), |builder, (name, text)| builder.source(*name, text.clone()));
    builder.stage("walk").build().expect_err("a mistake").to_string()
}

/// Kills: the rule about part pointers applied only to functions that a stage calls; naga writes the others too, and panics.
#[test]
fn a_part_pointer_is_refused_where_nobody_calls_it() {
    let unused = "fn helper(x: ptr<function, u32>) {}\nfn unused(w: ptr<function, Walk>) { helper(&(*w).left); }\n";
    let message = refused(&[("a.wgsl", format!("{SOUND}{unused}"))]);
    assert!(message.contains("a pointer to a part of a variable") && message.contains("a.wgsl:6:"), "{message}");
}

/// Kills: a place inside of a character of several bytes.
#[test]
fn a_malformed_import_may_end_in_any_character() {
    for text in ["import package::scène::é", "import é", "import package::{é", "import package::a::b é;"] {
        assert!(refused(&[("a.wgsl", text.to_owned())]).contains("import"), "{text}");
    }
}

/// Kills: a declaration that runs on into the next module, blamed on that one or on nobody.
#[test]
fn an_incomplete_last_declaration_is_found_in_its_own_file() {
    let message = refused(&[("a.wgsl", "const X = 1u // no end\n".into()), ("b.wgsl", SOUND.into())]);
    assert!(message.contains("a.wgsl:1:11") && message.contains("not complete"), "{message}");
    let message = refused(&[("b.wgsl", format!("{SOUND}const X = 1u"))]);
    assert!(message.contains("b.wgsl:5:11") && message.contains("not complete"), "{message}");
}

/// Kills: a state that takes all memory of the host before anything is refused.
#[test]
fn a_state_of_millions_of_scalars_is_refused() {
    let message = refused(&[("a.wgsl", SOUND.replace("left: u32", "left: u32, stack: array<vec4f, 100000000>"))]);
    assert!(message.contains("400000001 scalars") && message.contains("limit is 4096"), "{message}");
}
