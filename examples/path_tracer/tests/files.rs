//! Real files, good and bad: whatever they contain, reading them ends in time with a valid scene or with one line that says why not.
//!
//! The files are not part of the project. `WAVEPOOL_ASSETS` names their folder: everything below its `bad` is broken or odd on purpose,
//! everything else is expected to load unless the error says that something is not supported. Without the variable the tests are
//! skipped, or fail when `WAVEPOOL_NO_SKIP=1`.

#[path = "files/memory.rs"]
mod memory;
#[path = "files/mistakes.rs"]
mod mistakes;
#[path = "files/mutations.rs"]
mod mutations;
#[path = "files/samples.rs"]
mod samples;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use path_tracer::scene::{self, LoadOptions, Scene};

const LONGEST: Duration = Duration::from_secs(5);

/// The folder with the files, or `None` after a line that says why the test is skipped.
fn assets() -> Option<PathBuf> {
    match std::env::var_os("WAVEPOOL_ASSETS") {
        Some(folder) => Some(PathBuf::from(folder)),
        None => {
            let strict = std::env::var_os("WAVEPOOL_NO_SKIP").is_some_and(|value| value == "1");
            assert!(!strict, "WAVEPOOL_ASSETS is not set and WAVEPOOL_NO_SKIP forbids to skip");
            println!("skipped: WAVEPOOL_ASSETS is not set");
            None
        }
    }
}

