//! Which leaves of the state a function reads before it has written them, and which it writes, from naga's IR.
//!
//! Key decision: forward data flow over structured control flow with two sets per point: what has been written on *every* way here
//! (must) and on *some* way here (may). A read counts unless its leaf is in the must set. Calls apply the callee's summary.
//! Loops need no iteration: writes only accumulate, so the must set at a loop's head is that of its first entry, and the may set is
//! that entry plus everything the loop may write. What is given up: a pointer indexed at run time counts as all elements it can
//! reach, and reading a struct whole counts as reading all of it; both are listed in [`Summary::widened`].
//!
//! **Invariant:** the sets err only on the side of more reads, more may-writes and fewer must-writes.

use std::{collections::HashMap, ops::Range};

use naga::{Block, Expression, Function, Handle, Module, Span, Statement, TypeInner};

use crate::{control::FINISH, layout::leaf_count};

/// A set of leaves, by index.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LeafSet(Vec<u64>);

impl LeafSet {
    /// All of the first `count` leaves.
    pub fn full(count: usize) -> Self {
        let mut set = LeafSet::default();
        set.insert_range(0..count);
        set
    }

    /// True when the leaf is in the set.
    pub fn contains(&self, leaf: usize) -> bool {
        self.0.get(leaf / 64).is_some_and(|word| word >> (leaf % 64) & 1 == 1)
    }

    /// Adds one leaf.
    pub fn insert(&mut self, leaf: usize) {
        if self.0.len() <= leaf / 64 {
            self.0.resize(leaf / 64 + 1, 0);
        }
        self.0[leaf / 64] |= 1 << (leaf % 64);
    }

    pub(crate) fn insert_range(&mut self, leaves: Range<usize>) {
        leaves.for_each(|leaf| self.insert(leaf));
    }

    fn zip(&self, other: &Self, combine: impl Fn(u64, u64) -> u64) -> Self {
        let word = |set: &Self, index: usize| set.0.get(index).copied().unwrap_or(0);
        let mut words: Vec<u64> = (0..self.0.len().max(other.0.len())).map(|i| combine(word(self, i), word(other, i))).collect();
        // Equal sets have equal representations.
        while words.last() == Some(&0) {
            words.pop();
        }
        LeafSet(words)
    }

    /// In either set.
    pub fn union(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a | b)
    }

    /// In both sets.
    pub fn intersection(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a & b)
    }

    /// In the first set alone.
    pub fn difference(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a & !b)
    }

    /// How many leaves.
    pub fn len(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// In increasing order.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.0.len() * 64).filter(|leaf| self.contains(*leaf))
    }
}

/// What has been written at a point of the program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// On every way to this point.
    pub must: LeafSet,
    /// On some way to this point.
    pub may: LeafSet,
}

impl Written {
    fn write(&mut self, leaves: Range<usize>, certain: bool) {
        self.may.insert_range(leaves.clone());
        if certain {
            self.must.insert_range(leaves);
        }
    }
}

/// Two ways meet; `None` is a point that is never reached.
pub(crate) fn join_alternatives(a: Option<Written>, b: Option<Written>) -> Option<Written> {
    match (a, b) {
        (Some(a), Some(b)) => Some(Written { must: a.must.intersection(&b.must), may: a.may.union(&b.may) }),
        (a, b) => a.or(b),
    }
}

/// What `second` leaves behind when it runs after `first`.
pub(crate) fn then(first: &Written, second: &Written) -> Written {
    Written { must: first.must.union(&second.must), may: first.may.union(&second.may) }
}

/// What a function does to the state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Leaves read while not certainly written before.
    pub reads: LeafSet,
    /// At exits that may continue the walk; `None` when every exit finishes it.
    pub on_continue: Option<Written>,
    /// At exits that may finish the walk; `None` when every exit continues it.
    pub on_finish: Option<Written>,
    /// Places where the analysis had to widen to a whole struct or array, with the reason.
    pub widened: Vec<(Span, String)>,
}

impl Summary {
    /// At any exit.
    pub fn on_return(&self) -> Written {
        join_alternatives(self.on_continue.clone(), self.on_finish.clone()).unwrap_or_default()
    }
}

/// Summarises `function` with respect to its argument number `argument`, a pointer to the state.
/// Functions in `opaque` are taken to touch nothing.
pub(crate) fn analyse(module: &Module, function: Handle<Function>, argument: u32, opaque: &[Handle<Function>]) -> Summary {
    let nothing = Summary { on_continue: Some(Written::default()), ..Summary::default() };
    let mut memo = opaque.iter().map(|function| ((*function, 0), nothing.clone())).collect();
    summarise(module, function, argument, &mut memo)
}

type Memo = HashMap<(Handle<Function>, u32), Summary>;

