//! A [`Scene`] as the bytes of five buffers and the WGSL that reads them.
//!
//! Key decision: no GPU here. Packing is a pure function from a scene and a camera to bytes, so every table can be tested, hashed and read
//! by a re-execution on the CPU; the caller makes buffers of them.
//!
//! **Invariant:** whatever packs is valid for the kernels: indices in range, numbers finite, tables exact, sizes within a binding.

mod absorption;
pub mod alias;
pub mod coat;
pub mod effects;
mod environment;
pub mod error;
pub mod exhaustive;
mod geometry;
pub mod hierarchy;
pub mod layers;
mod lights;
pub mod lobes;
mod materials;
pub mod nodes;
pub mod normalise;
mod placement;
pub mod record;
pub mod records;
mod tables;
mod textures;
mod view;

use std::borrow::Cow;

pub use effects::Effects;
pub use error::Error;
pub use layers::LayerRequest;
pub use normalise::Normalisation;
pub use records::records_wgsl;

use crate::scene::{Camera, Scene};
use hierarchy::SHORT_STACK;
use nodes::NodeRows;
use tables::Tables;

/// What packing needs to know besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct PackOptions {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// A path scatters at most this often; 0 shows emitters only.
    pub max_depth: u32,
    /// Keys all random numbers.
    pub seed: u32,
    /// Roulette spares paths that scattered less often.
    pub roulette_depth: u32,
    /// Roulette never gives a path less than this chance.
    pub roulette_floor: f32,
    /// How light is found.
    pub light_strategy: LightStrategy,
    /// What is asked for beside the colour.
    pub layers: LayerRequest,
    /// Coverage is asked for, and the environment is not seen directly.
    pub transparent: bool,
    /// The sample that numbers of objects and materials are taken from.
    pub first_sample: u32,
    /// Bytes that one binding can hold.
    pub binding_limit: u64,
    /// Bytes that one uniform binding can hold, where rows had better lie in uniform memory; 0: never. It takes numbers of 64 bits.
    pub uniform_limit: u64,
    /// Triangles up to which a ray is tested against all of them, without a hierarchy; 0: never. See [`exhaustive`].
    pub exhaustive_limit: u32,
}

impl Default for PackOptions {
    fn default() -> Self {
        PackOptions {
            width: 512,
            height: 512,
            max_depth: 64,
            seed: 0,
            roulette_depth: 4,
            roulette_floor: 0.05,
            light_strategy: LightStrategy::Mis,
            layers: LayerRequest::NONE,
            transparent: false,
            first_sample: 0,
            binding_limit: 128 << 20,
            uniform_limit: 0,
            exhaustive_limit: 0,
        }
    }
}

/// How light is found; the expected image is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum LightStrategy {
    /// Picking lights and running into them, weighted against each other.
    #[default]
    Mis,
    /// Running into them alone; punctual lights are still picked because nothing can run into them.
    Bsdf,
    /// Picking them alone; what a mirror shows is still run into.
    Lights,
}

/// What is in a packed scene.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Facts {
    /// What the scene calls for.
    pub effects: Effects,
    /// Packed triangles.
    pub triangle_count: u32,
    /// Entries of the light selection.
    pub light_count: u32,
    /// Inner nodes on the longest way down the hierarchy.
    pub bvh_depth: u32,
    /// Nodes lie on a grid: see [`nodes`].
    pub compact_nodes: bool,
    /// Rows lie in uniform memory, as numbers of 64 bits: bindings 1 to 3 are uniform buffers.
    pub uniform_rows: bool,
    /// Rays are tested against all triangles: see [`exhaustive`].
    pub exhaustive: bool,
    /// Everything that was dropped, clamped or reduced; one line each, names the thing.
    pub warnings: Vec<String>,
}

/// One WGSL module of the program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramModule {
    /// What imports call it.
    pub path: Cow<'static, str>,
    /// The file's name for messages.
    pub file: Cow<'static, str>,
    /// The WGSL.
    pub text: Cow<'static, str>,
}

/// The content of group 1. No buffer is empty.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GpuScene {
    /// Binding 0, a uniform.
    pub view: Vec<u8>,
    /// Binding 1: nodes of the hierarchy.
    pub bvh: Vec<u8>,
    /// Binding 2: triangles, then vertex attributes.
    pub triangles: Vec<u8>,
    /// Binding 3: materials, textures, lights, alias tables.
    pub tables: Vec<u8>,
    /// Binding 4: texels of images and of the panorama.
    pub texels: Vec<u8>,
    /// How the scene was moved into the unit ball.
    pub normalisation: Normalisation,
    /// What is in it.
    pub facts: Facts,
    layers: LayerRequest,
    transparent: bool,
    constants: Vec<(&'static str, u32)>,
    /// Where rays are tested against all triangles.
    all_slots: Vec<u32>,
}

