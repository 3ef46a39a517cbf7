//! The statements of an OBJ file: positions, texture coordinates, normals, and faces over them.
//!
//! Key decision: a face may use only what stands above it, as the format says; so every index is checked when it is read, and the
//! message has the line.
//!
//! **Invariant:** every index of a [`Corner`] is in range or [`NONE`]; positions are finite.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::super::gltf::Warnings;
use super::super::polygon::{self, Tally};
use super::lines::{Lines, Words, shown};
use crate::error::Fault;

/// An index that a corner does not give.
pub(super) const NONE: u32 = u32::MAX;

#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub(super) position: u32,
    pub(super) uv: u32,
    pub(super) normal: u32,
}

pub(super) struct Face {
    /// Where its corners end; they begin where those of the face before it end.
    pub(super) end: usize,
    /// Into the names of materials.
    pub(super) material: u32,
    /// Zero: flat.
    pub(super) smoothing: u32,
}

#[derive(Default)]
pub(super) struct Geometry {
    pub(super) positions: Vec<Vec3>,
    /// Encoded as in the file; empty, or one for each position.
    pub(super) colors: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
    pub(super) corners: Vec<Corner>,
    pub(super) faces: Vec<Face>,
    /// As `usemtl` names them; the first stands for faces without a material.
    pub(super) materials: Vec<String>,
    /// As `mtllib` names them: the rest of each line.
    pub(super) libraries: Vec<String>,
    pub(super) tally: Tally,
    n_statements: usize,
    /// Numbers with letters behind them: the first one, and how many.
    first_cut: Option<String>,
    n_cut: usize,
    n_bad: usize,
}

impl Geometry {
    /// # Errors
    /// At the first statement that cannot be understood, with its line.
    pub(super) fn read(bytes: &[u8], warnings: &mut Warnings) -> Result<Geometry, Fault> {
        let mut geometry = Geometry { materials: vec![String::new()], ..Geometry::default() };
        let mut names: HashMap<Vec<u8>, u32> = HashMap::new();
        let (mut material, mut smoothing) = (0u32, 0u32);
        for (number, line) in Lines::new(bytes)? {
            let mut words = Words::new(&line);
            let Some(statement) = words.next() else { continue };
            geometry.n_statements += 1;
            let done = match statement {
                b"v" => geometry.read_position(words),
                b"vt" => geometry.read_uv(words),
                b"vn" => geometry.read_normal(words),
                b"f" | b"fo" => geometry.read_face(words, material, smoothing),
                b"s" => {
                    smoothing = smoothing_group(words.next().unwrap_or_default(), warnings);
                    Ok(())
                }
                b"usemtl" => {
                    let new = u32::try_from(geometry.materials.len()).unwrap_or(NONE);
                    material = *names.entry(words.rest().to_vec()).or_insert_with(|| {
                        geometry.materials.push(String::from_utf8_lossy(words.rest()).into_owned());
                        new
                    });
                    Ok(())
                }
                b"mtllib" => {
                    geometry.libraries.push(String::from_utf8_lossy(words.rest()).into_owned());
                    Ok(())
                }
                // Names of parts show nowhere: the scene is one list of triangles.
                b"g" | b"o" => Ok(()),
                b"p" | b"l" => {
                    warnings.push(String::from("points and lines are left out"));
                    Ok(())
                }
                unknown => {
                    geometry.n_statements -= 1;
                    warnings.push(format!("the statement '{}' is unknown and is skipped", shown(unknown)));
                    Ok(())
                }
            };
            done.map_err(|fault| fault.within(format_args!("line {number}")))?;
        }
        if geometry.n_statements == 0 {
            return Err(Fault::invalid("content", "there is no statement of an OBJ file"));
        }
        geometry.warn(warnings);
        Ok(geometry)
    }

    fn warn(&self, warnings: &mut Warnings) {
        if let Some(first) = &self.first_cut {
            warnings.push(format!("{} numbers have something behind them that is left out, the first is {first}", self.n_cut));
        }
        if self.n_bad > 0 {
            warnings.push(format!("{} numbers of normals, texture coordinates or colours are not finite and become zero", self.n_bad));
        }
        if !self.colors.is_empty() {
            warnings.push(String::from(polygon::COLORS_WARNING));
        }
    }

    /// Up to `N` numbers, and how many there were.
    fn numbers<const N: usize>(&mut self, mut words: Words<'_>) -> Result<([f32; N], usize), Fault> {
        let mut values = [0.0; N];
        let mut count = 0;
        for value in &mut values {
            let before = words;
            let Some(parsed) = words.number() else { break };
            let parsed = parsed.map_err(|what| Fault::invalid(format_args!("number {}", count + 1), what))?;
            if !parsed.whole {
                self.n_cut += 1;
                let word = || before.clone().next().map(shown).unwrap_or_default();
                self.first_cut.get_or_insert_with(|| format!("'{}', read as {}", word(), parsed.value));
            }
            *value = parsed.value;
            count += 1;
        }
        Ok((values, count))
    }

