//! What is refused, and in which words: every text is compared whole.
//!
//! Key decision: the texts lie together in `diagnostics.txt`, where a reader can judge them as prose; `WAVEPOOL_BLESS=1` rewrites the
//! file, and the change is then reviewed like any other.

use std::fmt::Write as _;

use wavepool::{Program, ProgramBuilder};

/// A program with one mistake. Parts left out are sound.
struct Mistake {
    name: &'static str,
    /// File and text, in the order given to the builder.
    files: &'static [(&'static str, &'static str)],
    stages: &'static [&'static str],
}

/// Mistakes in what is asked of features, which are `bends`, on, and `hops`, off.
const CONDITIONS: &[(&str, &str)] = &[
    ("unknown feature", "@if(bends && !hopps) const ONE = 1u;\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    ("elif without its if", "const ONE = 1u;\n@elif(hops) const TWO = 2u;\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    (
        "else behind else",
        "fn walk(w: ptr<function, Walk>) -> u32 {\n    @if(bends) return FINISH;\n    @else return CONTINUE;\n    @else return 2u;\n}\n",
    ),
    (
        "else with a condition",
        "fn walk(w: ptr<function, Walk>) -> u32 {\n    @if(bends) return FINISH;\n    @else(hops) return CONTINUE;\n}\n",
    ),
    ("condition without parentheses", "@if bends const ONE = 1u;\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    (
        "condition that mixes operators",
        "fn walk(w: ptr<function, Walk>) -> u32 {\n    @if(bends && hops || true) return FINISH;\n    return CONTINUE;\n}\n",
    ),
    ("empty condition", "@if() const ONE = 1u;\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    ("condition for no statement", "fn walk(w: ptr<function, Walk>) -> u32 {\n    return FINISH;\n    @if(bends)\n}\n"),
    ("two conditions for one node", "@if(bends) @if(!hops) const ONE = 1u;\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    (
        "condition behind an attribute",
        "@group(1) @if(bends) @binding(0) var<uniform> one: vec4f;\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n",
    ),
    ("condition for an argument", "fn walk(w: ptr<function, Walk>, @if(hops) item: Item) -> u32 { return FINISH; }\n"),
    ("condition for a statement without its semicolon", "fn walk(w: ptr<function, Walk>) -> u32 {\n    @if(hops) (*w).seed = 1u\n}\n"),
    (
        "mistake in a part that is removed",
        "fn walk(w: ptr<function, Walk>) -> u32 {\n    @if(hops) { @if(bend) (*w).seed = 1u; }\n    return FINISH;\n}\n",
    ),
    (
        "mistake behind removed parts",
        "@if(hops) /* Größe: ½ */ fn hop(w: ptr<function, Walk>) {\n    (*w).position += «;\n}\n\n@if(bends) fn walk(w: ptr<function, Walk>) -> u32 {\n    @if(hops) hop(w); @else (*w).sed += 1u;\n    return FINISH;\n}\n",
    ),
    ("name that a feature removed", "@if(hops) fn hop() {}\nfn walk(w: ptr<function, Walk>) -> u32 {\n    hop();\n    return FINISH;\n}\n"),
    (
        "imported name that a feature removed",
        "import package::rest::{Walk, jump};\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n",
    ),
    ("constant declared again", "const SIDES = 6u;\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    ("unknown constant", "import constants::{SIDES, SIDE};\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    ("constant of another type", "fn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = SIDES;\n    return FINISH;\n}\n"),
];

const STATE: &str = "struct Walk { position: f32, seed: u32 }\n";
const GENERATE: &str = "fn generate(w: ptr<function, Walk>, item: Item) { (*w).seed = item.pixel; }\n";
const FINISH: &str = "fn finish(w: ptr<function, Walk>) -> f32 { return (*w).position; }\n";
const STEP: &str = "fn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n";

/// Mistakes in one file; `STATE`, `GENERATE` and `FINISH` stand in a file of their own before it.
const IN_A_STAGE: &[(&str, &str)] = &[
    (
        "pointer to a member as argument",
        "fn hash(x: ptr<function, u32>) { *x = *x * 7u; }\nfn walk(w: ptr<function, Walk>) -> u32 {\n    hash(&(*w).seed);\n    return FINISH;\n}\n",
    ),
    (
        "pointer to a member through a let",
        "fn hash(x: ptr<function, u32>) { *x = *x * 7u; }\nfn walk(w: ptr<function, Walk>) -> u32 {\n    let seed = &(*w).seed;\n    hash(seed);\n    return FINISH;\n}\n",
    ),
    (
        "pointer to an element of a local array",
        "fn hash(x: ptr<function, u32>) { *x = *x * 7u; }\nfn walk(w: ptr<function, Walk>) -> u32 {\n    var words: array<u32, 4>;\n    hash(&words[2]);\n    return FINISH;\n}\n",
    ),
    (
        "pointer to a buffer's element",
        "@group(1) @binding(0) var<storage, read_write> log: array<u32>;\nfn note(x: ptr<storage, u32, read_write>) { *x = 1u; }\nfn walk(w: ptr<function, Walk>) -> u32 {\n    note(&log[3]);\n    return FINISH;\n}\n",
    ),
    ("stage with another argument", "fn walk(w: Walk) -> u32 {\n    return FINISH;\n}\n"),
    ("stage with too many arguments", "fn walk(w: ptr<function, Walk>, item: Item) -> u32 { return FINISH; }\n"),
    ("stage that returns bool", "fn walk(w: ptr<function, Walk>) -> bool { return true; }\n"),
    ("stage on another state", "struct Other { a: f32 }\nfn walk(o: ptr<function, Other>) -> u32 { return FINISH; }\n"),
    ("missing stage", "fn wander(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    (
        "survival without reweight",
        "fn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\nfn survival(w: ptr<function, Walk>) -> f32 { return 0.5; }\n",
    ),
    (
        "reweight with another argument",
        "fn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\nfn survival(w: ptr<function, Walk>) -> f32 { return 0.5; }\nfn reweight(w: ptr<function, Walk>, p: u32) {}\n",
    ),
    (
        "a key that writes",
        "fn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\nfn queue_key(w: ptr<function, Walk>) -> u32 { (*w).seed += 1u; return (*w).seed; }\n",
    ),
    (
        "a key of another type",
        "fn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\nfn queue_key(w: ptr<function, Walk>) -> f32 { return 1.0; }\n",
    ),
    ("no stage decides", "fn walk(w: ptr<function, Walk>) { (*w).position += 1.0; }\n"),
    ("type error in a stage", "fn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = (*w).seed;\n    return FINISH;\n}\n"),
    ("type error in an operand", "fn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = 1.0 + (*w).seed;\n    return FINISH;\n}\n"),
    ("unknown variable", "fn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = positon;\n    return FINISH;\n}\n"),
    ("unknown member", "fn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).positon = 1.0;\n    return FINISH;\n}\n"),
    ("syntax error", "fn walk(w: ptr<function, Walk>) -> u32 {\n    if (*w).seed == ) { return FINISH; }\n    return CONTINUE;\n}\n"),
    ("missing semicolon", "// A comment.\nfn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = 1.0\n    return FINISH;\n}\n"),
    (
        "after non-ASCII text",
        "// Größe: ½ Δx → «weit», 🙂\nfn walk(w: ptr<function, Walk>) -> u32 {\n    /* Ä */ let ß = 1.0; (*w).position = ß + länge;\n    return FINISH;\n}\n",
    ),
    ("tabs", "fn walk(w: ptr<function, Walk>) -> u32 {\n\t\treturn DONE;\n}\n"),
    (
        "missing closing brace at the end",
        "fn walk(w: ptr<function, Walk>) -> u32 {\n    if ((*w).seed == 0u) { return FINISH;\n    return CONTINUE;\n}\n",
    ),
    ("closing brace too many", "fn walk(w: ptr<function, Walk>) -> u32 {\n    return CONTINUE;\n}}\n"),
    ("comment without an end", "fn walk(w: ptr<function, Walk>) -> u32 {\n    /* never closed\n    return CONTINUE;\n}\n"),
    ("private variable", "var<private> total: f32;\nfn walk(w: ptr<function, Walk>) -> u32 {\n    total += 1.0;\n    return FINISH;\n}\n"),
    (
        "private variable behind a call",
        "var<private> total: f32;\nfn add() { total += 1.0; }\nfn walk(w: ptr<function, Walk>) -> u32 {\n    add();\n    return FINISH;\n}\n",
    ),
    (
        "workgroup variable",
        "var<workgroup> shared_sum: array<u32, 64>;\nfn walk(w: ptr<function, Walk>) -> u32 {\n    shared_sum[0] = 1u;\n    return FINISH;\n}\n",
    ),
    ("barrier", "fn walk(w: ptr<function, Walk>) -> u32 {\n    workgroupBarrier();\n    return FINISH;\n}\n"),
    ("storage barrier", "fn walk(w: ptr<function, Walk>) -> u32 {\n    storageBarrier();\n    return FINISH;\n}\n"),
    (
        "subgroup operation",
        "fn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = subgroupAdd((*w).position);\n    return FINISH;\n}\n",
    ),
    (
        "float atomic",
        "@group(1) @binding(0) var<storage, read_write> sums: array<atomic<f32>>;\nfn walk(w: ptr<function, Walk>) -> u32 {\n    atomicAdd(&sums[0], 1.0);\n    return FINISH;\n}\n",
    ),
    (
        "store to a buffer",
        "@group(1) @binding(0) var<storage, read_write> log: array<u32>;\nfn walk(w: ptr<function, Walk>) -> u32 {\n    log[0] = 1u;\n    return FINISH;\n}\n",
    ),
    (
        "store to a buffer through a let",
        "struct Log { lines: array<vec4u> }\n@group(1) @binding(0) var<storage, read_write> log: Log;\nfn walk(w: ptr<function, Walk>) -> u32 {\n    let line = &log.lines[2];\n    (*line).y = 1u;\n    return FINISH;\n}\n",
    ),
    (
        "store to a texture",
        "@group(1) @binding(0) var picture: texture_storage_2d<rgba8unorm, write>;\nfn walk(w: ptr<function, Walk>) -> u32 {\n    textureStore(picture, vec2u(1u), vec4f(1.0));\n    return FINISH;\n}\n",
    ),
    (
        "derivative",
        "@group(1) @binding(0) var picture: texture_2d<f32>;\n@group(1) @binding(1) var nearest: sampler;\nfn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = textureSample(picture, nearest, vec2f(0.5)).x;\n    return FINISH;\n}\n",
    ),
    ("entry point", "fn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n@compute @workgroup_size(64)\nfn mine() { }\n"),
    (
        "reserved binding",
        "@group(0) @binding(7) var<uniform> settings: vec4f;\nfn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = settings.x;\n    return FINISH;\n}\n",
    ),
    (
        "bindings that collide",
        "@group(1) @binding(0) var<uniform> one: vec4f;\n@group(1) @binding(0) var<uniform> two: vec4f;\nfn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = one.x + two.x;\n    return FINISH;\n}\n",
    ),
    ("reserved name declared", "fn wf_mine() {}\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    ("reserved name used", "fn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).seed = wf_control.step;\n    return FINISH;\n}\n"),
    ("name of the contract declared", "const FINISH = 3u;\nfn walk(w: ptr<function, Walk>) -> u32 { return 1u; }\n"),
    ("name that generated code uses", "fn read(x: f32) -> f32 { return x; }\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    (
        "built-in function that generated code uses",
        "fn min(x: f32, y: f32) -> f32 { return x * y; }\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n",
    ),
    ("recursion", "fn down(x: u32) -> u32 { return down(x); }\nfn walk(w: ptr<function, Walk>) -> u32 { return down(1u); }\n"),
    (
        "declared twice across files",
        "fn generate(w: ptr<function, Walk>, item: Item) {}\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n",
    ),
    (
        "declared twice in a file",
        "fn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n",
    ),
    ("unknown module", "import package::wander::{hop};\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    ("unknown package", "import wavepol::math::random::{pcg4d};\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    (
        "unknown imported name",
        "import wavepool::math::random::{pcg4d, unit_f23};\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n",
    ),
    ("import without a semicolon", "import wavepool::math::random::{pcg4d}\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    ("import with dots", "import wavepool.math.random;\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    ("import of nothing", "import wavepool::math::random::{};\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
    (
        "import after a declaration",
        "const ONE = 1u;\nimport wavepool::math::random::{pcg4d};\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n",
    ),
    (
        "name used without its import",
        "fn walk(w: ptr<function, Walk>) -> u32 {\n    (*w).position = unit_f32(7u);\n    return FINISH;\n}\n",
    ),
];

/// Mistakes outside of the stage.
const ELSEWHERE: &[Mistake] = &[
    Mistake {
        name: "bool in the state",
        files: &[(
            "walk.wgsl",
            "struct Walk {\n    alive: bool,\n}\nfn generate(w: ptr<function, Walk>, item: Item) {}\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\nfn finish(w: ptr<function, Walk>) -> f32 { return 1.0; }\n",
        )],
        stages: &["walk"],
    },
    Mistake {
        name: "state that is no struct",
        files: &[(
            "walk.wgsl",
            "fn generate(w: ptr<function, f32>, item: Item) {}\nfn walk(w: ptr<function, f32>) -> u32 { return FINISH; }\nfn finish(w: ptr<function, f32>) -> f32 { return 1.0; }\n",
        )],
        stages: &["walk"],
    },
    Mistake {
        name: "result that cannot be summed",
        files: &[
            ("state.wgsl", STATE),
            ("walk.wgsl", GENERATE),
            ("stage.wgsl", STEP),
            ("finish.wgsl", "\nfn finish(w: ptr<function, Walk>) -> i32 {\n    return 1;\n}\n"),
        ],
        stages: &["walk"],
    },
    Mistake { name: "no finish", files: &[("state.wgsl", STATE), ("walk.wgsl", GENERATE), ("stage.wgsl", STEP)], stages: &["walk"] },
    Mistake {
        name: "stage given twice",
        files: &[("state.wgsl", STATE), ("walk.wgsl", GENERATE), ("stage.wgsl", STEP), ("finish.wgsl", FINISH)],
        stages: &["walk", "walk"],
    },
    Mistake {
        name: "no stage at all",
        files: &[("state.wgsl", STATE), ("walk.wgsl", GENERATE), ("stage.wgsl", STEP), ("finish.wgsl", FINISH)],
        stages: &[],
    },
    Mistake {
        name: "brace open at the end of a file that is not the last",
        files: &[
            ("state.wgsl", STATE),
            ("walk.wgsl", "fn generate(w: ptr<function, Walk>, item: Item) {\n    (*w).seed = item.pixel;\n"),
            ("stage.wgsl", STEP),
            ("finish.wgsl", FINISH),
        ],
        stages: &["walk"],
    },
    Mistake {
        name: "mistake behind blanked imports",
        files: &[
            ("state.wgsl", STATE),
            (
                "hop.wgsl",
                "import package::state::Walk; // Größe\nimport /* Ø */ wavepool::math::random::{\n    pcg4d, /* ½ */\n    unit_f32,\n};\n\nfn hop(w: ptr<function, Walk>) {\n    (*w).position += unit_f32((*w).sed);\n}\n",
            ),
            ("walk.wgsl", GENERATE),
            ("stage.wgsl", STEP),
            ("finish.wgsl", FINISH),
        ],
        stages: &["walk"],
    },
    Mistake {
        name: "two mistakes in two files",
        files: &[("one.wgsl", "import package::nowhere::a;\n"), ("two.wgsl", "import package::nowhere::b;\n")],
        stages: &["walk"],
    },
];

fn refusal(files: &[(&str, &str)], stages: &[&str]) -> String {
    refusal_of(Program::builder("mistake"), files, stages)
}

fn refusal_of(builder: ProgramBuilder, files: &[(&str, &str)], stages: &[&str]) -> String {
    let builder = files.iter().fold(builder, |builder, (file, text)| builder.source((*file).to_owned(), (*text).to_owned()));
    let builder = stages.iter().fold(builder, |builder, stage| builder.stage(stage));
    builder.build().map_or_else(|error| error.to_string(), |_| "NOT REFUSED".into())
}

/// Kills: offsets that drift over imports, files or characters of several bytes; a rule of a stage that is no longer checked; a panic
/// of naga on a pointer to a member; mistakes blamed on generated code.
#[test]
fn refusals_read_as_committed() {
    let mut found = String::new();
    let mut add = |name: &str, text: &str| {
        let _ = writeln!(found, "== {name}\n{}\n", text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n"));
    };
    let before = format!("{STATE}{GENERATE}{FINISH}");
    for (name, text) in IN_A_STAGE {
        add(name, &refusal(&[("rest.wgsl", &before), ("stages/walk.wgsl", text)], &["walk"]));
    }
    let rest = format!("{before}@if(hops) fn jump() {{}}\n");
    let builder = Program::builder("mistake").feature("bends", true).feature("hops", false).constant("SIDES", 6u32);
    for (name, text) in CONDITIONS {
        add(name, &refusal_of(builder.clone(), &[("rest.wgsl", &rest), ("stages/walk.wgsl", text)], &["walk"]));
    }
    let sound = [("rest.wgsl", before.as_str()), ("walk.wgsl", STEP)];
    let builder = || Program::builder("mistake");
    for (name, builder) in [
        ("feature given twice", builder().feature("hops", true).feature("hops", false)),
        ("feature without a name", builder().feature("normal maps", true)),
        ("constant that is not a number", builder().constant("SCALE", f32::NAN)),
        ("constant with a reserved name", builder().constant("wf_lanes", 1u32)),
        ("constant without a name", builder().constant("2D", true)),
        ("constant with the name of a keyword", builder().constant("loop", -1)),
        ("constant with a name of the contract", builder().constant("FINISH", 1u32)),
        ("constant given twice", builder().constant("SCALE", 1.0).constant("SCALE", 2.0)),
    ] {
        add(name, &refusal_of(builder, &sound, &["walk"]));
    }
    for mistake in ELSEWHERE {
        add(mistake.name, &refusal(mistake.files, mistake.stages));
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/link/diagnostics.txt");
    if std::env::var_os("WAVEPOOL_BLESS").is_some() {
        std::fs::write(path, &found).expect("the folder is writable");
    }
    let expected = std::fs::read_to_string(path).unwrap_or_default().replace("\r\n", "\n");
    let sections = |text: &str| text.split("== ").map(str::to_owned).collect::<Vec<_>>();
    for (found, expected) in sections(&found).iter().zip(sections(&expected)) {
        assert!(*found == expected, "found\n{found}\nexpected\n{expected}");
    }
    assert_eq!(found, expected);
    assert!(!found.contains("NOT REFUSED") && !found.contains("generated by wavepool"));
}

/// Random damage to sound programs: characters lost, doubled and swapped, lines cut, words replaced.
/// Kills: a panic of the library on any text; a message that points behind the end of a file or into the middle of a character.
#[test]
fn damaged_programs_never_panic() {
    let conditions = "@if(a) struct Walk { position: f32, seed: u32 } @else struct Walk { a: u32, }
        fn generate(w: ptr<function, Walk>, item: Item) { @if(!a) { hop(); } @else (*w).seed = item.pixel; }
        fn walk(w: ptr<function, Walk>) -> u32 { switch (*w).seed { @if(a) case 1u: { return FINISH; } default: {} } return FINISH; }";
    let sound = [
        include_str!("../../../examples/collatz/src/collatz.wgsl").to_owned(),
        format!("{conditions}\n{FINISH}"),
        format!("import wavepool::math::random::{{pcg4d, unit_f32}};\n{STATE}{GENERATE}{STEP}{FINISH}"),
        format!(
            "// Größe ½\n{STATE}/* Ä /* ö */ ü */\n{GENERATE}{STEP}{FINISH}@group(1) @binding(0) var<storage, read> t: array<vec4f>;\n"
        ),
    ];
    let words = [
        "fn",
        "{",
        "}",
        "(",
        ")",
        ";",
        "ptr<function, Walk>",
        "&(*w).seed",
        "loop",
        "é",
        "/*",
        "*/",
        "import",
        "@if(a)",
        "@elif(",
        "@else",
        "@",
        "wf_x",
        "array<Walk, 3>",
        "0x7fffffff",
        "*w",
    ];
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below.max(1)
    };
    let mut refused = 0;
    for round in 0..3000 {
        let mut text: Vec<char> = sound[round % sound.len()].chars().collect();
        for _ in 0..=random(3) {
            let at = random(text.len());
            match random(4) {
                0 => drop(text.drain(at..(at + 1 + random(6)).min(text.len()))),
                1 => text.insert(at, text[at]),
                2 => text.truncate(at.max(20)),
                _ => drop(text.splice(at..at, words[random(words.len())].chars())),
            }
        }
        let text: String = text.into_iter().collect();
        let stage = if round % sound.len() == 0 { "step" } else { "walk" };
        let builder = Program::builder("damaged").feature("a", true).source("damaged.wgsl", text.clone()).stage(stage);
        let outcome = std::panic::catch_unwind(|| builder.build().map(drop));
        match outcome {
            Ok(Ok(())) => {}
            Ok(Err(error)) => {
                refused += 1;
                let message = error.to_string();
                assert!(message.starts_with("error: ") && !message.contains("generated by wavepool"), "round {round}: {message}\n{text}");
            }
            Err(_) => panic!("round {round}: panic on\n{text}"),
        }
    }
    assert!((1000..3000).contains(&refused), "{refused} programs refused");
}