impl GpuScene {
    /// Packs a scene as seen by a camera.
    ///
    /// **Cost:** building the hierarchy dominates; about a second per million triangles.
    ///
    /// # Errors
    /// When a table exceeds a binding, an index dangles or a number is out of range.
    pub fn pack(scene: &Scene, camera: &Camera, options: &PackOptions) -> Result<GpuScene, Error> {
        let mut facts = Facts::default();
        let warnings = &mut facts.warnings;
        let material_limit = u64::from(records::triangle_flags::MATERIAL_MASK);
        if scene.materials.len() as u64 > material_limit {
            return Err(Error::TooMany { what: "materials", count: scene.materials.len() as u64, limit: material_limit });
        }
        let used = scene.triangles.iter().flat_map(|triangle| triangle.vertices);
        let normalisation = Normalisation::of(used.filter_map(|index| scene.vertices.get(index as usize)).map(|vertex| vertex.position));
        let mut textures = textures::Textures::default();
        let mut records = materials::pack(scene, &mut textures, warnings)?;
        let lobes = lobes::pack(scene, &mut records, &mut textures, warnings)?;
        if records.len() as u64 > material_limit {
            return Err(Error::TooMany { what: "leaves of materials", count: records.len() as u64, limit: material_limit });
        }
        let in_sight = lobes.in_sight(scene, &records);
        let mut effects = Effects::of_surfaces(&in_sight, &scene.vertices);
        effects.textures |= lobes.have_textures(&in_sight);
        let materials = &records[..scene.materials.len()];
        let absorption = absorption::rows(scene, materials, &normalisation, warnings);
        effects.absorption = absorption.is_some();
        let mut geometry = geometry::pack(scene, &normalisation, materials, warnings)?;

        // The panorama takes what the images leave of the texel buffer.
        let room = options.binding_limit.saturating_sub(textures.words.len() as u64 * 4 + 4096);
        let room = tables::environment_texels_within(options.binding_limit).min(room / 12);
        let environment = scene.environment.as_ref().map(|map| environment::pack(map, room, warnings)).transpose()?;
        let environment = environment.filter(|map| map.alias.is_some());
        let flux = environment.as_ref().map_or(0.0, |map| map.flux);
        let lights = lights::pack(scene, &normalisation, materials, &mut geometry, flux, options.light_strategy)?;
        effects.environment = environment.is_some();
        effects.emissive_triangles = geometry.triangles.iter().any(|triangle| triangle.material & records::triangle_flags::EMISSIVE != 0);
        effects.punctual_lights = !lights.punctuals.is_empty();
        effects.samplable_lights = lights.records.iter().any(|light| light.pmf > 0.0);

        let mut view = view::of_camera(camera, &normalisation, options.width, options.height)?;
        view.seed = options.seed;
        view.max_depth = options.max_depth;
        view.roulette_depth = options.roulette_depth;
        view.roulette_floor = options.roulette_floor.clamp(1e-6, 1.0);
        view.bvh_root = geometry.hierarchy.root;
        view.vertices = (geometry.triangles.len() * 4) as u32;
        let mut tables = Tables::build(&mut view, &records, textures, &lights, environment.as_ref());

        let layer_table = options.layers.append_table(&mut tables, options.first_sample, &geometry.triangles, &scene.object_of);
        let mut constants = effects.constants(geometry.hierarchy.depth, options.light_strategy).to_vec();
        let nodes = NodeRows::pack(&geometry.hierarchy.nodes);
        constants.extend(nodes.constants());
        if effects.material_trees {
            constants.extend([("TREE_TABLE", tables.append(lobes.rows.as_flattened())), ("TREE_LOBES", lobes.most(&in_sight).max(1))]);
        }
        constants.extend(absorption.map(|rows| ("ABSORPTION_TABLE", tables.append(rows.as_flattened()))));
        constants.extend(layer_table.map(|row| ("LAYER_TABLE", row)));

        let mut triangles = bytemuck::cast_slice(&geometry.triangles).to_vec();
        triangles.extend_from_slice(bytemuck::cast_slice(&geometry::vertex_rows(&scene.vertices, &effects)));
        facts.triangle_count = geometry.triangles.len() as u32;
        facts.light_count = lights.records.iter().filter(|light| light.pmf > 0.0).count() as u32;
        facts.exhaustive = facts.triangle_count <= options.exhaustive_limit && !effects.alpha;
        let all_slots = if facts.exhaustive { exhaustive::slots_in_scene_order(&geometry.triangles) } else { Vec::new() };
        facts.bvh_depth = geometry.hierarchy.depth;
        facts.compact_nodes = nodes.is_compact;
        facts.effects = effects;
        let limit = options.binding_limit;
        let mut bvh = bounded("nodes of the hierarchy", bytemuck::cast_slice(&nodes.rows).to_vec(), limit)?;
        let mut triangles = bounded("triangles and vertices", triangles, limit)?;
        let mut rows = bounded("materials and lights", bytemuck::cast_slice(&tables.rows).to_vec(), limit)?;
        facts.uniform_rows = placement::is_uniform(&[&bvh, &triangles, &rows], options.uniform_limit);
        if facts.uniform_rows {
            let buffers = [("BVH_BUFFER_ROWS", &mut bvh), ("TRIANGLE_BUFFER_ROWS", &mut triangles), ("TABLE_BUFFER_ROWS", &mut rows)];
            constants.extend(buffers.map(|(name, bytes)| (name, placement::fill(bytes))));
        }
        Ok(GpuScene {
            view: bytemuck::bytes_of(&view).to_vec(),
            bvh,
            triangles,
            tables: rows,
            texels: bounded("texels", bytemuck::cast_slice(&tables.texels).to_vec(), limit)?,
            normalisation,
            constants,
            all_slots,
            layers: options.layers,
            transparent: options.transparent,
            facts,
        })
    }

