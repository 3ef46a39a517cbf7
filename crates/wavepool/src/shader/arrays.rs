//! Array members of the state that stages reach through generated accessors.
//!
//! Key decision: a member named with `ProgramBuilder::array` is reached through `load_NAME` and `store_NAME` alone. In the megakernel these
//! use the member; in wavefront kernels they go to the bank at once, so that a stage moves the elements that it touches and no others.
//! Both pass values through the same formats and pins. What is given up: the state cannot be copied as a whole, and arrays share no
//! planes. The accessors must be there before naga can read the program, so the member's type is found by tokens and checked afterwards.
//!
//! **Invariant:** an index out of range reads zeros and writes nothing, and the ledger counts it.

use std::{fmt::Write as _, ops::Range};

use naga::{Expression, Function, Handle, Span, Statement, Type, TypeInner};

use super::{
    Composition,
    generate::Glue,
    inspect::Inspector,
    rules::each_statement,
    scan,
    storage::{packed, pin_leaves, unpacked},
};
use crate::{
    error::Error,
    layout::{BLOCK, Cell, Leaf, Storage, flatten, leaf_count},
};

/// An array member as its declaration reads, before naga has seen it.
#[derive(Clone, Debug)]
pub(crate) struct DeclaredArray {
    name: String,
    state: String,
    element: String,
    length: String,
}

/// An array member that naga has confirmed.
#[derive(Clone, Debug)]
pub(crate) struct StateArray {
    pub(crate) name: String,
    pub(crate) element: String,
    pub(crate) length: u32,
    /// Its leaves within the state.
    pub(crate) leaves: Range<usize>,
    /// Those of one element, as reached from it.
    pub(crate) element_leaves: Vec<Leaf>,
    /// The stored words of one element.
    pub(crate) cells: Vec<Cell>,
    /// Functions of the contract that reach it: name, loads, stores.
    pub(crate) users: Vec<(String, bool, bool)>,
}

impl StateArray {
    /// True when something reads what was stored.
    pub(crate) fn is_kept(&self) -> bool {
        self.users.iter().any(|(_, loads, _)| *loads)
    }

    /// Splits the cells of the whole state: those of elements become the cells of one element, the others stay.
    pub(crate) fn take_cells(&mut self, cells: &mut Vec<Cell>) -> Result<(), Error> {
        let size = self.element_leaves.len();
        let (mine, others): (Vec<Cell>, Vec<Cell>) = cells.drain(..).partition(|cell| self.leaves.contains(&cell.leaves.start));
        *cells = others;
        let prefix = |index: usize| format!(".{}[{index}]", self.name);
        let of = |index: usize| {
            let start = self.leaves.start + index * size;
            mine.iter().filter(move |cell| (start..start + size).contains(&cell.leaves.start)).map(move |cell| Cell {
                path: cell.path[prefix(index).len()..].to_owned(),
                storage: cell.storage,
                leaves: cell.leaves.start - start..cell.leaves.end - start,
            })
        };
        self.cells = of(0).collect();
        match (1..self.length as usize).find(|index| !of(*index).eq(self.cells.iter().cloned())) {
            Some(_) => Err(Error::Field {
                field: self.name.clone(),
                problem: format!("all elements of an accessible array have one format: declare it for `{}[]`", self.name),
            }),
            None => Ok(()),
        }
    }
}

