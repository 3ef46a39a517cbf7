//! Whole files, made here, in all three encodings.

use std::path::Path;

use glam::{Vec2, Vec3, Vec4};

use super::super::model::Scene;
use super::read;

/// A square in the plane z = 0 out of one polygon, with everything that a vertex can have.
const TEXT: &str = "ply\nformat ascii 1.0\ncomment one square\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n\
    property short nx\nproperty short ny\nproperty short nz\nproperty float s\nproperty float t\nproperty uchar red\nproperty uchar green\n\
    property uchar blue\nproperty uchar alpha\nproperty int quality\nelement rope 1\nproperty list uchar float knots\nproperty int age\n\
    element face 1\nproperty uchar flags\nproperty list ushort uint vertex_indices\nend_header\n\
    0 0 0 0 0 1 0 0 255 0 0 255 7\n1 0 0 0 0 1 1 0 0 255 0 255 7\n1 1 0 0 0 1 1 1 255 255 255 51 7\n0 1 0 0 0 1 0 1 188 0 0 255 7\n\
    2 0.5 0.25 9\n3 4 0 1 2 3\n";

/// The same file in binary.
fn binary(big: bool) -> Vec<u8> {
    let (header, body) = TEXT.split_once("end_header\n").unwrap();
    let name = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = format!("{}end_header\n", header.replace("ascii", name)).into_bytes();
    let mut lines = body.lines();
    let sizes = "ffdhhhffBBBBi";
    let mut put = |kind: char, word: &str| {
        let mut number = match kind {
            'f' => word.parse::<f32>().unwrap().to_le_bytes().to_vec(),
            'd' => word.parse::<f64>().unwrap().to_le_bytes().to_vec(),
            'h' => word.parse::<i16>().unwrap().to_le_bytes().to_vec(),
            'i' => word.parse::<i32>().unwrap().to_le_bytes().to_vec(),
            _ => word.parse::<u8>().unwrap().to_le_bytes().to_vec(),
        };
        if big {
            number.reverse();
        }
        bytes.extend(number);
    };
    for line in lines.by_ref().take(4) {
        line.split(' ').zip(sizes.chars()).for_each(|(word, kind)| put(kind, word));
    }
    for (line, sizes) in lines.zip(["Bffi", "Bhiiii"]) {
        line.split(' ').zip(sizes.chars()).for_each(|(word, kind)| put(kind, word));
    }
    bytes
}

fn load(bytes: &[u8]) -> Result<Scene, String> {
    let text = |f: crate::error::Fault| f.in_named("a.ply").to_string();
    let mut scene = read(Path::new("a.ply"), bytes).map_err(text)?;
    scene.check().map_err(text)?;
    Ok(scene)
}

fn refused(from: &str, to: &str) -> String {
    assert!(TEXT.contains(from), "{from}");
    load(TEXT.replacen(from, to, 1).as_bytes()).map(|scene| scene.vertices.len()).unwrap_err()
}

// Kills: bytes in the wrong order, a skipped property that shifts the next, t that grows downwards, colours that stay encoded, and
// the scale of bytes applied to alpha only.
#[test]
fn all_encodings_say_the_same() {
    let scene = load(TEXT.as_bytes()).unwrap();
    assert_eq!(scene.triangles.iter().map(|t| t.vertices).collect::<Vec<_>>(), [[0, 1, 2], [0, 2, 3]]);
    let corner = scene.vertices[2];
    assert_eq!((corner.position, corner.normal, corner.uv), (Vec3::new(1.0, 1.0, 0.0), Vec3::Z, [Vec2::new(1.0, 0.0); 2]));
    assert!(corner.color.abs_diff_eq(Vec4::new(1.0, 1.0, 1.0, 0.2), 1e-6), "{}", corner.color);
    assert!((scene.vertices[3].color.x - 0.5).abs() < 0.01, "{}", scene.vertices[3].color);
    for name in ["'quality' of 'vertex'", "'rope'", "'flags' of 'face'", "sRGB", "no materials"] {
        assert_eq!(scene.warnings.iter().filter(|line| line.contains(name)).count(), 1, "{name}: {:?}", scene.warnings);
    }
    for big in [false, true] {
        let other = load(&binary(big)).unwrap();
        assert_eq!((&other.vertices, &other.triangles), (&scene.vertices, &scene.triangles), "{big}");
    }
}

// Kills: a body that starts one byte late when its first byte looks like a line break, and lines that end with CR or CR LF.
#[test]
fn line_ends_of_all_kinds() {
    let scene = load(TEXT.as_bytes()).unwrap();
    for end in ["\r\n", "\r"] {
        assert_eq!(load(TEXT.replace('\n', end).as_bytes()).unwrap().vertices, scene.vertices, "{end:?}");
    }
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty char x\nproperty char y\nproperty char z\n".to_vec();
    bytes.extend(b"element face 1\nproperty list char char vertex_index\nend_header\n\n\0\0\x0B\0\0\x0A\x01\0\x03\0\x01\x02");
    assert_eq!(load(&bytes).unwrap().vertices[0].position, Vec3::new(10.0, 0.0, 0.0));
}

