//! What can be seen in a module's text before it is parsed: tokens, imports, declarations, brackets.
//!
//! Key decision: one tokeniser that knows comments and words, nothing else; everything finer is naga's business. Mistakes that would
//! spill over into the next module (an open bracket or comment) are found here, where they begin.

use std::ops::Range;

use super::{Diagnostic, SourceModule};

/// An `import` statement: where it stands, what it wants.
pub(super) struct Import {
    pub(super) span: Range<usize>,
    pub(super) module: Vec<String>,
    pub(super) names: Vec<(String, Range<usize>)>,
}

/// Names that generated code relies on: a module that declares one of them would change its meaning.
const RELIED_ON: [&str; 20] = [
    "array",
    "atomic",
    "atomicAdd",
    "atomicSub",
    "bitcast",
    "f32",
    "function",
    "i32",
    "min",
    "ptr",
    "read",
    "read_write",
    "select",
    "storage",
    "u32",
    "vec2u",
    "vec3u",
    "vec4u",
    "vec2f",
    "vec3f",
];
/// Names that the scheduler declares for every program.
const OF_THE_CONTRACT: [&str; 4] = ["CONTINUE", "FINISH", "Item", "item_coordinates"];

fn error(module: &SourceModule, span: Range<usize>, message: &str, label: &str, notes: &[String]) -> Diagnostic {
    Diagnostic::new(&module.file, &module.text, span, message, label, notes)
}