/// Finds the declared arrays in the text of a program whose generating function is named `generate`.
pub(crate) fn find_arrays(composition: &Composition, generate: &str, names: &[String]) -> Result<Vec<DeclaredArray>, Error> {
    let mut found: Vec<DeclaredArray> = Vec::new();
    for name in names {
        let refuse = |problem: String| Error::Field { field: name.clone(), problem };
        if found.iter().any(|array| array.name == *name) {
            return Err(refuse("the array is declared twice".into()));
        }
        let state = scan::state_struct(&composition.text, generate).ok_or_else(|| {
            refuse(format!("accessors need `fn {generate}(NAME: ptr<function, STATE>, ...)`, spelled out, to find the state"))
        })?;
        let members = scan::members(&composition.text, &state);
        let Some((_, ty)) = members.iter().find(|(member, _)| member == name) else {
            let known: Vec<&str> = members.iter().map(|(member, _)| member.as_str()).collect();
            return Err(refuse(format!("`{state}` has no such member; it has {}", known.join(", "))));
        };
        let Some((element, length)) = scan::array_parts(ty) else {
            return Err(refuse(format!("it is `{ty}`; accessors are for `array<ELEMENT, LENGTH>`")));
        };
        for accessor in [format!("load_{name}"), format!("store_{name}")] {
            if let Some((_, place)) = scan::declarations(&composition.text).into_iter().find(|(declared, _)| *declared == accessor) {
                let message = format!("`{accessor}` is declared by the scheduler for the array `{name}`");
                let span = Span::new(place.start as u32, place.end as u32);
                return Err(Error::Shader(vec![composition.diagnostic(span, &message, "choose another name", &[])]));
            }
        }
        found.push(DeclaredArray { name: name.clone(), state, element, length });
    }
    Ok(found)
}

/// Accessors that use the member; between them and the walk stands `kept`, what an element goes through when it is stored or loaded.
fn member_accessors(name: &str, state: &str, element: &str, length: &str, kept: [&str; 2], out: &mut String) {
    let [settle, pin] = kept;
    let _ = write!(
        out,
        "fn load_{name}(wf_state: ptr<function, {state}>, wf_index: u32) -> {element} {{\n    \
         if (wf_index >= u32({length})) {{ atomicAdd(&wf_counters[WF_OUT_OF_RANGE], 1u); return {element}(); }}\n    \
         return {pin}((*wf_state).{name}[wf_index]);\n\
         }}\n\
         fn store_{name}(wf_state: ptr<function, {state}>, wf_index: u32, wf_value: {element}) {{\n    \
         if (wf_index >= u32({length})) {{ atomicAdd(&wf_counters[WF_OUT_OF_RANGE], 1u); return; }}\n    \
         (*wf_state).{name}[wf_index] = {settle}(wf_value);\n\
         }}\n"
    );
}

/// Accessors as naga needs them to inspect a program.
pub(crate) fn plain_accessors(arrays: &[DeclaredArray]) -> String {
    let mut out = String::new();
    for DeclaredArray { name, state, element, length } in arrays {
        member_accessors(name, state, element, length, ["", ""], &mut out);
    }
    out
}

/// Accessors for the execution at hand.
pub(super) fn accessors(glue: &Glue, out: &mut String) {
    let arrays = &glue.interface.arrays;
    if !arrays.is_empty() && glue.execution.is_wavefront() {
        out.push_str("var<private> wf_array_base: u32;\n");
    }
    for array in arrays {
        let StateArray { name, element, length, .. } = array;
        let _ = writeln!(out, "fn wf_pin_array_{name}(wf_value: {element}) -> {element} {{\n    var wf_element = wf_value;");
        pin_leaves(glue, &mut array.element_leaves.iter(), "wf_element", out);
        let _ = writeln!(out, "    return wf_element;\n}}");
        let _ = writeln!(out, "fn wf_settle_array_{name}(wf_value: {element}) -> {element} {{\n    var wf_element = wf_value;");
        for cell in array.cells.iter().filter(|cell| cell.storage != Storage::Word) {
            let _ = writeln!(out, "    wf_element{0} = wf_settle_{1}(wf_element{0});", cell.path, cell.storage.name());
        }
        let _ = writeln!(out, "    return wf_pin_array_{name}(wf_element);\n}}");
        if glue.execution.is_wavefront() {
            bank_accessors(glue, array, out);
        } else {
            let kept = [format!("wf_settle_array_{name}"), format!("wf_pin_array_{name}")];
            member_accessors(name, &glue.interface.state, element, &format!("{length}u"), [&kept[0], &kept[1]], out);
        }
    }
}

