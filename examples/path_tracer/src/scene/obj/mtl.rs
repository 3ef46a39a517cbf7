//! What a material library says, statement by statement; nothing is interpreted here.
//!
//! Key decision: numbers that are missing or none are errors, because a material that is silently black is worse than none;
//! statements without a counterpart in the scene's model are named once.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::Vec3;

use super::super::gltf::Warnings;
use super::lines::{Lines, Words, shown};
use super::texture_map::Map;
use crate::error::Fault;

/// One `newmtl` with what follows it; `None` is what the file does not say.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Definition {
    /// `Kd`.
    pub(super) diffuse: Option<Vec3>,
    /// `Ks`.
    pub(super) specular: Option<Vec3>,
    /// `Ke`.
    pub(super) emissive: Option<Vec3>,
    /// `Tf`.
    pub(super) filter: Option<Vec3>,
    /// `Ns`.
    pub(super) exponent: Option<f32>,
    /// `d`, or one less `Tr`.
    pub(super) opacity: Option<f32>,
    /// `Ni`.
    pub(super) ior: Option<f32>,
    /// `illum`.
    pub(super) model: Option<f32>,
    /// `Pr`.
    pub(super) roughness: Option<f32>,
    /// `Pm`.
    pub(super) metallic: Option<f32>,
    pub(super) map_diffuse: Option<Map>,
    pub(super) map_emissive: Option<Map>,
    pub(super) map_opacity: Option<Map>,
    /// `map_Pr`.
    pub(super) map_roughness: Option<Map>,
    /// `map_Pm`.
    pub(super) map_metallic: Option<Map>,
    /// `map_Bump` or `bump`.
    pub(super) map_bump: Option<Map>,
    /// `norm`.
    pub(super) map_normal: Option<Map>,
}

/// Adds the materials of a library; the first of two with the same name stays.
pub(super) fn read(bytes: &[u8], definitions: &mut HashMap<String, Definition>, warnings: &mut Warnings) -> Result<(), Fault> {
    let mut open: Option<(String, Definition)> = None;
    let mut close = |open: Option<(String, Definition)>, warnings: &mut Warnings| {
        let Some((name, definition)) = open else { return };
        match definitions.entry(name) {
            Entry::Occupied(known) => warnings.push(format!("material '{}' is defined twice, the first counts", known.key())),
            Entry::Vacant(vacant) => drop(vacant.insert(definition)),
        }
    };
    for (number, line) in Lines::new(bytes)? {
        let mut words = Words::new(&line);
        let Some(statement) = words.next() else { continue };
        if statement == b"newmtl" {
            let name = String::from_utf8_lossy(words.rest()).into_owned();
            close(open.replace((name, Definition::default())), warnings);
            continue;
        }
        let Some((_, definition)) = &mut open else {
            warnings.push(format!("'{}' before the first newmtl of a library is skipped", shown(statement)));
            continue;
        };
        definition.statement(statement, words, warnings).map_err(|f| f.within(format_args!("line {number}")))?;
    }
    close(open, warnings);
    Ok(())
}

impl Definition {
    fn statement(&mut self, statement: &[u8], words: Words<'_>, warnings: &mut Warnings) -> Result<(), Fault> {
        // Case is not kept by everything that writes these files.
        match statement.to_ascii_lowercase().as_slice() {
            b"kd" => self.diffuse = color("Kd", words, warnings)?,
            b"ks" => self.specular = color("Ks", words, warnings)?,
            b"ke" => self.emissive = color("Ke", words, warnings)?,
            b"tf" => self.filter = color("Tf", words, warnings)?,
            b"ns" => self.exponent = Some(number("Ns", words)?),
            b"ni" => self.ior = Some(number("Ni", words)?),
            b"illum" => self.model = Some(number("illum", words)?),
            b"pr" => self.roughness = Some(number("Pr", words)?),
            b"pm" => self.metallic = Some(number("Pm", words)?),
            b"d" => {
                let mut after = words;
                if after.next() == Some(b"-halo") {
                    warnings.push(String::from("'d -halo' is read as 'd'"));
                    self.opacity = Some(number("d", after)?);
                } else {
                    self.opacity = Some(number("d", words)?);
                }
            }
            // Whoever writes both means the same.
            b"tr" => {
                let opacity = 1.0 - number("Tr", words)?;
                self.opacity.get_or_insert(opacity);
            }
            b"map_kd" => self.map_diffuse = Map::read("map_Kd", words, warnings)?,
            b"map_ke" => self.map_emissive = Map::read("map_Ke", words, warnings)?,
            b"map_pr" => self.map_roughness = Map::read("map_Pr", words, warnings)?,
            b"map_pm" => self.map_metallic = Map::read("map_Pm", words, warnings)?,
            b"map_d" => self.map_opacity = Map::read("map_d", words, warnings)?,
            b"map_bump" | b"bump" => self.map_bump = Map::read("map_Bump", words, warnings)?,
            b"norm" | b"map_kn" => self.map_normal = Map::read("norm", words, warnings)?,
            _ => warnings.push(format!("the statement '{}' of materials is not used", shown(statement))),
        }
        Ok(())
    }
}

fn number(name: &str, mut words: Words<'_>) -> Result<f32, Fault> {
    let parsed = words.number().unwrap_or_else(|| Err(String::from("there is no number"))).map_err(|what| Fault::invalid(name, what))?;
    if !parsed.value.is_finite() {
        return Err(Fault::invalid(name, "the number is not finite"));
    }
    Ok(parsed.value)
}

/// One number for grey or three; `None` for a colour in other terms.
fn color(name: &str, mut words: Words<'_>, warnings: &mut Warnings) -> Result<Option<Vec3>, Fault> {
    let mut first = words;
    if let Some(kind @ (b"spectral" | b"xyz")) = first.next() {
        warnings.push(format!("'{name} {}' is left out", shown(kind)));
        return Ok(None);
    }
    let red = number(name, words)?;
    words.next();
    let Some(green) = words.number() else { return Ok(Some(Vec3::splat(red))) };
    let blue = words.number().unwrap_or_else(|| Err(String::from("there are two numbers instead of one or three")));
    let fault = |what: String| Fault::invalid(name, what);
    let color = Vec3::new(red, green.map_err(fault)?.value, blue.map_err(fault)?.value);
    if !color.is_finite() {
        return Err(Fault::invalid(name, "a number is not finite"));
    }
    Ok(Some(color))
}
