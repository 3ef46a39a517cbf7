//! `--frames`: numbered pictures of an animation.

use std::fs;

use crate::{has_adapter, hash_of, json, path_tracer, refuses, triangle_that_moves};

/// Kills: frames of what does not move, two moments at once, options of a series without one, commands that pick a frame in silence.
#[test]
fn frames_need_an_animation_and_a_range() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = triangle_that_moves(folder.path());
    for range in ["2..1", "1..", "one", "1.5..2"] {
        refuses(&["render", &scene, "--frames", range], 2, &[&format!("--frames {range}: "), "both of them included"]);
    }
    refuses(&["render", &scene, "--frames", "1..2", "--fps", "0"], 2, &["--fps 0"]);
    refuses(&["render", "cornell-box", "--frames", "1..2"], 2, &["cornell-box", "--frames"]);
    let still = folder.path().join("still.ply").display().to_string();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    fs::write(&still, ply).expect("written");
    refuses(&["render", &still, "--frames", "1..2"], 2, &["still.ply has no animation"]);
    refuses(&["render", &scene, "--animation", "slide"], 2, &["--animation slide", "--time", "--frames"]);
    refuses(&["explain", &scene, "--frames", "1..2"], 2, &["--frames 1..2", "--time"]);
    for wrong in [&["--frames", "1..2", "--time", "1"][..], &["--fps", "24"], &["--skip-existing"]] {
        assert_eq!(path_tracer(&[&["render", &scene], wrong].concat()).status.code(), Some(2), "{wrong:?}");
    }
    let nowhere = folder.path().join("no-folder").join("a_##.png").display().to_string();
    refuses(&["render", &scene, "--frames", "1..2", "--out", &nowhere], 1, &["a_01.png", "cannot write"]);
    let info = path_tracer(&["info", &scene, "--json"]);
    let animations = json(&String::from_utf8_lossy(&info.stdout))["animations"].clone();
    assert_eq!(animations, serde_json::json!([{ "name": "slide", "seconds": [0.0, 2.0] }]));
    let said = String::from_utf8_lossy(&path_tracer(&["info", &scene]).stdout).into_owned();
    assert!(said.contains("'slide', seconds 0 to 2"), "{said}");
}

/// Kills: a range without its last frame, frames counted from another moment, a camera that follows what it should see move or that depends
/// on the range, names without numbers, one JSON for all, frames that are skipped or rendered against what was asked for.
#[test]
fn a_frame_is_what_its_moment_shows() {
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scene = triangle_that_moves(folder.path());
    let path = |name: &str| folder.path().join(name).display().to_string();
    let rendered = |arguments: &[&str]| {
        let output = path_tracer(&[&["render", &scene, "--size", "16x16", "--samples", "2"], arguments].concat());
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        (String::from_utf8_lossy(&output.stdout).into_owned(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (stdout, stderr) = rendered(&["--frames", "1..3", "--fps", "2", "--json", "--out", &path("a.npy")]);
    let said: Vec<serde_json::Value> = stdout.lines().map(json).collect();
    for (index, said) in said.iter().enumerate() {
        let frame = index + 1;
        assert_eq!((said["frame"].as_u64(), said["time"].as_f64()), (Some(frame as u64), Some(frame as f64 / 2.0)));
        assert_eq!(said["file"].as_str(), Some(path(&format!("a.000{frame}.npy")).as_str()));
        let warnings = said["warnings"].to_string();
        assert!(warnings.contains("framed") && warnings.contains("plain sky"), "{warnings}");
    }
    assert_eq!(said.len(), 3);
    assert_eq!(stderr.matches("framed").count(), 1, "said for every frame: {stderr}");
    let bytes: Vec<Vec<u8>> = (1..=3).map(|frame| fs::read(path(&format!("a.000{frame}.npy"))).expect("a frame")).collect();
    assert!(bytes[0] != bytes[1] && bytes[1] != bytes[2]);

    // A frame and the same moment alone.
    let camera = ["--look-from", "0.8,0.6,2.4", "--look-at", "0.5,0.4,0"];
    rendered(&[&camera[..], &["--time", "1", "--out", &path("moment.npy")]].concat());
    rendered(&[&camera[..], &["--frames", "2..=2", "--fps", "2", "--out", &path("frame.npy")]].concat());
    assert_eq!(fs::read(path("frame.0002.npy")).expect("a frame"), fs::read(path("moment.npy")).expect("a picture"));
    // Frame 2 of 1..3 and frame 2 alone.
    let (line, _) = rendered(&["--frames", "2", "--fps", "2", "--out", &path("b_###.npy"), "--quiet", "--stats", &path("s.json")]);
    assert_eq!(line, "");
    assert_eq!(fs::read(path("b_002.npy")).expect("a frame"), bytes[1]);
    assert!(fs::metadata(path("s.0002.json")).is_ok());

    // What is there stays only when that is asked for.
    fs::write(path("a.0002.npy"), "an older picture").expect("written");
    let again = ["--frames", "1..3", "--fps", "2", "--out", &path("a.npy")];
    let (said, _) = rendered(&[&again[..], &["--skip-existing"]].concat());
    assert_eq!(said.matches("is there already").count(), 3, "{said}");
    assert_eq!(fs::read(path("a.0002.npy")).expect("a file"), b"an older picture");
    let (said, _) = rendered(&again);
    assert_eq!(fs::read(path("a.0002.npy")).expect("a frame"), bytes[1]);
    assert_eq!(said.matches("adapter:").count(), 1, "{said}");
    for frame in ["frame 1: ", "frame 2: ", "frame 3: "] {
        assert!(said.lines().any(|line| line.starts_with(frame) && line.contains("image-hash")), "{said}");
    }
}

/// Kills: a note about a camera that is not used, in pictures and in exports; its silence where the camera is used.
#[test]
fn a_chosen_camera_is_not_said_to_be_framed() {
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scene = triangle_that_moves(folder.path());
    let out = folder.path().join("a.png").display().to_string();
    let noted = |arguments: &[&str]| {
        let output = path_tracer(&[&["render", &scene, "--size", "8x8", "--samples", "1", "--out", &out], arguments].concat());
        assert!(output.status.success() && !hash_of(&String::from_utf8_lossy(&output.stdout)).is_empty());
        String::from_utf8_lossy(&output.stderr).contains("framed from the front")
    };
    assert!(noted(&[]) && noted(&["--fov", "30"]));
    assert!(!noted(&["--look-from", "0,0,3", "--look-at", "0,0,0"]) && !noted(&["--camera", "framed"]));
    let xml = folder.path().join("a.xml").display().to_string();
    let export = ["export", &scene, "--mitsuba", &xml, "--look-from", "0,0,3", "--look-at", "0,0,0"];
    assert!(!String::from_utf8_lossy(&path_tracer(&export).stderr).contains("framed"));
}
