//! The header: which elements follow, how many, and of which numbers each consists.
//!
//! Key decision: the lines are split as the first line ends, because in a binary file the byte after `end_header` and its line break
//! may look like a line break too.
//!
//! **Invariant:** the numbers of a header are promises; [`super::values`] compares them with the bytes that are there.

use super::super::gltf::Warnings;
use crate::error::Fault;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn of(name: &str) -> Result<Number, String> {
        Ok(match name {
            "char" | "int8" => Number::I8,
            "uchar" | "uint8" => Number::U8,
            "short" | "int16" => Number::I16,
            "ushort" | "uint16" => Number::U16,
            "int" | "int32" => Number::I32,
            "uint" | "uint32" => Number::U32,
            "float" | "float32" => Number::F32,
            "double" | "float64" => Number::F64,
            _ => return Err(format!("the type '{name}' is unknown")),
        })
    }

    /// Bytes in a binary file.
    pub(super) fn size(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::F64 => 8,
        }
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Number::F32 | Number::F64)
    }

    /// What stands for 1 in a colour.
    pub(super) fn full(self) -> f64 {
        match self {
            Number::I8 => 127.0,
            Number::U8 => 255.0,
            Number::I16 => 32_767.0,
            Number::U16 => 65_535.0,
            Number::I32 => f64::from(i32::MAX),
            Number::U32 => f64::from(u32::MAX),
            Number::F32 | Number::F64 => 1.0,
        }
    }
}

/// One number of an element, or a list of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    /// The type of the length, for a list.
    pub(super) length: Option<Number>,
    pub(super) number: Number,
}

/// Things of one kind that follow each other in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Lines up to and including `end_header`, for messages about text files.
    pub(super) n_lines: usize,
}

/// No honest header has more; a list of them costs time for each element.
const MOST_PROPERTIES: usize = 1000;

impl Header {
    /// The header and the bytes after it.
    pub(super) fn read<'a>(bytes: &'a [u8], warnings: &mut Warnings) -> Result<(Header, &'a [u8]), Fault> {
        let end = match bytes.strip_prefix(b"ply") {
            Some([b'\r', b'\n', ..] | [b'\n', ..]) => b'\n',
            Some([b'\r', ..]) => b'\r',
            _ => return Err(Fault::invalid("header", "the file does not start with the line 'ply'")),
        };
        let mut rest = bytes;
        let mut n_lines = 0usize;
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let line = next_line(&mut rest, end).ok_or_else(|| Fault::invalid("header", "there is no line 'end_header'"))?;
            n_lines += 1;
            let words: Vec<&str> = line.split_ascii_whitespace().take(8).collect();
            let fault = |what: String| Fault::invalid(format_args!("line {n_lines}"), what);
            match words[..] {
                [] | ["ply"] | ["comment" | "obj_info", ..] => {}
                ["end_header"] => break,
                ["format", name, ..] => encoding = Some(read_encoding(name).map_err(fault)?),
                ["element", name, count, ..] => {
                    let count = count.parse().map_err(|_| fault(format!("the count '{count}' of the element '{name}' is no number")))?;
                    if elements.iter().any(|element| element.name == name) {
                        return Err(fault(format!("the element '{name}' is declared twice")));
                    }
                    elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                ["property", ..] => {
                    let element = elements.last_mut().ok_or_else(|| fault(String::from("a property comes before any element")))?;
                    let property = read_property(&words[1..]).map_err(fault)?;
                    if element.properties.iter().any(|known| known.name == property.name) {
                        return Err(fault(format!("the property '{}' of '{}' is declared twice", property.name, element.name)));
                    }
                    element.properties.push(property);
                    if elements.iter().map(|element| element.properties.len()).sum::<usize>() > MOST_PROPERTIES {
                        return Err(fault(format!("there are more than {MOST_PROPERTIES} properties")));
                    }
                }
                [word, ..] => warnings.push(format!("header: the line '{word}' is unknown and is skipped")),
            }
            if elements.len() > MOST_PROPERTIES {
                return Err(Fault::invalid("header", format_args!("there are more than {MOST_PROPERTIES} elements")));
            }
        }
        let encoding = encoding.ok_or_else(|| Fault::invalid("header", "there is no line 'format'"))?;
        Ok((Header { encoding, elements, n_lines }, rest))
    }
}

fn read_encoding(name: &str) -> Result<Encoding, String> {
    Ok(match name {
        "ascii" => Encoding::Text,
        "binary_little_endian" => Encoding::LittleEndian,
        "binary_big_endian" => Encoding::BigEndian,
        _ => return Err(format!("the format '{name}' is unknown")),
    })
}

fn read_property(words: &[&str]) -> Result<Property, String> {
    match *words {
        ["list", length, number, name, ..] => {
            let length = Number::of(length)?;
            if length.is_float() {
                return Err(format!("the length of the list '{name}' is no integer"));
            }
            Ok(Property { name: name.to_owned(), length: Some(length), number: Number::of(number)? })
        }
        [number, name, ..] if number != "list" => Ok(Property { name: name.to_owned(), length: None, number: Number::of(number)? }),
        _ => Err(String::from("the property has no type or no name")),
    }
}

/// The text up to the next line break, which is taken too; `None` for lines that are endless or no text.
fn next_line<'a>(rest: &mut &'a [u8], end: u8) -> Option<&'a str> {
    const LONGEST: usize = 1 << 16;
    let at = rest.iter().take(LONGEST).position(|&c| c == end)?;
    let line = &rest[..at];
    *rest = &rest[at + 1..];
    // A comment in another encoding than UTF-8 is nobody's business.
    if line.starts_with(b"comment") || line.starts_with(b"obj_info") {
        return Some("comment");
    }
    std::str::from_utf8(line).ok()
}
