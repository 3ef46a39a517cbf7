//! Copies of a mesh, variants of its materials, and extensions that are kept without being shown.

use glam::{Vec3, Vec4};

use super::super::super::LoadOptions;
use super::super::super::model::Scene;
use super::{QUAD, file, file_with};

// Kills: instances that replace the node's own transform, a scale after the rotation, and a mesh that is shown once more without one.
#[test]
fn instances_stand_relative_to_their_node() {
    let mut numbers = QUAD.to_vec();
    numbers.extend([0., 0., 0., 10., 0., 0.]);
    // The second copy is turned by a quarter turn around Z.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    numbers.extend([0., 0., 0., 1., 0., 0., half, half]);
    numbers.extend([1., 1., 1., 3., 1., 1.]);
    let rest = |count: usize| {
        format!(
            r#""nodes":[{{"mesh":0,"translation":[0,0,7],"extensions":{{"EXT_mesh_gpu_instancing":
                {{"attributes":{{"TRANSLATION":1,"ROTATION":2,"SCALE":3,"_ID":1}}}}}}}}],
            "meshes":[{{"primitives":[{{"mode":5,"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":4}},
                {{"bufferView":1,"componentType":5126,"type":"VEC3","count":2}},
                {{"bufferView":2,"componentType":5126,"type":"VEC4","count":{count}}},
                {{"bufferView":3,"componentType":5126,"type":"VEC3","count":2}}]"#
        )
    };
    let views = [(0, 48), (48, 24), (72, 32), (104, 24)];
    let scene = file(&numbers, &views, &rest(2)).unwrap();
    assert_eq!(scene.triangles.len(), 4);
    for expected in [Vec3::new(1.0, 0.0, 7.0), Vec3::new(10.0, 3.0, 7.0), Vec3::new(9.0, 0.0, 7.0)] {
        assert!(scene.vertices.iter().any(|vertex| vertex.position.abs_diff_eq(expected, 1e-5)), "{expected}");
    }
    assert_eq!(scene.warnings, ["node 0: the attribute _ID of its instances is left out"]);
    let text = file(&numbers, &views, &rest(1)).unwrap_err();
    assert!(text.contains("TRANSLATION, accessor 1: 2 elements, not 1"), "{text}");
}

// Kills: instances of a small file that are made before their number is compared with the caps.
#[test]
fn implied_instances_are_capped() {
    let instanced = r#"{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":1}}}}"#;
    let rest = format!(
        r#""nodes":[{}],"meshes":[{{"primitives":[{{"mode":5,"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":4}},
            {{"componentType":5126,"type":"VEC3","count":1000000}}]"#,
        [instanced; 40].join(",")
    );
    let text = file(&QUAD, &[(0, 48)], &rest).map(|scene| scene.vertices.len()).unwrap_err();
    assert!(text.contains("is not supported"), "{text}");
}

