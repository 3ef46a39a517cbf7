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
