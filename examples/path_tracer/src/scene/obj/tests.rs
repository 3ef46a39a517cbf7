//! Whole files, made here, with libraries and textures beside them.

use std::fs;
use std::path::Path;

use glam::{Vec2, Vec3, Vec4};

use super::super::model::{AlphaMode, Material, Scene, Wrap};
use super::read;

fn load_in(folder: &Path, text: &str) -> Result<Scene, String> {
    let explain = |f: crate::error::Fault| f.in_named("a.obj").to_string();
    let mut scene = read(&folder.join("a.obj"), text.as_bytes()).map_err(explain)?;
    scene.check().map_err(explain)?;
    Ok(scene)
}

fn load(text: &str) -> Result<Scene, String> {
    load_in(Path::new("no-such-folder"), text)
}

fn png(folder: &Path, name: &str, texels: &[[u8; 4]]) {
    let flat = texels.as_flattened().to_vec();
    image::RgbaImage::from_raw(u32::try_from(texels.len()).unwrap(), 1, flat).unwrap().save(folder.join(name)).unwrap();
}

fn has(scene: &Scene, words: &str) -> bool {
    scene.warnings.iter().any(|line| line.contains(words))
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

// Kills: indices from zero, negative ones that count from the start, forgotten line joins, and v that grows downwards.
#[test]
fn corners_of_all_spellings_are_found() {
    let text = format!("{SQUARE}vt 0.25 1 0\nvn 0 0 2\ng a b\no c\nf 1/1/1 2//1 \\\n 3/1 -1 # the last one\n");
    let scene = load(&text).unwrap();
    assert_eq!(scene.triangles.iter().map(|t| t.vertices).collect::<Vec<_>>(), [[0, 1, 2], [0, 2, 3]]);
    let corners: Vec<_> = scene.vertices.iter().map(|v| (v.position, v.uv[0])).collect();
    let uv = Vec2::new(0.25, 0.0);
    let expected = [(Vec3::ZERO, uv), (Vec3::X, Vec2::ZERO), (Vec3::new(1.0, 1.0, 0.0), uv), (Vec3::Y, Vec2::ZERO)];
    assert_eq!(corners, expected);
    assert!(scene.vertices.iter().all(|v| v.normal == Vec3::Z), "unit length, whether from the file or of the face");
}

// Kills: smooth normals across an edge without a group or between two groups, and flat ones inside of a group.
#[test]
fn smoothing_groups_say_what_is_smooth() {
    let roof = |first: &str, second: &str| {
        let text = format!("v 0 0 0\nv 0 1 0\nv -1 0 0\nv 0 0 -1\ns {first}\nf 1 2 3\ns {second}\nf 1 4 2\n");
        load(&text).unwrap().vertices.iter().filter(|v| v.position == Vec3::ZERO).map(|v| v.normal).collect::<Vec<_>>()
    };
    let between = Vec3::new(1.0, 0.0, 1.0).normalize();
    let [one] = roof("1", "1")[..] else { panic!("not shared") };
    assert!(one.abs_diff_eq(between, 1e-6), "{one}");
    for (first, second) in [("off", "off"), ("1", "2"), ("0", "0"), ("1", "off")] {
        assert_eq!(roof(first, second), [Vec3::Z, Vec3::X], "{first} {second}");
    }
}

// Kills: colours of one vertex that shift to the next, and colours that stay encoded.
#[test]
fn some_vertices_may_have_colors() {
    let scene = load("v 0 0 0\nv 1 0 0 1 0 0.5\nv 0 1 0 1\nf 1 2 3\n").unwrap();
    let colors: Vec<Vec4> = scene.vertices.iter().map(|v| v.color).collect();
    assert_eq!((colors[0], colors[2]), (Vec4::ONE, Vec4::ONE));
    assert!(colors[1].abs_diff_eq(Vec4::new(1.0, 0.0, 0.214_041, 1.0), 1e-5), "{}", colors[1]);
    assert!(has(&scene, "sRGB"));
}

// Kills: messages without the line, the word or the limit, and indices that are trusted.
#[test]
fn mistakes_are_located() {
    for (line, words) in [
        ("f 1 2 5", "line 5, corner '5': vertex 5 does not exist, there are 4 so far"),
        ("f 0 1 2", "vertex 0 does not exist"),
        ("f -5 1 2", "vertex -5 does not exist"),
        ("f -9223372036854775808 1 2", "vertex -9223372036854775808 does not exist"),
        ("f 99999999999999999999 1 2", "'99999999999999999999' is no index"),
        ("f 1/1 2 3", "texture coordinate 1 does not exist, there are 0 so far"),
        ("f 1//1 2 3", "normal 1 does not exist"),
        ("f 1/2/3/4 2 3", "line 5, corner '1/2/3/4'"),
        ("f 1.5 2 3", "'1.5' is no index"),
        ("f / 2 3", "there is no vertex"),
        ("v 1 2", "line 5, v: 2 numbers instead of three"),
        ("v 1 x 2", "line 5, number 2: 'x' is no number"),
        ("v 1 nan 2", "the position is not finite"),
        ("v 1 1e99 2", "the position is not finite"),
        ("vt", "there is no number"),
        ("vn 1 2", "2 numbers instead of three"),
    ] {
        let text = load(&format!("{SQUARE}{line}\n")).map(|scene| scene.triangles.len()).unwrap_err();
        assert!(text.starts_with("a.obj: line 5") && text.contains(words), "{line}: {text}");
    }
    assert!(load("hello\nworld\n").unwrap_err().contains("no statement of an OBJ file"));
    assert!(load("").is_err() && load("\u{FEFF}").is_err());
}

// Kills: silence about what is left out, one line for each occurrence, and a face of two corners that panics.
#[test]
fn what_is_left_out_is_named_once() {
    let scene =
        load(&format!("{SQUARE}vp 1 2\nvp 3 4\ncurv 1\nl 1 2\np 1\np 2\nf 1 2\nf\nusemtl gone\nf 1 2 3\ns x\nv 3.1+e2 0 0\nvt nan 0\n"))
            .unwrap();
    for words in
        ["'vp' is unknown", "'curv'", "points and lines", "2 faces have fewer than three", "'gone' is not defined", "'x' is no number"]
    {
        assert_eq!(scene.warnings.iter().filter(|line| line.contains(words)).count(), 1, "{words}: {:?}", scene.warnings);
    }
    assert!(has(&scene, "1 numbers have something behind them") && has(&scene, "1 numbers of normals"), "{:?}", scene.warnings);
    assert_eq!(scene.triangles.len(), 1);
    let dented = load("v 1 -1 0\nv 0.2 0 0\nv 1 1 0\nv 0 0 0\nf 1 2 3 4\n").unwrap();
    assert!(dented.triangles.len() == 2 && !has(&dented, "faces cross"), "{:?}", dented.warnings);
    let crossed = load("v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 3 0\nf 1 2 3 4\n").unwrap();
    assert!(has(&crossed, "1 faces cross themselves"), "{:?}", crossed.warnings);
}

// Kills: materials by number instead of name, names cut at spaces, options taken for the name, transforms that forget that v is turned
// over, and images that are decoded once for each material.
#[test]
fn libraries_and_textures_lie_beside_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    png(at, "red tile.png", &[[255, 0, 0, 255]; 2]);
    png(at, "holes.png", &[[0, 0, 0, 255], [255, 255, 255, 255]]);
    png(at, "normal.png", &[[128, 128, 255, 255]]);
    let library = "Kd 9 9 9\nnewmtl red tile\nKd 0.5\nmap_Kd -s 2 4 1 -o 0.25 0.5 -clamp on -mm 0 1 red tile.png\nKe 1 2 3\nTr 0.25\nNs 7\nKa 1 1 1\n\
        newmtl holes\nmap_Kd .\\red tile.png\nmap_d holes.png\nnorm -bm 0.5 normal.png\nmap_Ke red tile.png\nnewmtl bump\nmap_Bump holes.png\n";
    fs::write(at.join("my library.mtl"), library).unwrap();
    let text = format!(
        "mtllib my library.mtl\nmtllib my library.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\n\
        usemtl red tile\nf 1/1 2/2 3/3\nusemtl holes\nf 1/1 2/2 3/3\nusemtl red tile\nf 1 3 4\nusemtl bump\nf 1 2 3\n"
    );
    let scene = load_in(at, &text).unwrap();
    let [red, holes, bump] = &scene.materials[..] else { panic!("{}", scene.materials.len()) };
    assert_eq!((red.name.as_str(), red.base_color, red.alpha), ("red tile", Vec4::new(0.5, 0.5, 0.5, 0.75), AlphaMode::Blend));
    assert_eq!(red.emissive, Vec3::new(1.0, 2.0, 3.0));
    let texture = red.base_color_texture.unwrap();
    assert_eq!(texture.wrap, [Wrap::Clamp; 2]);
    // The point 0.25 above the lower edge: 4 * 0.25 + 0.5 above the lower edge of the picture.
    let v = texture.transform[1].dot(Vec3::new(0.0, 0.75, 1.0));
    assert!((v - (1.0 - 1.5)).abs() < 1e-6, "{v}");
    assert_eq!((holes.alpha, holes.emissive, holes.normal_scale), (AlphaMode::Blend, Vec3::ONE, 0.5));
    let cut = &scene.images[holes.base_color_texture.unwrap().image as usize];
    assert_eq!(cut.texels, [[255, 0, 0, 0], [255, 0, 0, 255]]);
    assert!(holes.normal_texture.is_some() && bump.normal_texture.is_none());
    let shown = scene.triangles.iter().find(|t| t.material == 1).unwrap();
    assert!(shown.vertices.iter().all(|&v| scene.vertices[v as usize].tangent.abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-5)));
    assert_eq!(scene.triangles.iter().map(|t| t.material).collect::<Vec<_>>(), [0, 0, 1, 2]);
    assert_eq!(scene.images.len(), 5, "three files, one of which is named in two ways, and one picture that is cut out");
    for words in ["'Kd' before the first newmtl", "'-mm'", "'Ka' of materials", "the heights of map_Bump 'holes.png'"] {
        assert!(has(&scene, words), "{words}: {:?}", scene.warnings);
    }
}