// Kills: flat normals where faces share vertices, normals that are not of unit length, and a vertex without a face that gets NaN.
#[test]
fn missing_normals_are_smooth() {
    let text = "ply\nformat ascii 1.0\nelement face 2\nproperty list int int vertex_indices\nelement vertex 5\nproperty float x\n\
        property float y\nproperty float z\nend_header\n3 0 1 2\n3 0 3 1\n0 0 0\n0 1 0\n-1 0 0\n0 0 -1\n9 9 9\n";
    let scene = load(text.as_bytes()).unwrap();
    let between = Vec3::new(1.0, 0.0, 1.0).normalize();
    assert!(scene.vertices[0].normal.abs_diff_eq(between, 1e-6), "{}", scene.vertices[0].normal);
    assert!(scene.vertices[2].normal.abs_diff_eq(Vec3::Z, 1e-6), "{}", scene.vertices[2].normal);
    assert_eq!(scene.vertices[4].normal, Vec3::ZERO);
}

// Kills: memory or time for what the header promises, an index or a length that is trusted, and messages that do not say where.
#[test]
fn promises_are_compared_with_the_file() {
    for (from, to, words) in [
        ("vertex 4", "vertex 33554432", "element vertex: 33554432 of them do not fit into the"),
        ("vertex 4", "vertex 4000000000", "4000000000 vertices (at most 33554432) is not supported"),
        ("vertex 4", "vertex -4", "line 4: the count '-4' of the element 'vertex' is no number"),
        ("face 1", "face 18446744073709551615", "element face: 18446744073709551615 of them"),
        ("3 4 0 1 2 3", "3 4 0 1 2 4", "line 30, element face 0, vertex_indices: vertex 4 does not exist, there are 4"),
        ("3 4 0 1 2 3", "3 4 0 1 2 -1", "vertex -1 does not exist"),
        ("3 4 0 1 2 3", "3 9 0 1 2 3", "the line ends before it"),
        ("3 4 0 1 2 3", "3 -4 0 1 2 3", "the length -4 of the list is negative"),
        ("3 4 0 1 2 3", "3 1e300 0 1 2 3", "the line ends before it"),
        ("1 0 0 0 0 1", "1 x 0 0 0 1", "line 26, element vertex 1, y: 'x' is no number"),
        ("1 0 0 0 0 1", "1 nan 0 0 0 1", "element vertex 1: the position NaN is not finite"),
        ("1 0 0 0 0 1", "1 1e300 0 0 0 1", "is not finite"),
        ("float y", "float yy", "the element 'vertex' has no property 'y'"),
        ("float y", "quad y", "line 6: the type 'quad' is unknown"),
        ("float y", "float x", "the property 'x' of 'vertex' is declared twice"),
        ("ushort uint", "float uint", "the length of the list 'vertex_indices' is no integer"),
        ("vertex_indices", "vertices", "the element 'face' has no list 'vertex_indices'"),
        ("ascii", "utf8", "line 2: the format 'utf8' is unknown"),
        ("format ascii 1.0\n", "", "there is no line 'format'"),
        ("end_header", "end", "there is no line 'end_header'"),
        ("ply", "plx", "the file does not start with the line 'ply'"),
    ] {
        let text = refused(from, to);
        assert!(text.starts_with("a.ply: ") && text.contains(words), "{from} -> {to}: {text}");
    }
}

// Kills: elements without a size that are walked one by one for ever, and a file cut anywhere that is read beyond its end.
#[test]
fn cut_files_and_empty_elements_end() {
    let endless =
        TEXT.replacen("element rope 1\nproperty list uchar float knots\nproperty int age\n", "element rope 18446744073709551615\n", 1);
    assert!(load(endless.replacen("2 0.5 0.25 9\n", "", 1).as_bytes()).is_ok());
    for whole in [binary(false), binary(true), TEXT.trim_end().as_bytes().to_vec()] {
        for length in 0..whole.len() {
            assert!(load(&whole[..length]).is_err(), "{length}");
        }
    }
}

// Kills: a cloud of points that is refused, or shown without a word.
#[test]
fn points_are_told() {
    let scene =
        load(b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3").unwrap();
    assert_eq!((scene.vertices.len(), scene.triangles.len()), (0, 0));
    assert!(scene.warnings.iter().any(|line| line.contains("cloud of points")), "{:?}", scene.warnings);
}