/// The text with comments as spaces of the same length, and where a comment begins that never ends.
pub(super) fn without_comments(text: &str) -> (Vec<u8>, Option<usize>) {
    let mut out = text.as_bytes().to_vec();
    let mut unclosed = None;
    let mut i = 0;
    while i < out.len() {
        if out[i..].starts_with(b"//") {
            while i < out.len() && out[i] != b'\n' {
                out[i] = b' ';
                i += 1;
            }
        } else if out[i..].starts_with(b"/*") {
            unclosed = Some(i);
            let mut depth = 0;
            while i < out.len() {
                let opens = out[i..].starts_with(b"/*");
                if opens || out[i..].starts_with(b"*/") {
                    depth += if opens { 1 } else { -1 };
                    out[i..i + 2].fill(b' ');
                    i += 2;
                    if depth == 0 {
                        unclosed = None;
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
    (out, unclosed)
}

/// The text with spaces in place of all that lies in `spans`, line breaks excepted.
pub(super) fn blank(text: &str, spans: impl Iterator<Item = Range<usize>>) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for span in spans {
        for byte in &mut bytes[span] {
            if !matches!(byte, b'\n' | b'\r') {
                *byte = b' ';
            }
        }
    }
    // Spans begin and end at tokens, which hold whole characters.
    String::from_utf8(bytes).unwrap_or_else(|_| text.to_owned())
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
        let is_double = [b"::", b"&&", b"||"].iter().any(|double| code[at..].starts_with(*double));
        at += if is_double { 2 } else { 1 };
    }
    (at > start).then_some(start..at)
}

pub(super) fn tokens(code: &[u8], start: usize) -> impl Iterator<Item = Range<usize>> {
    std::iter::successors(next_token(code, start), |token| next_token(code, token.end))
}

/// Brackets and comments that would swallow what follows, and names that are not the module's to use.
pub(super) fn check(module: &SourceModule) -> Option<Diagnostic> {
    let (code, unclosed) = without_comments(&module.text);
    if let Some(start) = unclosed {
        return Some(error(module, start..start + 2, "this comment is never closed", "begins here", &[]));
    }
    let mut open: Vec<Range<usize>> = Vec::new();
    for token in tokens(&code, 0) {
        let word = &code[token.clone()];
        match word {
            b"{" | b"(" | b"[" => open.push(token),
            b"}" | b")" | b"]" => {
                let shown = char::from(word[0]);
                let Some(opening) = open.pop() else {
                    return Some(error(module, token, &format!("`{shown}` closes nothing"), "nothing is open here", &[]));
                };
                let before = char::from(code[opening.start]);
                if !matches!((before, shown), ('{', '}') | ('(', ')') | ('[', ']')) {
                    let message = format!("`{before}` is closed by `{shown}`");
                    return Some(Diagnostic::labelled(
                        &module.file,
                        &module.text,
                        &[(opening, "opened here"), (token, "closed here")],
                        &message,
                        &[],
                    ));
                }
            }
            _ if word.starts_with(b"wf_") => {
                let message = format!("`{}`: names beginning with `wf_` are reserved for generated code", String::from_utf8_lossy(word));
                return Some(error(module, token, &message, "reserved", &[]));
            }
            _ => {}
        }
    }
    if let Some(opening) = open.pop() {
        let message = format!("`{}` is never closed", char::from(code[opening.start]));
        return Some(error(module, opening, &message, "opened here", &[]));
    }
    // Without its end, the last declaration would run on into the next module.
    let last = tokens(&code, 0).last().filter(|token| !matches!(&code[token.clone()], b";" | b"}"))?;
    Some(error(module, last, "the last declaration is not complete", "expected `;` after this", &[]))
}

/// The imports at the head of `text`, which is the module's own with parts blanked, and what is wrong with them.
pub(super) fn imports(module: &SourceModule, text: &str) -> (Vec<Import>, Vec<Diagnostic>) {
    let (code, _) = without_comments(text);
    let mut imports = Vec::new();
    let mut errors = Vec::new();
    let mut at = 0;
    while let Some(keyword) = next_token(&code, at).filter(|token| &code[token.clone()] == b"import") {
        let mut parts: Vec<(String, Range<usize>)> = Vec::new();
        let mut names = Vec::new();
        let mut braces = None;
        let mut end = keyword.end;
        let mut complete = false;
        for token in tokens(&code, end) {
            let word = String::from_utf8_lossy(&code[token.clone()]).into_owned();
            match (word.as_str(), braces) {
                (";", _) => complete = true,
                ("::", None) | (",", Some(true)) => {}
                ("{", None) => braces = Some(true),
                ("}", Some(true)) => braces = Some(false),
                _ if !word.bytes().all(is_word) => break,
                (_, Some(true)) => names.push((word, token.clone())),
                (_, None) => parts.push((word, token.clone())),
                (_, Some(false)) => break,
            }
            end = token.end;
            if complete {
                break;
            }
        }
        if braces.is_none() {
            names.extend(parts.pop());
        }
        let span = keyword.start..end;
        if !complete || parts.is_empty() || names.is_empty() || braces == Some(true) {
            let note = "written as `import package::folder::file::{name, other};`".to_owned();
            let label = if complete { "names nothing" } else { "expected `;` or another part here" };
            let place = if complete { span } else { end.saturating_sub(1)..end };
            errors.push(error(module, place, "malformed import", label, &[note]));
            return (imports, errors);
        }
        at = end;
        imports.push(Import { span, module: parts.into_iter().map(|(word, _)| word).collect(), names });
    }
    if let Some(late) = tokens(&code, at).find(|token| &code[token.clone()] == b"import") {
        errors.push(error(module, late, "this import stands too late", "imports come before the first declaration", &[]));
    }
    (imports, errors)
}

/// Names declared at module level with their places.
pub(super) fn declarations(text: &str) -> Vec<(String, Range<usize>)> {
    let (code, _) = without_comments(text);
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

/// Why a module may not declare `name`, if it may not.
pub(super) fn reserved(name: &str) -> Option<String> {
    if OF_THE_CONTRACT.contains(&name) {
        Some(format!("`{name}` is declared by the scheduler for every program"))
    } else if RELIED_ON.contains(&name) {
        Some(format!("`{name}` is a name of WGSL that generated code relies on"))
    } else {
        None
    }
}

/// True for names that WGSL and generated code can take: ASCII letters, digits and underscores, the first one a letter.
pub(crate) fn is_identifier(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

/// The state's type: that behind the first argument of the function `generate`.
pub(super) fn state_struct(text: &str, generate: &str) -> Option<String> {
    let (code, _) = without_comments(text);
    let words: Vec<Range<usize>> = tokens(&code, 0).collect();
    let word = |index: usize| words.get(index).map_or(&b""[..], |token| &code[token.clone()]);
    let expected: [&[u8]; 10] = [b"fn", generate.as_bytes(), b"(", b"", b":", b"ptr", b"<", b"function", b",", b""];
    let is_head = |start: usize| expected.iter().enumerate().all(|(index, part)| part.is_empty() || word(start + index) == *part);
    (0..words.len()).find(|start| is_head(*start)).map(|start| String::from_utf8_lossy(word(start + 9)).into_owned())
}

/// Members of the struct `name` with their types as written.
pub(super) fn members(text: &str, name: &str) -> Vec<(String, String)> {
    let (code, _) = without_comments(text);
    let words: Vec<Range<usize>> = tokens(&code, 0).collect();
    let word = |index: usize| words.get(index).map_or(&b""[..], |token| &code[token.clone()]);
    let head = (0..words.len()).find(|at| word(*at) == b"struct" && word(at + 1) == name.as_bytes() && word(at + 2) == b"{");
    let Some(mut at) = head.map(|head| head + 3) else { return Vec::new() };
    let mut members = Vec::new();
    while at < words.len() && word(at) != b"}" {
        if word(at + 1) != b":" {
            // An attribute or a comma.
            at += 1;
            continue;
        }
        let (start, mut depth) = (at + 2, 0_i32);
        let mut end = start;
        while end < words.len() && !(depth == 0 && matches!(word(end), b"," | b"}")) {
            depth += match word(end) {
                b"<" | b"(" => 1,
                b">" | b")" => -1,
                _ => 0,
            };
            end += 1;
        }
        if end > start {
            let ty = &code[words[start].start..words[end - 1].end];
            members.push((String::from_utf8_lossy(word(at)).into_owned(), String::from_utf8_lossy(ty).into_owned()));
        }
        at = end;
    }
    members
}

/// Element and length of `array<ELEMENT, LENGTH>`.
pub(super) fn array_parts(ty: &str) -> Option<(String, String)> {
    let inner = ty.strip_prefix("array")?.trim().strip_prefix('<')?.strip_suffix('>')?.trim().trim_end_matches(',');
    let mut depth = 0;
    let comma = inner.char_indices().filter(|(_, c)| {
        depth += match c {
            '<' | '(' => 1,
            '>' | ')' => -1,
            _ => 0,
        };
        *c == ',' && depth == 0
    });
    let (element, length) = inner.split_at(comma.last()?.0);
    Some((element.trim().to_owned(), length[1..].trim().to_owned()))
}
