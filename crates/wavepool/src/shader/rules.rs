//! The rules of a stage: what would let a walk depend on its neighbours or on the schedule, and what naga cannot write.
//!
//! **Invariant:** each rule names the place and the way out; none depends on the schedule.

use naga::{AddressSpace, Block, Expression, Function, Handle, Span, Statement, TypeInner};

use super::inspect::Inspector;

impl Inspector<'_> {
    /// The rules of a stage, for a function that stages may call.
    pub(super) fn check_rules(&mut self, handle: Handle<Function>) {
        let mut found: Vec<(Span, String, &str)> = Vec::new();
        let function = &self.module.functions[handle];
        let name = function.name.clone().unwrap_or_default();
        for (handle, expression) in function.expressions.iter() {
            let by_neighbours = match expression {
                Expression::Derivative { .. } => true,
                Expression::ImageSample { level, .. } => matches!(level, naga::SampleLevel::Auto | naga::SampleLevel::Bias(_)),
                _ => false,
            };
            if by_neighbours {
                let label = "use textureLoad or textureSampleLevel";
                let span = function.expressions.get_span(handle);
                found.push((span, format!("`{name}` takes a derivative, which needs neighbouring pixels"), label));
            }
            if let Expression::GlobalVariable(global) = expression {
                let variable = &self.module.global_variables[*global];
                let what = match variable.space {
                    AddressSpace::Private => "var<private>",
                    AddressSpace::WorkGroup => "var<workgroup>",
                    _ => continue,
                };
                let span = function.expressions.get_span(handle);
                let span = if span.is_defined() { span } else { self.module.global_variables.get_span(*global) };
                found.push((
                    span,
                    format!("`{name}` uses {what} `{}`", variable.name.as_deref().unwrap_or("")),
                    "a stage is pure in its lane: keep it in the state",
                ));
            }
        }
        each_statement(&function.body, &mut |statement, span| match statement {
            Statement::ControlBarrier(_) | Statement::MemoryBarrier(_) | Statement::WorkGroupUniformLoad { .. } => {
                found.push((span, format!("`{name}` waits at a barrier"), "a stage does not know its work-group"));
            }
            Statement::SubgroupBallot { .. } | Statement::SubgroupGather { .. } | Statement::SubgroupCollectiveOperation { .. } => {
                found.push((span, format!("`{name}` uses a subgroup operation"), "a stage does not know its subgroup"));
            }
            Statement::ImageStore { .. } => {
                found.push((span, format!("`{name}` writes to a texture"), "a walk leaves results through `finish` alone"))
            }
            Statement::Store { pointer, .. } if self.root_is_global(function, *pointer) => {
                found.push((
                    span,
                    format!("`{name}` writes to a buffer without an atomic"),
                    "lanes race: use integer atomics or the state",
                ));
            }
            Statement::Atomic { pointer, .. } if self.is_float_atomic(function, *pointer) => {
                found.push((span, format!("`{name}` adds floats atomically"), "the sum would depend on the order of the lanes"));
            }
            _ => {}
        });
        for (span, message, label) in found {
            self.error(span, &message, label);
        }
    }

    /// The rule that holds for every function, called or not.
    pub(super) fn check_pointers(&mut self, handle: Handle<Function>) {
        let mut found: Vec<Span> = Vec::new();
        let function = &self.module.functions[handle];
        each_statement(&function.body, &mut |statement, span| {
            let Statement::Call { arguments, .. } = statement else { return };
            for argument in arguments.iter().filter(|argument| self.is_part_pointer(function, **argument)) {
                let place = function.expressions.get_span(*argument);
                found.push(if place.is_defined() { place } else { span });
            }
        });
        let message = format!("`{}` passes a pointer to a part of a variable", function.name.as_deref().unwrap_or_default());
        for span in found {
            self.error(span, &message, "copy it into a `var`, pass that, copy it back");
        }
    }

    /// `&v.member` or `&v[i]` as an argument: naga 30 accepts it and panics when it writes SPIR-V (wgpu issues 4540 and 5593).
    fn is_part_pointer(&self, function: &Function, argument: Handle<Expression>) -> bool {
        let mut root = argument;
        let mut is_part = false;
        loop {
            match function.expressions[root] {
                Expression::AccessIndex { base, .. } | Expression::Access { base, .. } => {
                    is_part = true;
                    root = base;
                }
                Expression::LocalVariable(_) => return is_part,
                Expression::FunctionArgument(index) => {
                    let ty = function.arguments.get(index as usize).map(|argument| &self.module.types[argument.ty].inner);
                    return is_part && matches!(ty, Some(TypeInner::Pointer { .. }));
                }
                _ => return false,
            }
        }
    }

    fn root_is_global(&self, function: &Function, mut pointer: Handle<Expression>) -> bool {
        loop {
            match function.expressions[pointer] {
                Expression::AccessIndex { base, .. } | Expression::Access { base, .. } => pointer = base,
                Expression::GlobalVariable(global) => {
                    return matches!(self.module.global_variables[global].space, AddressSpace::Storage { .. });
                }
                _ => return false,
            }
        }
    }

    fn is_float_atomic(&self, function: &Function, mut pointer: Handle<Expression>) -> bool {
        let mut path = Vec::new();
        loop {
            match function.expressions[pointer] {
                Expression::AccessIndex { base, index } => {
                    path.push(Some(index));
                    pointer = base;
                }
                Expression::Access { base, .. } => {
                    path.push(None);
                    pointer = base;
                }
                Expression::GlobalVariable(global) => {
                    let mut ty = self.module.global_variables[global].ty;
                    for step in path.iter().rev() {
                        ty = match (&self.module.types[ty].inner, step) {
                            (TypeInner::Struct { members, .. }, Some(index)) => members[*index as usize].ty,
                            (TypeInner::Array { base, .. }, _) => *base,
                            _ => return false,
                        };
                    }
                    return matches!(self.module.types[ty].inner, TypeInner::Atomic(scalar) if scalar.kind == naga::ScalarKind::Float);
                }
                _ => return false,
            }
        }
    }
}

/// Visits the statements of a block and of the blocks within.
pub(super) fn each_statement(block: &Block, visit: &mut dyn FnMut(&Statement, Span)) {
    for (statement, span) in block.span_iter() {
        visit(statement, *span);
        match statement {
            Statement::Block(inner) => each_statement(inner, visit),
            Statement::If { accept, reject, .. } => {
                each_statement(accept, visit);
                each_statement(reject, visit);
            }
            Statement::Switch { cases, .. } => cases.iter().for_each(|case| each_statement(&case.body, visit)),
            Statement::Loop { body, continuing, .. } => {
                each_statement(body, visit);
                each_statement(continuing, visit);
            }
            _ => {}
        }
    }
}
