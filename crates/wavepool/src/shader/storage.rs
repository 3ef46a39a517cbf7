//! How leaves get into registers and back: pins, storage formats, loads, stores, poison.
//!
//! Key decision: a packed cell goes through its format right after a function that may have written it, in every execution and with pins
//! off too ([`settle`]); what the wavefront later stores and loads is then the word itself, because decoding, encoding and decoding again
//! changes nothing. So values that were clamped are counted once, and alike everywhere.
//!
//! **Invariant:** what is settled was loaded or written before; garbage is never counted.

use std::fmt::Write as _;

use super::{LeafSet, Summary, generate::Glue};
use crate::layout::{BLOCK, Cell, Leaf, Scalar, Storage};

pub(super) fn to_word(scalar: Scalar, expression: &str) -> String {
    match scalar {
        Scalar::U32 => expression.to_owned(),
        _ => format!("bitcast<u32>({expression})"),
    }
}

pub(super) fn from_word(scalar: Scalar, expression: &str) -> String {
    match scalar {
        Scalar::U32 => expression.to_owned(),
        scalar => format!("bitcast<{}>({expression})", scalar.wgsl()),
    }
}

/// A value through an integer `or` with a zero that the compiler cannot see: no algebra crosses it. Not `xor`: a leaf that two pins touch
/// without a use between them would come out bare, since `x ^ z ^ z` is `x` (lavapipe does see that). Integers too: a float may travel as
/// its bits.
fn pinned(scalar: Scalar, expression: &str) -> String {
    from_word(scalar, &format!("({} | wf_control.opaque_zero)", to_word(scalar, expression)))
}

/// `wf_pin`, which passes every leaf of the state through [`pinned`], and what the formats in use need.
pub(super) fn pin(glue: &Glue, out: &mut String) {
    let one = if glue.pins { pinned(Scalar::F32, "x") } else { "x".into() };
    let _ = writeln!(out, "fn wf_pin_f32(x: f32) -> f32 {{ return {one}; }}");
    let _ = writeln!(out, "fn wf_pin(wf_state: ptr<function, {}>) {{", glue.interface.state);
    let is_element = |leaf: usize| glue.interface.arrays.iter().any(|array| array.leaves.contains(&leaf));
    let mut leaves = glue.interface.leaves.iter().enumerate().filter(|(leaf, _)| !is_element(*leaf)).map(|(_, leaf)| leaf);
    pin_leaves(glue, &mut leaves, "(*wf_state)", out);
    out.push_str("}\n");
    for storage in Storage::ALL {
        let elements = glue.interface.arrays.iter().flat_map(|array| &array.cells);
        if glue.interface.cells.iter().chain(elements).any(|cell| cell.storage == storage) {
            format_functions(storage, out);
        }
    }
}

/// Pins the leaves of whatever lies at `place`.
pub(super) fn pin_leaves(glue: &Glue, leaves: &mut dyn Iterator<Item = &Leaf>, place: &str, out: &mut String) {
    for leaf in leaves.filter(|_| glue.pins) {
        let place = format!("{place}{}", leaf.path);
        let _ = writeln!(out, "    {place} = {};", pinned(leaf.scalar, &place));
    }
}

/// Into a word, out of it, and there and back with the ledger's word for what does not fit.
fn format_functions(storage: Storage, out: &mut String) {
    let (name, Some(shape)) = (storage.name(), storage.shape()) else { return };
    let each: Vec<String> = "xyz".chars().take(if shape == "vec2f" { 2 } else { 3 }).map(|part| format!("wf_pin_f32(v.{part})")).collect();
    let each = each.join(", ");
    let _ = write!(
        out,
        "fn wf_pack_{name}(v: {shape}) -> u32 {{ return encode_{name}({shape}({each})) | wf_control.opaque_zero; }}\n\
         fn wf_unpack_{name}(word: u32) -> {shape} {{\n    \
         let v = decode_{name}(word);\n    \
         return {shape}({each});\n\
         }}\n\
         fn wf_settle_{name}(v: {shape}) -> {shape} {{\n    \
         if (!{name}_fits({shape}({each}))) {{ atomicAdd(&wf_counters[WF_STORAGE_CLAMPED], 1u); }}\n    \
         return wf_unpack_{name}(wf_pack_{name}(v));\n\
         }}\n"
    );
}

