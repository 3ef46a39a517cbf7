//! Every kernel that the repository can make, as text: all programs under every kind of schedule.
//!
//! Key decision: a list and not files, so that a test counts what a second compiler will see; the program `dump_kernels` writes it down.

use std::{
    collections::HashSet,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
};

use glam::{Vec2, Vec3, Vec4};
use path_tracer::{
    LayerRequest, Renderer, Settings,
    gpu_scene::{GpuScene, PackOptions, exhaustive::EXHAUSTIVE_TRIANGLES},
    scene::{
        AlphaMode, BUILTIN, Curve, Environment, Image, LightKind, Material, MaterialTree, PunctualLight, Scene, TextureUse, Triangle,
        Vertex, Weight, Wrap, builtin, framing::frame,
    },
};
use wavepool::{
    ImageTiles, Instruments, LinearRange, Program, Schedule,
    policy::{Execution, Grain, RouletteScope, WorkSource},
};

use crate::programs;

/// One complete module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kernel {
    /// Program, schedule and part; a good name for a file.
    pub name: String,
    /// The WGSL as a device would see it.
    pub text: String,
}

/// How the kernels are scheduled: executions, orders and regeneration.
const SCHEDULES: [&str; 22] = [
    "never",
    "never-full",
    "block",
    "block,launch=full",
    "block,order=morton",
    "block,order=depth-max",
    "never,order=depth-mean",
    "block,order=depth-decayed",
    "block,order=error",
    "block,local=all",
    "never-full,local=all",
    "per-lane",
    "per-lane,local=all",
    "compaction,order=morton",
    "keyed",
    "megakernel",
    "megakernel,order=morton",
    "megakernel,pins=off",
    "megakernel-regen",
    "megakernel-regen,order=morton",
    "persistent",
    "persistent,order=morton",
];
const PLAIN: Instruments =
    Instruments { checked: false, assertions: false, steps: false, lengths: false, times: false, markers: false, look_after: 0 };
/// What is observed, under names for files, and whether unused leaves are poisoned.
const SETTINGS: [(&str, Instruments, bool); 3] =
    [("", PLAIN, false), ("", PLAIN, true), (",observed", Instruments { checked: true, lengths: true, ..PLAIN }, false)];
const ROULETTES: [&str; 5] = ["lane", "block-max", "block-mean", "group:32", "none"];

/// All of them, without repetition: programs share the kernels of the scheduler.
///
/// # Panics
/// When a program or a schedule is not sound.
pub fn all() -> Vec<Kernel> {
    let programs = all_programs();
    let next = AtomicUsize::new(0);
    // Linking is plain computation: every core takes the next program.
    let work = || std::iter::from_fn(|| programs.get(next.fetch_add(1, Relaxed))).map(|(name, program)| (name, of_program(name, program)));
    let mut made: Vec<(&String, Vec<Kernel>)> = std::thread::scope(|scope| {
        let n_threads = std::thread::available_parallelism().map_or(1, usize::from);
        let threads: Vec<_> = (0..n_threads).map(|_| scope.spawn(|| work().collect::<Vec<_>>())).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("every program links")).collect()
    });
    made.sort_by_key(|(name, _)| programs.iter().position(|(other, _)| other == *name));
    let mut seen = HashSet::new();
    made.into_iter().flat_map(|(_, kernels)| kernels).filter(|kernel| seen.insert(kernel.text.clone())).collect()
}

fn of_program(program_name: &str, program: &Program) -> Vec<Kernel> {
    let mut kernels = Vec::new();
    let mut seen = HashSet::new();
    for schedule in SCHEDULES.iter().flat_map(|schedule| ROULETTES.map(|roulette| format!("{schedule},roulette={roulette}"))) {
        for (observed, instruments, poison) in SETTINGS {
            let mut parsed: Schedule = schedule.parse().unwrap_or_else(|error| panic!("{schedule}: {error}"));
            if is_refused(program, &parsed) {
                continue;
            }
            parsed.poison = poison.then_some(0x7fc0_0000);
            let sources: [(&str, &dyn WorkSource); 2] =
                [("image", &ImageTiles { width: 40, height: 56 }), ("range", &LinearRange { count: 1000 })];
            for (source_name, source) in sources {
                let poisoned = if poison { ",poison" } else { "" };
                let name = format!("{program_name},{source_name},{schedule}{poisoned}{observed}");
                let parts = program.wgsl_with(source, &parsed, &instruments).unwrap_or_else(|error| panic!("{name}: {error}"));
                for (part, text) in parts {
                    let name =
                        format!("{name},{part}").replace("order=", "").replace("roulette=", "roulette-").replace(['=', ',', ':'], "_");
                    if seen.insert(text.clone()) {
                        kernels.push(Kernel { name, text });
                    }
                }
            }
        }
    }
    kernels
}

