//! From files to a [`Scene`].
//!
//! Key decision: a reader either returns a scene that passed [`Scene::validate`] or an error that names the place; nothing after this
//! module checks an index or a number again. What can be repaired without a guess about the author's intent is repaired, and every
//! repair is one line in [`Scene::warnings`].
//!
//! **Invariant:** no file makes a reader panic, recurse without bound, or allocate much more than the file's own size explains;
//! the caps of [`limits`] bound what compression and instancing can multiply.

pub mod builtin;
pub mod environment;
pub mod framing;
mod gltf;
mod guard;
pub mod limits;
mod material_extensions;
mod material_tree;
mod model;
mod obj;
mod ply;
mod polygon;
pub mod shapes;
mod validate;

use std::path::Path;

pub use crate::error::Error;
pub use builtin::{BUILTIN, builtin};
pub use environment::load_environment;
pub use material_extensions::*;
pub use material_tree::{Curve, Layer, MaterialTree, Weight};
pub use model::*;
pub use validate::Bounds;

/// What a scene file is asked for; the default is what it shows by itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Seconds at which animations are shown; without one everything is in its rest pose.
    pub time: Option<f32>,
    /// The name of the animation that is shown at `time`; without one it is the first of the file.
    pub animation: Option<String>,
    /// The name of the material variant (KHR_materials_variants); without one the materials are the default ones.
    pub variant: Option<String>,
}

/// Reads a scene file: glTF 2.0, binary (`.glb`) or text (`.gltf`), Wavefront OBJ (`.obj`) with its materials, or PLY (`.ply`).
///
/// The scene has at least one camera; if the file has none, it is [`framing::FRAMED`].
///
/// # Errors
/// When the file cannot be read, breaks its format, or requires an extension that is not supported.
pub fn load(path: &Path) -> Result<Scene, Error> {
    load_with(path, &LoadOptions::default())
}

/// [`load`] at a moment of an animation or with a variant of the materials.
///
/// # Errors
/// As [`load`], and when the file has no animation or no variant of the name, or the time is not finite.
pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Scene, Error> {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let kind = match extension.as_deref() {
        Some(kind @ ("glb" | "gltf" | "obj" | "ply")) => kind,
        _ => return Err(Error::extension(path, ".glb or .gltf, .obj or .ply")),
    };
    let bytes = limits::read_file(path)?;
    let read = match kind {
        "obj" => obj::read(path, &bytes),
        "ply" => ply::read(path, &bytes),
        _ => gltf::read(path, &bytes, options),
    };
    let mut scene = read.map_err(|fault| fault.in_file(path))?;
    if matches!(kind, "obj" | "ply") && *options != LoadOptions::default() {
        scene.warnings.push(format!("a .{kind} file has no animations and no variants: what was asked for is left out"));
    }
    scene.check().map_err(|fault| fault.in_file(path))?;
    if scene.triangles.is_empty() {
        scene.warnings.push(String::from("the scene shows no triangles"));
    }
    if scene.cameras.is_empty() {
        let camera = framing::frame(scene.bounds(), 1.0);
        scene.cameras.push(camera);
        scene.warnings.push(String::from(framing::NOTE));
    }
    Ok(scene)
}
