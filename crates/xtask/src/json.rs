//! A reader for the JSON that `path-tracer adapters --json` prints.
//!
//! Key decision: a whole, strict reader in a hundred lines rather than a search for quotes, because driver names hold brackets, commas
//! and escapes. Numbers keep their text: nobody here computes with them.

use std::{iter::Peekable, str::Chars};

/// Deeper nesting is refused, so that no input overflows the stack.
const MAX_DEPTH: usize = 32;

/// A JSON value; objects keep the order of their members.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Value {
    /// `null`, `true`, `false` or a number, as written.
    Bare(String),
    /// A string with its escapes resolved.
    Text(String),
    /// An array.
    List(Vec<Value>),
    /// An object.
    Object(Vec<(String, Value)>),
}

/// Reads exactly one value.
///
/// # Errors
/// One line that says what was expected.
pub(crate) fn parse(text: &str) -> Result<Value, String> {
    let mut reader = Reader { rest: text.chars().peekable() };
    let value = reader.value(0)?;
    match reader.next_visible() {
        None => Ok(value),
        Some(extra) => Err(format!("unexpected `{extra}` after the end of the JSON value")),
    }
}

struct Reader<'a> {
    rest: Peekable<Chars<'a>>,
}

impl Reader<'_> {
    fn next_visible(&mut self) -> Option<char> {
        self.peek_visible();
        self.rest.next()
    }

    fn peek_visible(&mut self) -> Option<char> {
        while self.rest.next_if(|c| matches!(c, ' ' | '\t' | '\n' | '\r')).is_some() {}
        self.rest.peek().copied()
    }

    fn expect(&mut self, wanted: char) -> Result<(), String> {
        match self.next_visible() {
            Some(c) if c == wanted => Ok(()),
            Some(c) => Err(format!("expected `{wanted}` in JSON, found `{c}`")),
            None => Err(format!("expected `{wanted}` in JSON, found the end")),
        }
    }

    fn value(&mut self, depth: usize) -> Result<Value, String> {
        if depth > MAX_DEPTH {
            return Err(format!("JSON is nested deeper than {MAX_DEPTH} levels"));
        }
        match self.peek_visible() {
            Some('"') => self.text().map(Value::Text),
            Some('[') => self.members('[', ']', |reader| reader.value(depth + 1)).map(Value::List),
            Some('{') => self.members('{', '}', |reader| reader.member(depth + 1)).map(Value::Object),
            Some(c) if c.is_ascii_alphanumeric() || c == '-' => self.bare(),
            Some(c) => Err(format!("unexpected `{c}` in JSON")),
            None => Err("JSON ends where a value is expected".into()),
        }
    }

    fn members<T>(&mut self, open: char, close: char, mut read: impl FnMut(&mut Self) -> Result<T, String>) -> Result<Vec<T>, String> {
        self.expect(open)?;
        let mut members = Vec::new();
        if self.peek_visible() == Some(close) {
            self.rest.next();
            return Ok(members);
        }
        loop {
            members.push(read(self)?);
            match self.next_visible() {
                Some(',') => {}
                Some(c) if c == close => return Ok(members),
                _ => return Err(format!("expected `,` or `{close}` in JSON")),
            }
        }
    }

    fn member(&mut self, depth: usize) -> Result<(String, Value), String> {
        self.peek_visible();
        let key = self.text()?;
        self.expect(':')?;
        Ok((key, self.value(depth)?))
    }

    fn bare(&mut self) -> Result<Value, String> {
        let mut word = String::new();
        while let Some(c) = self.rest.next_if(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '+' | '.')) {
            word.push(c);
        }
        let known = matches!(word.as_str(), "null" | "true" | "false") || word.parse::<f64>().is_ok_and(f64::is_finite);
        if known { Ok(Value::Bare(word)) } else { Err(format!("`{word}` is no JSON value")) }
    }

    fn text(&mut self) -> Result<String, String> {
        self.expect('"')?;
        let mut text = String::new();
        loop {
            match self.rest.next() {
                Some('"') => return Ok(text),
                Some('\\') => text.push(self.escape()?),
                Some(c) => text.push(c),
                None => return Err("a JSON string has no end".into()),
            }
        }
    }

    fn escape(&mut self) -> Result<char, String> {
        Ok(match self.rest.next() {
            Some(c @ ('"' | '\\' | '/')) => c,
            Some('n') => '\n',
            Some('t') => '\t',
            Some('r') => '\r',
            Some('b') => '\u{8}',
            Some('f') => '\u{c}',
            Some('u') => {
                let digits: String = self.rest.by_ref().take(4).collect();
                let code = u32::from_str_radix(&digits, 16).map_err(|_| format!("`\\u{digits}` is no JSON escape"))?;
                // Halves of surrogate pairs cannot occur in names of drivers; a mark shows where one was.
                char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER)
            }
            _ => return Err("unknown escape in a JSON string".into()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a reader that splits at commas, brackets or quotes inside strings.
    #[test]
    fn strings_may_hold_anything() {
        let text = r#" [ {"name":"llvmpipe (LLVM 15, 256 bits) [\"a\\b\" \u0041]", "n": -1.5e3, "list": [], "o": {}} , null ] "#;
        let name = Value::Text(r#"llvmpipe (LLVM 15, 256 bits) ["a\b" A]"#.into());
        let object = Value::Object(vec![
            ("name".into(), name),
            ("n".into(), Value::Bare("-1.5e3".into())),
            ("list".into(), Value::List(vec![])),
            ("o".into(), Value::Object(vec![])),
        ]);
        assert_eq!(parse(text), Ok(Value::List(vec![object, Value::Bare("null".into())])));
    }

    /// Kills: a reader that returns what it has so far, and one that recurses without a limit.
    #[test]
    fn broken_texts_are_errors() {
        for text in ["", "[", "[1,]", "[1 2]", "{\"a\" 1}", "\"open", "nul", "[] []", "\"\\x\"", "\"\\u12\""] {
            assert!(parse(text).is_err(), "{text:?} was accepted");
        }
        assert!(parse(&"[".repeat(100_000)).is_err());
    }
}
