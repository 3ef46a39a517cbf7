//! What a picture file holds besides its colours: alpha and facts, through the binary.

use std::{collections::BTreeMap, fs};

use crate::{has_adapter, json, path_tracer, triangle_that_moves};

/// Kills: an alpha that does not reach the files, is missing where a format could hold it or left out without a word; a sky that is left in
/// the picture; colours multiplied by alpha in a PNG.
#[test]
fn a_transparent_picture_has_an_alpha() {
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let warnings = |scene: &str, name: &str| {
        let arguments = ["render", scene, "--size", "32x32", "--samples", "16", "--transparent", "--json", "--out", &path(name)];
        let output = path_tracer(&arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        json(&String::from_utf8_lossy(&output.stdout))["warnings"].to_string()
    };
    // Lit by a plain sky, and the same as a lamp.
    let lit = triangle_that_moves(folder.path());
    let lamp = path("lamp.gltf");
    let text = fs::read_to_string(&lit).expect("written").replace(r#""POSITION":0}"#, r#""POSITION":0},"material":0"#);
    let black = r#""materials":[{"emissiveFactor":[1,1,1],"pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1]}}],"#;
    fs::write(&lamp, text.replacen('{', &format!("{{{black}"), 1)).expect("written");
    assert!(!warnings(&lit, "lit.png").contains("place") && !warnings(&lamp, "lamp.png").contains("place"));
    assert!(!warnings(&lit, "lit.exr").contains("place") && warnings(&lit, "lit.npy").contains("no place for A"));
    for name in ["lit.png", "lamp.png"] {
        let pixels = image::open(path(name)).expect("a picture").into_rgba8();
        let colors =
            |is_meant: fn(u8) -> bool| pixels.pixels().filter(|pixel| is_meant(pixel.0[3])).map(|pixel| pixel.0).collect::<Vec<_>>();
        let (empty, partly) = (colors(|alpha| alpha == 0), colors(|alpha| alpha > 0 && alpha < 255));
        assert!(
            empty.len() > 300 && partly.len() > 20 && empty.len() + partly.len() < 900,
            "{} empty, {} partly",
            empty.len(),
            partly.len()
        );
        assert!(empty.iter().all(|color| *color == [0; 4]), "{name}");
        // A lamp is as bright at its edges as in its middle.
        assert!(name == "lit.png" || partly.iter().all(|color| color[..3] == [255; 3]), "{partly:?}");
    }
}

/// Kills: a PNG that does not say how it came to be, or says something else than the command line does.
#[test]
fn a_png_says_how_it_came_to_be() {
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("a.png").display().to_string();
    let arguments = ["render", "cornell-box", "--size", "16x16", "--samples", "3", "--seed", "7", "--json", "--out", &out];
    let output = path_tracer(&arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = json(&String::from_utf8_lossy(&output.stdout));
    let reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(&out).expect("a file"))).read_info().expect("a PNG");
    let texts = reader.info().uncompressed_latin1_text.iter().map(|chunk| (chunk.keyword.clone(), chunk.text.clone()));
    let texts: BTreeMap<String, String> = texts.collect();
    let expected = [
        ("Software", concat!("wavepool path-tracer ", env!("CARGO_PKG_VERSION"))),
        ("command", &format!("path-tracer {}", arguments.join(" "))),
        ("filmHash", said["hash"].as_str().expect("a hash")),
        ("samples", "3"),
        ("schedule", said["schedule"].as_str().expect("a schedule")),
        ("seed", "7"),
    ];
    for (name, text) in expected {
        assert_eq!(texts.get(name).map(String::as_str), Some(text), "{name}");
    }
}
