//! What a scene and a request call for, and nothing else.

use super::*;
use crate::scene::{AlphaMode, Environment, LightKind, Material, PunctualLight, Triangle, Vertex};
use glam::{Vec3, Vec4};
use wavepool::policy::RouletteScope;

fn lit_triangle(material: Material) -> Scene {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let light = PunctualLight {
        kind: LightKind::Point,
        position: Vec3::Z,
        direction: Vec3::ZERO,
        intensity: Vec3::ONE,
        range: f32::INFINITY,
        profile: None,
    };
    Scene {
        vertices: corners.map(|position| Vertex { position, normal: Vec3::Z, color: Vec4::ONE, ..Vertex::default() }).to_vec(),
        triangles: vec![Triangle { vertices: [0, 1, 2], material: 0 }],
        materials: vec![material],
        lights: vec![light],
        ..Scene::default()
    }
}

/// Members of the state and the text of all stages.
fn program_of_scene(scene: &Scene) -> (Vec<String>, String) {
    let program = Renderer::program(scene).unwrap_or_else(|error| panic!("{error}"));
    let layout = program.layout(Some(RouletteScope::Lane));
    let mut members: Vec<String> = layout.leaves.iter().map(|leaf| leaf.path.split('.').nth(1).unwrap_or_default().to_owned()).collect();
    members.dedup();
    let [(_, stages), ..] = program.wgsl(&ImageTiles { width: 16, height: 16 }, &Schedule::block()).expect("valid");
    (members, stages)
}

/// The builtin scenes, and one that calls for next to nothing.
fn scenes() -> Vec<Scene> {
    let built_in = crate::scene::BUILTIN.iter().map(|(name, _)| crate::scene::builtin(name).expect("it is in the list"));
    built_in.chain([lit_triangle(Material { ior: 1.0, ..Material::default() }), Scene::default()]).collect()
}

// Kills: a word of code, a leaf of the state or of the film, a row of a table, for layers or an alpha that nobody has asked for. The
// program is compared with one whose modules have lost every line that speaks of them and which knows of no such feature.
#[test]
fn without_a_request_there_are_no_layers_and_no_alpha() {
    let speaks_of_layers = |text: &str| ["layer_", "delta_surfaces", "transparent"].iter().any(|word| text.contains(word));
    for scene in scenes() {
        let packed = pack(&scene, &Settings::default(), &SceneForm::PLAIN).expect("packs");
        let program = Renderer::program_of(&packed).unwrap_or_else(|error| panic!("{error}"));
        let mut modules = packed.program_modules();
        let before = modules.len();
        modules.retain(|module| !module.path.contains("layer") && module.path != "path_tracer::delta_bsdf");
        assert_eq!(before - modules.len(), 6);
        for module in &mut modules {
            let mut lines: Vec<&str> = module.text.lines().collect();
            lines.retain(|line| !(line.contains("@if") && speaks_of_layers(line)));
            let is_left = |line: &&str| line.split("//").next().is_some_and(speaks_of_layers);
            assert_eq!(lines.iter().copied().find(is_left), None, "{}: without a condition", module.file);
            module.text = lines.join("\n").into();
        }
        let mut features = packed.features();
        features.retain(|(name, _)| !speaks_of_layers(name));
        let bare = program_from(&packed, modules, &features).unwrap_or_else(|error| panic!("{error}"));

        let (scope, image) = (Some(RouletteScope::Lane), ImageTiles { width: 16, height: 16 });
        assert_eq!(program.layout(scope).table(), bare.layout(scope).table(), "{}", scene.name);
        for schedule in [Schedule::block(), Schedule::megakernel()] {
            let texts = |program: &Program| {
                let parts = program.wgsl(&image, &schedule).unwrap_or_else(|error| panic!("{error}"));
                parts.map(|(_, text)| text.split_whitespace().collect::<Vec<_>>().join(" "))
            };
            assert!(texts(&program) == texts(&bare), "{}: {schedule}", scene.name);
            assert!(!texts(&program)[0].contains("fn gather_layers"), "{}", scene.name);
        }
        // Nor do the buffers hold anything for them.
        let numbered = pack(&scene, &Settings { first_sample: 9, ..Settings::default() }, &SceneForm::PLAIN).expect("packs");
        assert_eq!(numbered, packed, "{}", scene.name);
    }
}

