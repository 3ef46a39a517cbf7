//! Trees of materials in whole files.

use super::super::super::model::Scene;
use super::{QUAD, file};
use crate::scene::{Curve, MaterialTree, Weight};

/// A quad of material 0 with these `extras`; materials `a`, `b` (with a normal map along the second set of coordinates) and `c`, which has a tree, follow.
fn read(extras: &str) -> Result<Scene, String> {
    let rest = format!(
        r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"mode":5,"attributes":{{"POSITION":0}},"material":0}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":4}}],
        "images":[{{"uri":"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg=="}}],
        "textures":[{{"source":0}}],"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"point","extras":{{"material_tree":"a"}}}}]}}}},
        "materials":[{{"name":"root"{extras}}},{{"name":"a","pbrMetallicRoughness":{{"roughnessFactor":0.25}}}},
            {{"name":"b","normalTexture":{{"index":0,"texCoord":1}}}},{{"name":"c","extras":{{"material_tree":"a"}}}}]"#
    );
    file(&QUAD, &[(0, 48)], &rest)
}

// Kills: a property of a light that nobody hears of, tangents along other coordinates in silence, a leaf that no mesh has and is not read, one that is read twice, a number taken for the scene's instead of the file's, a texture of a weight that
// stays behind, tangents that no leaf gets.
#[test]
fn leaves_come_from_the_file() {
    let scene = read(
        r#","extras":{"material_tree":{"over":2,"fresnel":1.5,"weight":0.5,"weight_texture":{"index":0},
            "under":{"mix":[{"of":"a","weight":0.25},{"of":"b","weight":0.5}]}}}"#,
    )
    .unwrap();
    let names: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["root", "b", "a"]);
    let Some(MaterialTree::Layer(layer)) = &scene.materials[0].tree else { panic!("{:?}", scene.materials[0].tree) };
    assert_eq!((layer.curve, layer.weight.factor, &layer.over), (Curve::Fresnel { ior: 1.5 }, 0.5, &MaterialTree::Leaf(1)));
    assert_eq!(layer.weight.texture.map(|texture| texture.image), Some(0));
    let parts = [(0.25, 2), (0.5, 1)].map(|(weight, leaf)| (Weight::constant(weight), MaterialTree::Leaf(leaf)));
    assert_eq!(layer.under, MaterialTree::Mix(parts.to_vec()));
    assert_eq!(scene.materials[2].roughness, 0.25);
    assert!(scene.vertices.iter().all(|vertex| vertex.tangent.truncate().length() > 0.5), "no tangents");
    let lost = "extras of light 0, material_tree: it belongs to a material, and is left out";
    assert_eq!(scene.warnings, [lost]);
    // The tree's own map follows the first set.
    let scene = read(r#","normalTexture":{"index":0},"extras":{"material_tree":{"over":"a","under":"b","weight":0.5}}"#).unwrap();
    let told = r#"material 0: the tangents of "b" follow texture coordinates 0, as others of the tree, and not 1"#;
    assert_eq!(scene.warnings, [told, lost]);
}

// Kills: circles of trees that are walked without end, names that are guessed, a place that is not named.
#[test]
fn what_is_no_leaf_is_told() {
    for (tree, expected) in [
        (r#""nobody""#, r#"material_tree: there is no material "nobody" in the file"#),
        ("9", "material_tree: there is no material 9 in the file"),
        ("true", "material_tree: there is no material true in the file"),
        (r#""root""#, r#"material_tree: "root" has a tree of its own: write that one out in its place"#),
        (r#""c""#, r#"material_tree: "c" has a tree of its own: write that one out in its place"#),
        (r#"{"over":"a"}"#, "material_tree: a node is the name of a material"),
    ] {
        let told = read(&format!(r#","extras":{{"material_tree":{tree}}}"#)).map(drop).unwrap_err();
        assert!(told.contains("material 0") && told.contains(expected), "{told}");
    }
}