fn varied(variant: Option<&str>) -> Result<Scene, String> {
    let rest = r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[{"mode":5,"attributes":{"POSITION":0},"material":0,
            "extensions":{"KHR_materials_variants":{"mappings":[{"material":1,"variants":[1]},{"material":2,"variants":[2,0]}]}}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":4}],
        "materials":[{"name":"plain"},{"name":"red"},{"name":"blue"}],
        "extensionsUsed":["KHR_materials_variants"],
        "extensions":{"KHR_materials_variants":{"variants":[{"name":"night"},{"name":"day"},{"name":"dusk"},{"name":"unused"}]}}"#;
    file_with(&QUAD, &[(0, 48)], rest, &LoadOptions { variant: variant.map(String::from), ..LoadOptions::default() })
}

// Kills: a variant taken for a material, one that hides what does not mention it, and an unknown name that shows the default.
#[test]
fn variants_are_chosen_by_name() {
    let name = |variant: Option<&str>| varied(variant).map(|scene| scene.materials[0].name.clone());
    assert_eq!(name(None).as_deref(), Ok("plain"));
    assert_eq!(name(Some("day")).as_deref(), Ok("red"));
    assert_eq!(name(Some("night")).as_deref(), Ok("blue"));
    assert_eq!(name(Some("unused")).as_deref(), Ok("plain"));
    let text = name(Some("noon")).unwrap_err();
    assert_eq!(text, "a.gltf: KHR_materials_variants: there is no variant 'noon', there are 'night', 'day', 'dusk', 'unused'");
    let warnings = varied(None).unwrap().warnings;
    assert_eq!(warnings, ["the default materials are shown; there are the variants 'night', 'day', 'dusk', 'unused'"]);
    assert!(varied(Some("day")).unwrap().warnings.is_empty());
}

// Kills: one warning for each material or extension, and one for records that change nothing.
#[test]
fn kept_extensions_are_told_in_one_line() {
    let material = |coat: f32| {
        let (coat, dispersion) = (format!(r#"{{"clearcoatFactor":{coat}}}"#), format!(r#"{{"dispersion":{coat}}}"#));
        format!(r#"{{"extensions":{{"KHR_materials_clearcoat":{coat},"KHR_materials_dispersion":{dispersion}}}}}"#)
    };
    let read = |coat: f32| {
        let primitive = |material: usize| format!(r#"{{"mode":5,"attributes":{{"POSITION":0}},"material":{material}}}"#);
        let rest = format!(
            r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{},{}]}}],"materials":[{},{}],
            "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":4}}],
            "extensionsUsed":["KHR_materials_clearcoat","KHR_materials_dispersion"]"#,
            primitive(0),
            primitive(1),
            material(coat),
            material(coat)
        );
        file(&QUAD, &[(0, 48)], &rest).unwrap().warnings
    };
    assert_eq!(read(0.5), ["these material extensions are read but not shown: KHR_materials_clearcoat, KHR_materials_dispersion"]);
    assert!(read(0.0).is_empty());
}

// Kills: vertex colours and both sets of texture coordinates read at the wrong width or in each other's place.
#[test]
fn quantized_attributes_are_widened() {
    let word = |a: u16, b: u16| f32::from_bits(u32::from(a) | u32::from(b) << 16);
    let bytes = |x: [u8; 4]| f32::from_bits(u32::from_le_bytes(x));
    // Positions in 16-bit integers with a stride of 8, texture coordinates in normalized bytes, colours in normalized bytes.
    let mut numbers = Vec::new();
    for (x, y) in [(0, 0), (100, 0), (0, 100), (100, 100)] {
        numbers.extend([word(x, y), word(7, 0)]);
    }
    numbers.extend([bytes([255, 51, 0, 0]); 4]);
    numbers.extend([bytes([102, 0, 0, 0]); 4]);
    numbers.extend([bytes([255, 0, 51, 255]); 4]);
    let rest = r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[{"mode":5,
            "attributes":{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":2,"COLOR_0":3}}]}],
        "extensionsRequired":["KHR_mesh_quantization"],
        "accessors":[{"bufferView":0,"componentType":5123,"type":"VEC3","count":4},
            {"bufferView":1,"componentType":5121,"normalized":true,"type":"VEC2","count":4},
            {"bufferView":2,"componentType":5121,"normalized":true,"type":"VEC2","count":4},
            {"bufferView":3,"componentType":5121,"normalized":true,"type":"VEC4","count":4}]"#;
    // The strides are the sizes of the views divided by four vertices.
    let scene = super::strided(&numbers, &[(0, 32, 8), (32, 16, 4), (48, 16, 4), (64, 16, 4)], rest).unwrap();
    assert!(scene.vertices.iter().any(|vertex| vertex.position == Vec3::new(100.0, 100.0, 7.0)));
    for vertex in &scene.vertices {
        assert!(vertex.uv[0].abs_diff_eq(glam::Vec2::new(1.0, 0.2), 1e-6) && vertex.uv[1].abs_diff_eq(glam::Vec2::new(0.4, 0.0), 1e-6));
        assert!(vertex.color.abs_diff_eq(Vec4::new(1.0, 0.0, 0.2, 1.0), 1e-6), "{}", vertex.color);
    }
}
