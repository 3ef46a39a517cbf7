//! Storage formats: which leaves travel together in one word.
//!
//! Key decision: a cell is one stored word and covers one leaf, or the two or three leaves of a vector in a packed format. Formats are a
//! property of the program and not of the schedule, and every execution takes a packed cell through its format wherever a function has
//! written it; so they change values, and change them everywhere alike.
//!
//! **Invariant:** a set of leaves that the layout works with contains all leaves of a cell or none.

use std::{collections::HashSet, ops::Range};

use naga::{Handle, Module, Type, TypeInner};

use super::{Leaf, leaf_count};
use crate::{
    error::Error,
    shader::{LeafSet, Summary, Written},
};

/// How a field of the state is kept between kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Storage {
    /// Each leaf in a word of its own, bit for bit: the default for every field.
    #[default]
    Word,
    /// A `vec3f` of length 1, or the zero vector, in one word: octahedral, 16 bits per side, error below 5e-5 rad. Any other length
    /// becomes 1, what is not finite becomes the zero vector; both count as clamped.
    UnitVector,
    /// A `vec2f` in one word: IEEE binary16, relative error 2^-11 from 2^-14 up, absolute error 2^-25 below. Beyond 65504 it is 65504
    /// with the sign, NaN becomes 0; both count as clamped.
    HalfPair,
    /// A `vec3f` of numbers from 0 to 65408 in one word: nine bits each and a shared exponent, error 1/511 of the largest component, or 2^-25.
    /// Larger numbers become 65408, negative ones and NaN become 0; both count as clamped.
    Rgb9e5,
}

impl Storage {
    /// Every format, for tables and tests.
    pub const ALL: [Storage; 4] = [Storage::Word, Storage::UnitVector, Storage::HalfPair, Storage::Rgb9e5];

    /// As tables print it, and as the names of its WGSL end.
    pub fn name(self) -> &'static str {
        match self {
            Storage::Word => "word",
            Storage::UnitVector => "unit_vector",
            Storage::HalfPair => "half_pair",
            Storage::Rgb9e5 => "rgb9e5",
        }
    }

    /// The module of its WGSL; no module has the name of the default.
    pub(crate) fn module(self) -> String {
        format!("math::{}", self.name())
    }

    /// The type that the format is for; `None` for any.
    pub fn shape(self) -> Option<&'static str> {
        match self {
            Storage::Word => None,
            Storage::HalfPair => Some("vec2f"),
            Storage::UnitVector | Storage::Rgb9e5 => Some("vec3f"),
        }
    }
}

/// One stored word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cell {
    /// How WGSL reaches it from the state, with a leading dot: `.origin.x`, `.direction`.
    pub path: String,
    /// How it is kept.
    pub storage: Storage,
    /// The leaves it covers.
    pub leaves: Range<usize>,
}

/// Something of the state that a format can be declared for.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    /// Without the leading dot.
    path: String,
    /// The same with the indices of arrays left out: `pair[].y`.
    pattern: String,
    shape: String,
    leaves: Range<usize>,
}

/// All fields below `ty`, arrays element by element.
pub(crate) fn fields(module: &Module, ty: Handle<Type>) -> Vec<Field> {
    let mut out = Vec::new();
    walk(module, ty, "", "", &mut 0, &mut out);
    out
}

fn walk(module: &Module, ty: Handle<Type>, path: &str, pattern: &str, next: &mut usize, out: &mut Vec<Field>) {
    let shape = match &module.types[ty].inner {
        TypeInner::Struct { members, .. } => {
            for member in members {
                let name = member.name.as_deref().unwrap_or("");
                let below = |prefix: &str| if prefix.is_empty() { name.to_owned() } else { format!("{prefix}.{name}") };
                walk(module, member.ty, &below(path), &below(pattern), next, out);
            }
            return;
        }
        TypeInner::Array { base, size: naga::ArraySize::Constant(count), .. } => {
            for index in 0..count.get() {
                walk(module, *base, &format!("{path}[{index}]"), &format!("{pattern}[]"), next, out);
            }
            return;
        }
        TypeInner::Scalar(scalar) => format!("{}32", letter(*scalar)),
        TypeInner::Vector { size, scalar } => format!("vec{}{}", *size as u8, letter(*scalar)),
        TypeInner::Matrix { columns, rows, scalar } => format!("mat{}x{}{}", *columns as u8, *rows as u8, letter(*scalar)),
        _ => String::new(),
    };
    let leaves = *next..*next + leaf_count(module, ty);
    *next = leaves.end;
    out.push(Field { path: path.to_owned(), pattern: pattern.to_owned(), shape, leaves });
}

