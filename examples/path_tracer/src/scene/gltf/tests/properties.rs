//! Custom properties: files that lights and materials ask for.

use std::fs;

use super::super::super::model::Scene;
use super::super::read;
use super::{QUAD, base64};
use crate::scene::LoadOptions;

/// A mesh (node 2) with material 0 or none below node 1, which has lamp 0 beside it (node 3); lamp 1 (node 4) hangs below nothing. Each
/// text is the `extras` of a part.
#[derive(Clone, Copy, Default)]
struct Parts<'a> {
    scene: &'a str,
    parent: &'a str,
    node: &'a str,
    mesh: &'a str,
    material: &'a str,
    lamp_node: &'a str,
    lamp: &'a str,
}

impl Parts<'_> {
    fn read(self) -> Result<Scene, String> {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.ies", "b.ies", "c.ies", "a.png", "b.png", "c.png", "sub/d.ies"] {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, b"").unwrap();
        }
        let extras = |text: &str| if text.is_empty() { String::new() } else { format!(r#","extras":{text}"#) };
        let bytes: Vec<u8> = QUAD.iter().flat_map(|x| x.to_le_bytes()).collect();
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":48,"uri":"data:;base64,{}"}}],
            "bufferViews":[{{"buffer":0,"byteLength":48}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":4}}],
            "scene":0,"scenes":[{{"nodes":[1,4]{}}}],
            "nodes":[{{"extras":{{"ies":"nowhere.ies"}}}},{{"children":[2,3]{}}},{{"mesh":0{}}},
            {{"extensions":{{"KHR_lights_punctual":{{"light":0}}}}{}}},{{"extensions":{{"KHR_lights_punctual":{{"light":1}}}}}}],
            "meshes":[{{"primitives":[{{"mode":5,"attributes":{{"POSITION":0}},"material":0}},{{"mode":5,"attributes":{{"POSITION":0}}}}]{}}}],
            "materials":[{{"name":"m"{}}}],
            "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"point"{}}},{{"type":"spot"}}]}}}}}}"#,
            base64(&bytes),
            extras(self.scene),
            extras(self.parent),
            extras(self.node),
            extras(self.lamp_node),
            extras(self.mesh),
            extras(self.material),
            extras(self.lamp),
        );
        let path = folder.path().join("a.gltf");
        let mut scene = read(&path, text.as_bytes(), &LoadOptions::default()).map_err(|f| f.in_named("a.gltf").to_string())?;
        scene.check().map_err(|f| f.in_named("a.gltf").to_string())?;
        let paths = scene.profiles.iter().map(|profile| &profile.path);
        assert!(paths.chain(heights(&scene).into_iter().flatten().map(|map| &map.path)).all(|path| path.is_absolute()));
        Ok(scene)
    }
}

fn heights(scene: &Scene) -> Vec<Option<&crate::scene::HeightMap>> {
    scene.materials.iter().map(|material| material.extensions.height_map.as_ref()).collect()
}

/// The profile of each light by name.
fn profiles(scene: &Scene) -> [Option<&str>; 2] {
    let name = |light: usize| scene.lights[light].profile.map(|profile| scene.profiles[profile as usize].name.as_str());
    [name(0), name(1)]
}

fn height_names(scene: &Scene) -> Vec<Option<&str>> {
    heights(scene).into_iter().map(|map| map.map(|map| map.name.as_str())).collect()
}

// Kills: a property that is looked for in one place only, an outer one that wins over an inner one, one that reaches the neighbour, two
// lights with a record each of one file, a property of a node that the scene does not show.
#[test]
fn the_innermost_profile_wins() {
    let [a, b, c] = [r#"{"ies":"a.ies"}"#, r#"{"ies":"b.ies"}"#, r#"{"ies":"c.ies"}"#];
    let read = |parts: Parts<'_>| parts.read().unwrap();
    assert_eq!(profiles(&read(Parts::default())), [None, None]);
    let scene = read(Parts { lamp: a, ..Parts::default() });
    assert_eq!((profiles(&scene), scene.warnings.len()), ([Some("a.ies"), None], 1));
    assert_eq!(scene.warnings, ["IES profiles are read but not rendered yet"]);
    assert_eq!(profiles(&read(Parts { lamp_node: a, ..Parts::default() })), [Some("a.ies"), None]);
    assert_eq!(profiles(&read(Parts { parent: a, ..Parts::default() })), [Some("a.ies"), None]);
    let scene = read(Parts { scene: a, ..Parts::default() });
    assert_eq!((profiles(&scene), scene.profiles.len()), ([Some("a.ies"); 2], 1));
    assert_eq!(profiles(&read(Parts { scene: a, parent: b, ..Parts::default() })), [Some("b.ies"), Some("a.ies")]);
    assert_eq!(profiles(&read(Parts { parent: a, lamp_node: b, ..Parts::default() })), [Some("b.ies"), None]);
    assert_eq!(profiles(&read(Parts { parent: a, lamp_node: b, lamp: c, ..Parts::default() })), [Some("c.ies"), None]);
}

// Kills: the same for height maps; a map of one user of a material that reaches all of its users, a scale of another carrier.
#[test]
fn the_innermost_height_map_wins() {
    let [a, b, c] = [r#"{"height_map":"a.png","height_scale":0.5}"#, r#"{"height_map":"b.png"}"#, r#"{"height_map":"c.png"}"#];
    let read = |parts: Parts<'_>| parts.read().unwrap();
    let scene = read(Parts { material: a, ..Parts::default() });
    assert_eq!(height_names(&scene), [Some("a.png"), None]);
    assert_eq!(heights(&scene)[0].unwrap().scale, Some(0.5));
    assert_eq!(scene.warnings, ["height maps are read but not rendered yet"]);
    for parts in [Parts { mesh: a, ..Parts::default() }, Parts { node: a, ..Parts::default() }, Parts { parent: a, ..Parts::default() }] {
        assert_eq!(height_names(&read(parts)), [Some("a.png"); 2]);
    }
    let scene = read(Parts { scene: a, parent: b, mesh: c, material: r#"{"height_map":"b.png","height_scale":2}"#, ..Parts::default() });
    assert_eq!(height_names(&scene), [Some("b.png"), Some("c.png")]);
    assert_eq!(heights(&scene).into_iter().map(|map| map.unwrap().scale).collect::<Vec<_>>(), [Some(2.0), None]);
    let both = read(Parts { lamp: r#"{"ies":"a.ies"}"#, node: b, ..Parts::default() });
    assert_eq!(both.warnings, ["IES profiles and height maps are read but not rendered yet"]);
}

// Kills: properties of other programs taken for ours, a spelling of Blender or Windows that is refused, a path that leaves the folder.
#[test]
fn extras_of_others_are_left_alone_and_paths_are_looked_at() {
    for others in ["7", "null", "[1,2]", r#""text""#, r#"{"IES":3,"height":{"map":1}}"#, r#"{"ies":null,"height_map":null}"#] {
        let scene = Parts { scene: others, parent: others, mesh: others, material: others, lamp: others, ..Parts::default() }.read();
        assert_eq!(scene.unwrap().warnings, [""; 0], "{others}");
    }
    for spelling in [r#"sub/d.ies"#, r#"//sub/d.ies"#, r#"//sub\\d.ies"#, r#"./sub/../sub/d.ies"#] {
        let scene = Parts { lamp: &format!(r#"{{"ies":"{spelling}"}}"#), ..Parts::default() }.read().unwrap();
        assert!(scene.profiles[0].path.ends_with("sub/d.ies"), "{spelling}");
    }
    let told = |text: &str| Parts { lamp_node: &format!(r#"{{"ies":{text}}}"#), ..Parts::default() }.read().map(drop).unwrap_err();
    assert!(told(r#""gone.ies""#).starts_with("a.gltf: node 3, extras of node 3, ies 'gone.ies': No such file"));
    for outside in [r#""../a.ies""#, r#""/etc/hostname""#, r#""///etc/hostname""#, r#""sub/../../x""#] {
        assert!(told(outside).contains("leads out of the folder"), "{}", told(outside));
    }
    assert!(told(r#""""#).contains("not a file") && told(r#""sub""#).contains("not a file"));
    assert!(told("7").contains("ies 7: it should be the path of a file as text"));
    let told = |text: &str| Parts { material: text, ..Parts::default() }.read().map(drop).unwrap_err();
    assert!(
        told(r#"{"height_map":"a.png","height_scale":"big"}"#).contains("extras of material 0, height_scale: 'big' is no finite number")
    );
    assert!(told(r#"{"height_map":"a.png","height_scale":1e39}"#).contains("39 is no finite number"));
}

// Kills: a property that does nothing and is not told.
#[test]
fn properties_without_use_are_told() {
    let told = |parts: Parts<'_>| parts.read().unwrap().warnings.join("; ");
    let [ies, height] = [r#"{"ies":"a.ies"}"#, r#"{"height_map":"a.png"}"#];
    assert_eq!(told(Parts { node: ies, ..Parts::default() }), "extras of node 2, ies: no light takes it, and it is left out");
    assert_eq!(told(Parts { mesh: ies, ..Parts::default() }), "extras of mesh 0, ies: no light takes it, and it is left out");
    assert_eq!(told(Parts { material: ies, ..Parts::default() }), "extras of material 0, ies: it belongs to a light, and is left out");
    assert_eq!(
        told(Parts { lamp_node: height, ..Parts::default() }),
        "extras of node 3, height_map: no material takes it, and it is left out"
    );
    assert_eq!(
        told(Parts { lamp: height, ..Parts::default() }),
        "extras of light 0, height_map: it belongs to a material, and is left out"
    );
    let lone = told(Parts { material: r#"{"height_scale":2}"#, ..Parts::default() });
    assert_eq!(lone, "extras of material 0, height_scale: there is no height_map beside it, and it is left out");
}
