//! Numbers out of the body of a PLY file, one element after the other.
//!
//! Key decision: text is read line by line, one element each, as the format says; a line that is too short is an error with its number
//! instead of a shift of everything that follows.
//!
//! **Invariant:** before the first element of a kind is read, the least that all of them need was compared with the bytes that remain;
//! before a list is read, its length was.

use super::header::{Element, Encoding, Header, Number};
use crate::error::Fault;

/// The part of the file that has not been read yet.
pub(super) struct Body<'a> {
    rest: &'a [u8],
    encoding: Encoding,
    /// Of the line that is read next, text only.
    line: usize,
}

impl<'a> Body<'a> {
    pub(super) fn new(header: &Header, rest: &'a [u8]) -> Body<'a> {
        Body { rest, encoding: header.encoding, line: header.n_lines }
    }

    /// Reads all elements of a kind: `scalar` gets the number of the element, that of the property and the value, `list` the values of a list.
    pub(super) fn read(
        &mut self,
        element: &Element,
        mut scalar: impl FnMut(usize, usize, f64),
        mut list: impl FnMut(usize, usize, &mut dyn Iterator<Item = f64>, usize) -> Result<(), String>,
    ) -> Result<(), Fault> {
        if element.properties.is_empty() {
            return Ok(());
        }
        self.check_size(element)?;
        for index in 0..element.count {
            let mut words = Words::default();
            if self.encoding == Encoding::Text {
                words = self.next_line().ok_or_else(|| {
                    Fault::invalid(
                        format_args!("element {} {index}", element.name),
                        format_args!("the file ends before it, there should be {}", element.count),
                    )
                })?;
            }
            for (at, property) in element.properties.iter().enumerate() {
                let (encoding, line) = (self.encoding, self.line);
                let fault = |what: String| {
                    let place = format!("element {} {index}, {}", element.name, property.name);
                    let place = if encoding == Encoding::Text { format!("line {line}, {place}") } else { place };
                    Fault::invalid(place, what)
                };
                let Some(length) = property.length else {
                    let value = match self.encoding {
                        Encoding::Text => words.number(property.number),
                        _ => take(&mut self.rest, property.number, self.encoding).ok_or_else(ends),
                    };
                    scalar(index, at, value.map_err(fault)?);
                    continue;
                };
                let length = match self.encoding {
                    Encoding::Text => words.number(length),
                    _ => take(&mut self.rest, length, self.encoding).ok_or_else(ends),
                };
                let length = length.and_then(|length| {
                    if length >= 0.0 { Ok(length as usize) } else { Err(format!("the length {length} of the list is negative")) }
                });
                let length = length.map_err(fault)?;
                let made = match self.encoding {
                    Encoding::Text => {
                        let mut broken = None;
                        let mut values =
                            std::iter::from_fn(|| words.number(property.number).map_err(|what| broken = Some(what)).ok()).take(length);
                        let made = list(index, at, &mut values, length);
                        // Whoever is not interested in a list leaves its values.
                        values.by_ref().for_each(drop);
                        match broken {
                            Some(what) => Err(what),
                            None => made,
                        }
                    }
                    encoding => {
                        let size = property.number.size();
                        let bytes = length.checked_mul(size).and_then(|n_bytes| self.rest.split_at_checked(n_bytes));
                        let (bytes, rest) = bytes.ok_or_else(|| {
                            fault(format!("a list of {length} numbers does not fit into the {} bytes that remain", self.rest.len()))
                        })?;
                        self.rest = rest;
                        let mut values =
                            bytes.chunks_exact(size).map(|mut bytes| take(&mut bytes, property.number, encoding).unwrap_or_default());
                        list(index, at, &mut values, length)
                    }
                };
                made.map_err(fault)?;
            }
        }
        Ok(())
    }

    /// The module's invariant.
    pub(super) fn check_size(&self, element: &Element) -> Result<(), Fault> {
        let least = |property: &super::header::Property| match self.encoding {
            // A digit and a space; the last line of a file may lack its end.
            Encoding::Text => 2,
            _ => property.length.unwrap_or(property.number).size(),
        };
        let each: usize = element.properties.iter().map(least).sum();
        let needed = each.checked_mul(element.count);
        if needed.is_none_or(|needed| needed > self.rest.len().saturating_add(1)) {
            let what = format!("{} of them do not fit into the {} bytes that remain", element.count, self.rest.len());
            return Err(Fault::invalid(format_args!("element {}", element.name), what));
        }
        Ok(())
    }

    /// The next line that is not empty.
    fn next_line(&mut self) -> Option<Words<'a>> {
        loop {
            if self.rest.is_empty() {
                return None;
            }
            let end = self.rest.iter().position(|&c| c == b'\n' || c == b'\r').unwrap_or(self.rest.len());
            let line = &self.rest[..end];
            let ending = if self.rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
            self.rest = self.rest.get(end + ending..).unwrap_or_default();
            self.line += 1;
            if !line.trim_ascii().is_empty() {
                return Some(Words { rest: line });
            }
        }
    }
}

fn ends() -> String {
    String::from("the file ends inside")
}

/// The words of a line.
#[derive(Default)]
struct Words<'a> {
    rest: &'a [u8],
}

impl Words<'_> {
    fn number(&mut self, number: Number) -> Result<f64, String> {
        self.rest = self.rest.trim_ascii_start();
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if word.is_empty() {
            return Err(String::from("the line ends before it"));
        }
        let shown = || String::from_utf8_lossy(word.get(..40).unwrap_or(word)).into_owned();
        let value: f64 =
            std::str::from_utf8(word).ok().and_then(|word| word.parse().ok()).ok_or_else(|| format!("'{}' is no number", shown()))?;
        if !number.is_float() && value.fract() != 0.0 {
            return Err(format!("'{}' is no integer", shown()));
        }
        Ok(value)
    }
}

/// Takes a number off the front of `bytes`.
fn take(bytes: &mut &[u8], number: Number, encoding: Encoding) -> Option<f64> {
    let (taken, rest) = bytes.split_at_checked(number.size())?;
    *bytes = rest;
    let mut word = [0u8; 8];
    let word = &mut word[..taken.len()];
    word.copy_from_slice(taken);
    if encoding == Encoding::BigEndian {
        word.reverse();
    }
    let (two, four, eight) = (word.first_chunk(), word.first_chunk(), word.first_chunk());
    Some(match number {
        Number::I8 => f64::from(word[0].cast_signed()),
        Number::U8 => f64::from(word[0]),
        Number::I16 => f64::from(i16::from_le_bytes(*two?)),
        Number::U16 => f64::from(u16::from_le_bytes(*two?)),
        Number::I32 => f64::from(i32::from_le_bytes(*four?)),
        Number::U32 => f64::from(u32::from_le_bytes(*four?)),
        Number::F32 => f64::from(f32::from_le_bytes(*four?)),
        Number::F64 => f64::from_le_bytes(*eight?),
    })
}