// Kills: a combination of layers and effects that does not compile, a layer with the state of another, state for the variance.
#[test]
fn every_request_gets_its_own_leaves() {
    let components = [3, 3, 1, 3, 1, 1, 0];
    let names = ["layer_albedo", "layer_normal", "layer_depth", "layer_position", "layer_object", "layer_material"];
    for scene in scenes() {
        let plain = Renderer::program(&scene).unwrap_or_else(|error| panic!("{error}"));
        let leaves_of = |program: &Program| program.layout(Some(RouletteScope::Lane)).leaves.len();
        let follows = pack(&scene, &Settings::default(), &SceneForm::PLAIN).expect("packs").facts.effects.delta_surfaces;
        for set in 1..128_u32 {
            // All of them for one scene, single ones and all together for the others.
            if !(scene.name == "cornell-box" || set.is_power_of_two() || set == 127) {
                continue;
            }
            let chosen: Vec<&str> = (0..7).filter(|bit| set >> bit & 1 == 1).map(|bit| LayerRequest::NAMES[bit]).collect();
            let request: LayerRequest = chosen.join(",").parse().expect("layers");
            let settings = Settings { layers: request, ..Settings::default() };
            let program = Renderer::program_with(&scene, &settings).unwrap_or_else(|error| panic!("{request}: {error}"));
            assert_eq!(program.stages().any(|stage| stage == LAYER_STAGE), request.needs_stage(), "{request}");
            let layout = program.layout(Some(RouletteScope::Lane));
            let expected: usize = (0..7).filter(|bit| set >> bit & 1 == 1).map(|bit| components[bit]).sum();
            let hits = usize::from(request.depth || request.position);
            let settled = usize::from(follows && (request.albedo || request.normal));
            assert_eq!(leaves_of(&program) - leaves_of(&plain), expected + hits + settled, "{}: {request}", scene.name);
            for (bit, name) in names.iter().enumerate() {
                let is_there = layout.leaves.iter().any(|leaf| leaf.path.split('.').nth(1) == Some(name));
                assert_eq!(is_there, set >> bit & 1 == 1, "{request}: {name}");
            }
        }
    }
}

// Kills: state, a stage or a table for an alpha, which needs none; a combination with layers or effects that does not compile.
#[test]
fn an_alpha_takes_a_leaf_of_the_film_and_nothing_else() {
    for scene in scenes() {
        for layers in [LayerRequest::NONE, LayerRequest::ALL] {
            let [opaque, transparent] = [false, true].map(|transparent| {
                let settings = Settings { layers, transparent, ..Settings::default() };
                let packed = pack(&scene, &settings, &SceneForm::PLAIN).expect("packs");
                let program = Renderer::program_of(&packed).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
                let parts = [packed.view, packed.bvh, packed.triangles, packed.tables, packed.texels];
                (program, parts)
            });
            let stages = |program: &Program| program.stages().map(str::to_owned).collect::<Vec<_>>();
            assert_eq!(stages(&transparent.0), stages(&opaque.0), "{}", scene.name);
            let leaves = |program: &Program| {
                let layout = program.layout(Some(RouletteScope::Lane));
                layout.leaves.iter().map(|leaf| leaf.path.clone()).collect::<Vec<_>>()
            };
            assert_eq!(leaves(&transparent.0), leaves(&opaque.0), "{}", scene.name);
            assert!(transparent.1 == opaque.1, "{}", scene.name);
        }
    }
}

// Kills: an effect with state or code in a scene that does not call for it, or without them in one that does.
#[test]
fn a_scene_gets_the_state_and_the_code_it_calls_for() {
    let parts = |members: &[&'static str], code: &[&'static str]| (members.to_vec(), code.to_vec());
    // An index of 1 is a surface without a coat.
    let matte = Material { ior: 1.0, ..Material::default() };
    let plain = lit_triangle(matte.clone());
    let dark = Scene { lights: Vec::new(), ..plain.clone() };
    let glass = lit_triangle(Material { transmission: 0.5, ..matte.clone() });
    let amber = Material { solid: true, attenuation_color: Vec3::splat(0.5), attenuation_distance: 1.0, ..glass.materials[0].clone() };
    let amber = lit_triangle(amber);
    let veil = lit_triangle(Material { alpha: AlphaMode::Blend, ..matte.clone() });
    let metal = lit_triangle(Material { metallic: 1.0, ..matte.clone() });
    let glow = lit_triangle(Material { emissive: Vec3::ONE, ..matte });
    let sky = Environment { name: "grey".into(), width: 2, height: 1, texels: vec![[0.5; 3]; 2] };
    let sky = Scene { environment: Some(sky), ..dark.clone() };
    let lit = ["bsdf_pdf", "shadow_origin", "shadow_vector", "shadow_radiance"];
    let cases = [
        ("dark", dark, parts(&[], &[])),
        ("plain", plain, parts(&lit, &["fn sample_punctual_light("])),
        ("glass", glass, parts(&[&lit[..], &["eta_scale"]].concat(), &["fn sample_punctual_light(", "fn sample_glass("])),
        ("amber", amber, parts(&[&lit[..], &["eta_scale"]].concat(), &["fn sample_punctual_light(", "fn sample_glass(", "fn absorb("])),
        ("veil", veil, parts(&lit, &["fn sample_punctual_light(", "fn is_present("])),
        ("metal", metal, parts(&lit, &["fn sample_punctual_light(", "fn sample_microfacets("])),
        ("glow", glow, parts(&lit, &["fn sample_punctual_light(", "fn sample_triangle_light("])),
        ("sky", sky, parts(&lit, &["fn environment_towards("])),
    ];
    let all_members = [&lit[..], &["eta_scale"]].concat();
    let all_code = [
        "fn sample_punctual_light(",
        "fn sample_triangle_light(",
        "fn environment_towards(",
        "fn sample_glass(",
        "fn absorb(",
        "fn sample_microfacets(",
        "fn is_present(",
        "fn sample_texture(",
    ];
    for (name, scene, (members, code)) in cases {
        let (found, text) = program_of_scene(&scene);
        for member in &all_members {
            assert_eq!(found.iter().any(|other| other == member), members.contains(member), "{name}: {member} of {found:?}");
        }
        for function in &all_code {
            assert_eq!(text.contains(function), code.contains(function), "{name}: {function}");
        }
    }
}
