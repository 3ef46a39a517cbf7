//! The commonest mistakes, one in each file, and the words by which its author finds it: the file, the thing, its value, the limit.

use std::fs;

use path_tracer::scene;

use super::samples::{self, with};

/// What is wrong, the file, and the words of the message behind the file's name.
type Mistake = (&'static str, &'static str, Vec<u8>, &'static [&'static str]);

fn gltf(from: &str, to: &str) -> Vec<u8> {
    with(samples::gltf(&samples::png()), from, to)
}

fn glb_with(at: usize, byte: u8) -> Vec<u8> {
    let mut bytes = samples::glb(&samples::png());
    bytes[at] = byte;
    bytes
}

fn obj(from: &str, to: &str) -> Vec<u8> {
    with(samples::OBJ.into(), from, to)
}

fn ply(from: &str, to: &str) -> Vec<u8> {
    with(samples::ply(0), from, to)
}

fn hdr(from: &str, to: &str) -> Vec<u8> {
    with(samples::hdr(2), from, to)
}

fn of_scenes() -> Vec<Mistake> {
    vec![
        ("the text is cut", "a.gltf", samples::gltf(&samples::png())[..600].to_vec(), &["JSON", "line"]),
        ("a comma is missing", "a.gltf", gltf(r#"},"scene":0"#, r#"} "scene":0"#), &["JSON", "expected", "line 1"]),
        ("a word instead of a number", "a.gltf", gltf(r#""count":6"#, r#""count":"six""#), &["JSON", "six"]),
        ("an old version", "a.gltf", gltf(r#""version":"2.0""#, r#""version":"1.0""#), &["asset", "version '1.0' is not supported"]),
        ("no version", "a.gltf", gltf(r#""version":"2.0""#, r#""generator":"x""#), &["asset", "there is no version"]),
        ("a node that does not exist", "a.gltf", gltf(r#""nodes":[0,2,3]"#, r#""nodes":[0,2,9]"#), &["scene 0", "node 9 does not exist"]),
        ("a node that is its own ancestor", "a.gltf", gltf(r#""mesh":0,"#, r#""mesh":0,"children":[0],"#), &["node 0", "ancestor"]),
        ("a mesh that does not exist", "a.gltf", gltf(r#""mesh":0"#, r#""mesh":7"#), &["node 1", "mesh 7", "does not exist"]),
        (
            "a material that does not exist",
            "a.gltf",
            gltf(r#""material":1"#, r#""material":5"#),
            &["mesh 0, primitive 1", "material 5", "does not exist"],
        ),
        (
            "an accessor longer than its view",
            "a.gltf",
            gltf(r#""count":4"#, r#""count":5"#),
            &["POSITION, accessor 0", "5 elements", "48 bytes"],
        ),
        (
            "a view longer than its buffer",
            "a.gltf",
            gltf(r#""byteOffset":48"#, r#""byteOffset":4800"#),
            &["NORMAL", "bufferView 1", "buffer 0 is too short"],
        ),
        (
            "an index beyond the vertices",
            "a.gltf",
            gltf(r#"{"buffer":0,"byteLength":48}"#, r#"{"buffer":0,"byteLength":24}"#),
            &["POSITION", "4 elements", "24 bytes"],
        ),
        (
            "an extension that is required",
            "a.gltf",
            gltf(r#""extensionsUsed""#, r#""extensionsRequired":["X_far"],"extensionsUsed""#),
            &["X_far", "not supported"],
        ),
        (
            "a file that is not there",
            "a.gltf",
            gltf("data:application/octet-stream;base64", "gone.bin?"),
            &["buffer 0", "gone.bin", "No such file"],
        ),
        (
            "a file outside of the folder",
            "a.gltf",
            gltf("data:application/octet-stream;base64,", "../"),
            &["buffer 0", "leads out of the folder"],
        ),
        (
            "a profile that is not there",
            "a.gltf",
            gltf(r#""type":"spot""#, r#""type":"spot","extras":{"ies":"lamps/gone.ies"}"#),
            &["node 3", "extras of light 0", "ies 'lamps/gone.ies'", "No such file"],
        ),
        (
            "a profile outside of the folder",
            "a.gltf",
            gltf(r#""type":"spot""#, r#""type":"spot","extras":{"ies":"//../lamp.ies"}"#),
            &["ies '//../lamp.ies'", "leads out of the folder"],
        ),
        (
            "a height map that is no name",
            "a.gltf",
            gltf(r#""name":"m""#, r#""name":"m","extras":{"height_map":true}"#),
            &["extras of material 0", "height_map true", "the path of a file as text"],
        ),
        (
            "a scale in words",
            "a.gltf",
            gltf(r#""name":"m""#, r#""name":"m","extras":{"height_map":"a.gltf","height_scale":"2 cm"}"#),
            &["extras of material 0", "height_scale", "'2 cm' is no finite number"],
        ),
        ("another file with this ending", "a.glb", b"\x89PNG\r\n\x1a\n".to_vec(), &["JSON"]),
        ("a container of another version", "a.glb", glb_with(4, 1), &["container version 1 is not supported"]),
        (
            "a container that is cut",
            "a.glb",
            samples::glb(&samples::png())[..900].to_vec(),
            &["header", "the length says", "the file has 900"],
        ),
        ("a picture that is none", "a.glb", with(samples::glb(&samples::png()), "PNG", "GNP"), &["image 0", "neither PNG, JPEG nor WebP"]),
        (
            "a vertex beyond the last",
            "a.obj",
            obj("2/2 5/3", "2/2 9/3"),
            &["line 19", "corner '9/3'", "vertex 9 does not exist", "there are 5"],
        ),
        ("a vertex of two numbers", "a.obj", obj("v 1 1 0", "v 1 1"), &["line 6", "2 numbers instead of three"]),
        ("a word for a number", "a.obj", obj("v 1 1 0", "v 1 one 0"), &["line 6", "number 2", "'one' is no number"]),
        ("text that is no OBJ", "a.obj", b"<html>\n<body>\n".to_vec(), &["there is no statement of an OBJ file"]),
        (
            "more vertices than there are",
            "a.ply",
            ply("vertex 5", "vertex 5000"),
            &["element vertex", "5000", "do not fit into the", "bytes that remain"],
        ),
        (
            "a corner beyond the last vertex",
            "a.ply",
            ply("4 0 1 2 3", "4 0 1 2 5"),
            &["line 24", "element face 0", "vertex 5 does not exist", "there are 5"],
        ),
        ("fewer vertices than announced", "a.ply", ply("0 1 0 0 1 255 128 0\n", ""), &["line", "element vertex 4"]),
        ("a type that does not exist", "a.ply", ply("float x", "real x"), &["line 5", "the type 'real' is unknown"]),
        ("no end of the header", "a.ply", ply("end_header", "end header"), &["header", "'end_header'"]),
    ]
}

fn of_environments() -> Vec<Mistake> {
    vec![
        ("another file with this ending", "a.hdr", b"P6\n8 8\n255\n".to_vec(), &["header", "#?RADIANCE"]),
        ("a size that is no number", "a.hdr", hdr("+X 16", "+X sixteen"), &["resolution", "'sixteen' is no positive number"]),
        (
            "a size that nobody can hold",
            "a.hdr",
            hdr("-Y 8 +X 16", "-Y 90000 +X 90000"),
            &["resolution", "90000 x 90000 texels are too many"],
        ),
        ("more lines than there are", "a.hdr", hdr("-Y 8 +X 16", "-Y 9 +X 16"), &["scanline 8", "the file ends"]),
        ("lines of another length", "a.hdr", hdr("+X 16", "+X 20"), &["scanline 0", "the encoded length is 16 instead of 20"]),
        ("an exposure of nothing", "a.hdr", hdr("EXPOSURE=0.5", "EXPOSURE=0"), &["header", "EXPOSURE '0' is no positive number"]),
        (
            "another encoding of colours",
            "a.hdr",
            hdr("32-bit_rle_rgbe", "16-bit_rle_rgbe"),
            &["the format '16-bit_rle_rgbe' is not supported"],
        ),
        ("another file with this ending", "a.exr", b"#?RADIANCE\n".to_vec(), &["content", "file identifier"]),
        ("a file that is cut", "a.exr", samples::exr(samples::Compression::ZIP16, false)[..400].to_vec(), &["content"]),
    ]
}

fn check(mistakes: Vec<Mistake>, load: impl Fn(&std::path::Path) -> Result<(), scene::Error>) -> Vec<String> {
    let mut complaints = Vec::new();
    for (what, name, bytes, words) in mistakes {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        fs::write(&path, &bytes).expect("written");
        match load(&path) {
            Ok(()) => complaints.push(format!("{what}: it is read")),
            Err(error) => {
                let text = error.to_string();
                let missing = words.iter().find(|&&word| !text.contains(word));
                if missing.is_some() || !text.starts_with(&format!("{}: ", path.display())) || text.lines().count() != 1 {
                    complaints.push(format!("{what}: {missing:?} is missing in: {text}"));
                }
            }
        }
    }
    complaints
}

// Kills: messages that say that something is wrong, but not what, where, and against which limit.
#[test]
fn mistakes_are_told_in_the_words_of_their_author() {
    let (scenes, environments) = (of_scenes(), of_environments());
    assert!(scenes.len() + environments.len() >= 30);
    let mut complaints = check(scenes, |path| scene::load(path).map(drop));
    complaints.extend(check(environments, |path| scene::load_environment(path).map(drop)));
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

// Kills: an ending that is refused without the ones that are read.
#[test]
fn endings_are_told() {
    let text = scene::load(std::path::Path::new("picture.gif")).map(drop).unwrap_err().to_string();
    assert_eq!(text, "picture.gif: the name should end in .glb or .gltf, .obj or .ply");
    let text = scene::load_environment(std::path::Path::new("picture.gif")).map(drop).unwrap_err().to_string();
    assert_eq!(text, "picture.gif: the name should end in .hdr or .exr");
}