// Kills: roughness read as metal, maps alone on a surface that reflects nothing, the number beside a map that is multiplied into it, a picture for each material that asks for it.
#[test]
fn maps_of_roughness_and_metal_share_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    png(folder.path(), "rough.png", &[[64, 64, 64, 255], [128, 128, 128, 255]]);
    png(folder.path(), "metal.png", &[[255, 255, 255, 255]]);
    let library = "newmtl both\nPr 0.5\nPm 0\nmap_Pr rough.png\nmap_Pm metal.png\nnewmtl rough\nPr 0.5\nPm 0\nmap_Pr rough.png\n\
        newmtl same\nmap_Pm metal.png\nmap_Pr rough.png\nnewmtl none\nPr 0.25\nmap_Pr gone.png\n";
    fs::write(folder.path().join("m.mtl"), library).unwrap();
    let faces: String = ["both", "rough", "same", "none"].map(|name| format!("usemtl {name}\nf 1 2 3\n")).concat();
    let scene = load_in(folder.path(), &format!("mtllib m.mtl\n{SQUARE}{faces}")).unwrap();
    let [both, rough, same, none] = &scene.materials[..] else { panic!("{}", scene.materials.len()) };
    let image = |material: &Material| &scene.images[material.metallic_roughness_texture.unwrap().image as usize];
    assert_eq!((both.roughness, both.metallic), (1.0, 1.0));
    assert_eq!(image(both).texels, [[255, 64, 255, 255], [255, 128, 255, 255]]);
    assert_eq!((rough.roughness, rough.metallic, image(rough).texels[0][1]), (1.0, 0.0, 64));
    assert_eq!((same.metallic_roughness_texture, same.ior), (both.metallic_roughness_texture, 1.5));
    assert_eq!((none.roughness, none.metallic_roughness_texture), (0.25, None));
    assert_eq!(scene.images.len(), 4, "two files and two that are made of them");
}