fn bank_accessors(glue: &Glue, array: &StateArray, out: &mut String) {
    let StateArray { name, element, length, cells, .. } = array;
    let state = &glue.interface.state;
    let first = glue.layout.arrays.iter().find(|planes| planes.name == *name).and_then(|planes| planes.plane);
    let guard = |otherwise: &str| {
        format!("    if (wf_index >= {length}u) {{ atomicAdd(&wf_counters[WF_OUT_OF_RANGE], 1u); return{otherwise}; }}\n")
    };
    let place = first.map_or(String::new(), |first| {
        format!("    let wf_place = wf_array_base + ({first}u + wf_index * {}u) * {BLOCK}u;\n", cells.len())
    });
    let word = |index: usize| format!("wf_bank[wf_place + {}u]", index as u32 * BLOCK);
    let _ = write!(
        out,
        "fn load_{name}(wf_state: ptr<function, {state}>, wf_index: u32) -> {element} {{\n    var wf_element = {element}();\n{}{place}",
        guard(" wf_element")
    );
    for (index, cell) in cells.iter().enumerate().filter(|_| first.is_some()) {
        let _ = writeln!(out, "    wf_element{} = {};", cell.path, unpacked(cell, &array.element_leaves, &word(index)));
    }
    let _ = writeln!(out, "    return wf_pin_array_{name}(wf_element);\n}}");
    let _ = write!(
        out,
        "fn store_{name}(wf_state: ptr<function, {state}>, wf_index: u32, wf_value: {element}) {{\n{}    \
         let wf_element = wf_settle_array_{name}(wf_value);\n{place}",
        guard("")
    );
    for (index, cell) in cells.iter().enumerate().filter(|_| first.is_some()) {
        let _ = writeln!(out, "    {} = {};", word(index), packed(cell, &array.element_leaves, "wf_element"));
    }
    out.push_str("}\n");
}

/// Tells the accessors where the lane's words begin; stands behind the declaration of `wf_base`.
pub(super) fn enter(glue: &Glue) -> &'static str {
    if glue.interface.arrays.is_empty() { "" } else { "wf_array_base = wf_base;\n    " }
}

/// Zeroes the arrays of a new walk.
pub(super) fn clear(glue: &Glue) -> String {
    let planes: Vec<Range<u32>> = glue.layout.arrays.iter().filter_map(|array| Some(array.plane?..array.plane? + array.planes())).collect();
    let each = planes.iter().map(|planes| {
        let Range { start, end } = planes;
        format!("for (var wf_plane = {start}u; wf_plane < {end}u; wf_plane++) {{ wf_bank[wf_base + wf_plane * {BLOCK}u] = 0u; }}\n    ")
    });
    each.collect()
}

