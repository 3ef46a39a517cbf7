//! What OBJ and MTL have in common: lines of words and numbers.
//!
//! Key decision: bytes, not text, because names in these files are in whatever encoding their author had.
//!
//! **Invariant:** every byte is looked at a bounded number of times, and a line is copied only when it goes on after a backslash.

use std::borrow::Cow;

use crate::error::Fault;

/// The lines of a file without comments, with the number of the first physical line of each.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    /// # Errors
    /// When the text is in UTF-16.
    pub(super) fn new(bytes: &'a [u8]) -> Result<Lines<'a>, Fault> {
        if bytes.starts_with(b"\xFE\xFF") || bytes.starts_with(b"\xFF\xFE") {
            return Err(Fault::unsupported("content", "text in UTF-16"));
        }
        Ok(Lines { rest: bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), number: 0 })
    }

    /// Up to the next line break, which is taken too.
    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&c| c == b'\n' || c == b'\r').unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        self.rest = rest.strip_prefix(b"\r\n").or_else(|| rest.get(1..)).unwrap_or_default();
        self.number += 1;
        Some(line.trim_ascii())
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let line = self.physical()?;
            let number = self.number;
            // A comment does not go on, because it may end with the name of a folder.
            if line.is_empty() || line.starts_with(b"#") {
                continue;
            }
            let Some(start) = line.strip_suffix(b"\\") else { return Some((number, Cow::Borrowed(line))) };
            let mut whole = start.to_vec();
            while let Some(line) = self.physical() {
                whole.push(b' ');
                match line.strip_suffix(b"\\") {
                    Some(part) => whole.extend_from_slice(part),
                    None => {
                        whole.extend_from_slice(line);
                        break;
                    }
                }
            }
            return Some((number, Cow::Owned(whole)));
        }
    }
}

/// The words of a line.
#[derive(Clone, Copy)]
pub(super) struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Words<'a> {
    pub(super) fn new(line: &'a [u8]) -> Words<'a> {
        Words { rest: line }
    }

    /// What has not been taken yet, without the spaces around it.
    pub(super) fn rest(self) -> &'a [u8] {
        self.rest.trim_ascii()
    }

    /// The next number, if there is one more word.
    pub(super) fn number(&mut self) -> Option<Result<Parsed, String>> {
        self.next().filter(|word| !word.starts_with(b"#")).map(number)
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest.trim_ascii_start();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (word, rest) = rest.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }
}

/// A number and whether the whole word belonged to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Parsed {
    /// Possibly not finite.
    pub(super) value: f32,
    pub(super) whole: bool,
}

/// Reads a number; what follows it in the same word is left out, as most programs do.
fn number(word: &[u8]) -> Result<Parsed, String> {
    let text = std::str::from_utf8(word).ok();
    if let Some(value) = text.and_then(|text| text.parse().ok()) {
        return Ok(Parsed { value, whole: true });
    }
    let digits = |from: usize| word[from..].iter().take_while(|c| c.is_ascii_digit()).count();
    let sign = usize::from(matches!(word.first(), Some(b'+' | b'-')));
    let mut end = sign + digits(sign);
    if word.get(end) == Some(&b'.') {
        end += 1 + digits(end + 1);
    }
    let prefix = word.get(..end).and_then(|prefix| std::str::from_utf8(prefix).ok()).and_then(|prefix| prefix.parse().ok());
    prefix.map(|value| Parsed { value, whole: false }).ok_or_else(|| format!("'{}' is no number", shown(word)))
}

/// A word in a message.
pub(super) fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(word.get(..60).unwrap_or(word)).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<(usize, String)> {
        Lines::new(text.as_bytes()).unwrap().map(|(number, line)| (number, String::from_utf8_lossy(&line).into_owned())).collect()
    }

    // Kills: numbers of lines that ignore joined or empty lines, comments that swallow the next line, and a backslash at the very end.
    #[test]
    fn lines_are_joined_and_numbered() {
        let text = "\u{FEFF}v 1 \\\n2 \\\r\n 3\n\n# a folder\\\n  f 1\r\rg last\\";
        let expected = [(1, "v 1  2  3"), (6, "f 1"), (8, "g last")];
        assert_eq!(lines(text).iter().map(|(n, line)| (*n, line.as_str())).collect::<Vec<_>>(), expected);
        assert!(Lines::new(b"\xFF\xFEv\0").is_err());
    }

    // Kills: an exponent that is read without its digits, signs that stop the scan, and words that count as zero.
    #[test]
    fn numbers_end_where_they_end() {
        for (word, value, whole) in [
            ("1", 1.0, true),
            ("-2.5e1", -25.0, true),
            ("+3.", 3.0, true),
            (".5", 0.5, true),
            ("3.1+e2", 3.1, false),
            ("1e", 1.0, false),
            ("-7,5", -7.0, false),
        ] {
            assert_eq!(number(word.as_bytes()), Ok(Parsed { value, whole }), "{word}");
        }
        for word in ["", "-", ".", "x1", "+-1", "\u{FF}"] {
            assert!(number(word.as_bytes()).is_err(), "{word}");
        }
        assert!(number(b"1e999").is_ok_and(|parsed| !parsed.value.is_finite()));
    }
}
