//! Joins WGSL modules by their imports, without touching a byte that naga reads.
//!
//! Syntax (a strict subset of WESL): `import package::folder::file::{name, other};` or `import package::folder::file::name;` on lines
//! before the first declaration. `package` is the package the importing file belongs to; other packages go by their name. An import
//! is a dependency and a check that the name exists; names are not mangled, so two modules may not declare the same one.
//!
//! **Invariant:** the composed text holds each module at its original length; only import statements become spaces.

use std::{borrow::Cow, collections::HashMap, ops::Range};

use naga::valid::{Capabilities, ValidationFlags, Validator};

use super::{Diagnostic, scan};

/// One WGSL file of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceModule {
    /// The package it belongs to: what `package::` means inside of it.
    pub package: Cow<'static, str>,
    /// What imports call it, with `::` between the parts.
    pub path: Cow<'static, str>,
    /// The file's name for messages.
    pub file: Cow<'static, str>,
    /// The WGSL.
    pub text: Cow<'static, str>,
}

/// The joined text with the way back.
#[derive(Clone, Debug, Default)]
pub(crate) struct Composition {
    pub(crate) text: String,
    segments: Vec<Segment>,
}

#[derive(Clone, Debug)]
struct Segment {
    range: Range<usize>,
    file: String,
    original: String,
}

impl Composition {
    /// Appends text that a file or a generator provides.
    pub(crate) fn push(&mut self, file: &str, original: &str, blanked: &str) {
        let start = self.text.len();
        self.text.push_str(blanked);
        self.segments.push(Segment { range: start..self.text.len(), file: file.to_owned(), original: original.to_owned() });
        self.text.push('\n');
    }

    /// Turns a span of the joined text into a message about the file it came from.
    pub(crate) fn diagnostic(&self, span: naga::Span, message: &str, label: &str, notes: &[String]) -> Diagnostic {
        self.labelled(&[(span, label)], message, notes)
    }

    /// The same with several places, the first of which is the mistake; those in other files are left out.
    fn labelled(&self, labels: &[(naga::Span, &str)], message: &str, notes: &[String]) -> Diagnostic {
        let place = |span: &naga::Span| {
            let range = span.to_range().filter(|_| span.is_defined())?;
            self.segments.iter().find(|segment| segment.range.contains(&range.start)).map(|segment| (segment, range))
        };
        let Some((segment, _)) = labels.first().and_then(|(span, _)| place(span)) else {
            let label = labels.first().map_or("", |(_, label)| label);
            return Diagnostic::nowhere(
                std::iter::once(message).chain([label]).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(": "),
            );
        };
        let base = segment.range.start;
        let labels: Vec<_> = labels
            .iter()
            .filter_map(|(span, label)| {
                let (other, range) = place(span)?;
                // naga names its own types where it has nothing to say.
                let label = if label.starts_with("naga::") { "" } else { label };
                (other.range.start == base).then(|| (range.start - base..range.end - base, label))
            })
            .collect();
        Diagnostic::labelled(&segment.file, &segment.original, &labels, message, notes)
    }

    /// Where the function of this name is declared, from `fn` to its name.
    pub(crate) fn declaration(&self, name: &str) -> naga::Span {
        let declares = |start: usize| {
            let rest = self.text[start + 2..].trim_start();
            rest.strip_prefix(name).is_some_and(|rest| rest.trim_start().starts_with('('))
        };
        let found = self.text.match_indices("fn").map(|(start, _)| start).find(|start| declares(*start));
        found.map_or(naga::Span::UNDEFINED, |start| {
            let end = self.text[start..].find('(').map_or(start, |length| start + length);
            naga::Span::new(start as u32, end as u32)
        })
    }

    /// The text as naga understands it.
    pub(crate) fn parse(&self) -> Result<naga::Module, Diagnostic> {
        let module = naga::front::wgsl::parse_str(&self.text).map_err(|error| self.parse_error(&error))?;
        Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module).map_err(|error| self.validation_error(&error))?;
        Ok(module)
    }

    /// A parse error of naga as messages about the user's files.
    fn parse_error(&self, error: &naga::front::wgsl::ParseError) -> Diagnostic {
        let notes: Vec<String> = error.notes().map(String::from).collect();
        let labels: Vec<(naga::Span, &str)> = error.labels().collect();
        self.labelled(&labels, error.message(), &notes)
    }

    /// A validation error of naga as a message about the user's files: the innermost cause at the narrowest place.
    fn validation_error(&self, error: &naga::WithSpan<naga::valid::ValidationError>) -> Diagnostic {
        let mut causes = vec![error.as_inner().to_string()];
        let mut source = std::error::Error::source(error.as_inner());
        while let Some(cause) = source {
            causes.push(cause.to_string());
            source = cause.source();
        }
        let mut message = causes.pop().unwrap_or_default();
        // Numbers of expressions and functions mean something inside naga alone.
        let mut notes: Vec<String> = causes.iter().rev().filter(|cause| !cause.starts_with("Expression [")).cloned().collect();
        for note in &mut notes {
            if let Some((_, rest)) = note.split_once("] '").filter(|_| note.starts_with("Function [")) {
                *note = format!("in function `{}`", rest.trim_end_matches("' is invalid"));
            }
        }
        if message == "Abstract types may only appear in constant expressions" {
            message = "the operands of this expression have different types".into();
            notes.insert(0, "WGSL converts no values by itself: write `f32(x)`, `u32(x)` or a literal such as `1u`".into());
        }
        let labels: Vec<(naga::Span, &str)> = error.spans().last().map(|(span, label)| (*span, label.as_str())).into_iter().collect();
        self.labelled(&labels, &message, &notes)
    }
}

