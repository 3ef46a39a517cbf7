//! What the library finds out about stages, against what was written down by hand.

use std::collections::BTreeSet;

use wavepool::{Program, layout::Layout, policy::RouletteScope, shader::LeafSet};
use wavepool_tests::traps::{STATE, TRAPS, Trap};

/// Leaf names of a set, without the leading dot.
fn names(layout: &Layout, set: &LeafSet) -> BTreeSet<String> {
    set.iter().map(|leaf| layout.leaves[leaf].path.trim_start_matches('.').to_owned()).collect()
}

/// The names that `words` stands for: `*` for all, `v` for everything below `v`.
fn expand(layout: &Layout, words: &str) -> BTreeSet<String> {
    let all = || layout.leaves.iter().map(|leaf| leaf.path.trim_start_matches('.').to_owned());
    let below = |name: &str, word: &str| {
        word == "*" || name.strip_prefix(word).is_some_and(|rest| rest.is_empty() || rest.starts_with('.') || rest.starts_with('['))
    };
    let mut found = BTreeSet::new();
    for word in words.split_whitespace() {
        let before = found.len();
        found.extend(all().filter(|name| below(name, word)));
        assert!(found.len() > before, "`{word}` names no leaf, or one that is named already");
    }
    found
}

fn trap_program(trap: &Trap) -> Program {
    let wgsl = format!(
        "{STATE}{}
         fn generate(p: ptr<function, State>, item: Item) {{}}
         fn end(p: ptr<function, State>) -> u32 {{ return FINISH; }}
         fn finish(p: ptr<function, State>) -> u32 {{ return 0u; }}",
        trap.wgsl
    );
    let program = Program::builder(trap.name).source("trap.wgsl", wgsl).stage("probe").stage("end").build();
    program.unwrap_or_else(|error| panic!("{}:\n{error}", trap.name))
}

