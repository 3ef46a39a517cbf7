//! glTF 2.0: reads a `.glb` or `.gltf` file into a scene.
//!
//! Key decision: the file is never trusted and never validated as a whole; what is shown is checked when it is used, what is not shown
//! is not looked at. So a broken animation does not keep a good mesh from being seen.
//!
//! The steps, one module each: `container` and `json` (what the text says), `uri` and `buffers` (where bytes are), `nodes` (what is
//! shown where), `accessor`, `topology`, `mesh` and `tangents` (shapes), `texture` and `material` (looks), `punctual` (lights and
//! cameras), `bake` (into the world).

mod accessor;
mod bake;
mod buffers;
mod container;
mod extensions;
mod json;
mod material;
pub(super) mod mesh;
mod nodes;
mod punctual;
pub(super) mod tangents;
#[cfg(test)]
mod tests;
pub(super) mod texture;
mod topology;
pub(super) mod uri;

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

use self::accessor::Accessors;
use self::buffers::Buffers;
use self::json::{Document, LightUse, Lights, Node, extension};
use self::mesh::{Budget, MaterialUse, Primitive};
use self::nodes::Placed;
use self::texture::Textures;
use super::model::{Material, Scene};
use crate::error::{Fault, one_line};

/// What was dropped, replaced or assumed; each thing is said once.
#[derive(Default)]
pub(super) struct Warnings {
    lines: Vec<String>,
    n_more: usize,
}

impl Warnings {
    /// Nobody reads more, and a file could otherwise make as many as it has bytes.
    const MOST: usize = 100;

    pub(super) fn push(&mut self, line: String) {
        let line = one_line(&line);
        if self.lines.contains(&line) {
            return;
        }
        if self.lines.len() < Self::MOST {
            self.lines.push(line);
        } else {
            self.n_more += 1;
        }
    }

    #[cfg(test)]
    fn lines(&self) -> &[String] {
        &self.lines
    }

    pub(super) fn into_lines(mut self) -> Vec<String> {
        if self.n_more > 0 {
            self.lines.push(format!("{} more warnings are not shown", self.n_more));
        }
        self.lines
    }
}

/// Reads the scene that `bytes` hold; `path` only says where files next to it are.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Scene, Fault> {
    let (json, bin) = container::split(bytes)?;
    let document = container::parse(json)?;
    let mut warnings = Warnings::default();
    extensions::check(&document, &mut warnings)?;
    let placed = nodes::place(&document, &mut warnings)?;
    let buffers = Buffers::read(&document, bin, path)?;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let scene_name = document.scenes.get(document.scene.unwrap_or(0)).and_then(|scene| scene.name.clone());
    let mut reader = Reader {
        document: &document,
        accessors: Accessors { document: &document, buffers: &buffers },
        textures: Textures { document: &document, buffers: &buffers, scene: path, images: Vec::new(), known: HashMap::new(), n_texels: 0 },
        lights: extension::<Lights>(&document.extensions, "KHR_lights_punctual")?.unwrap_or_default(),
        materials: HashMap::new(),
        meshes: HashMap::new(),
        read_budget: Budget::default(),
        bake_budget: Budget::default(),
        scene: Scene { name: stem.or(scene_name).unwrap_or_default(), ..Scene::default() },
        warnings,
    };
    // All instances are counted before the first one is made.
    for placed in &placed {
        reader.measure(placed).map_err(|fault| reader.explain(fault, placed))?;
    }
    for placed in &placed {
        reader.show(placed).map_err(|fault| reader.explain(fault, placed))?;
    }
    let Reader { mut scene, textures, warnings, .. } = reader;
    scene.images = textures.images;
    scene.warnings = warnings.into_lines();
    Ok(scene)
}

struct Reader<'a> {
    document: &'a Document,
    accessors: Accessors<'a>,
    textures: Textures<'a>,
    lights: Lights,
    materials: HashMap<Option<usize>, MaterialUse>,
    meshes: HashMap<usize, Vec<Primitive>>,
    read_budget: Budget,
    bake_budget: Budget,
    scene: Scene,
    warnings: Warnings,
}

