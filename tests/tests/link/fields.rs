//! What a program declares about fields of its state, and in which words it is refused.

use wavepool::{
    Error, Program,
    layout::{Layout, Storage},
};

const WGSL: &str = "struct Inner { x: f32, y: vec2f }
struct Walk { direction: vec3f, beta: vec3f, left: u32, pair: array<Inner, 2>, uv: vec2f, frame: mat2x2f }
fn generate(w: ptr<function, Walk>, item: Item) { (*w).left = 3u; }
fn aim(w: ptr<function, Walk>) { (*w).direction.x = 1.0; (*w).uv = (*w).pair[1].y; }
fn walk(w: ptr<function, Walk>) -> u32 {
    (*w).beta += (*w).direction + vec3f((*w).uv, 0.0);
    (*w).left -= 1u;
    if ((*w).left == 0u) { return FINISH; }
    return CONTINUE;
}
fn finish(w: ptr<function, Walk>) -> vec3f { return (*w).beta; }";

fn build(formats: &[(&str, Storage)]) -> Result<Program, Error> {
    let builder = Program::builder("fields").source("fields.wgsl", WGSL).stage("aim").stage("walk");
    formats.iter().fold(builder, |builder, (field, storage)| builder.storage(field, *storage)).build()
}

fn refusal(formats: &[(&str, Storage)]) -> String {
    build(formats).expect_err("refused").to_string()
}

/// Kills: a format for a field that does not exist, of the wrong type, or declared twice, taken in silence; a message without the field
/// or without what there is.
#[test]
fn formats_that_do_not_fit_are_refused() {
    assert_eq!(
        refusal(&[("directoin", Storage::UnitVector)]),
        "field `directoin`: the state has no such field; it has direction: vec3f, beta: vec3f, left: u32, pair[].x: f32, pair[].y: vec2f, \
         uv: vec2f, frame: mat2x2f"
    );
    assert_eq!(refusal(&[("left", Storage::HalfPair)]), "field `left`: it is a u32; the format half_pair takes a vec2f");
    assert_eq!(refusal(&[("uv", Storage::Rgb9e5)]), "field `uv`: it is a vec2f; the format rgb9e5 takes a vec3f");
    assert_eq!(
        refusal(&[("beta", Storage::Rgb9e5), ("beta", Storage::Word)]),
        "field `beta`: its format is declared twice: rgb9e5 before, word now"
    );
    assert_eq!(
        refusal(&[("pair[].y", Storage::HalfPair), ("pair[1].y", Storage::HalfPair)]),
        "field `pair[1].y`: its format is declared twice: half_pair as `pair[].y` before, half_pair now"
    );
    assert!(matches!(build(&[("nothing", Storage::Word)]), Err(Error::Field { field, .. }) if field == "nothing"));
}

fn moves(layout: &Layout, leaf: &str) -> Vec<String> {
    let rows = layout.rows();
    let row = rows.iter().find(|row| row.leaf == leaf).unwrap_or_else(|| panic!("no row `{leaf}`:\n{}", layout.table()));
    row.stages.iter().map(|moves| format!("{} {}/{}", moves.marks(), moves.bytes_read, moves.bytes_written)).collect()
}

/// Kills: a vector in one word moved leaf by leaf; a word written in part and stored without the rest; a table that does not tell formats.
#[test]
fn a_cell_moves_as_a_whole() {
    let plain = build(&[]).expect("a program").layout(None);
    assert_eq!(moves(&plain, "direction.x"), ["w 0/4", "r 4/0"]);
    assert_eq!(moves(&plain, "direction.y"), [" 0/0", "r 4/0"]);
    let formats =
        [("direction", Storage::UnitVector), ("beta", Storage::Rgb9e5), ("uv", Storage::HalfPair), ("pair[].y", Storage::HalfPair)];
    let packed = build(&formats).expect("a program").layout(None);
    assert_eq!(moves(&packed, "direction"), ["rw 4/4", "r 4/0"]);
    assert_eq!(moves(&packed, "uv"), ["w 0/4", "r 4/0"]);
    assert_eq!(moves(&packed, "pair[1].y"), ["r 4/0", " 0/0"]);
    assert_eq!(packed.rows().iter().find(|row| row.leaf == "pair[0].y").and_then(|row| row.plane), None);
    assert_eq!((plain.planes_unshared(), packed.planes_unshared()), (12, 6));
    let table = packed.table();
    for word in ["storage", "unit_vector", "rgb9e5", "half_pair"] {
        assert!(table.contains(word) && !plain.table().contains(word), "{word}\n{table}");
    }
    for (layout, kernel) in [(&plain, 0), (&packed, 0), (&packed, 1)] {
        let sum = layout
            .rows()
            .iter()
            .map(|row| &row.stages[kernel])
            .fold((4, 0), |sum, moves| (sum.0 + moves.bytes_read as usize, sum.1 + moves.bytes_written as usize));
        assert_eq!(sum, layout.kernels[kernel].bytes());
    }
}