fn summarise(module: &Module, handle: Handle<Function>, argument: u32, memo: &mut Memo) -> Summary {
    if let Some(known) = memo.get(&(handle, argument)) {
        return known.clone();
    }
    let function = &module.functions[handle];
    let mut walk = Walk { module, function, argument, memo, summary: Summary::default(), loops: Vec::new() };
    let end = walk.block(&function.body, Some(Written::default()));
    // Falling off the end returns nothing, which continues the walk.
    let mut summary = walk.summary;
    summary.on_continue = join_alternatives(summary.on_continue.take(), end);
    memo.insert((handle, argument), summary.clone());
    summary
}

struct Walk<'a> {
    module: &'a Module,
    function: &'a Function,
    argument: u32,
    memo: &'a mut Memo,
    summary: Summary,
    /// Innermost last: what holds at the `break` and `continue` statements seen so far.
    loops: Vec<Jumps>,
}

#[derive(Default)]
struct Jumps {
    at_break: Option<Written>,
    at_continue: Option<Written>,
    is_switch: bool,
}

impl Walk<'_> {
    /// Follows `block` from `at`; returns what holds at its end, `None` when its end is not reached.
    fn block(&mut self, block: &Block, mut at: Option<Written>) -> Option<Written> {
        for statement in block.iter() {
            let written = at?;
            at = self.statement(statement, written);
        }
        at
    }

    fn statement(&mut self, statement: &Statement, mut at: Written) -> Option<Written> {
        match statement {
            Statement::Emit(range) => {
                for handle in range.clone() {
                    if let Expression::Load { pointer } = self.function.expressions[handle] {
                        self.read(pointer, self.function.expressions.get_span(handle), &at);
                    }
                }
            }
            Statement::Store { pointer, .. } => {
                if let Some((leaves, exact)) = self.leaves(*pointer) {
                    at.write(leaves, exact);
                }
            }
            Statement::Call { function, arguments, .. } => {
                let before = at.must.clone();
                for (index, argument) in arguments.iter().enumerate() {
                    if self.leaves(*argument).is_some() {
                        let callee = summarise(self.module, *function, index as u32, self.memo);
                        // One state passed twice: what one name writes may be read by the other before.
                        self.summary.reads = self.summary.reads.union(&callee.reads.difference(&before));
                        self.summary.widened.extend(callee.widened.iter().cloned());
                        at = then(&at, &callee.on_return());
                    }
                }
            }
            Statement::Block(inner) => return self.block(inner, Some(at)),
            Statement::If { accept, reject, .. } => {
                let accepted = self.block(accept, Some(at.clone()));
                let rejected = self.block(reject, Some(at));
                return join_alternatives(accepted, rejected);
            }
            Statement::Switch { cases, .. } => {
                self.loops.push(Jumps { is_switch: true, ..Jumps::default() });
                let mut end = None;
                let mut falling = None;
                for case in cases {
                    let reached = self.block(&case.body, join_alternatives(falling.take(), Some(at.clone())));
                    if case.fall_through {
                        falling = reached;
                    } else {
                        end = join_alternatives(end, reached);
                    }
                }
                let jumps = self.loops.pop().unwrap_or_default();
                return join_alternatives(join_alternatives(end, falling), jumps.at_break);
            }
            Statement::Loop { body, continuing, break_if } => {
                // A later round may have written whatever the loop may write.
                at.may = at.may.union(&self.may_write(body)).union(&self.may_write(continuing));
                self.loops.push(Jumps::default());
                let end = self.block(body, Some(at));
                let at_continue = self.loops.last_mut().and_then(|jumps| jumps.at_continue.take());
                let end = self.block(continuing, join_alternatives(end, at_continue));
                let jumps = self.loops.pop().unwrap_or_default();
                return if break_if.is_some() { join_alternatives(jumps.at_break, end) } else { jumps.at_break };
            }
            Statement::Break => {
                if let Some(jumps) = self.loops.last_mut() {
                    jumps.at_break = join_alternatives(jumps.at_break.take(), Some(at));
                }
                return None;
            }
            Statement::Continue => {
                if let Some(jumps) = self.loops.iter_mut().rev().find(|jumps| !jumps.is_switch) {
                    jumps.at_continue = join_alternatives(jumps.at_continue.take(), Some(at));
                }
                return None;
            }
            Statement::Return { value } => {
                let known = value.and_then(|value| self.constant(value));
                if value.is_none() || known != Some(FINISH) {
                    self.summary.on_continue = join_alternatives(self.summary.on_continue.take(), Some(at.clone()));
                }
                if value.is_some() && known.is_none_or(|known| known == FINISH) {
                    self.summary.on_finish = join_alternatives(self.summary.on_finish.take(), Some(at));
                }
                return None;
            }
            Statement::Kill => return None,
            _ => {}
        }
        Some(at)
    }

    fn read(&mut self, pointer: Handle<Expression>, span: Span, at: &Written) {
        let Some((leaves, exact)) = self.leaves(pointer) else { return };
        if !exact {
            self.summary.widened.push((span, "an index known only at run time reads every element".into()));
        } else if matches!(self.function.expressions[pointer], Expression::FunctionArgument(_)) {
            // naga places `*p` where `p` is declared: name the function.
            let function = self.function.name.as_deref().unwrap_or("");
            self.summary.widened.push((span, format!("`{function}` copies the whole state, which reads all of it")));
        }
        let mut read = LeafSet::default();
        read.insert_range(leaves);
        self.summary.reads = self.summary.reads.union(&read.difference(&at.must));
    }

    /// The leaves a pointer into the state reaches, and whether exactly these; `None` for other pointers.
    fn leaves(&self, pointer: Handle<Expression>) -> Option<(Range<usize>, bool)> {
        let typed = self.pointee(pointer)?;
        Some((typed.1, typed.2))
    }

    /// Type behind the pointer, leaves, exactness.
    fn pointee(&self, pointer: Handle<Expression>) -> Option<(naga::proc::TypeResolution, Range<usize>, bool)> {
        use naga::proc::TypeResolution::{Handle as Named, Value};
        let types = &self.module.types;
        match self.function.expressions[pointer] {
            Expression::FunctionArgument(index) if index == self.argument => {
                let TypeInner::Pointer { base, .. } = types[self.function.arguments.get(index as usize)?.ty].inner else { return None };
                Some((Named(base), 0..leaf_count(self.module, base), true))
            }
            Expression::AccessIndex { base, index } => {
                let (ty, leaves, exact) = self.pointee(base)?;
                let index = index as usize;
                let (inner, start, count) = match ty.inner_with(types) {
                    TypeInner::Struct { members, .. } => {
                        let before = members[..index].iter().map(|member| leaf_count(self.module, member.ty)).sum();
                        (Named(members[index].ty), before, leaf_count(self.module, members[index].ty))
                    }
                    TypeInner::Array { base, .. } => {
                        let count = leaf_count(self.module, *base);
                        (Named(*base), index * count, count)
                    }
                    TypeInner::Matrix { rows, scalar, .. } => {
                        let count = *rows as usize;
                        (Value(TypeInner::Vector { size: *rows, scalar: *scalar }), index * count, count)
                    }
                    TypeInner::Vector { scalar, .. } => (Value(TypeInner::Scalar(*scalar)), index, 1),
                    _ => return None,
                };
                if !exact {
                    return Some((inner, leaves, false));
                }
                Some((inner, leaves.start + start..leaves.start + start + count, true))
            }
            Expression::Access { base, .. } => {
                let (ty, leaves, _) = self.pointee(base)?;
                let inner = match ty.inner_with(types) {
                    TypeInner::Array { base, .. } => Named(*base),
                    TypeInner::Matrix { rows, scalar, .. } => Value(TypeInner::Vector { size: *rows, scalar: *scalar }),
                    TypeInner::Vector { scalar, .. } => Value(TypeInner::Scalar(*scalar)),
                    _ => return None,
                };
                Some((inner, leaves, false))
            }
            _ => None,
        }
    }

    fn constant(&self, value: Handle<Expression>) -> Option<u32> {
        let literal = match self.function.expressions[value] {
            Expression::Literal(literal) => literal,
            Expression::Constant(constant) => match self.module.global_expressions[self.module.constants[constant].init] {
                Expression::Literal(literal) => literal,
                _ => return None,
            },
            _ => return None,
        };
        match literal {
            naga::Literal::U32(value) => Some(value),
            _ => None,
        }
    }

    /// Every leaf that some statement of the block may write.
    fn may_write(&mut self, block: &Block) -> LeafSet {
        let mut set = LeafSet::default();
        for statement in block.iter() {
            match statement {
                Statement::Store { pointer, .. } => {
                    if let Some((leaves, _)) = self.leaves(*pointer) {
                        set.insert_range(leaves);
                    }
                }
                Statement::Call { function, arguments, .. } => {
                    for (index, argument) in arguments.iter().enumerate() {
                        if self.leaves(*argument).is_some() {
                            let callee = summarise(self.module, *function, index as u32, self.memo);
                            set = set.union(&callee.on_return().may);
                        }
                    }
                }
                Statement::Block(inner) => set = set.union(&self.may_write(inner)),
                Statement::If { accept, reject, .. } => set = set.union(&self.may_write(accept)).union(&self.may_write(reject)),
                Statement::Switch { cases, .. } => {
                    for case in cases {
                        set = set.union(&self.may_write(&case.body));
                    }
                }
                Statement::Loop { body, continuing, .. } => {
                    set = set.union(&self.may_write(body)).union(&self.may_write(continuing));
                }
                _ => {}
            }
        }
        set
    }
}
