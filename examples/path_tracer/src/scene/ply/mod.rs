//! PLY: reads a polygon file, text or binary of either byte order, into a scene.
//!
//! Key decision: a reader of our own, because the header of a PLY file promises sizes, and what reads it must compare them with the
//! bytes that are there before it believes them. Only the elements `vertex` and `face` are shown; the others are stepped over.
//!
//! The steps, one module each: `header` (what the file declares), `values` (numbers out of text or bytes), `mesh` (vertices and faces).
//!
//! **Source:** G. Turk, "The PLY Polygon File Format", 1994.

mod header;
mod mesh;
#[cfg(test)]
mod tests;
mod values;

use std::path::Path;

use self::header::Header;
use super::gltf::Warnings;
use super::model::{Material, Scene, Triangle};
use crate::error::Fault;

/// Reads the scene that `bytes` hold; `path` gives it its name.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Scene, Fault> {
    let mut warnings = Warnings::default();
    let (header, body) = Header::read(bytes, &mut warnings)?;
    let mesh = mesh::read(&header, body, &mut warnings)?;
    let triangles = mesh.triangles.into_iter().map(|vertices| Triangle { vertices, material: 0 }).collect();
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    warnings.push(String::from("the format has no materials: the surface is white and matt under a thin coat"));
    let vertices = mesh.vertices;
    Ok(Scene { name, vertices, triangles, materials: vec![Material::default()], warnings: warnings.into_lines(), ..Scene::default() })
}