/// Kills: a loop taken to run at least once; a switch without its default; a call, a pointer or a copy not followed; a run-time index
/// taken for element 0; a verdict in a variable taken for CONTINUE; a break that leaves the wrong loop.
#[test]
fn traps_have_the_committed_sets() {
    assert!(TRAPS.len() >= 20);
    let mut wrong = Vec::new();
    for trap in TRAPS {
        let program = trap_program(trap);
        let layout = program.layout(None);
        let summary = program.summary("probe").expect("the stage exists");
        let mut check = |what: &str, found: Option<&LeafSet>, expected: Option<&str>| {
            let found = found.map(|set| names(&layout, set));
            let expected = expected.map(|words| expand(&layout, words));
            if found != expected {
                wrong.push(format!("{}, {what}: found {found:?}, expected {expected:?}", trap.name));
            }
        };
        check("reads", Some(&summary.reads), Some(trap.reads));
        for (exit, written, expected) in
            [("continues", &summary.on_continue, trap.continues), ("finishes", &summary.on_finish, trap.finishes)]
        {
            let (must, may) = expected.split_once('/').map_or((None, None), |(must, may)| (Some(must), Some(may)));
            check(&format!("{exit}, must"), written.as_ref().map(|written| &written.must), must);
            check(&format!("{exit}, may"), written.as_ref().map(|written| &written.may), may);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Kills: a leaf counted twice or forgotten when a type is flattened.
#[test]
fn leaves_are_the_scalars_in_order() {
    let layout = trap_program(&TRAPS[0]).layout(None);
    let found: Vec<&str> = layout.leaves.iter().map(|leaf| leaf.path.as_str()).collect();
    let expected = ".a .b .c .n .k .v.x .v.y .v.z .m[0].x .m[0].y .m[1].x .m[1].y .list[0] .list[1] .list[2] .list[3] .inner.x \
                    .inner.y.x .inner.y.y .pair[0].x .pair[0].y.x .pair[0].y.y .pair[1].x .pair[1].y.x .pair[1].y.y";
    assert_eq!(found, expected.split_whitespace().collect::<Vec<_>>());
}

/// Kills: places where the analysis gives up that nobody is told about.
#[test]
fn widening_is_reported_with_its_line() {
    let wgsl = "struct State { a: f32, list: array<f32, 4>, n: u32 }
fn generate(p: ptr<function, State>, item: Item) {}
fn probe(p: ptr<function, State>) {
    (*p).a = (*p).list[(*p).n];
    let all = *p;
    (*p).a += all.a;
}
fn end(p: ptr<function, State>) -> u32 { return FINISH; }
fn finish(p: ptr<function, State>) -> f32 { return (*p).a; }";
    let program = Program::builder("widened").source("w.wgsl", wgsl).stage("probe").stage("end").build().expect("valid");
    assert_eq!(
        program.widened(),
        [
            "w.wgsl:4:14: an index known only at run time reads every element",
            "w.wgsl:3:10: `probe` copies the whole state, which reads all of it"
        ]
    );
}

fn flow(wgsl: &str, stages: &[&str]) -> Program {
    let builder = Program::builder("flow").source("flow.wgsl", wgsl.to_owned());
    stages.iter().fold(builder, |builder, stage| builder.stage(stage)).build().unwrap_or_else(|error| panic!("{error}"))
}

/// What a kernel of the layout moves, as text: `load | late | store`.
fn moves(layout: &Layout, stage: &str) -> String {
    let kernel = layout.kernels.iter().find(|kernel| kernel.stage == stage).expect("the stage exists");
    let words = |set| names(layout, set).into_iter().collect::<Vec<_>>().join(" ");
    format!("{} | {} | {}", words(&kernel.load), words(&kernel.load_late), words(&kernel.store))
}

/// Kills: planes for leaves that never leave a kernel; leaves loaded that the stage overwrites; what only `finish` reads loaded in
/// every step; a partly written leaf stored without having been loaded.
#[test]
fn planes_and_traffic_follow_the_lifetimes() {
    let program = flow(
        "struct Walk { total: f32, hop: f32, scratch: f32, left: u32, unread: f32, tag: u32, mark: f32, never: vec4f }
         fn generate(w: ptr<function, Walk>, item: Item) { (*w).left = item.pixel % 5u; (*w).tag = item.pixel; (*w).unread = 1.0; }
         fn trace(w: ptr<function, Walk>) { (*w).scratch = f32((*w).left); (*w).hop = (*w).scratch * 0.5; (*w).unread = (*w).hop; }
         fn shade(w: ptr<function, Walk>) -> u32 {
             if ((*w).left == 0u) { return FINISH; }
             if ((*w).hop > 1.0) { (*w).total += (*w).hop; (*w).mark = 2.0; }
             (*w).left -= 1u;
             return CONTINUE;
         }
         fn finish(w: ptr<function, Walk>) -> vec2f { return vec2f((*w).total, f32((*w).tag) + (*w).mark); }",
        &["trace", "shade"],
    );
    let layout = program.layout(None);
    assert_eq!(names(&layout, &layout.kept()), ["hop", "left", "mark", "tag", "total"].map(String::from).into());
    assert_eq!(names(&layout, &layout.generate), ["left", "mark", "tag", "total"].map(String::from).into());
    assert_eq!(moves(&layout, "trace"), "left |  | hop");
    assert_eq!(moves(&layout, "shade"), "hop left mark total | tag | left mark total");
    assert_eq!((layout.planes(), layout.bytes_per_lane()), (6, 24));
}

/// Kills: a leaf that is written on one way only taken as written when the walk finishes on another.
#[test]
fn finish_sees_what_was_there_before() {
    let program = flow(
        "struct Walk { a: f32, b: f32, left: u32 }
         fn generate(w: ptr<function, Walk>, item: Item) { (*w).left = 1u; }
         fn walk(w: ptr<function, Walk>) -> u32 {
             if ((*w).left == 0u) { (*w).b = 2.0; return FINISH; }
             (*w).left -= 1u;
             (*w).a = 1.0;
             return CONTINUE;
         }
         fn finish(w: ptr<function, Walk>) -> f32 { return (*w).a + (*w).b; }",
        &["walk"],
    );
    // `b` is written on every way that finishes: nobody keeps it. `a` is not, and `finish` alone reads it.
    assert_eq!(moves(&program.layout(None), "walk"), "left | a | a left");
}

/// Kills: leaves of the state in stage order only, without the way back from the last stage to the first.
#[test]
fn lifetimes_go_round_the_step() {
    let program = flow(
        "struct Walk { carried: f32, left: u32 }
         fn generate(w: ptr<function, Walk>, item: Item) { (*w).left = 3u; }
         fn first(w: ptr<function, Walk>) -> u32 { if ((*w).carried > 2.0) { return FINISH; } return CONTINUE; }
         fn second(w: ptr<function, Walk>) { (*w).carried = f32((*w).left); }
         fn third(w: ptr<function, Walk>) { (*w).left += 1u; }
         fn finish(w: ptr<function, Walk>) -> u32 { return (*w).left; }",
        &["first", "second", "third"],
    );
    let layout = program.layout(None);
    assert_eq!(moves(&layout, "first"), "carried | left | ");
    assert_eq!(moves(&layout, "second"), "left |  | carried");
    assert_eq!(moves(&layout, "third"), "left |  | left");
    assert_eq!(names(&layout, &layout.generate), ["carried", "left"].map(String::from).into());
}

/// Kills: what `survival` and `reweight` read not loaded; what a killed walk's `finish` reads taken as unneeded.
#[test]
fn roulette_is_part_of_the_last_stage() {
    let program = flow(
        "struct Walk { beta: f32, chance: f32, sum: f32 }
         fn generate(w: ptr<function, Walk>, item: Item) { (*w).beta = 1.0; (*w).chance = 0.5; }
         fn scatter(w: ptr<function, Walk>) { (*w).beta *= 0.9; }
         fn survival(w: ptr<function, Walk>) -> f32 { return (*w).chance; }
         fn reweight(w: ptr<function, Walk>, inverse_p: f32) { (*w).beta *= inverse_p; (*w).chance *= 0.99; }
         fn stop(w: ptr<function, Walk>) -> u32 { if ((*w).beta > 100.0) { return FINISH; } return CONTINUE; }
         fn finish(w: ptr<function, Walk>) -> f32 { return (*w).sum; }",
        &["stop", "scatter"],
    );
    assert_eq!(moves(&program.layout(Some(RouletteScope::Lane)), "scatter"), "beta chance | sum | beta chance");
    assert_eq!(moves(&program.layout(None), "scatter"), "beta |  | beta");
}

/// Kills: a leaf of the state for a member that no feature asks for; one feature set that leaks into another program of the same files;
/// an import that is followed, or a name that clashes, although a condition removes it.
#[test]
fn what_a_feature_removes_has_no_leaf() {
    let text = "@if(false) import package::nowhere::nothing;
        @if(false) fn step() {}
        struct Walk { left: u32, @if(counts) steps: vec2u, @if(false) never: f32, @else always: f32 }
        fn generate(walk: ptr<function, Walk>, item: Item) { (*walk).left = item.pixel; (*walk).always = 1.0; }
        fn step(walk: ptr<function, Walk>) -> u32 {
            @if(counts) (*walk).steps.y += 1u;
            return FINISH;
        }
        fn finish(walk: ptr<function, Walk>) -> u32 {
            @if(counts) { return (*walk).steps.y; }
            @else return (*walk).left;
        }";
    let of = |counts| {
        let program = Program::builder("walk").source("walk.wgsl", text).stage("step").feature("counts", counts).build();
        let program = program.unwrap_or_else(|error| panic!("{error}"));
        let layout = program.layout(None);
        let leaves: Vec<String> = layout.leaves.iter().map(|leaf| leaf.path.clone()).collect();
        let reads = names(&layout, &program.summary("step").expect("the stage exists").reads);
        (leaves, reads)
    };
    let (leaves, reads) = of(true);
    assert_eq!(leaves, [".left", ".steps.x", ".steps.y", ".always"]);
    assert_eq!(reads, BTreeSet::from(["steps.y".to_owned()]));
    let (leaves, reads) = of(false);
    assert_eq!(leaves, [".left", ".always"]);
    assert_eq!(reads, BTreeSet::new());
}

/// Kills: a constant that arrives as another value, or before which a module of the user is read.
#[test]
fn constants_of_the_host_are_there_for_all_modules() {
    let text = "import constants::{SIDES, IS_ROUND};
        struct Walk { list: array<f32, SIDES> }
        const_assert SIDES == 3u && IS_ROUND && LOW == -2147483648 && SCALE == 0.1f;
        fn generate(walk: ptr<function, Walk>, item: Item) {}
        fn step(walk: ptr<function, Walk>) -> u32 { return FINISH; }
        fn finish(walk: ptr<function, Walk>) -> f32 { return (*walk).list[1]; }";
    let builder = Program::builder("walk").source("walk.wgsl", text).stage("step");
    let builder = builder.constant("SIDES", 3u32).constant("IS_ROUND", true).constant("LOW", i32::MIN).constant("SCALE", 0.1f32);
    let program = builder.build().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(program.layout(None).leaves.len(), 3);
}