impl Inspector<'_> {
    pub(super) fn accessor_functions(&self, arrays: &[DeclaredArray]) -> Vec<Handle<Function>> {
        let names: Vec<String> = arrays.iter().flat_map(|array| ["load", "store"].map(|verb| format!("{verb}_{}", array.name))).collect();
        let is_accessor = |function: &Function| function.name.as_ref().is_some_and(|name| names.contains(name));
        self.module.functions.iter().filter(|(_, function)| is_accessor(function)).map(|(handle, _)| handle).collect()
    }

    /// The declared arrays as members of the state; empty after a mistake, which has been reported.
    pub(super) fn arrays(
        &mut self,
        state: Handle<Type>,
        declared: &[DeclaredArray],
        roles: &[(String, Handle<Function>)],
    ) -> Vec<StateArray> {
        let accessors = self.accessor_functions(declared);
        let users: Vec<(String, Vec<Handle<Function>>)> =
            roles.iter().map(|(name, function)| (name.clone(), self.reachable(&[*function]).0.into_iter().collect())).collect();
        let TypeInner::Struct { members, .. } = &self.module.types[state].inner else { return Vec::new() };
        let mut arrays = Vec::new();
        let mut start = 0;
        for member in members {
            let leaves = start..start + leaf_count(&self.module, member.ty);
            start = leaves.end;
            let Some(index) = declared.iter().position(|array| member.name.as_ref() == Some(&array.name)) else { continue };
            let TypeInner::Array { base, size: naga::ArraySize::Constant(length), .. } = self.module.types[member.ty].inner else {
                continue;
            };
            let mut element_leaves = Vec::new();
            if flatten(&self.module, base, "", &mut element_leaves).is_err() {
                continue;
            }
            let by_name = |verb: &str| {
                let name = format!("{verb}_{}", declared[index].name);
                accessors.iter().copied().find(|handle| self.module.functions[*handle].name.as_ref() == Some(&name))
            };
            let (load, store) = (by_name("load"), by_name("store"));
            let calls =
                |functions: &[Handle<Function>], accessor: Option<Handle<Function>>| accessor.is_some_and(|it| functions.contains(&it));
            arrays.push(StateArray {
                name: declared[index].name.clone(),
                element: declared[index].element.clone(),
                length: length.get(),
                leaves,
                element_leaves,
                cells: Vec::new(),
                users: users.iter().map(|(name, functions)| (name.clone(), calls(functions, load), calls(functions, store))).collect(),
            });
        }
        arrays
    }

    /// What would pass by the accessors: the member itself, the state as a whole, a second state.
    pub(super) fn check_array_use(&mut self, handle: Handle<Function>, state: Handle<Type>, declared: &[DeclaredArray]) {
        let types = &self.module.types;
        let function = &self.module.functions[handle];
        let name = function.name.clone().unwrap_or_default();
        let whole = |expression: Handle<Expression>| match function.expressions[expression] {
            Expression::FunctionArgument(index) => {
                matches!(types[function.arguments[index as usize].ty].inner, TypeInner::Pointer { base, .. } if base == state)
            }
            _ => false,
        };
        let member = |index: u32| match &types[state].inner {
            TypeInner::Struct { members, .. } => declared.iter().find(|array| members[index as usize].name.as_ref() == Some(&array.name)),
            _ => None,
        };
        let all: Vec<String> = declared.iter().map(|array| format!("`{}`", array.name)).collect();
        let all = all.join(", ");
        let mut found: Vec<(Span, String, String)> = Vec::new();
        for (place, expression) in function.expressions.iter() {
            let span = function.expressions.get_span(place);
            match *expression {
                Expression::AccessIndex { base, index } if whole(base) => {
                    if let Some(DeclaredArray { name: array, .. }) = member(index) {
                        let label = format!("use `load_{array}(state, index)` and `store_{array}(state, index, value)`");
                        found.push((span, format!("`{name}` reaches into the array `{array}`"), label));
                    }
                }
                Expression::Load { pointer } if whole(pointer) => {
                    let label = "copy the members that you need".to_owned();
                    found.push((span, format!("`{name}` copies the whole state, which holds {all}"), label));
                }
                _ => {}
            }
        }
        each_statement(&function.body, &mut |statement, span| {
            if let Statement::Store { pointer, .. } = statement
                && whole(*pointer)
            {
                let label = "assign the members that change".to_owned();
                found.push((span, format!("`{name}` assigns the whole state, which holds {all}"), label));
            }
        });
        for (place, variable) in function.local_variables.iter().filter(|(_, variable)| self.contains(variable.ty, state)) {
            let shown = variable.name.as_deref().unwrap_or("");
            let label = "there is one state per lane: keep the members that you need".to_owned();
            found.push((function.local_variables.get_span(place), format!("`{name}` makes a second state `{shown}`, with {all}"), label));
        }
        for (span, message, label) in found {
            self.error(span, &message, &label);
        }
    }

    fn contains(&self, ty: Handle<Type>, wanted: Handle<Type>) -> bool {
        ty == wanted
            || match &self.module.types[ty].inner {
                TypeInner::Struct { members, .. } => members.iter().any(|member| self.contains(member.ty, wanted)),
                TypeInner::Array { base, .. } => self.contains(*base, wanted),
                _ => false,
            }
    }
}