fn letter(scalar: naga::Scalar) -> char {
    match scalar.kind {
        naga::ScalarKind::Float => 'f',
        naga::ScalarKind::Sint => 'i',
        _ => 'u',
    }
}

/// The cells of a state whose fields have the declared formats, in the order of the leaves.
pub(crate) fn cells(fields: &[Field], leaves: &[Leaf], declared: &[(String, Storage)]) -> Result<Vec<Cell>, Error> {
    let mut storage_of: Vec<Option<(&str, Storage)>> = vec![None; fields.len()];
    for (name, storage) in declared {
        let refuse = |problem: String| Err(Error::Field { field: name.clone(), problem });
        let wanted: Vec<usize> =
            (0..fields.len()).filter(|index| [&fields[*index].path, &fields[*index].pattern].contains(&name)).collect();
        let Some(first) = wanted.first().map(|index| &fields[*index]) else {
            let mut seen = HashSet::new();
            let known: Vec<String> = fields
                .iter()
                .filter(|field| seen.insert(&field.pattern))
                .map(|field| format!("{}: {}", field.pattern, field.shape))
                .collect();
            return refuse(format!("the state has no such field; it has {}", known.join(", ")));
        };
        if let Some(shape) = storage.shape().filter(|shape| *shape != first.shape) {
            return refuse(format!("it is a {}; the format {} takes a {shape}", first.shape, storage.name()));
        }
        for index in wanted {
            if let Some((other, before)) = storage_of[index] {
                let as_what = if other == name { String::new() } else { format!(" as `{other}`") };
                return refuse(format!("its format is declared twice: {}{as_what} before, {} now", before.name(), storage.name()));
            }
            storage_of[index] = Some((name, *storage));
        }
    }
    let mut cells = Vec::new();
    for (field, storage) in fields.iter().zip(storage_of) {
        match storage.map(|(_, storage)| storage).filter(|storage| *storage != Storage::Word) {
            Some(storage) => {
                let dot = if field.path.is_empty() || field.path.starts_with('[') { "" } else { "." };
                cells.push(Cell { path: format!("{dot}{}", field.path), storage, leaves: field.leaves.clone() });
            }
            None => cells.extend(field.leaves.clone().map(|leaf| Cell {
                path: leaves[leaf].path.clone(),
                storage: Storage::Word,
                leaves: leaf..leaf + 1,
            })),
        }
    }
    Ok(cells)
}

impl Cell {
    /// True when the set holds some leaf of the cell.
    pub(crate) fn touches(&self, set: &LeafSet) -> bool {
        self.leaves.clone().any(|leaf| set.contains(leaf))
    }

    fn fills(&self, set: &LeafSet) -> bool {
        self.leaves.clone().all(|leaf| set.contains(leaf))
    }
}

fn gather(cells: &[Cell], wanted: impl Fn(&Cell) -> bool) -> LeafSet {
    let mut set = LeafSet::default();
    cells.iter().filter(|cell| wanted(cell)).for_each(|cell| set.insert_range(cell.leaves.clone()));
    set
}

/// What a function does to whole cells: reads one if it reads any leaf of it, certainly writes it only if it writes all of them. A packed
/// cell that some way to an exit leaves alone counts as read: it goes through its format there, and must not be garbage.
pub(crate) fn over_cells(cells: &[Cell], summary: &Summary) -> Summary {
    let written = |written: &Written| Written {
        must: gather(cells, |cell| cell.fills(&written.must)),
        may: gather(cells, |cell| cell.touches(&written.may)),
    };
    let (on_continue, on_finish) = (summary.on_continue.as_ref().map(written), summary.on_finish.as_ref().map(written));
    let mut reads = gather(cells, |cell| cell.touches(&summary.reads));
    for exit in on_continue.iter().chain(&on_finish) {
        let uncertain = exit.may.difference(&exit.must);
        reads = reads.union(&gather(cells, |cell| cell.storage != Storage::Word && cell.touches(&uncertain)));
    }
    Summary { reads, on_continue, on_finish, widened: Vec::new() }
}