// Kills: a name that leads out of the folder in any spelling, and an error where a warning does.
#[test]
fn nothing_outside_of_the_folder_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    fs::create_dir(&inner).unwrap();
    fs::write(folder.path().join("secret.mtl"), "newmtl m\nKd 1 0 0\n").unwrap();
    png(folder.path(), "secret.png", &[[1, 2, 3, 255]]);
    let absolute = folder.path().join("secret.png");
    fs::write(
        inner.join("a.mtl"),
        format!(
            "newmtl m\nKd 0 1 0\nmap_Kd ..\\secret.png\nmap_Ke x/../../secret.png\nnorm {}\nmap_d C:\\secret.png\n",
            absolute.display()
        ),
    )
    .unwrap();
    let scene = load_in(&inner, &format!("mtllib ../secret.mtl\nmtllib a.mtl gone.mtl\n{SQUARE}usemtl m\nf 1 2 3\n")).unwrap();
    assert_eq!(scene.materials[0].base_color, Vec4::new(0.0, 1.0, 0.0, 1.0));
    assert!(scene.images.is_empty());
    let outside = scene.warnings.iter().filter(|line| line.contains("leads out of the folder")).count();
    assert_eq!(outside, 4, "{:?}", scene.warnings);
    assert!(has(&scene, "C:\\secret.png: only data and relative files") && has(&scene, "mtllib 'gone.mtl'"), "{:?}", scene.warnings);
}

// Kills: mistakes in a library that are told without its name and line.
#[test]
fn mistakes_in_libraries_are_located() {
    let folder = tempfile::tempdir().unwrap();
    for (line, words) in [
        ("Kd 1 x 2", "Kd: 'x' is no number"),
        ("Kd 1 2", "Kd: there are two numbers"),
        ("Kd", "Kd: there is no number"),
        ("Ke 1 inf 1", "Ke: a number is not finite"),
        ("Ns nan", "Ns: the number is not finite"),
        ("Tr", "Tr: there is no number"),
        ("map_Kd -s x.png", "map_Kd -s: there is no number"),
        ("norm -bm 1e99 x.png", "norm -bm: the number is not finite"),
    ] {
        fs::write(folder.path().join("m.mtl"), format!("newmtl m\n{line}\n")).unwrap();
        let text = load_in(folder.path(), "mtllib m.mtl\nv 0 0 0\n").map(|scene| scene.warnings).unwrap_err();
        assert!(text.contains("a.obj: mtllib 'm.mtl', line 2, ") && text.contains(words), "{line}: {text}");
    }
}