/// All files below `folder` with one of the endings, or with any when there are none, in order.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut open = vec![folder.to_path_buf()];
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if endings.is_empty() || path.extension().and_then(|e| e.to_str()).is_some_and(|e| endings.contains(&e)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Reads every file; returns how many were read, and the complaints about how the reader behaved.
fn read_all<T>(
    files: &[PathBuf],
    is_bad: impl Fn(&Path) -> bool,
    read: impl Fn(&Path) -> Result<T, scene::Error>,
    check: impl Fn(T) -> Result<(), String>,
) -> (usize, Vec<String>) {
    let mut complaints = Vec::new();
    let mut n_read = 0;
    for path in files {
        let start = Instant::now();
        let mut complain = |what: String| complaints.push(format!("{}: {what}", path.display()));
        match catch_unwind(AssertUnwindSafe(|| read(path))) {
            Err(_) => complain(String::from("panicked")),
            Ok(Ok(made)) => {
                n_read += 1;
                check(made).unwrap_or_else(&mut complain);
            }
            Ok(Err(error)) => {
                let text = error.to_string();
                if text.lines().count() != 1 || !text.contains(&path.display().to_string()) {
                    complain(format!("the error is not one line that names the file: {text}"));
                }
                if !is_bad(path) && !text.contains("is not supported") {
                    complain(text);
                }
            }
        }
        if start.elapsed() > LONGEST {
            complain(format!("took {:?}", start.elapsed()));
        }
    }
    (n_read, complaints)
}

// Kills: an index or a size that is trusted, a panic or an endless loop in any of the readers, and a scene that breaks its invariants.
#[test]
fn scenes_load_or_say_why_not() {
    scenes_load(scene::load);
}

// Kills: the same in animations, whose curves are not looked at without a time.
#[test]
fn scenes_load_at_a_time() {
    scenes_load(|path| scene::load_with(path, &LoadOptions { time: Some(0.7), ..LoadOptions::default() }));
}

fn scenes_load(load: impl Fn(&Path) -> Result<Scene, scene::Error>) {
    let Some(assets) = assets() else { return };
    let bad = assets.join("bad");
    let files = files(&assets, &["glb", "gltf", "obj", "ply"]);
    assert!(!files.is_empty(), "there are no scenes below {}", assets.display());
    let (n_read, complaints) = read_all(
        &files,
        // Its line `element face` is a comment, which makes it a broken file among good ones.
        |path| path.starts_with(&bad) || path.ends_with("ply/issue623.ply"),
        load,
        |mut scene| {
            let n_triangles = scene.triangles.len();
            scene.validate().map_err(|e| e.to_string())?;
            if scene.triangles.len() != n_triangles || scene.cameras.is_empty() {
                return Err(String::from("loading leaves work to validate() or to frame()"));
            }
            match scene.warnings.iter().find(|line| line.lines().count() != 1) {
                Some(line) => Err(format!("a warning is not one line: {line}")),
                None => Ok(()),
            }
        },
    );
    println!("{n_read} of {} scenes are read", files.len());
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    assert!(n_read > 0);
}

// Kills: a broken or odd file that is shown as if nothing were wrong with it, whatever its ending; scenes and panoramas alike.
#[test]
fn what_is_broken_is_refused_or_told() {
    let Some(assets) = assets() else { return };
    let files = files(&assets.join("bad"), &[]);
    assert!(files.len() > 100, "there are only {} broken files", files.len());
    let told = |warnings: Vec<String>| match warnings.is_empty() {
        true => Err(String::from("it is read without a word")),
        false => Ok(()),
    };
    let (n_scenes, mut complaints) = read_all(&files, |_| true, scene::load, |scene| told(scene.warnings));
    let (n_panoramas, more) = read_all(&files, |_| true, scene::load_environment, |(_, warnings)| told(warnings));
    complaints.extend(more);
    println!("{n_scenes} scenes and {n_panoramas} panoramas of {} broken files are read", files.len());
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

// Kills: the same for panoramas.
#[test]
fn environments_load_or_say_why_not() {
    let Some(assets) = assets() else { return };
    let bad = assets.join("bad");
    let files = files(&assets, &["hdr", "exr"]);
    assert!(!files.is_empty(), "there are no panoramas below {}", assets.display());
    let (n_read, complaints) = read_all(
        &files,
        |path| path.starts_with(&bad),
        scene::load_environment,
        |(environment, _)| match environment.texels.as_flattened().iter().all(|&x| x.is_finite() && x >= 0.0) {
            true => Ok(()),
            false => Err(String::from("a texel is not finite or negative")),
        },
    );
    println!("{n_read} of {} panoramas are read", files.len());
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    assert!(n_read > 0);
}

// Kills: every wrong decoder that still returns plausible colours: the same picture in all encodings has the same texels.
#[test]
fn encodings_of_one_picture_agree() {
    let Some(assets) = assets() else { return };
    let small = assets.join("env/small");
    let read = |name: &str| scene::load_environment(&small.join(name)).unwrap().0;
    let reference = read("rle.hdr");
    for name in ["flat.hdr", "old_rle.hdr", "flipX.hdr", "flipY.hdr", "rgbe_magic.hdr"] {
        if small.join(name).exists() {
            assert_eq!(read(name).texels, reference.texels, "{name}");
        }
    }
    let reference = read("half_zip.exr");
    for name in ["half_no.exr", "half_rle.exr", "half_zips.exr", "half_pxr24.exr", "tiled.exr", "rgba_zip.exr"] {
        if small.join(name).exists() {
            assert_eq!(read(name).texels, reference.texels, "{name}");
        }
    }
    for name in ["half_b44.exr", "half_b44a.exr", "half_dwaa.exr", "half_dwab.exr", "y_only.exr"] {
        if small.join(name).exists() {
            let found = read(name).texels;
            let luminance = |[r, g, b]: [f32; 3]| f64::from(0.2126 * r + 0.7152 * g + 0.0722 * b);
            let pairs = || found.iter().zip(&reference.texels).map(|(&a, &b)| (luminance(a), luminance(b)));
            let (difference, sum) = pairs().fold((0.0, 0.0), |(difference, sum), (a, b)| (difference + (a - b).abs(), sum + b));
            assert!(found.len() == reference.texels.len() && difference < 0.05 * sum, "{name}: {}", difference / sum);
        }
    }
}

// Kills: an object per primitive or per file, a name that goes to the neighbour, triangles without a number.
#[test]
fn nodes_with_meshes_are_objects() {
    let Some(assets) = assets() else { return };
    let helmet = scene::load(&assets.join("gltf/FlightHelmet/FlightHelmet.gltf")).unwrap();
    let names = ["Hose_low", "RubberWood_low", "GlassPlastic_low", "MetalParts_low", "LeatherParts_low", "Lenses_low"];
    assert_eq!(helmet.objects, names);
    assert_eq!(helmet.object_of.len(), helmet.triangles.len());
    // Each node of this file has a material of its own.
    for (triangle, object) in helmet.triangles.iter().zip(&helmet.object_of) {
        assert!(helmet.materials[triangle.material as usize].name.starts_with(names[*object as usize].trim_end_matches("_low")));
    }
}
