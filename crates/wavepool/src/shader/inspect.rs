//! Reads a composed program with naga: finds the contract's functions, checks their signatures and the rules of a stage.
//!
//! **Invariant:** whatever passes here can be wrapped in every execution; what cannot is reported with its place and the rule.

use std::{collections::BTreeSet, ops::Range};

use naga::{AddressSpace, Expression, Function, Handle, Module, Span, Statement, StorageAccess, Type, TypeInner};

use super::{Composition, DeclaredArray, Diagnostic, StateArray, Summary, analyse, rules::each_statement};
use crate::{
    layout::{Cell, Field, Leaf, MOST_LEAVES, Scalar, fields, flatten, leaf_count},
    program::Names,
};

/// What a program offers to the scheduler.
#[derive(Clone, Debug)]
pub(crate) struct Interface {
    pub(crate) state: String,
    pub(crate) leaves: Vec<Leaf>,
    /// What formats can be declared for, and the words that the declared ones make.
    pub(crate) fields: Vec<Field>,
    pub(crate) cells: Vec<Cell>,
    /// Members that stages reach through accessors; their leaves belong to no cell above.
    pub(crate) arrays: Vec<StateArray>,
    pub(crate) result: Vec<Leaf>,
    pub(crate) generate: Summary,
    pub(crate) stages: Vec<StageFacts>,
    pub(crate) finish: Summary,
    pub(crate) survival: Option<Summary>,
    pub(crate) reweight: Option<Summary>,
    pub(crate) queue_key: Option<Summary>,
    pub(crate) resources: Vec<Resource>,
    /// Names of all functions that a stage may reach.
    pub(crate) functions: BTreeSet<String>,
}

/// A stage as found in the WGSL.
#[derive(Clone, Debug)]
pub(crate) struct StageFacts {
    pub(crate) name: String,
    pub(crate) summary: Summary,
    /// Returns `CONTINUE` or `FINISH`.
    pub(crate) decides: bool,
}

/// A variable with a binding that the program uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Resource {
    pub(crate) name: String,
    pub(crate) group: u32,
    pub(crate) binding: u32,
    pub(crate) kind: ResourceKind,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ResourceKind {
    Uniform,
    Storage { writable: bool },
    Texture { dimension: wgpu::TextureViewDimension, sample_type: wgpu::TextureSampleType },
    Sampler,
}

pub(super) struct Inspector<'a> {
    pub(super) module: Module,
    composition: &'a Composition,
    errors: Vec<Diagnostic>,
    state: Option<Handle<Type>>,
    item: Option<Handle<Type>>,
}

/// Parses, validates and inspects; the returned diagnostics are complete as far as later ones do not follow from earlier ones.
pub(crate) fn inspect(composition: &Composition, names: &Names, arrays: &[DeclaredArray]) -> Result<Interface, Vec<Diagnostic>> {
    let module = composition.parse().map_err(|diagnostic| vec![diagnostic])?;
    let item = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some("Item")).map(|(handle, _)| handle);
    let mut inspector = Inspector { module, composition, errors: Vec::new(), state: None, item };
    let interface = inspector.interface(names, arrays);
    match interface {
        Some(interface) if inspector.errors.is_empty() => Ok(interface),
        _ => Err(inspector.errors),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    Generate,
    Stage,
    Finish,
    Survival,
    Reweight,
    QueueKey,
}

impl Role {
    fn signature(self, name: &str, state: &str) -> String {
        let head = format!("fn {name}(lane: ptr<function, {state}>");
        match self {
            Role::Generate => format!("{head}, item: Item)"),
            Role::Stage => format!("{head}) or {head}) -> u32"),
            Role::Finish => format!("{head}) -> f32, u32, a vector or a struct of these"),
            Role::Survival => format!("{head}) -> f32"),
            Role::Reweight => format!("{head}, inverse_p: f32)"),
            Role::QueueKey => format!("{head}) -> u32"),
        }
    }
}