    /// What conditions in the modules may ask for: effects of the scene, layers of the request, whether the picture is transparent, the form
    /// of the nodes, whether there are any, and the placement of rows.
    pub fn features(&self) -> Vec<(&'static str, bool)> {
        let forms = [
            ("compact_nodes", self.facts.compact_nodes),
            ("uniform_rows", self.facts.uniform_rows),
            ("exhaustive", self.facts.exhaustive),
            ("short_stack", self.facts.bvh_depth <= SHORT_STACK),
        ];
        let rest = [("transparent", self.transparent)].into_iter().chain(forms);
        self.facts.effects.features().into_iter().chain(self.layers.features()).chain(rest).collect()
    }

    /// True when paths bring home more than their radiance.
    pub fn brings_more_than_radiance(&self) -> bool {
        self.transparent || self.layers.any()
    }

    /// What is asked for beside the colour.
    pub fn layers(&self) -> LayerRequest {
        self.layers
    }

    /// All modules that the stages import: shared math, the path tracer's files and the generated records. What the scene calls for is
    /// decided by [`features`](Self::features) and [`constants`](Self::constants).
    pub fn program_modules(&self) -> Vec<ProgramModule> {
        let file = |module: &wavepool_shaders::Module| ProgramModule {
            path: Cow::Borrowed(module.path),
            file: Cow::Borrowed(module.file),
            text: Cow::Borrowed(module.text),
        };
        let mut modules: Vec<ProgramModule> = wavepool_shaders::MATH.iter().chain(wavepool_shaders::PATH_TRACER).map(file).collect();
        modules.push(ProgramModule {
            path: Cow::Borrowed("path_tracer::records"),
            file: Cow::Borrowed("generated path_tracer::records"),
            text: Cow::Owned(records_wgsl()),
        });
        if self.facts.exhaustive {
            modules.push(ProgramModule {
                path: Cow::Borrowed("path_tracer::all_triangles"),
                file: Cow::Borrowed("generated path_tracer::all_triangles"),
                text: Cow::Owned(exhaustive::all_triangles_wgsl(&self.all_slots)),
            });
        }
        modules
    }

    /// Numbers that the modules take from the package `constants`.
    pub fn constants(&self) -> &[(&'static str, u32)] {
        &self.constants
    }
}

/// Checks a buffer's size and fills an empty one up to a row.
fn bounded(what: &'static str, mut bytes: Vec<u8>, limit: u64) -> Result<Vec<u8>, Error> {
    if bytes.len() as u64 > limit {
        return Err(Error::TooLarge { what, bytes: bytes.len() as u64, limit });
    }
    bytes.resize(bytes.len().next_multiple_of(16).max(32), 0);
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use glam::{Mat4, Vec3, Vec4};

    use super::*;
    use crate::scene::{Material, Projection, Triangle, Vertex};

    fn triangle(material: Material) -> Scene {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        Scene {
            vertices: corners.map(|position| Vertex { position, normal: Vec3::Z, color: Vec4::ONE, ..Vertex::default() }).to_vec(),
            triangles: vec![Triangle { vertices: [0, 1, 2], material: 0 }],
            materials: vec![material],
            ..Scene::default()
        }
    }

    fn packed(scene: &Scene) -> Result<GpuScene, Error> {
        let projection = Projection::Perspective { vertical_fov: 1.0 };
        let camera = Camera { name: String::new(), world_from_camera: Mat4::IDENTITY, projection };
        GpuScene::pack(scene, &camera, &PackOptions { binding_limit: 1 << 20, ..PackOptions::default() })
    }

    // Kills: an empty buffer, which a binding cannot hold, or one that is not whole rows.
    #[test]
    fn no_buffer_is_empty() {
        let scene = packed(&Scene::default()).expect("an empty scene");
        for bytes in [&scene.view, &scene.bvh, &scene.triangles, &scene.tables, &scene.texels] {
            assert!(bytes.len() >= 16 && bytes.len().is_multiple_of(16), "{}", bytes.len());
        }
        assert!(!scene.facts.effects.samplable_lights && scene.facts.triangle_count == 0);
    }

    // Kills: a binding that is exceeded in silence.
    #[test]
    fn a_table_too_large_is_refused_by_name() {
        let mut scene = triangle(Material::default());
        scene.vertices.resize(1 << 17, scene.vertices[0]);
        let error = packed(&scene).expect_err("two mebibytes of vertices");
        assert_eq!(error.to_string(), "triangles and vertices take 2097216 bytes, one binding holds 1048576");
    }
}