/// What `link` refuses with a reason: lanes that part ways and share a draw, and keys of a program that has none or one stage alone.
fn is_refused(program: &Program, schedule: &Schedule) -> bool {
    let grain = schedule.regeneration.grain();
    let scope = schedule.roulette.as_ref().map(|roulette| roulette.scope()).filter(|_| program.has_roulette());
    let by_block = matches!(scope, Some(RouletteScope::Block(_)));
    let is_keyed = grain == Grain::KeyedLanes;
    let parts_ways = schedule.execution == Execution::MegakernelRegen && scope.is_some_and(RouletteScope::is_shared);
    parts_ways
        || (grain.is_by_lane() && by_block)
        || (is_keyed && (scope.is_some_and(RouletteScope::is_shared) || !program.has_queue_key() || program.stages().count() < 2))
}

/// The examples and the programs of the tests, under names that are good in files.
fn all_programs() -> Vec<(String, Program)> {
    let small = programs::all().into_iter().map(|build| build()).map(|program| {
        let name = program.name().replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        (name, program)
    });
    let built_in = BUILTIN.iter().map(|(name, _)| ((*name).to_owned(), builtin(name).expect("it is in the list")));
    let made = [("everything", everything()), ("leaves", leaves()), ("nothing", Scene::default()), ("fine", fine())];
    let made = made.map(|(name, scene)| (name.to_owned(), scene));
    let scenes = built_in.chain(made);
    let path_tracers = scenes.map(|(name, scene)| {
        let program = Renderer::program(&scene).unwrap_or_else(|error| panic!("{name}: {error}"));
        (format!("path_tracer-{name}"), program)
    });
    let with = |layers, transparent| {
        let settings = Settings { layers, transparent, ..Settings::default() };
        Renderer::program_with(&everything(), &settings).unwrap_or_else(|error| panic!("{layers}, {transparent}: {error}"))
    };
    let exhaustive = {
        let scene = builtin("cornell-box").expect("it is in the list");
        let options = PackOptions { exhaustive_limit: EXHAUSTIVE_TRIANGLES, ..PackOptions::default() };
        let packed = GpuScene::pack(&scene, &frame(scene.bounds(), 1.0), &options).expect("it packs");
        assert!(packed.facts.exhaustive, "the box has become too large");
        Renderer::program_of(&packed).expect("it links")
    };
    let settings = Settings { layers: LayerRequest::ALL, transparent: true, ..Settings::default() };
    let leaves = Renderer::program_with(&leaves(), &settings).expect("it links");
    let requests = [
        ("layers", with(LayerRequest::ALL, false)),
        ("transparent", with(LayerRequest::NONE, true)),
        ("exhaustive", exhaustive),
        ("leaves-layers", leaves),
    ];
    small.chain(path_tracers).chain(requests.map(|(name, program)| (format!("path_tracer-{name}"), program))).collect()
}

/// Small triangles on a large one, too fine for nodes on a grid.
fn fine() -> Scene {
    let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
    for (at, size) in (0..64).map(|index| (Vec3::ONE * index as f32 * 1e-5, 1e-6)).chain([(Vec3::NEG_Z, 1.0)]) {
        let first = scene.vertices.len() as u32;
        let corner = |offset: Vec3| Vertex { position: at + offset * size, normal: Vec3::Z, color: Vec4::ONE, ..Vertex::default() };
        scene.vertices.extend([Vec3::ZERO, Vec3::X, Vec3::Y].map(corner));
        scene.triangles.push(Triangle { vertices: [first, first + 1, first + 2], material: 0 });
    }
    let packed = GpuScene::pack(&scene, &frame(scene.bounds(), 1.0), &PackOptions::default()).expect("it packs");
    assert!(!packed.facts.compact_nodes, "the grid is fine enough for it");
    scene
}