impl Inspector<'_> {
    fn interface(&mut self, names: &Names, declared: &[DeclaredArray]) -> Option<Interface> {
        for entry in &self.module.entry_points {
            let message = format!("`{}` is an entry point", entry.name);
            let place = self.composition.declaration(&entry.name);
            self.errors.push(self.composition.diagnostic(place, &message, "kernels are generated; stages are plain functions", &[]));
        }
        let generate = self.role(&names.generate, Role::Generate)?;
        let stages: Vec<_> = names.stages.iter().filter_map(|name| Some((name.clone(), self.role(name, Role::Stage)?))).collect();
        let finish = self.role(&names.finish, Role::Finish)?;
        let survival = self.optional(&names.survival, Role::Survival);
        let reweight = self.optional(&names.reweight, Role::Reweight);
        let queue_key = self.optional(&names.queue_key, Role::QueueKey);
        for (have, lack) in [(&names.survival, &names.reweight), (&names.reweight, &names.survival)] {
            if let (Some(function), None) = (self.find(have), self.find(lack)) {
                let label = format!("roulette needs `{lack}` too");
                self.error(self.head(function), &format!("`{have}` stands alone"), &label);
            }
        }
        let decides = |(_, function): &&(String, Handle<Function>)| self.module.functions[*function].result.is_some();
        if let (Some((_, last)), None) = (stages.last(), stages.iter().find(decides)) {
            self.error(self.head(*last), "the walks never end: no stage returns CONTINUE or FINISH", "the last stage, for one, could");
        }
        let state = self.state?;
        let mut leaves = Vec::new();
        let scalars = leaf_count(&self.module, state);
        let flat = if scalars > MOST_LEAVES {
            Err(format!("it has {scalars} scalars, the limit is {MOST_LEAVES}"))
        } else {
            flatten(&self.module, state, "", &mut leaves)
        };
        if let Err(problem) = flat {
            let span = self.module.types.get_span(state);
            let message = format!("`{}` cannot be kept between stages: {problem}", self.type_name(state));
            self.error(span, &message, "the state");
        }
        let result_type = self.module.functions[finish].result.as_ref()?.ty;
        let mut result = Vec::new();
        let is_small = leaf_count(&self.module, result_type) <= MOST_LEAVES;
        let flat = if is_small { flatten(&self.module, result_type, "", &mut result) } else { Err(String::new()) };
        let supported = flat.is_ok() && !result.is_empty() && result.iter().all(|leaf| leaf.scalar != Scalar::I32);
        if !supported {
            let span = self.head(finish);
            self.error(span, "the result cannot be summed", "f32, u32, a vector or a struct of these");
        }
        let mut roots = vec![generate, finish];
        roots.extend(stages.iter().map(|stage| stage.1));
        roots.extend(survival);
        roots.extend(reweight);
        roots.extend(queue_key);
        let (functions, globals) = self.reachable(&roots);
        functions.iter().for_each(|function| self.check_rules(*function));
        // What naga cannot write stops it even where nobody calls it.
        let all: Vec<_> = self.module.functions.iter().map(|(handle, _)| handle).collect();
        all.iter().for_each(|function| self.check_pointers(*function));
        let accessors = self.accessor_functions(declared);
        if !declared.is_empty() {
            functions
                .difference(&accessors.iter().copied().collect())
                .for_each(|function| self.check_array_use(*function, state, declared));
        }
        let mut roles = vec![(names.generate.clone(), generate), (names.finish.clone(), finish)];
        roles.extend(stages.iter().cloned());
        roles.extend(survival.map(|function| (names.survival.clone(), function)));
        roles.extend(reweight.map(|function| (names.reweight.clone(), function)));
        roles.extend(queue_key.map(|function| (names.queue_key.clone(), function)));
        if let Some(function) = queue_key.filter(|function| !analyse(&self.module, *function, 0, &accessors).on_return().may.is_empty()) {
            let message = format!("`{}` writes to the state", names.queue_key);
            self.error(self.head(function), &message, "only some schedules ask for a key: asking must change nothing");
        }
        let arrays = self.arrays(state, declared, &roles);
        let resources = self.resources(&globals);
        if !self.errors.is_empty() {
            return None;
        }
        let module = &self.module;
        let functions = functions.iter().filter_map(|function| module.functions[*function].name.clone()).collect();
        let summary = |function| analyse(module, function, 0, &accessors);
        Some(Interface {
            state: self.type_name(state),
            leaves,
            fields: fields(module, state),
            cells: Vec::new(),
            arrays,
            result,
            generate: summary(generate),
            stages: stages
                .into_iter()
                .map(|(name, function)| StageFacts {
                    name,
                    summary: summary(function),
                    decides: module.functions[function].result.is_some(),
                })
                .collect(),
            finish: summary(finish),
            survival: survival.map(summary),
            reweight: reweight.map(summary),
            queue_key: queue_key.map(summary),
            resources,
            functions,
        })
    }

    pub(super) fn error(&mut self, span: Span, message: &str, label: &str) {
        let diagnostic = self.composition.diagnostic(span, message, label, &[]);
        self.errors.push(diagnostic);
    }

    fn type_name(&self, ty: Handle<Type>) -> String {
        self.module.types[ty].name.clone().unwrap_or_else(|| "?".into())
    }

    fn find(&self, name: &str) -> Option<Handle<Function>> {
        self.module.functions.iter().find(|(_, function)| function.name.as_deref() == Some(name)).map(|(handle, _)| handle)
    }

    /// From `fn` to the opening brace.
    fn head(&self, function: Handle<Function>) -> Span {
        let span = self.module.functions.get_span(function);
        let Some(Range { start, end }) = span.to_range() else { return span };
        let length = self.composition.text.get(start..end).and_then(|text| text.find('{')).unwrap_or(end - start);
        let head = self.composition.text[start..start + length].trim_end().len();
        Span::new(start as u32, (start + head) as u32)
    }

    fn optional(&mut self, name: &str, role: Role) -> Option<Handle<Function>> {
        self.find(name)?;
        self.role(name, role)
    }

    /// The function of this name, when its signature is the role's.
    fn role(&mut self, name: &str, role: Role) -> Option<Handle<Function>> {
        let Some(handle) = self.find(name) else {
            let known: Vec<&str> = self
                .module
                .functions
                .iter()
                .filter_map(|(_, function)| function.name.as_deref())
                .filter(|name| !name.starts_with("wf_") && *name != "item_coordinates")
                .collect();
            self.errors.push(Diagnostic::nowhere(format!("no function `{name}` in the program; there are: {}", known.join(", "))));
            return None;
        };
        let types = &self.module.types;
        let function = &self.module.functions[handle];
        let first = function.arguments.first().map(|argument| &types[argument.ty].inner);
        let state = match first {
            Some(TypeInner::Pointer { base, space: AddressSpace::Function }) if matches!(types[*base].inner, TypeInner::Struct { .. }) => {
                Some(*base)
            }
            _ => None,
        };
        let second = function.arguments.get(1).map(|argument| argument.ty);
        let second_inner = second.map(|ty| &types[ty].inner);
        let returns = function.result.as_ref().map(|result| &types[result.ty].inner);
        let is = |inner: Option<&TypeInner>, scalar| matches!(inner, Some(TypeInner::Scalar(found)) if *found == scalar);
        let fits = state.is_some()
            && match role {
                Role::Generate => function.arguments.len() == 2 && second == self.item && returns.is_none(),
                Role::Stage => function.arguments.len() == 1 && (returns.is_none() || is(returns, naga::Scalar::U32)),
                Role::Finish => function.arguments.len() == 1 && returns.is_some(),
                Role::Survival => function.arguments.len() == 1 && is(returns, naga::Scalar::F32),
                Role::QueueKey => function.arguments.len() == 1 && is(returns, naga::Scalar::U32),
                Role::Reweight => function.arguments.len() == 2 && is(second_inner, naga::Scalar::F32) && returns.is_none(),
            };
        let same_state = self.state.is_none() || state.is_none() || self.state == state;
        if !fits || !same_state {
            let state_name = self.state.or(state).map_or_else(|| "State".into(), |state| self.type_name(state));
            let span = self.head(handle);
            let message = format!("`{name}` has the wrong signature");
            let note = format!("expected: {}", role.signature(name, &state_name));
            let diagnostic = self.composition.diagnostic(
                span,
                &message,
                if same_state { "this is not what the scheduler calls" } else { "works on another state" },
                &[note],
            );
            self.errors.push(diagnostic);
            return None;
        }
        self.state = self.state.or(state);
        Some(handle)
    }

    /// Functions called from the roots, and global variables these use.
    pub(super) fn reachable(&self, roots: &[Handle<Function>]) -> (BTreeSet<Handle<Function>>, BTreeSet<Handle<naga::GlobalVariable>>) {
        let mut functions = BTreeSet::new();
        let mut globals = BTreeSet::new();
        let mut open = roots.to_vec();
        while let Some(handle) = open.pop() {
            if !functions.insert(handle) {
                continue;
            }
            let function = &self.module.functions[handle];
            globals.extend(function.expressions.iter().filter_map(|(_, expression)| match expression {
                Expression::GlobalVariable(global) => Some(*global),
                _ => None,
            }));
            each_statement(&function.body, &mut |statement, _| {
                if let Statement::Call { function, .. } = statement {
                    open.push(*function);
                }
            });
        }
        (functions, globals)
    }

    fn resources(&mut self, globals: &BTreeSet<Handle<naga::GlobalVariable>>) -> Vec<Resource> {
        let mut resources = Vec::new();
        for &handle in globals {
            let variable = &self.module.global_variables[handle];
            let name = variable.name.clone().unwrap_or_default();
            let Some(binding) = &variable.binding else { continue };
            if name.starts_with("wf_") {
                continue;
            }
            let span = self.module.global_variables.get_span(handle);
            if binding.group == 0 {
                self.error(span, &format!("`{name}` uses a reserved binding"), "group 0 belongs to the scheduler; use group 1 to 3");
                continue;
            }
            let kind = match (&self.module.types[variable.ty].inner, variable.space) {
                (_, AddressSpace::Uniform) => Some(ResourceKind::Uniform),
                (_, AddressSpace::Storage { access }) => Some(ResourceKind::Storage { writable: access.contains(StorageAccess::STORE) }),
                (TypeInner::Sampler { comparison: false }, _) => Some(ResourceKind::Sampler),
                (TypeInner::Image { dim, arrayed, class }, _) => texture(*dim, *arrayed, *class),
                _ => None,
            };
            match kind {
                Some(kind) => resources.push(Resource { name, group: binding.group, binding: binding.binding, kind }),
                None => self.error(
                    span,
                    &format!("`{name}` is a kind of resource that stages cannot use"),
                    "buffers, sampled textures and samplers",
                ),
            }
        }
        resources.sort_by_key(|resource| (resource.group, resource.binding));
        for pair in resources.windows(2).filter(|pair| (pair[0].group, pair[0].binding) == (pair[1].group, pair[1].binding)) {
            let [first, second] = [&pair[0].name, &pair[1].name];
            let variable = self.module.global_variables.iter().find(|(_, variable)| variable.name.as_ref() == Some(second));
            let span = variable.map_or(Span::UNDEFINED, |(handle, _)| self.module.global_variables.get_span(handle));
            let place = format!("@group({}) @binding({})", pair[0].group, pair[0].binding);
            self.error(span, &format!("`{first}` and `{second}` share {place}"), "stages use both");
        }
        resources
    }
}

fn texture(dim: naga::ImageDimension, arrayed: bool, class: naga::ImageClass) -> Option<ResourceKind> {
    use wgpu::TextureViewDimension as View;
    let dimension = match (dim, arrayed) {
        (naga::ImageDimension::D1, false) => View::D1,
        (naga::ImageDimension::D2, false) => View::D2,
        (naga::ImageDimension::D2, true) => View::D2Array,
        (naga::ImageDimension::D3, false) => View::D3,
        (naga::ImageDimension::Cube, false) => View::Cube,
        (naga::ImageDimension::Cube, true) => View::CubeArray,
        _ => return None,
    };
    let sample_type = match class {
        // Stages load texels and filter by hand, so that every device filters alike.
        naga::ImageClass::Sampled { kind: naga::ScalarKind::Float, multi: false } => wgpu::TextureSampleType::Float { filterable: false },
        naga::ImageClass::Sampled { kind: naga::ScalarKind::Uint, multi: false } => wgpu::TextureSampleType::Uint,
        naga::ImageClass::Sampled { kind: naga::ScalarKind::Sint, multi: false } => wgpu::TextureSampleType::Sint,
        _ => return None,
    };
    Some(ResourceKind::Texture { dimension, sample_type })
}
