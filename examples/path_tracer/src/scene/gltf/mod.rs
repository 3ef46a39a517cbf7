//! glTF 2.0: reads a `.glb` or `.gltf` file into a scene.
//!
//! Key decision: the file is never trusted and never validated as a whole; what is shown is checked when it is used, what is not shown
//! is not looked at. So a broken animation does not keep a good mesh from being seen.
//!
//! The steps, one module each: `container` and `json` (what the text says), `uri`, `buffers` and `meshopt` (where bytes
//! are), `animation` (the pose),
//! `nodes` (what is shown where), `accessor`, `topology`, `mesh`, `morph` and `tangents` (shapes), `texture`, `material`, `layers`,
//! `specular_glossiness`, `material_tree` and `variants` (looks), `punctual` (lights and cameras), `extras` (custom properties), `skin`, `instancing` and
//! `bake` (into the world).

mod accessor;
mod animation;
mod bake;
mod buffers;
mod container;
mod extensions;
mod extras;
mod instancing;
mod json;
mod layers;
mod material;
mod material_tree;
pub(super) mod mesh;
mod meshopt;
mod morph;
mod nodes;
mod punctual;
mod skin;
mod specular_glossiness;
pub(super) mod tangents;
#[cfg(test)]
mod tests;
pub(super) mod texture;
mod topology;
pub(super) mod uri;
mod variants;

use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use serde_json::Value;

use self::accessor::Accessors;
use self::animation::Pose;
use self::bake::Transforms;
use self::buffers::Buffers;
use self::extras::{Carrier, CustomProperties};
use self::json::{Document, LightUse, Lights, Node, TextureInfo, extension};
use self::mesh::{Budget, MaterialUse, Primitive};
use self::nodes::{Graph, Placed};
use self::skin::Skin;
use self::texture::Textures;
use super::LoadOptions;
use super::model::{Material, PunctualLight, Scene, TextureUse};
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
pub(super) fn read(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Scene, Fault> {
    let (json, bin) = container::split(bytes)?;
    let document = container::parse(json)?;
    let mut warnings = Warnings::default();
    extensions::check(&document, &mut warnings)?;
    let buffers = Buffers::read(&document, bin, path)?;
    let accessors = Accessors { document: &document, buffers: &buffers };
    let pose = Pose::read(&document, &accessors, options, &mut warnings)?;
    let graph = nodes::place(&document, &pose, &mut warnings)?;
    let variant = variants::choose(&document, options.variant.as_deref(), &mut warnings)?;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let scene_name = document.scenes.get(document.scene.unwrap_or(0)).and_then(|scene| scene.name.clone());
    let lights = extension::<Lights>(&document.extensions, "KHR_lights_punctual")?.unwrap_or_default();
    let mut reader = Reader {
        document: &document,
        accessors,
        pose: &pose,
        graph: &graph,
        skins: HashMap::new(),
        variant,
        textures: Textures { document: &document, buffers: &buffers, scene: path, images: Vec::new(), known: HashMap::new(), n_texels: 0 },
        lights: &lights,
        properties: CustomProperties::new(&document, &lights.lights, path, &graph.placed),
        materials: HashMap::new(),
        meshes: Vec::new(),
        known_meshes: HashMap::new(),
        read_budget: Budget::default(),
        bake_budget: Budget::default(),
        scene: Scene { name: stem.or(scene_name).unwrap_or_default(), ..Scene::default() },
        warnings,
    };
    // All instances are counted before the first one is made.
    let mut shapes = Vec::new();
    for placed in &graph.placed {
        shapes.push(reader.measure(placed).map_err(|fault| reader.explain(fault, placed))?);
    }
    for (placed, shape) in graph.placed.iter().zip(shapes) {
        reader.show(placed, shape).map_err(|fault| reader.explain(fault, placed))?;
    }
    let Reader { mut scene, textures, properties, mut warnings, .. } = reader;
    properties.tell_unused(&graph.placed, &mut warnings);
    scene.profiles = properties.profiles;
    let unseen: BTreeSet<&str> = scene.materials.iter().flat_map(|material| material.extensions.effective()).collect();
    if !unseen.is_empty() {
        let names = unseen.into_iter().collect::<Vec<_>>().join(", ");
        warnings.push(format!("these material extensions are read but not shown: {names}"));
    }
    let has_heights = scene.materials.iter().any(|material| material.extensions.height_map.is_some());
    let unrendered = [(!scene.profiles.is_empty(), "IES profiles"), (has_heights, "height maps")];
    let unrendered: Vec<&str> = unrendered.into_iter().filter_map(|(is_there, what)| is_there.then_some(what)).collect();
    if !unrendered.is_empty() {
        warnings.push(format!("{} are read but not rendered yet", unrendered.join(" and ")));
    }
    scene.images = textures.images;
    scene.animations = animation::list(&document);
    scene.warnings = warnings.into_lines();
    Ok(scene)
}

struct Reader<'a> {
    document: &'a Document,
    accessors: Accessors<'a>,
    pose: &'a Pose,
    graph: &'a Graph,
    skins: HashMap<usize, Skin>,
    variant: Option<usize>,
    textures: Textures<'a>,
    lights: &'a Lights,
    properties: CustomProperties<'a>,
    /// By number, and by what around it gives it a height map.
    materials: HashMap<(Option<usize>, Option<Carrier>), MaterialUse>,
    meshes: Vec<Shape>,
    /// A mesh, the bits of its morph weights, and what gives it a height map: equal ones are read once.
    known_meshes: HashMap<(usize, Vec<u32>, Option<Carrier>), usize>,
    read_budget: Budget,
    bake_budget: Budget,
    scene: Scene,
    warnings: Warnings,
}

