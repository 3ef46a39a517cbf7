//! Resolves `@if(..)`, `@elif(..)` and `@else` in front of declarations, imports, members, statements and cases of a switch.
//!
//! Key decision: a walk over nodes that knows just where each ends; what is inside is naga's business. It is a strict subset of WESL:
//! a node takes one condition, before its other attributes, and `@elif` and `@else` follow the node that their chain began with.
//!
//! **Invariant:** the text keeps its length and its line breaks. What is removed becomes spaces, and so do the conditions themselves.

use std::ops::Range;

use super::{
    Diagnostic, SourceModule,
    features::{Features, Mistake, evaluate, is_name},
    scan::{blank, tokens, without_comments},
};

/// The module's text for one set of features, and what is wrong with its conditions. The brackets of the module are in order.
pub(super) fn resolve(module: &SourceModule, features: &Features) -> (String, Vec<Diagnostic>) {
    let (code, _) = without_comments(&module.text);
    let tokens = tokens(&code, 0).collect();
    let mut walk = Walk { module, features, code: &code, tokens, at: 0, depth: 0, removed: Vec::new(), errors: Vec::new() };
    walk.nodes(Scope::Module);
    (blank(&module.text, walk.removed.into_iter()), walk.errors)
}

/// What kind of nodes stand side by side.
#[derive(Clone, Copy, PartialEq)]
enum Scope {
    Module,
    Members,
    Statements,
    Cases,
}

/// Deeper nesting is left alone; naga refuses it anyway.
const DEEPEST: usize = 127;

const CONDITIONS: [&[u8]; 3] = [b"if", b"elif", b"else"];

struct Walk<'a> {
    module: &'a SourceModule,
    features: &'a Features,
    code: &'a [u8],
    tokens: Vec<Range<usize>>,
    at: usize,
    depth: usize,
    removed: Vec<Range<usize>>,
    errors: Vec<Diagnostic>,
}

