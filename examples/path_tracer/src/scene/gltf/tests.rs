//! Whole files, made here: what only shows when all the modules of the reader work together.

mod compressed;
mod copies;
mod pictures;
mod poses;
mod properties;
mod trees;

use std::path::Path;

use glam::{Vec3, Vec4};

use super::super::LoadOptions;
use super::super::model::Scene;
use super::read;

fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |group: &[u8]| {
        let bits = group.iter().fold(0u32, |bits, &byte| bits << 8 | u32::from(byte)) << (8 * (3 - group.len()));
        (0..=group.len()).map(|digit| char::from(ALPHABET[(bits >> (18 - 6 * digit) & 63) as usize])).collect::<String>()
    };
    bytes.chunks(3).map(digits).collect()
}

/// A file whose only buffer holds `numbers`; every bufferView shows a number of bytes from an offset.
fn file(numbers: &[f32], views: &[(usize, usize)], rest: &str) -> Result<Scene, String> {
    file_with(numbers, views, rest, &LoadOptions::default())
}

fn file_with(numbers: &[f32], views: &[(usize, usize)], rest: &str, options: &LoadOptions) -> Result<Scene, String> {
    let view = |&(offset, length): &(usize, usize)| format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}}}"#);
    of_views(numbers, &views.iter().map(view).collect::<Vec<_>>(), rest, options)
}

/// The same with a stride for every bufferView.
fn strided(numbers: &[f32], views: &[(usize, usize, usize)], rest: &str) -> Result<Scene, String> {
    let view = |&(offset, length, stride): &(usize, usize, usize)| {
        format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length},"byteStride":{stride}}}"#)
    };
    of_views(numbers, &views.iter().map(view).collect::<Vec<_>>(), rest, &LoadOptions::default())
}

fn of_views(numbers: &[f32], views: &[String], rest: &str, options: &LoadOptions) -> Result<Scene, String> {
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    of_bytes(&bytes, views, rest, options)
}

fn of_bytes(bytes: &[u8], views: &[String], rest: &str, options: &LoadOptions) -> Result<Scene, String> {
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{},"uri":"data:;base64,{}"}}],"bufferViews":[{}],{rest}}}"#,
        bytes.len(),
        base64(bytes),
        views.join(",")
    );
    let mut scene = read(Path::new("a.gltf"), text.as_bytes(), options).map_err(|f| f.in_named("a.gltf").to_string())?;
    scene.check().map_err(|f| f.in_named("a.gltf").to_string())?;
    Ok(scene)
}

const QUAD: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];
const STRIP: &str = r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[{"mode":5,"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":4"#;

// Kills: an index of the vertex or the accessor that is off, and infinities that pass where NaN does not.
#[test]
fn a_bad_position_is_named() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut numbers = QUAD;
        numbers[7] = bad;
        let text = file(&numbers, &[(0, 48)], &format!("{STRIP}}}]")).unwrap_err();
        assert_eq!(text, "a.gltf: node 0, mesh 0, primitive 0, POSITION, accessor 0: vertex 2 is not finite");
    }
}

// Kills: shared vertices in a mesh without normals, and flat normals against the winding.
#[test]
fn missing_normals_are_flat() {
    let scene = file(&QUAD, &[(0, 48)], &format!("{STRIP}}}]")).unwrap();
    assert_eq!((scene.vertices.len(), scene.triangles.len()), (6, 2));
    assert!(scene.vertices.iter().all(|v| v.normal == Vec3::Z && v.tangent == Vec4::ZERO && v.color == Vec4::ONE));
}

// Kills: sparse values at the wrong element, and a sparse index that writes elsewhere.
#[test]
fn sparse_values_replace_elements() {
    let sparse = |index: u8| {
        // The index lies in the first byte of the first number; the new value follows.
        let mut numbers = vec![f32::from_bits(u32::from(index)), 5.0, 6.0, 7.0];
        numbers.extend(QUAD);
        let sparse = r#","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":2}}}]"#;
        file(&numbers, &[(16, 48), (0, 1), (4, 12)], &format!("{STRIP}{sparse}"))
    };
    let scene = sparse(3).unwrap();
    let moved = |p: Vec3| scene.vertices.iter().filter(|v| v.position == p).count();
    assert_eq!((moved(Vec3::new(5.0, 6.0, 7.0)), moved(Vec3::new(1.0, 1.0, 0.0))), (1, 0));
    assert!(sparse(4).unwrap_err().contains("index 4 is out of range"));
}

// Kills: a sparse list of indices that is refused or read without its replacements, and one without bytes of its own.
#[test]
fn sparse_indices_replace_elements() {
    // Three zeros become 0, 3, 2: the places 1 and 2 in bytes, then the new indices in 16 bits.
    let mut numbers = vec![f32::from_bits(0x0000_0201), f32::from_bits(0x0002_0003)];
    numbers.extend(QUAD);
    let rest = r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":2,"componentType":5126,"type":"VEC3","count":4},
            {"componentType":5123,"type":"SCALAR","count":3,
                "sparse":{"count":2,"indices":{"bufferView":0,"componentType":5121},"values":{"bufferView":1}}}]"#;
    let scene = file(&numbers, &[(0, 2), (4, 4), (8, 48)], rest).unwrap();
    let positions: Vec<Vec3> = scene.vertices.iter().map(|vertex| vertex.position).collect();
    assert_eq!(positions, [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
}

// Kills: MikkTSpace fed with v downwards, which turns every bump of a normal map into a dent.
#[test]
fn generated_bitangents_point_up_in_the_picture() {
    let mut numbers = QUAD.to_vec();
    // The picture stands upright on the quad: v is 1 at its lower edge.
    numbers.extend([0., 1., 1., 1., 0., 0., 1., 0.]);
    // The smallest PNG: one texel.
    let png: &[u8] = &{
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbaImage::new(1, 1).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    let rest = format!(
        r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"mode":5,"material":0,"attributes":{{"POSITION":0,"TEXCOORD_0":1}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":4}},
            {{"bufferView":1,"componentType":5126,"type":"VEC2","count":4}}],
        "materials":[{{"normalTexture":{{"index":0}}}}],"textures":[{{"source":0}}],"images":[{{"uri":"data:image/png;base64,{}"}}]"#,
        base64(png)
    );
    let scene = file(&numbers, &[(0, 48), (48, 32)], &rest).unwrap();
    for vertex in &scene.vertices {
        assert!(vertex.tangent.abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-6), "{}", vertex.tangent);
        let bitangent = vertex.normal.cross(vertex.tangent.truncate()) * vertex.tangent.w;
        assert!(bitangent.abs_diff_eq(Vec3::Y, 1e-6), "{bitangent}");
    }
}

// Kills: a budget that is asked after the vertices are there, or not at all: a small file that shows a mesh very often.
#[test]
fn instances_are_capped() {
    let mut rest = String::from(r#""meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"#);
    rest.push_str(r#""accessors":[{"componentType":5126,"type":"VEC3","count":131071}],"nodes":["#);
    rest.push_str(&vec![r#"{"mesh":0}"#; 300].join(","));
    rest.push(']');
    // Only the size is kept, because a failure would print a scene of gigabytes.
    let text = file(&[], &[], &rest).map(|scene| scene.vertices.len()).unwrap_err();
    assert!(text.contains("so many vertices is not supported"), "{text}");
}