/// A mesh in its own space, its morph targets added.
struct Shape {
    mesh: usize,
    /// With their numbers in the mesh; those that show nothing are missing.
    primitives: Vec<(usize, Primitive)>,
}

impl Reader<'_> {
    /// Reads the mesh of a node and takes all its copies off the budget; returns its place in `meshes`.
    fn measure(&mut self, placed: &Placed) -> Result<Option<usize>, Fault> {
        let node = &self.document.nodes[placed.node];
        let Some(mesh) = node.mesh else { return Ok(None) };
        let weights = morph::weights(self.document, placed.node, mesh, self.pose, &mut self.warnings)?;
        let shape = self.read_mesh(mesh, &weights, self.properties.height_carrier(mesh, placed.node))?;
        let n_copies = match node.skin {
            Some(_) => 1,
            None => instancing::count(node, &self.accessors)?.unwrap_or(1),
        };
        for (_, made) in &self.meshes[shape].primitives {
            let all = |n: usize| n.saturating_mul(n_copies);
            self.bake_budget.spend(all(made.vertices.len()), all(made.triangles.len()))?;
        }
        Ok(Some(shape))
    }

    /// Puts what a node carries into the scene.
    fn show(&mut self, placed: &Placed, shape: Option<usize>) -> Result<(), Fault> {
        let node = &self.document.nodes[placed.node];
        if let Some(shape) = shape {
            self.show_mesh(node, placed, shape)?;
            self.scene.name_object(&node.name.clone().unwrap_or_else(|| format!("node {}", placed.node)));
        }
        if let Some(index) = node.camera {
            self.show_camera(node, index, placed).map_err(|f| f.within(format_args!("camera {index}")))?;
        }
        if let Some(LightUse { light }) = extension(&node.extensions, "KHR_lights_punctual")? {
            let place = format!("light {light}");
            let source = self.lights.lights.get(light).ok_or_else(|| Fault::invalid(&place, "it does not exist"))?;
            let made = punctual::light(source, &place, placed.world_from_node, &mut self.warnings).map_err(|f| f.within(&place))?;
            let profile = self.properties.profile(light, placed.node)?;
            self.scene.lights.push(PunctualLight { profile, ..made });
        }
        Ok(())
    }

    fn show_mesh(&mut self, node: &Node, placed: &Placed, shape: usize) -> Result<(), Fault> {
        let Shape { mesh, primitives } = &self.meshes[shape];
        if primitives.is_empty() {
            return Ok(());
        }
        let place = |number: usize| format!("mesh {mesh}, primitive {number}");
        let rigid = Transforms::Rigid(placed.world_from_node);
        if let Some(skin) = node.skin {
            let skin = match self.skins.entry(skin) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(vacant) => vacant.insert(Skin::read(self.document, skin, &self.accessors, self.graph)?),
            };
            if node.extensions.contains_key("EXT_mesh_gpu_instancing") {
                self.warnings.push(format!("node {}: the instances of its skinned mesh are left out", placed.node));
            }
            for (number, made) in primitives {
                let source = &self.document.meshes[*mesh].primitives[*number];
                let mixed = skin.mix(source, &self.accessors, &place(*number), &mut self.warnings);
                let mixed = mixed.map_err(|f| f.within(place(*number)))?;
                let transforms = mixed.as_deref().map(Transforms::Skinned);
                bake::bake(&mut self.scene, made, transforms.as_ref().unwrap_or(&rigid)).map_err(|f| f.within(place(*number)))?;
            }
            return Ok(());
        }
        let instances = instancing::read(node, &format!("node {}", placed.node), &self.accessors, &mut self.warnings)?;
        for (number, made) in primitives {
            let mut bake =
                |transforms: &Transforms<'_>| bake::bake(&mut self.scene, made, transforms).map_err(|f| f.within(place(*number)));
            match &instances {
                Some(instances) => {
                    for node_from_instance in instances.transforms() {
                        bake(&Transforms::Rigid(placed.world_from_node * node_from_instance))?;
                    }
                }
                None => bake(&rigid)?,
            }
        }
        Ok(())
    }

    fn show_camera(&mut self, node: &Node, index: usize, placed: &Placed) -> Result<(), Fault> {
        let camera = self.document.cameras.get(index).ok_or_else(|| Fault::invalid("node", "it does not exist"))?;
        let made = punctual::camera(camera, node.name.as_deref(), &format!("camera {index}"), placed.world_from_node)?;
        self.scene.cameras.push(made);
        Ok(())
    }

    /// The place of a mesh in `meshes`, read at its first use with these weights and with this around it.
    fn read_mesh(&mut self, index: usize, weights: &[f32], heights: Option<Carrier>) -> Result<usize, Fault> {
        let key = (index, weights.iter().map(|weight| weight.to_bits()).collect(), heights);
        if let Some(&known) = self.known_meshes.get(&key) {
            return Ok(known);
        }
        let missing = || Fault::invalid(format_args!("mesh {index}"), "it does not exist");
        let mesh = self.document.meshes.get(index).ok_or_else(missing)?;
        let mut made = Vec::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("mesh {index}, primitive {number}");
            let material = variants::material(primitive, self.variant).map_err(|f| f.within(&place))?;
            let material = self.material(material, heights).map_err(|f| f.within(&place))?;
            let (accessors, budget) = (&self.accessors, &mut self.read_budget);
            let read = mesh::read(primitive, material, weights, accessors, budget, &place, &mut self.warnings);
            made.extend(read.map_err(|f| f.within(&place))?.map(|primitive| (number, primitive)));
        }
        self.meshes.push(Shape { mesh: index, primitives: made });
        self.known_meshes.insert(key, self.meshes.len() - 1);
        Ok(self.meshes.len() - 1)
    }

    /// The scene's material for a primitive, read at its first use.
    fn material(&mut self, index: Option<usize>, heights: Option<Carrier>) -> Result<MaterialUse, Fault> {
        let vacant = match self.materials.entry((index, heights)) {
            Entry::Occupied(known) => return Ok(*known.get()),
            Entry::Vacant(vacant) => vacant,
        };
        let mut material: Material = match index {
            None => material::fallback(),
            Some(index) => {
                let place = format!("material {index}");
                let source = self.document.materials.get(index).ok_or_else(|| Fault::invalid(&place, "it does not exist"))?;
                material::read(source, &place, &mut self.textures, &mut self.warnings).map_err(|f| f.within(&place))?
            }
        };
        material.extensions.height_map = self.properties.height_map(index, heights)?;
        let made = MaterialUse {
            index: u32::try_from(self.scene.materials.len()).unwrap_or(u32::MAX),
            tangent_uv_set: material::tangent_uv_set(&material),
        };
        self.scene.materials.push(material);
        vacant.insert(made);
        let document = self.document;
        let written = index.and_then(|index| Some((index, document.materials[index].extras.material_tree.as_ref()?)));
        let Some((number, written)) = written else { return Ok(made) };
        // Of the tree's own material only the normal map is left.
        let own = self.scene.materials[made.index as usize].normal_texture.map(|texture| texture.uv_set);
        let mut leaves = Leaves { reader: self, place: format!("material {number}"), tangent_uv_set: own };
        let tree = material_tree::read(written, &mut leaves).map_err(|f| f.within(&leaves.place))?;
        let made = MaterialUse { tangent_uv_set: leaves.tangent_uv_set, ..made };
        self.scene.materials[made.index as usize].tree = Some(tree);
        self.materials.insert((index, heights), made);
        Ok(made)
    }

    /// Adds the name of the node where people know it by that.
    fn explain(&self, fault: Fault, placed: &Placed) -> Fault {
        match &self.document.nodes[placed.node].name {
            Some(name) => fault.within(format_args!("node {} '{name}'", placed.node)),
            None => fault.within(format_args!("node {}", placed.node)),
        }
    }
}