impl Reader<'_> {
    /// Reads the mesh of a node and takes it off the budget.
    fn measure(&mut self, placed: &Placed) -> Result<(), Fault> {
        let node = &self.document.nodes[placed.node];
        let Some(index) = node.mesh else { return Ok(()) };
        if node.skin.is_some() {
            self.warnings.push(format!("node {}: the skin is left out, its mesh is shown in rest pose", placed.node));
        }
        self.read_mesh(index)?;
        for made in self.meshes.get(&index).into_iter().flatten() {
            self.bake_budget.spend(made.vertices.len(), made.triangles.len())?;
        }
        Ok(())
    }

    /// Puts what a node carries into the scene.
    fn show(&mut self, placed: &Placed) -> Result<(), Fault> {
        let node = &self.document.nodes[placed.node];
        if let Some(index) = node.mesh {
            for (primitive, made) in self.meshes.get(&index).into_iter().flatten().enumerate() {
                bake::bake(&mut self.scene, made, placed.world_from_node)
                    .map_err(|f| f.within(format_args!("mesh {index}, primitive {primitive}")))?;
            }
        }
        if let Some(index) = node.camera {
            self.show_camera(node, index, placed).map_err(|f| f.within(format_args!("camera {index}")))?;
        }
        if let Some(LightUse { light }) = extension(&node.extensions, "KHR_lights_punctual")? {
            let place = format!("light {light}");
            let source = self.lights.lights.get(light).ok_or_else(|| Fault::invalid(&place, "it does not exist"))?;
            let made = punctual::light(source, &place, placed.world_from_node, &mut self.warnings).map_err(|f| f.within(&place))?;
            self.scene.lights.push(made);
        }
        Ok(())
    }

    fn show_camera(&mut self, node: &Node, index: usize, placed: &Placed) -> Result<(), Fault> {
        let camera = self.document.cameras.get(index).ok_or_else(|| Fault::invalid("node", "it does not exist"))?;
        let made = punctual::camera(camera, node.name.as_deref(), &format!("camera {index}"), placed.world_from_node)?;
        self.scene.cameras.push(made);
        Ok(())
    }

    /// Reads a mesh at its first use.
    fn read_mesh(&mut self, index: usize) -> Result<(), Fault> {
        if self.meshes.contains_key(&index) {
            return Ok(());
        }
        let missing = || Fault::invalid(format_args!("mesh {index}"), "it does not exist");
        let mesh = self.document.meshes.get(index).ok_or_else(missing)?;
        let mut made = Vec::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("mesh {index}, primitive {number}");
            if !primitive.targets.is_empty() {
                self.warnings.push(format!("mesh {index}: the morph targets are left out, it is shown in rest pose"));
            }
            let material = self.material(primitive.material).map_err(|f| f.within(&place))?;
            let (accessors, budget) = (&self.accessors, &mut self.read_budget);
            let read = mesh::read(primitive, material, accessors, budget, &place, &mut self.warnings);
            made.extend(read.map_err(|f| f.within(&place))?);
        }
        self.meshes.insert(index, made);
        Ok(())
    }

    /// The scene's material for a primitive, read at its first use.
    fn material(&mut self, index: Option<usize>) -> Result<MaterialUse, Fault> {
        let vacant = match self.materials.entry(index) {
            Entry::Occupied(known) => return Ok(*known.get()),
            Entry::Vacant(vacant) => vacant,
        };
        let material: Material = match index {
            None => material::fallback(),
            Some(index) => {
                let place = format!("material {index}");
                let source = self.document.materials.get(index).ok_or_else(|| Fault::invalid(&place, "it does not exist"))?;
                material::read(source, &place, &mut self.textures, &mut self.warnings).map_err(|f| f.within(&place))?
            }
        };
        let made = MaterialUse {
            index: u32::try_from(self.scene.materials.len()).unwrap_or(u32::MAX),
            normal_uv_set: material.normal_texture.map(|texture| texture.uv_set),
        };
        self.scene.materials.push(material);
        Ok(*vacant.insert(made))
    }

    /// Adds the name of the node where people know it by that.
    fn explain(&self, fault: Fault, placed: &Placed) -> Fault {
        match &self.document.nodes[placed.node].name {
            Some(name) => fault.within(format_args!("node {} '{name}'", placed.node)),
            None => fault.within(format_args!("node {}", placed.node)),
        }
    }
}
