//! Constants that a program gets from its host.
//!
//! Key decision: they become the module `constants`, before all others, so that a clash, an import and a reserved name are reported as
//! they are between the user's own files.

use std::fmt;

use super::{SourceModule, features::is_name};
use crate::Error;

/// The value of a constant that a program gets from its host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constant {
    /// `u32`.
    U32(u32),
    /// `i32`.
    I32(i32),
    /// `f32`; finite.
    F32(f32),
    /// `bool`.
    Bool(bool),
}

impl From<u32> for Constant {
    fn from(value: u32) -> Self {
        Constant::U32(value)
    }
}

impl From<i32> for Constant {
    fn from(value: i32) -> Self {
        Constant::I32(value)
    }
}

impl From<f32> for Constant {
    fn from(value: f32) -> Self {
        Constant::F32(value)
    }
}

impl From<bool> for Constant {
    fn from(value: bool) -> Self {
        Constant::Bool(value)
    }
}

impl fmt::Display for Constant {
    /// Type and value as WGSL writes them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Constant::U32(value) => write!(f, "u32 = {value}u"),
            // Without suffix, because 2147483648i is out of range before the minus is applied.
            Constant::I32(value) => write!(f, "i32 = {value}"),
            // The shortest digits that name this very number.
            Constant::F32(value) => write!(f, "f32 = {value:?}f"),
            Constant::Bool(value) => write!(f, "bool = {value}"),
        }
    }
}

/// Refuses what WGSL cannot say. Names that are taken are found when the program is composed.
pub(super) fn check(name: &str, value: Constant) -> Result<(), Error> {
    let problem = match value {
        Constant::F32(value) if !value.is_finite() => format!("{value} is not a number that WGSL can write"),
        _ if name.starts_with("wf_") || name.starts_with("__") => "names beginning with `wf_` or `__` are reserved".into(),
        _ if !is_name(name.as_bytes()) => "not a name: ASCII letters, digits and `_`, no digit in front".into(),
        _ if naga::keywords::wgsl::RESERVED.contains(&name) => "a word of WGSL".into(),
        _ => return Ok(()),
    };
    Err(Error::Constant { name: name.to_owned(), problem })
}

/// The module that declares all of them.
pub(super) fn module(constants: &[(String, Constant)]) -> SourceModule {
    let text: String = constants.iter().map(|(name, value)| format!("const {name}: {value};\n")).collect();
    SourceModule { package: "constants".into(), path: "".into(), file: "constants of the program".into(), text: text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_back(value: Constant) -> naga::Literal {
        let text = module(&[("VALUE".into(), value)]).text;
        let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)));
        let (_, constant) = module.constants.iter().next().expect("one constant");
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(literal) => literal,
            ref other => panic!("{text}: {other:?}"),
        }
    }

    /// Kills: floats rounded to few digits, the least i32, the sign of zero or subnormal numbers lost.
    #[test]
    fn every_bit_survives() {
        let mut word = 0x1234_5678_u32;
        let mut floats = vec![0.0, -0.0, 0.1, 1.0, 16_777_216.0, f32::MAX, f32::MIN, f32::MIN_POSITIVE, f32::EPSILON, 1e-45, -3.4e-39];
        for _ in 0..5000 {
            word = word.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            floats.push(f32::from_bits(word ^ (word >> 15)));
        }
        for value in floats.into_iter().filter(|value| value.is_finite()) {
            let naga::Literal::F32(found) = read_back(value.into()) else { panic!("{value} is no f32") };
            assert_eq!(found.to_bits(), value.to_bits(), "{value:?}");
        }
        for value in [i32::MIN, -1, 0, i32::MAX] {
            assert_eq!(read_back(value.into()), naga::Literal::I32(value));
        }
        assert_eq!(read_back(u32::MAX.into()), naga::Literal::U32(u32::MAX));
        assert_eq!(read_back(true.into()), naga::Literal::Bool(true));
    }

    /// Kills: a value or a name that would make generated text of what the host said.
    #[test]
    fn what_wgsl_cannot_say_is_refused() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(check("A", value.into()).is_err());
        }
        for name in ["", "_", "1A", "A: u32 = 1u; const B", "größe", "wf_lanes", "__a", "const", "loop"] {
            assert!(check(name, Constant::U32(1)).is_err(), "{name}");
        }
        assert!(check("ROWS_2", Constant::U32(1)).is_ok());
    }
}