/// The word of a cell that lies at `place`.
pub(super) fn packed(cell: &Cell, leaves: &[Leaf], place: &str) -> String {
    let value = format!("{place}{}", cell.path);
    match cell.storage {
        Storage::Word => to_word(leaves[cell.leaves.start].scalar, &value),
        storage => format!("wf_pack_{}({value})", storage.name()),
    }
}

/// The value of a cell from its word.
pub(super) fn unpacked(cell: &Cell, leaves: &[Leaf], word: &str) -> String {
    match cell.storage {
        Storage::Word => from_word(leaves[cell.leaves.start].scalar, word),
        storage => format!("wf_unpack_{}({word})", storage.name()),
    }
}

fn cells_of<'a>(glue: &'a Glue, leaves: &'a LeafSet) -> impl Iterator<Item = (&'a Cell, u32)> {
    let plane = |cell: &Cell| glue.layout.plane_of[cell.leaves.start];
    glue.layout.cells.iter().filter(|cell| cell.touches(leaves)).filter_map(move |cell| Some((cell, plane(cell)?)))
}

pub(super) fn load(glue: &Glue, leaves: &LeafSet, indent: &str, out: &mut String) {
    for (cell, plane) in cells_of(glue, leaves) {
        let word = format!("wf_bank[wf_base + {}u]", plane * BLOCK);
        let _ = writeln!(out, "{indent}wf_state{} = {};", cell.path, unpacked(cell, &glue.layout.leaves, &word));
    }
}

pub(super) fn store(glue: &Glue, leaves: &LeafSet, out: &mut String) {
    for (cell, plane) in cells_of(glue, leaves) {
        let word = packed(cell, &glue.layout.leaves, "wf_state");
        let _ = writeln!(out, "    wf_bank[wf_base + {}u] = {word};", plane * BLOCK);
    }
}

/// Takes the packed cells among the written leaves through their formats.
pub(super) fn settle(glue: &Glue, written: &LeafSet, indent: &str, out: &mut String) {
    for cell in glue.interface.cells.iter().filter(|cell| cell.storage != Storage::Word && cell.touches(written)) {
        let place = format!("wf_state{}", cell.path);
        let _ = writeln!(out, "{indent}{place} = wf_settle_{}({place});", cell.storage.name());
    }
}

/// The same after a stage whose verdict stands in `wf_verdict`, if it has one: what only one verdict has written is settled there alone.
pub(super) fn settle_stage(glue: &Glue, stage: &Summary, indent: &str, out: &mut String) {
    let may = |exit: &Option<super::Written>| exit.as_ref().map(|written| written.may.clone());
    let (Some(going_on), Some(ending)) = (may(&stage.on_continue), may(&stage.on_finish)) else {
        return settle(glue, &stage.on_return().may, indent, out);
    };
    let touched = |set: &LeafSet| {
        let mut whole = LeafSet::default();
        glue.interface.cells.iter().filter(|cell| cell.touches(set)).for_each(|cell| whole.insert_range(cell.leaves.clone()));
        whole
    };
    let (going_on, ending) = (touched(&going_on), touched(&ending));
    settle(glue, &going_on.intersection(&ending), indent, out);
    for (condition, set) in [("!=", going_on.difference(&ending)), ("==", ending.difference(&going_on))] {
        let mut inner = String::new();
        settle(glue, &set, &format!("{indent}    "), &mut inner);
        if !inner.is_empty() {
            let _ = writeln!(out, "{indent}if (wf_verdict {condition} FINISH) {{\n{inner}{indent}}}");
        }
    }
}

/// Fills leaves that nobody may use with the poison word, when asked.
pub(super) fn poison_state(glue: &Glue, spared: &LeafSet, out: &mut String) {
    let Some(word) = glue.poison else { return };
    for leaf in LeafSet::full(glue.layout.leaves.len()).difference(spared).iter() {
        let facts = &glue.layout.leaves[leaf];
        // The word reaches the kernel at run time: a NaN written as a constant is refused by WGSL.
        let value = from_word(facts.scalar, &format!("({word:#x}u ^ wf_control.opaque_zero)"));
        let _ = writeln!(out, "    wf_state{} = {value};", facts.path);
    }
}

/// Fills planes in which a new walk keeps nothing with the poison word, when asked.
pub(super) fn poison_planes(glue: &Glue, out: &mut String) {
    let Some(word) = glue.poison else { return };
    for plane in glue.layout.planes_not_born() {
        let _ = writeln!(out, "    wf_bank[wf_base + {}u] = {word:#x}u;", plane * BLOCK);
    }
}
