//! A texture statement: options, then the name of a file.
//!
//! Key decision: options that move or clamp the picture are understood, the others are named once and stepped over with their numbers.

use glam::Vec3;

use super::super::gltf::Warnings;
use super::super::model::Wrap;
use super::lines::{Words, shown};
use crate::error::Fault;

/// Which image, and how it lies on the surface.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// As the file writes it.
    pub(super) name: String,
    /// `-o`, along u and v upwards.
    offset: [f32; 2],
    /// `-s`.
    scale: [f32; 2],
    /// `-clamp on`.
    clamp: bool,
    /// `-bm`.
    pub(super) strength: f32,
}

impl Map {
    /// Reads what follows the statement; `None` after a warning when there is no name.
    ///
    /// # Errors
    /// When an option lacks its numbers.
    pub(super) fn read(statement: &str, mut words: Words<'_>, warnings: &mut Warnings) -> Result<Option<Map>, Fault> {
        let mut map = Map { name: String::new(), offset: [0.0; 2], scale: [1.0; 2], clamp: false, strength: 1.0 };
        loop {
            let before = words;
            let Some(word) = words.next() else { break };
            let place = || format!("{statement} {}", shown(word));
            match word {
                b"-o" => map.offset = pair(&mut words, 0.0).map_err(|what| Fault::invalid(place(), what))?,
                b"-s" => map.scale = pair(&mut words, 1.0).map_err(|what| Fault::invalid(place(), what))?,
                b"-bm" => {
                    let value = words.number().map_or_else(|| Err(String::from("there is no number")), |parsed| parsed.map(|p| p.value));
                    map.strength = value.and_then(finite).map_err(|what| Fault::invalid(place(), what))?;
                }
                b"-clamp" => map.clamp = words.next() == Some(b"on"),
                b"-t" | b"-mm" => {
                    warnings.push(format!("the option '{}' of textures is left out", shown(word)));
                    skip_numbers(&mut words, 3);
                }
                b"-blendu" | b"-blendv" | b"-boost" | b"-texres" | b"-imfchan" | b"-type" | b"-cc" | b"-colorspace" => {
                    warnings.push(format!("the option '{}' of textures is left out", shown(word)));
                    words.next();
                }
                // A name may begin with a minus too.
                _ => {
                    map.name = String::from_utf8_lossy(before.rest()).into_owned();
                    break;
                }
            }
        }
        if map.name.is_empty() {
            warnings.push(format!("{statement}: there is no name of a file"));
            return Ok(None);
        }
        Ok(Some(map))
    }

    pub(super) fn wrap(&self) -> [Wrap; 2] {
        [if self.clamp { Wrap::Clamp } else { Wrap::Repeat }; 2]
    }

    /// The transform of texture coordinates in the scene's sense, where v grows downwards.
    pub(super) fn transform(&self) -> [Vec3; 2] {
        let ([u, v], [scale_u, scale_v]) = (self.offset, self.scale);
        [Vec3::new(scale_u, 0.0, u), Vec3::new(0.0, scale_v, 1.0 - scale_v - v)]
    }
}

fn finite(value: f32) -> Result<f32, String> {
    if value.is_finite() { Ok(value) } else { Err(String::from("the number is not finite")) }
}

/// One to three numbers, of which the first two count; `fill` stands for the second.
fn pair(words: &mut Words<'_>, fill: f32) -> Result<[f32; 2], String> {
    let mut values = [None; 3];
    for value in &mut values {
        let mut ahead = *words;
        // A word that is no number is the next option or the name.
        let Some(Ok(parsed)) = ahead.number().filter(|parsed| parsed.as_ref().is_ok_and(|p| p.whole)) else { break };
        *value = Some(finite(parsed.value)?);
        *words = ahead;
    }
    let first = values[0].ok_or("there is no number")?;
    Ok([first, values[1].unwrap_or(fill)])
}

fn skip_numbers(words: &mut Words<'_>, most: usize) {
    for _ in 0..most {
        let mut ahead = *words;
        if !ahead.number().is_some_and(|parsed| parsed.is_ok_and(|p| p.whole)) {
            return;
        }
        *words = ahead;
    }
}