/// Joins `roots` and everything they import from `library`, dependencies first, into `composition`.
pub(crate) fn compose(composition: &mut Composition, roots: &[SourceModule], library: &[SourceModule]) -> Result<(), Vec<Diagnostic>> {
    let mut order = Vec::new();
    let mut state = HashMap::new();
    let all: Vec<&SourceModule> = roots.iter().chain(library).collect();
    let mut errors = Vec::new();
    for root in 0..roots.len() {
        visit(root, &all, &mut state, &mut order, &mut errors);
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let mut declared: HashMap<String, (usize, Range<usize>)> = HashMap::new();
    for &index in &order {
        let module = all[index];
        let (imports, _) = scan::imports(module);
        let blanked = blank(&module.text, imports.iter().map(|import| import.span.clone()));
        for (name, span) in scan::declarations(&blanked) {
            if let Some(message) = scan::reserved(&name) {
                errors.push(Diagnostic::new(&module.file, &module.text, span.clone(), &message, "choose another name", &[]));
            }
            if let Some((other, _)) = declared.get(&name) {
                let message = format!("`{name}` is declared twice");
                let note = format!("the other declaration is in {}", all[*other].file);
                errors.push(Diagnostic::new(&module.file, &module.text, span.clone(), &message, "declared again", &[note]));
            }
            declared.insert(name, (index, span));
        }
        composition.push(&module.file, &module.text, &blanked);
    }
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// Depth first over imports; a module enters `order` after all that it needs. Cycles are fine for WGSL and simply not followed twice.
fn visit(index: usize, all: &[&SourceModule], state: &mut HashMap<usize, ()>, order: &mut Vec<usize>, errors: &mut Vec<Diagnostic>) {
    if state.insert(index, ()).is_some() {
        return;
    }
    let module = all[index];
    if let Some(problem) = scan::check(module) {
        errors.push(problem);
        return;
    }
    let (imports, mut problems) = scan::imports(module);
    errors.append(&mut problems);
    for import in imports {
        let (package, path) = match import.module.split_first() {
            Some((first, rest)) if first == "package" => (module.package.as_ref(), rest.join("::")),
            Some((first, rest)) => (first.as_str(), rest.join("::")),
            None => continue,
        };
        let Some(found) = all.iter().position(|other| other.package == package && other.path == path) else {
            let known: Vec<&str> = all.iter().filter(|other| other.package == package).map(|other| other.path.as_ref()).collect();
            let note = if known.is_empty() {
                let mut packages: Vec<&str> = all.iter().map(|other| other.package.as_ref()).collect();
                packages.sort_unstable();
                packages.dedup();
                format!("packages known here: {}", packages.join(", "))
            } else {
                format!("modules of `{package}`: {}", known.join(", "))
            };
            let message = format!("unknown import `{}`", import.module.join("::"));
            errors.push(Diagnostic::new(&module.file, &module.text, import.span, &message, "no such module", &[note]));
            continue;
        };
        let names: Vec<String> = scan::declarations(&all[found].text).into_iter().map(|(name, _)| name).collect();
        for (name, span) in import.names {
            if !names.contains(&name) {
                let message = format!("`{}` declares no `{name}`", import.module.join("::"));
                errors.push(Diagnostic::new(&module.file, &module.text, span, &message, "unknown name", &[]));
            }
        }
        visit(found, all, state, order, errors);
    }
    order.push(index);
}

fn blank(text: &str, spans: impl Iterator<Item = Range<usize>>) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for span in spans {
        for byte in &mut bytes[span] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
    }
    // Import statements hold no partial characters: they begin and end at ASCII bytes.
    String::from_utf8(bytes).unwrap_or_else(|_| text.to_owned())
}