const ARRAY_STATE: &str = "struct Vertex { position: vec3f, weight: f32 }
struct Walk { count: u32, vertices: array<Vertex, 4>, sum: f32 }
fn generate(w: ptr<function, Walk>, item: Item) { store_vertices(w, 0u, Vertex(vec3f(1.0), 2.0)); }
fn finish(w: ptr<function, Walk>) -> f32 { return (*w).sum; }
";

fn array_refusal(member: &str, wgsl: &str) -> String {
    let builder = Program::builder("arrays").source("arrays.wgsl", format!("{ARRAY_STATE}{wgsl}")).stage("walk");
    builder.array(member).build().expect_err("refused").to_string()
}

/// Kills: a walk that passes by the accessors, which the wavefront would not see; a place shown in the wrong line; no way out named.
#[test]
fn arrays_are_reached_through_accessors_alone() {
    let walk =
        |body: &str| array_refusal("vertices", &format!("fn walk(w: ptr<function, Walk>) -> u32 {{\n    {body}\n    return FINISH;\n}}\n"));
    assert_eq!(
        walk("(*w).sum = (*w).vertices[(*w).count].weight;"),
        "error: `walk` reaches into the array `vertices`
  ┌─ arrays.wgsl:6:16
  │
6 │     (*w).sum = (*w).vertices[(*w).count].weight;
  │                ^^^^^^^^^^^^^ use `load_vertices(state, index)` and `store_vertices(state, index, value)`"
    );
    assert_eq!(
        walk("*w = Walk();"),
        "error: `walk` assigns the whole state, which holds `vertices`
  ┌─ arrays.wgsl:6:5
  │
6 │     *w = Walk();
  │     ^^^^^^^^^^^ assign the members that change"
    );
    assert_eq!(
        walk("var other: Walk; store_vertices(&other, 0u, Vertex());"),
        "error: `walk` makes a second state `other`, with `vertices`
  ┌─ arrays.wgsl:6:5
  │
6 │     var other: Walk; store_vertices(&other, 0u, Vertex());
  │     ^^^^^^^^^^^^^^^ there is one state per lane: keep the members that you need"
    );
    let copy = walk("let all = *w; (*w).sum = all.sum;");
    assert!(copy.starts_with("error: `walk` copies the whole state, which holds `vertices`") && copy.contains("arrays.wgsl:5:9"), "{copy}");
    assert_eq!(
        array_refusal("vertices", "fn load_vertices() {}\nfn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n"),
        "error: `load_vertices` is declared by the scheduler for the array `vertices`
  ┌─ arrays.wgsl:5:4
  │
5 │ fn load_vertices() {}
  │    ^^^^^^^^^^^^^ choose another name"
    );
    let sound = "fn walk(w: ptr<function, Walk>) -> u32 { return FINISH; }\n";
    assert_eq!(array_refusal("vertexes", sound), "field `vertexes`: `Walk` has no such member; it has count, vertices, sum");
    assert_eq!(array_refusal("sum", sound), "field `sum`: it is `f32`; accessors are for `array<ELEMENT, LENGTH>`");
}

/// Kills: an array in the leaves' planes; a row without its bytes or without who loads and stores; planes for what nobody loads.
#[test]
fn an_array_has_one_row() {
    let layout = wavepool_tests::arrays::packed_web().layout(None);
    let rows = layout.rows();
    let row = rows.iter().find(|row| row.leaf == "vertices[6]").unwrap_or_else(|| panic!("no row\n{}", layout.table()));
    // Position and direction in a word each, weight, mark.
    assert_eq!(row.bytes, 6 * 4 * 4);
    assert_eq!(row.stages.iter().map(|moves| moves.marks()).collect::<Vec<_>>(), ["rw", "rf"]);
    assert_eq!((row.stages[0].bytes_read, row.stages[1].bytes_written), (16, 0));
    assert!(layout.table().contains("96 bytes"), "{}", layout.table());
    let links = layout.arrays.iter().find(|array| array.name == "links").expect("it is there");
    assert_eq!(links.plane, row.plane.map(|plane| plane + 24));
    assert_eq!(layout.planes(), links.plane.unwrap_or(0) + 5);
    assert!(layout.plane_of.iter().flatten().all(|plane| Some(*plane) < row.plane));
    let text = format!("{ARRAY_STATE}fn walk(w: ptr<function, Walk>) -> u32 {{ (*w).sum += 1.0; return FINISH; }}");
    let unread = Program::builder("unread").source("unread.wgsl", text).stage("walk").array("vertices").build().expect("a program");
    assert_eq!(unread.layout(None).planes(), 2);
}
