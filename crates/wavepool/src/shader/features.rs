//! Features of a program and the conditions that ask for them.
//!
//! Syntax (a strict subset of WESL): names of features, `true`, `false`, `!`, `&&`, `||` and parentheses. As in WGSL, `&&` and `||`
//! side by side need parentheses.
//!
//! **Invariant:** a name that the program does not give is a mistake, never `false`: a typo must not remove code in silence.

use std::ops::Range;

use crate::Error;

/// What `@if` may ask for, and the answers.
pub(crate) type Features = [(String, bool)];

/// What is wrong with a condition, and where.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Mistake {
    Unknown { name: String, place: Range<usize> },
    Malformed { place: Range<usize>, label: &'static str },
}

/// More of them open at once help nobody, and the stack is finite.
const MOST_PARENTHESES: usize = 64;

/// Evaluates the condition that consists of `tokens` of `code`; what is missing is reported at `end`.
pub(super) fn evaluate(code: &[u8], tokens: &[Range<usize>], end: Range<usize>, features: &Features) -> Result<bool, Mistake> {
    let mut condition = Condition { code, tokens, at: 0, end, features, open: 0 };
    let value = condition.chain()?;
    match condition.peek() {
        None => Ok(value),
        Some(_) => Err(condition.malformed("expected `&&`, `||` or the end of the condition")),
    }
}

struct Condition<'a> {
    code: &'a [u8],
    tokens: &'a [Range<usize>],
    at: usize,
    end: Range<usize>,
    features: &'a Features,
    open: usize,
}

impl<'a> Condition<'a> {
    fn peek(&self) -> Option<&'a [u8]> {
        self.tokens.get(self.at).map(|token| &self.code[token.clone()])
    }

    fn malformed(&self, label: &'static str) -> Mistake {
        Mistake::Malformed { place: self.tokens.get(self.at).unwrap_or(&self.end).clone(), label }
    }

    /// Terms joined by one kind of operator.
    fn chain(&mut self) -> Result<bool, Mistake> {
        let mut value = self.term()?;
        let mut joined_by = None;
        while let Some(operator) = self.peek().filter(|word| matches!(*word, b"&&" | b"||")) {
            if joined_by.is_some_and(|before| before != operator) {
                return Err(self.malformed("`&&` and `||` side by side need parentheses"));
            }
            joined_by = Some(operator);
            self.at += 1;
            let next = self.term()?;
            value = if operator == b"&&" { value && next } else { value || next };
        }
        Ok(value)
    }

    fn term(&mut self) -> Result<bool, Mistake> {
        let mut is_negated = false;
        while self.peek() == Some(b"!") {
            is_negated = !is_negated;
            self.at += 1;
        }
        let value = match self.peek() {
            Some(b"true") => true,
            Some(b"false") => false,
            Some(b"(") => {
                self.open += 1;
                if self.open > MOST_PARENTHESES {
                    return Err(self.malformed("nested too deep"));
                }
                self.at += 1;
                let inner = self.chain()?;
                if self.peek() != Some(b")") {
                    return Err(self.malformed("expected `&&`, `||` or `)`"));
                }
                self.open -= 1;
                inner
            }
            Some(word) if is_name(word) => {
                let name = String::from_utf8_lossy(word).into_owned();
                let place = self.tokens[self.at].clone();
                let known = self.features.iter().find(|(feature, _)| *feature == name);
                known.ok_or(Mistake::Unknown { name, place })?.1
            }
            _ => return Err(self.malformed("expected the name of a feature")),
        };
        self.at += 1;
        Ok(value != is_negated)
    }
}

/// True for what features and constants may be called: ASCII letters, digits and `_`, without a digit in front.
pub(super) fn is_name(word: &[u8]) -> bool {
    word.first().is_some_and(|first| !first.is_ascii_digit())
        && word.iter().all(|byte| byte.is_ascii_alphanumeric() || *byte == b'_')
        && word != b"_"
}

/// Refuses features that no condition could ask for, or that have two answers.
pub(super) fn check(features: &Features) -> Result<(), Error> {
    for (index, (name, _)) in features.iter().enumerate() {
        let problem = match name.as_str() {
            "true" | "false" => "conditions use this word themselves",
            _ if !is_name(name.as_bytes()) => "not a name: ASCII letters, digits and `_`, no digit in front",
            _ if features[..index].iter().any(|(other, _)| other == name) => "given twice: a program has one set of features",
            _ => continue,
        };
        return Err(Error::Feature { name: name.clone(), problem: problem.to_owned() });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{super::scan::tokens, *};

    fn value(text: &str) -> Result<bool, Mistake> {
        let features = [("on".to_owned(), true), ("off".to_owned(), false)];
        let tokens: Vec<_> = tokens(text.as_bytes(), 0).collect();
        evaluate(text.as_bytes(), &tokens, text.len()..text.len(), &features)
    }

    /// Kills: an operator taken for the other, a negation lost or applied to the whole chain, parentheses ignored.
    #[test]
    fn conditions_have_the_values_of_logic() {
        for text in ["on", "true", "!off", "!!on", "on && !off", "off || on", "!(off || false)", "(off && on) || on", "!off && (on||off)"] {
            assert_eq!(value(text), Ok(true), "{text}");
        }
        for text in ["off", "false", "!on", "on && off", "off || off", "!(on || off)", "on && !(true)", "off && (off || on)", "!off && off"]
        {
            assert_eq!(value(text), Ok(false), "{text}");
        }
    }

    /// Kills: a condition cut short or guessed at; deep nesting that exhausts the stack; a message at the wrong place.
    #[test]
    fn malformed_conditions_are_located() {
        for (text, at) in
            [("", 0), ("on off", 3), ("on &&", 5), ("on & off", 3), ("(on", 3), ("on || off && on", 10), ("7", 0), ("on == off", 3)]
        {
            let Err(Mistake::Malformed { place, .. }) = value(text) else { panic!("{text}") };
            assert_eq!(place.start, at, "{text}");
        }
        assert_eq!(value("on && onn"), Err(Mistake::Unknown { name: "onn".into(), place: 6..9 }));
        assert!(value(&format!("{}on{}", "(".repeat(100_000), ")".repeat(100_000))).is_err());
        assert_eq!(value(&format!("{}on", "!".repeat(100_000))), Ok(true));
    }

    /// Kills: a feature that no condition can name, or that is both on and off.
    #[test]
    fn names_of_features_can_be_asked_for() {
        let with = |name: &str| check(&[("a".to_owned(), true), (name.to_owned(), false)]);
        for name in ["", "_", "1st", "two words", "größe", "true", "a"] {
            assert!(with(name).is_err(), "{name}");
        }
        assert!(with("normal_maps2").is_ok());
    }
}
