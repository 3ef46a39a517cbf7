//! Joins WGSL modules by their imports, without touching a byte that naga reads.
//!
//! Syntax (a strict subset of WESL): `import package::folder::file::{name, other};` or `import package::folder::file::name;` on lines
//! before the first declaration. `package` is the package the importing file belongs to; other packages go by their name. An import
//! is a dependency and a check that the name exists; names are not mangled, so two modules may not declare the same one.
//!
//! **Invariant:** the composed text holds each module at its original length; only import statements become spaces.

use std::{borrow::Cow, collections::HashMap, ops::Range};

use super::Diagnostic;

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
        let range = span.to_range().unwrap_or(0..0);
        match self.segments.iter().find(|segment| segment.range.contains(&range.start)) {
            Some(segment) if span.is_defined() => {
                let base = segment.range.start;
                Diagnostic::new(&segment.file, &segment.original, range.start - base..range.end - base, message, label, notes)
            }
            _ => {
                Diagnostic::nowhere(std::iter::once(message).chain([label]).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(": "))
            }
        }
    }

    /// A parse error of naga as messages about the user's files.
    pub(crate) fn parse_error(&self, error: &naga::front::wgsl::ParseError) -> Diagnostic {
        let notes: Vec<String> = error.notes().map(String::from).collect();
        match error.labels().next() {
            Some((span, label)) => self.diagnostic(span, error.message(), label, &notes),
            None => Diagnostic::nowhere(error.message().to_owned()),
        }
    }

    /// A validation error of naga as a message about the user's files: the innermost cause at the narrowest place.
    pub(crate) fn validation_error(&self, error: &naga::WithSpan<naga::valid::ValidationError>) -> Diagnostic {
        let mut causes = vec![error.as_inner().to_string()];
        let mut source = std::error::Error::source(error.as_inner());
        while let Some(cause) = source {
            causes.push(cause.to_string());
            source = cause.source();
        }
        let message = causes.pop().unwrap_or_default();
        causes.reverse();
        match error.spans().last() {
            Some((span, label)) => self.diagnostic(*span, &message, label, &causes),
            None => Diagnostic::nowhere(message),
        }
    }
}

/// An `import` statement: where it stands, what it wants.
struct Import {
    span: Range<usize>,
    module: Vec<String>,
    names: Vec<(String, Range<usize>)>,
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
        let (imports, _) = parse_imports(module);
        let blanked = blank(&module.text, imports.iter().map(|import| import.span.clone()));
        for (name, span) in declarations(&blanked) {
            if name.starts_with("wf_") {
                let message = format!("`{name}`: names beginning with `wf_` are reserved for generated code");
                errors.push(Diagnostic::new(&module.file, &module.text, span.clone(), &message, "reserved", &[]));
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
    let (imports, mut problems) = parse_imports(module);
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
        let names: Vec<String> = declarations(&all[found].text).into_iter().map(|(name, _)| name).collect();
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

/// Byte offsets at which the text is code: comments become spaces of the same length.
fn without_comments(text: &str) -> Vec<u8> {
    let mut out = text.as_bytes().to_vec();
    let mut i = 0;
    while i < out.len() {
        if out[i..].starts_with(b"//") {
            while i < out.len() && out[i] != b'\n' {
                out[i] = b' ';
                i += 1;
            }
        } else if out[i..].starts_with(b"/*") {
            let mut depth = 0;
            while i < out.len() {
                if out[i..].starts_with(b"/*") {
                    depth += 1;
                    out[i] = b' ';
                    out[i + 1] = b' ';
                    i += 2;
                } else if out[i..].starts_with(b"*/") {
                    depth -= 1;
                    out[i] = b' ';
                    out[i + 1] = b' ';
                    i += 2;
                    if depth == 0 {
                        break;
                    }
                } else {
                    if out[i] != b'\n' {
                        out[i] = b' ';
                    }
                    i += 1;
                }
            }
        } else {
            i += 1;
        }
    }
    out
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_' || byte >= 0x80
}

fn next_token(code: &[u8], mut at: usize) -> Option<Range<usize>> {
    while at < code.len() && code[at].is_ascii_whitespace() {
        at += 1;
    }
    let start = at;
    while at < code.len() && is_word(code[at]) {
        at += 1;
    }
    if at == start && at < code.len() {
        at += if code[at..].starts_with(b"::") { 2 } else { 1 };
    }
    (at > start).then_some(start..at)
}

fn parse_imports(module: &SourceModule) -> (Vec<Import>, Vec<Diagnostic>) {
    let code = without_comments(&module.text);
    let mut imports = Vec::new();
    let mut errors = Vec::new();
    let mut at = 0;
    while let Some(keyword) = next_token(&code, at).filter(|token| &code[token.clone()] == b"import") {
        let mut parts: Vec<(String, Range<usize>)> = Vec::new();
        let mut names = Vec::new();
        let mut in_braces = false;
        let mut end = keyword.end;
        let mut complete = false;
        while let Some(token) = next_token(&code, end) {
            end = token.end;
            let word = String::from_utf8_lossy(&code[token.clone()]).into_owned();
            match word.as_str() {
                ";" => {
                    complete = true;
                    break;
                }
                "::" | "," => {}
                "{" => in_braces = true,
                "}" => in_braces = false,
                _ if !word.bytes().all(is_word) => break,
                _ if in_braces => names.push((word, token)),
                _ => parts.push((word, token)),
            }
        }
        if names.is_empty() {
            names.extend(parts.pop());
        }
        let span = keyword.start..end;
        if !complete || parts.is_empty() {
            let note = "written as `import package::folder::file::{name, other};`".to_owned();
            errors.push(Diagnostic::new(&module.file, &module.text, span, "malformed import", "", &[note]));
            break;
        }
        at = end;
        imports.push(Import { span, module: parts.into_iter().map(|(word, _)| word).collect(), names });
    }
    (imports, errors)
}

/// Names declared at module level with their places.
fn declarations(text: &str) -> Vec<(String, Range<usize>)> {
    let code = without_comments(text);
    let mut names = Vec::new();
    let mut depth = 0_i32;
    let mut at = 0;
    while let Some(token) = next_token(&code, at) {
        at = token.end;
        match &code[token] {
            b"{" | b"(" => depth += 1,
            b"}" | b")" => depth -= 1,
            b"fn" | b"struct" | b"const" | b"override" | b"alias" | b"var" if depth == 0 => {
                let mut name = next_token(&code, at);
                // `var<storage, read> name`: skip the angle brackets.
                if name.clone().is_some_and(|token| &code[token] == b"<") {
                    while let Some(token) = name {
                        name = next_token(&code, token.end);
                        if &code[token] == b">" {
                            break;
                        }
                    }
                }
                if let Some(token) = name {
                    at = token.end;
                    names.push((String::from_utf8_lossy(&code[token.clone()]).into_owned(), token));
                }
            }
            _ => {}
        }
    }
    names
}