impl<'a> Walk<'a> {
    fn word(&self, ahead: usize) -> &'a [u8] {
        self.tokens.get(self.at + ahead).map_or(b"", |token| &self.code[token.clone()])
    }

    fn error(&mut self, place: Range<usize>, message: &str, label: &str, notes: &[String]) {
        self.errors.push(Diagnostic::new(&self.module.file, &self.module.text, place, message, label, notes));
    }

    fn at_condition(&self) -> bool {
        self.word(0) == b"@" && CONDITIONS.contains(&self.word(1))
    }

    /// From a token to the last one before the current.
    fn since(&self, first: usize) -> Range<usize> {
        let last = self.at.max(first + 1).min(self.tokens.len()) - 1;
        self.tokens[first].start..self.tokens[last].end
    }

    /// All nodes up to the bracket that closes their scope, or to the end.
    fn nodes(&mut self, scope: Scope) {
        // Whether a node of the chain that the last one belongs to has been kept.
        let mut chain: Option<bool> = None;
        while self.at < self.tokens.len() && (self.word(0) != b"}" || scope == Scope::Module) {
            let first = self.at;
            if !self.at_condition() {
                chain = None;
                self.node(scope, None);
                // A bracket that closes nothing was reported before; no token may hold up the walk.
                self.at = self.at.max(first + 1);
                continue;
            }
            let mistakes = self.errors.len();
            let is_kept = self.condition(&mut chain);
            let condition = self.since(first);
            self.removed.push(condition.clone());
            if self.at_condition() {
                let place = self.tokens[self.at].start..self.tokens[self.at + 1].end;
                self.error(place, "a second condition for one node", "join them with `&&`", &[]);
                self.condition(&mut Some(true));
            }
            let node = self.at;
            // What follows a broken condition would be blamed for it.
            self.node(scope, Some(&condition).filter(|_| self.errors.len() == mistakes));
            if !is_kept && self.at > node {
                let span = self.since(node);
                self.removed.push(span);
            }
        }
    }

    /// Reads a condition; true when the node behind it stays.
    fn condition(&mut self, chain: &mut Option<bool>) -> bool {
        let keyword = self.word(1);
        let shown = format!("@{}", String::from_utf8_lossy(keyword));
        let place = self.tokens[self.at].start..self.tokens[self.at + 1].end;
        self.at += 2;
        let is_first = keyword == b"if";
        let before = if is_first { false } else { chain.unwrap_or(true) };
        if !is_first && chain.is_none() {
            let label = "follows no `@if` or `@elif`";
            self.error(place.clone(), &format!("`{shown}` without its `@if`"), label, &[]);
        }
        if keyword == b"else" {
            let first = self.at;
            if self.word(0) == b"(" {
                self.bracketed();
                // `@else (*path).depth = 1u;` begins with a parenthesis too.
                if begins_statement(self.word(0)) && !matches!(self.word(0), b"*" | b"&" | b"(") {
                    let place = self.since(first);
                    self.error(place, "`@else` takes no condition", "write `@elif` for one", &[]);
                } else {
                    self.at = first;
                }
            }
            *chain = None;
            return !before;
        }
        let holds = self.parenthesised(place);
        *chain = Some(before || holds);
        holds && !before
    }

    /// The value of the condition in parentheses; true when it is malformed, which is reported.
    fn parenthesised(&mut self, keyword: Range<usize>) -> bool {
        let first = self.at;
        let outcome = if self.word(0) == b"(" {
            self.bracketed();
            let inner = &self.tokens[first + 1..self.at - 1];
            evaluate(self.code, inner, self.tokens[self.at - 1].clone(), self.features)
        } else {
            Err(Mistake::Malformed { place: keyword, label: "expected a condition in parentheses after this" })
        };
        match outcome {
            Ok(value) => return value,
            Err(Mistake::Malformed { place, label }) => {
                let note = "written with names of features, `true`, `false`, `!`, `&&`, `||` and parentheses".to_owned();
                self.error(place, "malformed condition", label, &[note]);
            }
            Err(Mistake::Unknown { name, place }) => {
                let known: Vec<&str> = self.features.iter().map(|(name, _)| name.as_str()).collect();
                let note = if known.is_empty() {
                    "the program has no features".to_owned()
                } else {
                    format!("features of the program: {}", known.join(", "))
                };
                self.error(place, &format!("unknown feature `{name}`"), "not given to the program", &[note]);
            }
        }
        true
    }

    /// One node with its attributes; `condition` is where its condition stands, if it has one.
    fn node(&mut self, scope: Scope, condition: Option<&Range<usize>>) {
        while self.word(0) == b"@" {
            if self.at_condition() {
                let place = self.tokens[self.at].start..self.tokens[self.at + 1].end;
                self.error(place, "a condition behind another attribute", "conditions come first", &[]);
            }
            self.at += 2;
            if self.word(0) == b"(" {
                self.group();
            }
        }
        let word = self.word(0);
        let (begins, what) = match scope {
            Scope::Module => (is_declaration(word), "a declaration or an import"),
            Scope::Members => (is_name(word), "a member"),
            Scope::Statements => (begins_statement(word), "a statement"),
            Scope::Cases => (matches!(word, b"case" | b"default"), "a case of the switch"),
        };
        if let Some(place) = condition.filter(|_| !begins) {
            self.error(place.clone(), "a condition for nothing", &format!("expected {what} after this"), &[]);
        }
        let first = self.at;
        let ending = match scope {
            Scope::Module => self.declaration(),
            Scope::Members => self.member(),
            Scope::Statements => self.statement(),
            Scope::Cases => self.body(Scope::Statements),
        };
        if let Err(missing) = ending.map_err(|missing| format!("expected `{missing}` after this"))
            && condition.is_some()
            && begins
        {
            let end = self.since(first).end;
            self.error(end - 1..end, "what stands behind the condition is not complete", &missing, &[]);
        }
    }

    /// To the semicolon, or to the end of the body of a function or struct. Fails with what is missing, as the others do.
    fn declaration(&mut self) -> Result<(), char> {
        let inner = match self.word(0) {
            b"fn" => Some(Scope::Statements),
            b"struct" => Some(Scope::Members),
            b"import" => {
                while self.at < self.tokens.len() && self.word(0) != b";" {
                    self.step();
                }
                self.at += 1;
                return Ok(());
            }
            _ => None,
        };
        match inner {
            Some(scope) => self.body(scope),
            None => self.simple(),
        }
    }

    /// To the comma that ends it. Commas between angle brackets belong to a type.
    fn member(&mut self) -> Result<(), char> {
        let mut angles = 0_u32;
        loop {
            match self.word(0) {
                b"" | b"}" => return Ok(()),
                b"<" if matches!(self.word(1), b"<" | b"=") => self.at += 1,
                b"<" => angles += 1,
                b">" => angles = angles.saturating_sub(1),
                b"," if angles == 0 => {
                    self.at += 1;
                    return Ok(());
                }
                _ => {}
            }
            self.step();
        }
    }

    fn statement(&mut self) -> Result<(), char> {
        match self.word(0) {
            b"{" | b"for" | b"while" | b"loop" | b"continuing" => self.body(Scope::Statements),
            b"switch" => self.body(Scope::Cases),
            b"if" => {
                let mut ending = self.body(Scope::Statements);
                while self.word(0) == b"else" {
                    ending = self.body(Scope::Statements);
                }
                ending
            }
            _ => self.simple(),
        }
    }

    /// To the end of the braces that come next, with the nodes between them.
    fn body(&mut self, inner: Scope) -> Result<(), char> {
        while !matches!(self.word(0), b"" | b"{" | b"}" | b";") {
            self.step();
        }
        if self.word(0) != b"{" {
            return Err('{');
        }
        self.depth += 1;
        if self.depth > DEEPEST {
            self.bracketed();
        } else {
            self.at += 1;
            self.nodes(inner);
            self.at += 1;
        }
        self.depth -= 1;
        Ok(())
    }

    /// To the semicolon, or to braces that come before it.
    fn simple(&mut self) -> Result<(), char> {
        while !matches!(self.word(0), b"" | b"{" | b"}" | b";") {
            self.step();
        }
        if self.word(0) != b";" {
            return Err(';');
        }
        self.at += 1;
        Ok(())
    }

    /// One token, or all that a bracket encloses, in which no condition may stand.
    fn step(&mut self) {
        match self.word(0) {
            b"(" | b"[" | b"{" => self.group(),
            _ => {
                self.stray();
                self.at += 1;
            }
        }
    }

    /// To behind the bracket that closes the one here; conditions between them are mistakes.
    fn group(&mut self) {
        let first = self.at;
        self.bracketed();
        let end = self.at;
        for at in first..end {
            self.at = at;
            self.stray();
        }
        self.at = end;
    }

    fn bracketed(&mut self) {
        let mut open = 0_usize;
        while self.at < self.tokens.len() {
            match self.word(0) {
                b"(" | b"[" | b"{" => open += 1,
                b")" | b"]" | b"}" => open -= 1,
                _ => {}
            }
            self.at += 1;
            if open == 0 {
                return;
            }
        }
    }

    fn stray(&mut self) {
        if self.at_condition() {
            let place = self.tokens[self.at].start..self.tokens[self.at + 1].end;
            let note = "conditions go before declarations, imports, members, statements and cases".to_owned();
            self.error(place, "a condition where none may stand", "not the beginning of a node", &[note]);
        }
    }
}

fn is_declaration(word: &[u8]) -> bool {
    matches!(word, b"import" | b"fn" | b"struct" | b"const" | b"override" | b"var" | b"alias" | b"const_assert")
}

fn begins_statement(word: &[u8]) -> bool {
    match word {
        b"else" | b"case" | b"default" => false,
        b"{" | b"(" | b"*" | b"&" => true,
        _ => word.first().is_some_and(|first| first.is_ascii_alphabetic() || *first == b'_' || !first.is_ascii()),
    }
}

#[cfg(test)]
#[path = "condition_tests.rs"]
mod tests;