    /// Zero for what is not finite; such numbers only colour the picture.
    fn finite(&mut self, value: f32) -> f32 {
        self.n_bad += usize::from(!value.is_finite());
        if value.is_finite() { value } else { 0.0 }
    }

    fn read_position(&mut self, words: Words<'_>) -> Result<(), Fault> {
        let ([x, y, z, color @ ..], count) = self.numbers::<6>(words)?;
        if count < 3 {
            return Err(Fault::invalid("v", format_args!("{count} numbers instead of three")));
        }
        let position = Vec3::new(x, y, z);
        if !position.is_finite() {
            return Err(Fault::invalid("v", "the position is not finite"));
        }
        // Four numbers are a position with a weight, which means something for curves only.
        if count == 6 {
            self.colors.resize(self.positions.len(), Vec3::ONE);
            let color = color.map(|channel| self.finite(channel));
            self.colors.push(Vec3::from_array(color));
        } else if !self.colors.is_empty() {
            self.colors.push(Vec3::ONE);
        }
        self.positions.push(position);
        Ok(())
    }

    fn read_uv(&mut self, words: Words<'_>) -> Result<(), Fault> {
        let ([u, v], count) = self.numbers::<2>(words)?;
        if count == 0 {
            return Err(Fault::invalid("vt", "there is no number"));
        }
        let (u, v) = (self.finite(u), self.finite(v));
        // The picture stands upright: v grows upwards in the file and downwards in the scene.
        self.uvs.push(Vec2::new(u, 1.0 - v));
        Ok(())
    }

    fn read_normal(&mut self, words: Words<'_>) -> Result<(), Fault> {
        let (normal, count) = self.numbers::<3>(words)?;
        if count < 3 {
            return Err(Fault::invalid("vn", format_args!("{count} numbers instead of three")));
        }
        let normal = Vec3::from_array(normal.map(|axis| self.finite(axis)));
        self.normals.push(normal.as_dvec3().normalize_or_zero().as_vec3());
        Ok(())
    }

    fn read_face(&mut self, words: Words<'_>, material: u32, smoothing: u32) -> Result<(), Fault> {
        let start = self.corners.len();
        for word in words.take_while(|word| !word.starts_with(b"#")) {
            let corner = self.corner(word).map_err(|what| Fault::invalid(format_args!("corner '{}'", shown(word)), what))?;
            self.corners.push(corner);
        }
        let count = self.corners.len() - start;
        self.tally.polygon(count)?;
        if count < 3 {
            self.corners.truncate(start);
        } else {
            self.faces.push(Face { end: self.corners.len(), material, smoothing });
        }
        Ok(())
    }

    /// `position`, `position/uv`, `position//normal` or `position/uv/normal`.
    fn corner(&self, word: &[u8]) -> Result<Corner, String> {
        let mut parts = word.split(|&c| c == b'/');
        let mut next = |count: usize, what: &str| match parts.next() {
            None | Some([]) => Ok(NONE),
            Some(part) => index(part, count, what),
        };
        let position = next(self.positions.len(), "vertex")?;
        let uv = next(self.uvs.len(), "texture coordinate")?;
        let normal = next(self.normals.len(), "normal")?;
        if position == NONE {
            return Err(String::from("there is no vertex"));
        }
        if parts.next().is_some() {
            return Err(String::from("there are more than three indices"));
        }
        Ok(Corner { position, uv, normal })
    }
}

/// From 1 upwards, or from -1 downwards for the last one that was read.
fn index(part: &[u8], count: usize, what: &str) -> Result<u32, String> {
    let number: Option<i64> = std::str::from_utf8(part).ok().and_then(|part| part.parse().ok());
    let number = number.ok_or_else(|| format!("'{}' is no index", shown(part)))?;
    let missing = || format!("{what} {number} does not exist, there are {count} so far");
    let distance = usize::try_from(number.unsigned_abs()).ok().filter(|n| (1..=count).contains(n)).ok_or_else(missing)?;
    let index = if number > 0 { distance - 1 } else { count - distance };
    u32::try_from(index).ok().filter(|&index| index != NONE).ok_or_else(missing)
}

/// Zero for `off`.
fn smoothing_group(word: &[u8], warnings: &mut Warnings) -> u32 {
    match word {
        b"off" => 0,
        // What some programs write for a single group.
        b"on" => 1,
        _ => std::str::from_utf8(word).ok().and_then(|word| word.parse().ok()).unwrap_or_else(|| {
            warnings.push(format!("the smoothing group '{}' is no number, faces are flat", shown(word)));
            0
        }),
    }
}
