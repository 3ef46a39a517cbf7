//! What is written for Mitsuba, read as text.

use super::*;
use crate::scene::{self, Curve, LightKind, Weight};

fn exported(change: impl Fn(&mut Scene), materials: Materials) -> (String, Vec<String>, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.xml");
    let mut scene = scene::builtin("cornell-box").unwrap();
    change(&mut scene);
    let camera = scene.cameras[0].clone();
    let settings = Settings { depth: 7, ..Settings::new(32, 24, 4) };
    let notes = write(&path, &scene, &camera, &settings, materials).unwrap();
    (fs::read_to_string(&path).unwrap(), notes, folder)
}

// Kills: segments counted as bounces, a mesh that is named but not there or not complete, a lamp that does not shine, and an
// approximation that nobody hears of.
#[test]
fn a_scene_names_what_it_is_made_of() {
    let (xml, notes, folder) = exported(|_| {}, Materials::Standard);
    assert!(xml.contains("name=\"max_depth\" value=\"8\"") && xml.contains("name=\"width\" value=\"32\""));
    assert_eq!(xml.matches("<shape").count(), 4);
    assert_eq!(xml.matches("<emitter type=\"area\"><rgb name=\"radiance\" value=\"17, 12, 4\"/>").count(), 1);
    assert!(xml.contains("principled") && notes.len() == 4 && notes[0].contains("`green`"), "{notes:?}");
    let mut faces = 0;
    for mesh in 0..4 {
        let name = format!("box_parts/mesh_{mesh}.ply");
        assert!(xml.contains(&name));
        let bytes = fs::read(folder.path().join(&name)).unwrap();
        let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
        let head = String::from_utf8(bytes[..end].to_vec()).unwrap();
        let count = |element: &str| -> usize { head.lines().find_map(|line| line.strip_prefix(element)).unwrap().trim().parse().unwrap() };
        assert_eq!(bytes.len() - end, count("element vertex") * 32 + count("element face") * 13, "{name}");
        faces += count("element face");
    }
    assert_eq!(faces, scene::builtin("cornell-box").unwrap().triangles.len());
    let (xml, notes, _folder) = exported(|_| {}, Materials::Model);
    assert!(xml.contains("type=\"wavepool\"") && notes.is_empty(), "{notes:?}");
    let (xml, notes, folder) = exported(|scene| scene.materials[3].double_sided = true, Materials::Model);
    assert!(xml.matches("type=\"area\"").count() == 2 && folder.path().join("box_parts/back_3.ply").exists() && notes.len() == 1);
}

// Kills: Lambert written as something else, glass that reflects only, a thin sheet that refracts, a share of glass that is lost.
#[test]
fn surfaces_that_mitsuba_has_are_exact() {
    let all = |change: fn(&mut Material)| exported(move |scene| scene.materials.iter_mut().for_each(change), Materials::Standard);
    let (xml, notes, _folder) = all(|material| material.ior = 1.0);
    assert!(xml.matches("type=\"diffuse\"").count() == 4 && notes.is_empty(), "{notes:?}");
    let (xml, _, _folder) = all(|material| (material.transmission, material.solid) = (1.0, true));
    assert!(xml.matches("type=\"dielectric\"").count() == 4 && !xml.contains("twosided"));
    let (xml, _, _folder) = all(|material| (material.transmission, material.solid) = (1.0, false));
    assert_eq!(xml.matches("type=\"thindielectric\"").count(), 4);
    let (xml, _, _folder) = all(|material| material.transmission = 0.25);
    assert_eq!(xml.matches("<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.25\"/><bsdf type=\"twosided\">").count(), 4);
    let (xml, notes, _folder) = all(|material| material.alpha = AlphaMode::Mask { cutoff: 0.5 });
    assert!(xml.matches("type=\"mask\"").count() == 4 && notes.iter().any(|note| note.contains("cutoff")));
}

