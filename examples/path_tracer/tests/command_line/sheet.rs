//! `path-tracer sheet`: many scenes in one picture.

use std::fs;

use super::{has_adapter, json, path_tracer, refuses};

/// A folder with a triangle, a broken file, a panorama of two texels (black and white) and a file that is nobody's.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, bytes).expect("written");
    };
    write("b/triangle.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("a/cut.glb", b"glTF\x02\0\0\0\xff\xff\0\0");
    write("sky.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\0\0\0\0\x80\x80\x80\x81");
    write("notes.txt", b"no scene");
    folder
}

/// Kills: a sheet that is begun although it cannot be written or is too large, a folder without scenes that makes an empty one.
#[test]
fn a_sheet_that_cannot_be_is_refused_before_it_is_made() {
    let folder = tempfile::tempdir().expect("a folder");
    let (place, out) = (folder.path().display().to_string(), folder.path().join("s.png").display().to_string());
    refuses(&["sheet", "cornell-box", "--out", "sheet.exr"], 1, &["sheet.exr: the name should end in .png"]);
    refuses(&["sheet", "cornell-box", "--out", "no-folder/s.png"], 1, &["s.png", "cannot write"]);
    refuses(&["sheet", &place, "--out", &out], 1, &[&place, "there is no scene in this folder", ".glb, .gltf, .obj, .ply, .hdr or .exr"]);
    refuses(&["sheet", "cornell-box", "--out", &out, "--env", "no-such.hdr"], 1, &["no-such.hdr"]);
    refuses(&["sheet", "cornell-box", "--out", &out, "--size", "32768x32768"], 2, &["--size 32768x32768", "pixels", "bytes"]);
    refuses(&["sheet", "cornell-box", "--out", &out, "--columns", "0"], 2, &["--columns 0"]);
    assert_eq!(path_tracer(&["sheet", "cornell-box"]).status.code(), Some(2));
    assert_eq!(path_tracer(&["sheet", "--out", &out]).status.code(), Some(2));
    assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 0);
}

/// Kills: work that ends at the first broken file, failures that do not change the exit code or are not named, cells out of order, a picture that is
/// missing or black, a panorama that is taken for a scene.
#[test]
fn a_folder_is_shown_at_a_glance() {
    if !has_adapter() {
        return;
    }
    let folder = folder();
    let out = folder.path().join("s.png");
    let (place, out_text) = (folder.path().display().to_string(), out.display().to_string());
    let gone = folder.path().join("gone.ply").display().to_string();
    let places = ["sheet", &place, "cornell-box", &gone, "no-such-scene", "--out", &out_text];
    let options = ["--size", "24x20", "--samples", "4", "--columns", "4", "--tone-map", "none"];
    let output = path_tracer(&[&places[..], &options, &["--json"]].concat());
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{stderr}");
    assert!(stderr.contains("3 of 6 are not shown") && stderr.contains("note: b/triangle.obj: the scene has no light"), "{stderr}");
    let said = json(&String::from_utf8_lossy(&output.stdout));
    let cells = said["cells"].as_array().expect("cells");
    let names: Vec<&str> = cells.iter().map(|cell| cell["file"].as_str().expect("a name")).collect();
    let below = |name: &str| folder.path().join(name).display().to_string();
    assert_eq!(names, [&below("a/cut.glb"), &below("b/triangle.obj"), &below("sky.hdr"), "cornell-box", &gone, "no-such-scene"]);
    let is_shown: Vec<bool> = cells.iter().map(|cell| cell["error"].is_null()).collect();
    assert_eq!((is_shown, said["failed"].as_u64()), (vec![false, true, true, true, false, false], Some(3)));
    assert!(cells[0]["error"].as_str().is_some_and(|why| why.contains("cut.glb")), "{said}");

    let picture = image::open(&out).expect("a picture").into_rgb8();
    assert_eq!(picture.dimensions(), (4 * 30 + 6, 2 * 38 + 6));
    let cell = |column: u32, row: u32| {
        let pixels = (0..20).flat_map(|y| (0..24).map(move |x| (6 + 30 * column + x, 6 + 38 * row + y)));
        pixels.map(|(x, y)| picture.get_pixel(x, y).0).collect::<Vec<_>>()
    };
    let mean = |pixels: &[[u8; 3]]| pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / pixels.len() as f64;
    // Grey cells have few values, pictures have many; the panorama's halves stand left and right.
    let n_values = |mut pixels: Vec<[u8; 3]>| {
        pixels.sort_unstable();
        pixels.dedup();
        pixels.len()
    };
    for (column, row) in [(0, 0), (0, 1), (1, 1)] {
        assert_eq!(n_values(cell(column, row)), 2, "{column},{row}");
    }
    for column in [1, 3] {
        assert!(n_values(cell(column, 0)) > 20 && (20.0..250.0).contains(&mean(&cell(column, 0))), "{column}");
    }
    let sky = cell(2, 0);
    assert_eq!((sky[10 * 24], sky[10 * 24 + 23]), ([0; 3], [255; 3]));

    let quiet = path_tracer(&["sheet", "cornell-box", "--out", &out_text, "--size", "24x20", "--samples", "1", "--quiet"]);
    assert!(quiet.status.success() && quiet.stdout.is_empty() && quiet.stderr.is_empty());
}