/// The file around the tree of one material.
struct Leaves<'r, 'a> {
    reader: &'r mut Reader<'a>,
    place: String,
    /// Of the tree's material, or of the first leaf that asks for one.
    tangent_uv_set: Option<u32>,
}

impl material_tree::Surroundings for Leaves<'_, '_> {
    fn leaf(&mut self, named: &Value) -> Result<u32, Fault> {
        let materials = &self.reader.document.materials;
        let by_name = |name: &str| materials.iter().position(|material| material.name.as_deref() == Some(name));
        let by_number = |number: u64| usize::try_from(number).ok().filter(|number| *number < materials.len());
        let found = named.as_str().map_or_else(|| named.as_u64().and_then(by_number), by_name);
        let fault = |what: &dyn std::fmt::Display| Fault::invalid("material_tree", what);
        let index = found.ok_or_else(|| fault(&format_args!("there is no material {named} in the file")))?;
        // Trees within trees by name could lead in circles.
        if materials[index].extras.material_tree.is_some() {
            return Err(fault(&format_args!("{named} has a tree of its own: write that one out in its place")));
        }
        let leaf = self.reader.material(Some(index), None)?;
        match (self.tangent_uv_set, leaf.tangent_uv_set) {
            (Some(own), Some(other)) if own != other => {
                let what = format_args!("the tangents of {named} follow texture coordinates {own}, as others of the tree, and not {other}");
                self.reader.warnings.push(format!("{}: {what}", self.place));
            }
            (own, other) => self.tangent_uv_set = own.or(other),
        }
        Ok(leaf.index)
    }

    fn texture(&mut self, info: &TextureInfo) -> Result<Option<TextureUse>, Fault> {
        self.reader.textures.read(info, &self.place, &mut self.reader.warnings)
    }
}
