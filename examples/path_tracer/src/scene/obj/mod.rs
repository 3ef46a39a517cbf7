//! Wavefront OBJ with MTL: reads a `.obj` file and the material libraries beside it into a scene.
//!
//! Key decision: a reader of our own. What these files need beside parsing is a place for every complaint, smoothing groups, and a
//! defence against indices and names that lead elsewhere; a missing library or texture is a warning, as it is common.
//!
//! The steps, one module each: `lines` (words and numbers), `geometry` (statements), `mtl` and `texture_map` (what a library says),
//! `material` (in terms of the scene's model), `build` (vertices and triangles).
//!
//! **Source:** Wavefront, "Advanced Visualizer Manual", appendices B1 (OBJ) and the MTL specification; the physically based extension
//! (`Pr`, `Pm`, `norm`) as its authors at Exocortex describe it.

mod build;
mod geometry;
mod lines;
mod material;
mod mtl;
#[cfg(test)]
mod tests;
mod texture_map;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use self::geometry::Geometry;
use self::material::Materials;
use self::mtl::Definition;
use super::gltf::{Warnings, uri};
use super::model::Scene;
use crate::error::{Fault, one_line};

/// Reads the scene that `bytes` hold; `path` says where files next to it are.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Scene, Fault> {
    let mut warnings = Warnings::default();
    let geometry = Geometry::read(bytes, &mut warnings)?;
    let definitions = read_libraries(&geometry.libraries, path, &mut warnings)?;
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let mut scene = Scene { name, ..Scene::default() };
    let mut materials = Materials::new(&definitions, path);
    build::build(geometry, &mut materials, &mut scene, &mut warnings)?;
    scene.images = materials.into_images();
    scene.warnings = warnings.into_lines();
    Ok(scene)
}

/// The same file has any number of spellings, and each is read.
const MOST_LIBRARIES: usize = 64;

/// Reads every library once.
fn read_libraries(lines: &[String], scene: &Path, warnings: &mut Warnings) -> Result<HashMap<String, Definition>, Fault> {
    let mut definitions = HashMap::new();
    let mut known = HashSet::new();
    for line in lines {
        if !known.insert(line.as_str()) {
            continue;
        }
        if known.len() > MOST_LIBRARIES {
            warnings.push(format!("only the first {MOST_LIBRARIES} mtllib statements are read"));
            break;
        }
        // A name with spaces, or several names; the format means the latter, people the former.
        let names = if line.split_ascii_whitespace().nth(1).is_none() || beside(line, scene).is_ok() {
            vec![line.as_str()]
        } else {
            line.split_ascii_whitespace().collect()
        };
        for name in names {
            match beside(name, scene) {
                Ok(bytes) => {
                    mtl::read(&bytes, &mut definitions, warnings).map_err(|f| f.within(format_args!("mtllib '{}'", one_line(name))))?
                }
                Err(what) => warnings.push(format!("mtllib '{name}': {what}; its materials are replaced")),
            }
        }
    }
    Ok(definitions)
}

/// A file below the folder of the scene; names may be written as on another system.
fn beside(name: &str, scene: &Path) -> Result<Vec<u8>, String> {
    uri::beside(&name.replace('\\', "/"), scene)
}