// Kills: shares of a tree that are those of its neighbours, leaves that swap places, light that is not absorbed where shares are missing, a
// curve that nobody hears of, two sides for glass.
#[test]
fn trees_are_blends_of_their_leaves() {
    let tree = |tree: MaterialTree| {
        let (xml, notes, _folder) = exported(
            |scene| {
                scene.materials.iter_mut().for_each(|material| material.ior = 1.0);
                scene.materials[0].tree = Some(tree.clone());
                scene.materials.push(Material { transmission: 1.0, name: "sheet".into(), ..Material::default() });
            },
            Materials::Standard,
        );
        let shape = xml.lines().find(|line| line.contains("mesh_0.ply")).unwrap().to_owned();
        (shape, notes)
    };
    let mix = |parts: &[(f32, u32)]| {
        MaterialTree::Mix(parts.iter().map(|(weight, leaf)| (Weight::constant(*weight), MaterialTree::Leaf(*leaf))).collect())
    };
    let (shape, notes) = tree(mix(&[(0.25, 1), (0.75, 2)]));
    let places =
        ["twosided", "blendbsdf", "\"weight\" value=\"0.75\"", "0.63, 0.065, 0.05", "0.14, 0.45, 0.091"].map(|part| shape.find(part));
    assert!(places.iter().all(Option::is_some) && places.is_sorted() && notes.is_empty(), "{shape} {notes:?}");
    let (shape, _) = tree(mix(&[(0.25, 1), (0.25, 2)]));
    let places = ["0.33333", "0, 0, 0", "0.63, 0.065, 0.05"].map(|part| shape.find(part));
    assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{shape}");
    let curve = Curve::Custom { normal: 0.5, grazing: 1.0, exponent: 5.0 };
    let layer = MaterialTree::layer(Weight::constant(0.5), curve, MaterialTree::Leaf(1), MaterialTree::Leaf(4));
    let (shape, notes) = tree(layer);
    assert!(shape.contains("value=\"0.75\"") && shape.contains("thindielectric"), "{shape}");
    assert!(shape.matches("twosided").count() == 1 && shape.find("blendbsdf") < shape.find("twosided"), "{shape}");
    assert!(notes.len() == 2 && notes[0].contains("normal incidence") && notes[1] == BLEND, "{notes:?}");
}

// Kills: lights and panoramas that stay at home, or turn up without what they approximate.
#[test]
fn lights_come_along() {
    let (xml, notes, folder) = exported(
        |scene| {
            for kind in [LightKind::Point, LightKind::Directional, LightKind::Spot { inner: 0.1, outer: 0.2 }] {
                let (position, intensity) = (Vec3::new(1.0, 2.0, 3.0), Vec3::splat(4.0));
                scene.lights.push(PunctualLight { kind, position, direction: -Vec3::Y, intensity, range: f32::INFINITY, profile: None });
            }
            scene.environment = Some(crate::scene::Environment::plain_sky());
        },
        Materials::Model,
    );
    for kind in ["point", "directional", "spot", "envmap"] {
        assert_eq!(xml.matches(&format!("<emitter type=\"{kind}\"")).count(), 1, "{kind}");
    }
    assert!(folder.path().join("box_parts/environment.exr").exists());
    assert_eq!(notes.len(), 2, "{notes:?}");
}

// Kills: a camera that looks backwards or mirrors: of Mitsuba's, +z is forwards and +x to the left.
#[test]
fn the_camera_looks_the_same_way() {
    let (xml, _, _folder) = exported(|_| {}, Materials::Model);
    let row = xml.lines().find(|line| line.contains("to_world")).unwrap();
    let numbers: Vec<f32> =
        row.split('"').find(|part| part.split(' ').count() == 16).unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
    let camera = scene::builtin("cornell-box").unwrap().cameras[0].world_from_camera;
    let column = |index: usize| Vec3::new(numbers[index], numbers[4 + index], numbers[8 + index]);
    assert!((column(2) + camera.z_axis.truncate()).length() < 1e-6 && (column(0) + camera.x_axis.truncate()).length() < 1e-6);
    assert!((column(3) - camera.w_axis.truncate()).length() < 1e-6);
}