/// One triangle that calls for every effect.
pub fn everything() -> Scene {
    let texture = |image| {
        let wrap = [Wrap::Mirror, Wrap::Clamp];
        Some(TextureUse { image, uv_set: 1, wrap, linear: true, transform: [Vec3::X, Vec3::Y] })
    };
    let vertex = |position| Vertex {
        position,
        normal: Vec3::Z,
        tangent: Vec4::new(1.0, 0.0, 0.0, 1.0),
        uv: [Vec2::ZERO, Vec2::ONE],
        color: Vec4::new(0.5, 1.0, 1.0, 1.0),
    };
    let light = |kind| PunctualLight {
        kind,
        position: Vec3::splat(2.0),
        direction: Vec3::NEG_Z,
        intensity: Vec3::ONE,
        range: f32::INFINITY,
        profile: None,
    };
    Scene {
        name: "everything".into(),
        vertices: [Vec3::ZERO, Vec3::X, Vec3::Y].map(vertex).to_vec(),
        triangles: vec![Triangle { vertices: [0, 1, 2], material: 0 }],
        materials: vec![Material {
            base_color_texture: texture(0),
            metallic: 0.5,
            metallic_roughness_texture: texture(0),
            normal_texture: texture(0),
            emissive: Vec3::ONE,
            emissive_texture: texture(0),
            alpha: AlphaMode::Blend,
            transmission: 0.5,
            solid: true,
            attenuation_color: Vec3::splat(0.5),
            attenuation_distance: 1.0,
            ..Material::default()
        }],
        images: vec![Image { name: "grey".into(), width: 2, height: 2, texels: vec![[128; 4]; 4] }],
        lights: vec![light(LightKind::Point), light(LightKind::Spot { inner: 0.1, outer: 0.2 }), light(LightKind::Directional)],
        environment: Some(Environment { name: "grey".into(), width: 2, height: 1, texels: vec![[0.5; 3]; 2] }),
        ..Scene::default()
    }
}

/// Everything, as leaves of a tree.
fn leaves() -> Scene {
    let mut scene = everything();
    let leaf = scene.materials[0].clone();
    let weight = Weight { factor: 0.5, texture: leaf.base_color_texture };
    let curve = Curve::Custom { normal: 0.0, grazing: 1.0, exponent: 5.0 };
    let inner = MaterialTree::layer(weight, Curve::Fresnel { ior: 1.5 }, MaterialTree::Leaf(1), MaterialTree::Leaf(1));
    scene.materials[0].tree = Some(MaterialTree::layer(weight, curve, MaterialTree::Leaf(1), inner));
    scene.materials.push(leaf);
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: an effect, an execution or a kernel of the scheduler that no second compiler would ever see.
    #[test]
    fn nothing_is_left_out() {
        let kernels = all();
        let of = |program: &str| kernels.iter().filter(|kernel| kernel.name.starts_with(program)).collect::<Vec<_>>();
        let everything = of("path_tracer-everything");
        let nothing = of("path_tracer-nothing");
        for effect in [
            "sample_texture",
            "is_present",
            "sample_glass",
            "absorb",
            "sample_microfacets",
            "sample_environment",
            "sample_punctual_light",
            "sample_triangle_light",
            "walk_hierarchy",
        ] {
            assert!(everything.iter().any(|kernel| kernel.text.contains(&format!("fn {effect}("))), "{effect}");
            assert!(nothing.iter().all(|kernel| !kernel.text.contains(&format!("fn {effect}("))), "{effect}");
        }
        for part in ["fn lobes_at(", "fn lobe_share(", "fn sample_tree(", "fn shading_frame("] {
            assert!(of("path_tracer-leaves").iter().any(|kernel| kernel.text.contains(part)), "{part}");
            assert!(everything.iter().all(|kernel| !kernel.text.contains("fn lobe_share(")));
        }
        assert!(!of("collatz").is_empty() && !of("path_tracer-cornell-box").is_empty());
        for entry in [
            "wf_tick",
            "wf_advance",
            "wf_resolve",
            "wf_generate",
            "wf_stage_sample_light",
            "wf_stage_gather_layers",
            "wf_megakernel",
            "wf_persistent",
            "wf_megakernel_regen",
            "wf_audit_lanes",
            "wf_audit_results",
        ] {
            assert!(kernels.iter().any(|kernel| kernel.text.contains(&format!("fn {entry}("))), "{entry}");
        }
        for word in [
            "count_steps(1u)",
            "if (!holds)",
            "(holds: bool) { }",
            "wf_length;",
            "wf_sort_key(tile)",
            "wf_tiles_in_square(",
            "remembered * 3u",
            "{ return filled; }",
            "wf_inverse_survival(",
            "wf_group_inverse(",
            "0x7fc00000u",
        ] {
            assert!(kernels.iter().any(|kernel| kernel.text.contains(word)), "{word}");
        }
        let mut names: Vec<_> = kernels.iter().map(|kernel| &kernel.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), kernels.len(), "two kernels would go to one file");
        let odd: Vec<_> =
            names.iter().filter(|name| !name.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))).take(3).collect();
        assert!(odd.is_empty(), "no name for a file: {odd:?}");
    }
}
