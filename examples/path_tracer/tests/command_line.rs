//! The command `path-tracer` as a stranger meets it: messages, exit codes, what happens to files.

#[path = "command_line/frames.rs"]
mod frames;
#[path = "command_line/sheet.rs"]
mod sheet;
#[path = "command_line/stopping.rs"]
mod stopping;
#[path = "command_line/transparent.rs"]
mod transparent;

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use path_tracer::wavepool::{
    SCHEDULE_KEYS, SCHEDULES, Schedule,
    policy::{LAUNCHES, ORDERS, ROULETTES},
};

fn path_tracer(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_path-tracer")).args(arguments).output().expect("the binary runs")
}

/// One line on stderr that contains every one of `parts`, the given exit code, nothing on stdout.
fn refuses(arguments: &[&str], code: i32, parts: &[&str]) {
    let output = path_tracer(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    assert_eq!(stderr.trim_end().lines().count(), 1, "{arguments:?}: {stderr}");
    parts.iter().for_each(|part| assert!(stderr.contains(part), "{arguments:?}: `{part}` is not in: {stderr}"));
    assert!(output.stdout.is_empty(), "{arguments:?} printed to stdout");
}

/// Kills: a scene name taken for a file without saying what else there is.
#[test]
fn missing_scenes_are_named() {
    refuses(&["render", "no-such-scene"], 1, &["no-such-scene", "built-in", "cornell-box", "mirror-corridor"]);
    refuses(&["render", "no-such-file.glb"], 1, &["no-such-file.glb"]);
    refuses(&["render", "cornell-box", "--env", "no-such-sky.hdr"], 1, &["no-such-sky.hdr"]);
    refuses(&["render", "picture.txt"], 1, &["picture.txt", ".glb or .gltf"]);
}

/// Kills: a render that starts before its arguments are understood.
#[test]
fn wrong_usage_is_exit_code_2() {
    refuses(&["render", "cornell-box", "--size", "0x64"], 2, &["--size 0x64"]);
    refuses(&["render", "cornell-box", "--size", "64"], 2, &["--size 64", "WIDTHxHEIGHT"]);
    refuses(&["render", "cornell-box", "--size", "99999x1"], 2, &["--size 99999x1"]);
    refuses(
        &["render", "cornell-box", "--schedule", "blok"],
        2,
        &["blok", "block, never, never-full", "megakernel, megakernel-regen, persistent"],
    );
    refuses(&["render", "cornell-box", "--schedule", "block,threshold=99"], 2, &["threshold=99"]);
    refuses(&["render", "cornell-box", "--samples", "0"], 2, &["--samples 0"]);
    refuses(&["render", "cornell-box", "--pool-blocks", "0"], 2, &["--pool-blocks 0"]);
    // Option, value, what is allowed: for every kind of value.
    for (option, value, allowed) in [
        ("--samples", "many", "whole number"),
        ("--depth", "-1", "from 0 to 4294967295"),
        ("--exposure", "inf", "finite"),
        ("--bits", "12", "allowed are 8, 16"),
        ("--tone-map", "filmic", "allowed are none, agx, aces"),
        ("--fov", "180", "0.01 to 179"),
        ("--look-from", "1,2", "X,Y,Z"),
        ("--env-intensity", "-1", "0 or more"),
        ("--env-rotation", "east", "finite"),
        ("--every", "10", "10s"),
    ] {
        refuses(&["render", "cornell-box", option, value], 2, &[&format!("{option} {value}: "), allowed]);
    }
    refuses(&["completions", "cmd"], 2, &["<SHELL> cmd", "bash", "zsh", "fish"]);
    assert_eq!(path_tracer(&["render"]).status.code(), Some(2));
    assert_eq!(path_tracer(&["paint"]).status.code(), Some(2));
}

/// Kills: finding out after the render that nothing can be written, or replacing an older picture by a broken one.
#[test]
fn an_existing_output_survives_a_failure() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("old.png");
    fs::write(&out, "an older picture").expect("written");
    let scene = folder.path().join("cut.glb");
    fs::write(&scene, b"glTF\x02\0\0\0\xff\xff\0\0").expect("written");
    let (scene, out_text) = (scene.display().to_string(), out.display().to_string());
    refuses(&["render", &scene, "--out", &out_text], 1, &["cut.glb"]);
    assert_eq!(fs::read(&out).expect("still there"), b"an older picture");

    let nowhere = folder.path().join("no-folder").join("a.png").display().to_string();
    refuses(&["render", "cornell-box", "--out", &nowhere], 1, &["a.png", "cannot write"]);
    refuses(&["render", "cornell-box", "--out", "picture.gif"], 1, &["picture.gif", ".png, .exr, .pfm or .npy"]);
    assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 2, "no file of ours stays behind");
}

/// A triangle whose second corner is not a number.
fn triangle_with_nan(folder: &Path) -> String {
    let mut bytes = Vec::new();
    for value in [0.0, 0.0, 0.0, 1.0, f32::NAN, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend_from_slice(&f32::to_le_bytes(value));
    }
    fs::write(folder.join("nan.bin"), bytes).expect("written");
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"uri":"nan.bin","byteLength":36}]}"#;
    let file = folder.join("nan.gltf");
    fs::write(&file, json).expect("written");
    file.display().to_string()
}

/// A lit triangle that moves by two metres along +x from second 0 to second 2; without a camera.
fn triangle_that_moves(folder: &Path) -> String {
    let numbers = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    let bytes: Vec<u8> = numbers.as_flattened().iter().chain(&[0.0, 2.0]).flat_map(|value| f32::to_le_bytes(*value)).collect();
    fs::write(folder.join("moves.bin"), bytes).expect("written");
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "animations":[{"name":"slide","channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],
            "samplers":[{"input":2,"output":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
            {"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"},
            {"bufferView":2,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[2]}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":24},
            {"buffer":0,"byteOffset":60,"byteLength":8}],
        "buffers":[{"uri":"moves.bin","byteLength":68}]}"#;
    let file = folder.join("moves.gltf");
    fs::write(&file, json).expect("written");
    file.display().to_string()
}

/// Kills: a NaN that reaches the acceleration structure, or a message that does not say where it is.
#[test]
fn positions_that_are_not_numbers_are_located() {
    let folder = tempfile::tempdir().expect("a folder");
    refuses(&["render", &triangle_with_nan(folder.path())], 1, &["nan.gltf", "mesh 0", "primitive 0", "vertex 1"]);
}

/// Kills: a command whose arguments collide, a table without the stages, stages that the scene does not call for, the state of
/// another schedule than the one asked for.
#[test]
fn a_scene_is_explained_without_a_device() {
    let output = path_tracer(&["explain", "cornell-box"]);
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for part in ["trace, gather_emission, sample_light, trace_shadow, next_bounce", "bytes per lane", "beta.x", "schedule: block"] {
        assert!(stdout.contains(part), "`{part}` is not in: {stdout}");
    }
    let packed = path_tracer(&["explain", "cornell-box", "--schedule", "compaction"]);
    let packed = String::from_utf8_lossy(&packed.stdout).into_owned();
    assert!(packed.contains("3 of them say which item a lane walks"), "{packed}");
    refuses(&["explain", "cornell-box", "--json"], 2, &["--json", "info SCENE"]);
    refuses(&["explain", "cornell-box", "--schedule", "auto"], 2, &["--schedule auto", "one can be explained"]);
    for command in ["render", "explain", "scenes", "adapters", "schedule", "schedules", "info", "compare", "sheet", "completions", "man"] {
        assert!(path_tracer(&[command, "--help"]).status.success(), "{command} --help");
    }
}

/// Kills: a policy that the list forgets, a listed one that the parser does not know, a list that is not printed.
#[test]
fn schedules_are_listed_and_can_be_typed_in() {
    let stdout = String::from_utf8_lossy(&path_tracer(&["schedules"]).stdout).into_owned();
    let specs = |key: &str, names: Vec<&'static str>| names.into_iter().map(|name| (name, format!("{key}{name}"))).collect::<Vec<_>>();
    let mut listed = specs("", SCHEDULES.iter().map(|choice| choice.name).collect());
    listed.extend(specs("block,order=", ORDERS.iter().map(|choice| choice.name).collect()));
    listed.extend(specs("block,roulette=", ROULETTES.iter().map(|choice| choice.name).collect()));
    listed.extend(specs("block,launch=", LAUNCHES.iter().map(|choice| choice.name).collect()));
    for (name, spec) in listed {
        assert!(stdout.lines().any(|line| line.trim_start().starts_with(name)), "{name} is not in: {stdout}");
        let printed = spec.parse::<Schedule>().expect(&spec).to_string();
        assert_eq!(printed.parse::<Schedule>().expect(&printed).to_string(), printed);
        assert!(name == "never-full" || printed.contains(name) || name == "live", "{spec}: {printed}");
    }
    for (key, ..) in SCHEDULE_KEYS {
        assert!(stdout.contains(&format!("  {key}=")), "{key} is not in: {stdout}");
        // Which stages there are, the program knows.
        let owner = if *key == "every" { "compaction" } else { "block" };
        let value = if *key == "local" { "trace+" } else { "no-such-value" };
        let message = format!("{owner},{key}={value}").parse::<Schedule>().expect_err(key).to_string();
        assert!(message.contains(&format!("{key}={value}: allowed is ")), "{message}");
    }
}

/// Kills: a dump that lacks a part, holds conditions or another schedule, or is left half-written without a word.
#[test]
fn the_composed_text_can_be_dumped() {
    let folder = tempfile::tempdir().expect("a folder");
    let dump = folder.path().join("new/dump");
    let dump_text = dump.display().to_string();
    let output = path_tracer(&["explain", "cornell-box", "--schedule", "megakernel", "--dump", &dump_text]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains(&dump_text));
    let mut names: Vec<_> = fs::read_dir(&dump).expect("made").map(|entry| entry.expect("listed").file_name()).collect();
    names.sort();
    assert_eq!(names, ["leaves.txt", "resolve.wgsl", "stages.wgsl", "tick.wgsl"]);
    let text = |name: &str| fs::read_to_string(dump.join(name)).expect("text");
    let stages = text("stages.wgsl");
    assert!(stages.contains("fn wf_megakernel(") && stages.contains("fn next_bounce(") && stages.contains("const WALK_ENDS: u32 = "));
    // The Cornell box has neither glass nor images.
    let code: String = stages.lines().map(|line| line.split("//").next().unwrap_or_default()).collect();
    for absent in ["@if", "@else", "fn sample_glass(", "fn sample_texture(", "import "] {
        assert!(!code.contains(absent), "{absent}");
    }
    assert!(text("tick.wgsl").contains("fn wf_advance(") && text("resolve.wgsl").contains("fn wf_resolve("));
    assert!(text("leaves.txt").contains("bytes per lane"));

    let file = folder.path().join("taken");
    fs::write(&file, "a file").expect("written");
    let file_text = file.display().to_string();
    refuses(&["explain", "cornell-box", "--dump", &file_text], 1, &["taken", "cannot write", "not a folder"]);
    refuses(&["explain", "cornell-box", "--dump", &file.join("below").display().to_string()], 1, &["below", "cannot write"]);
    assert_eq!(fs::read(&file).expect("still there"), b"a file");
}

/// Kills: a summary without the hash that scripts compare, or with two of them; a hash that depends on the schedule.
#[test]
fn a_render_prints_one_hash_whatever_the_schedule() {
    let adapters = path_tracer(&["adapters", "--json"]);
    assert!(adapters.status.success());
    if String::from_utf8_lossy(&adapters.stdout).trim() == "[]" {
        assert!(std::env::var_os("WAVEPOOL_NO_SKIP").is_none(), "no adapter");
        println!("skipped: no adapter");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let mut hashes = Vec::new();
    for (schedule, name) in [("never", "a.png"), ("block,threshold=0.1,check_every=1", "b.exr"), ("megakernel", "c.png")] {
        let out = folder.path().join(name).display().to_string();
        let output = path_tracer(&["render", "cornell-box", "--size", "40x24", "--samples", "2", "--schedule", schedule, "--out", &out]);
        let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let lines: Vec<&str> = stdout.lines().filter_map(|line| line.strip_prefix("image-hash: ")).collect();
        assert_eq!(lines.len(), 1, "{stdout}");
        assert!(lines[0].len() == 16 && lines[0].bytes().all(|byte| byte.is_ascii_hexdigit()), "{stdout}");
        hashes.push(lines[0].to_owned());
        assert!(fs::metadata(&out).expect("a picture").len() > 100);
    }
    assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");
}

/// Kills: a drawing that begins without its arguments understood; endings and a megakernel that are found out after the runs.
#[test]
fn a_drawing_that_cannot_be_is_refused_before_it_is_made() {
    refuses(&["schedule", "cornell-box", "--out", "picture.png"], 1, &["picture.png: the name should end in .svg or .html"]);
    refuses(&["schedule", "cornell-box", "--out", "no-folder/a.svg"], 1, &["a.svg", "cannot write"]);
    refuses(&["schedule", "no-such-scene", "--out", "a.svg"], 1, &["no-such-scene", "built-in"]);
    let megakernel = ["schedule", "cornell-box", "--schedule", "never", "--schedule", "megakernel", "--out", "a.svg"];
    refuses(&megakernel, 2, &["--schedule megakernel", "no steps to draw"]);
    refuses(&["schedule", "cornell-box", "--pool-blocks", "0", "--out", "a.svg"], 2, &["--pool-blocks 0"]);
    assert_eq!(path_tracer(&["schedule", "cornell-box"]).status.code(), Some(2));
}

/// Kills: a drawing whose launches or steps are not those of the run; one of several schedules left out; a page that is a still.
#[test]
fn schedules_are_drawn_from_the_run() {
    if String::from_utf8_lossy(&path_tracer(&["adapters", "--json"]).stdout).trim() == "[]" {
        assert!(std::env::var_os("WAVEPOOL_NO_SKIP").is_none(), "no adapter");
        println!("skipped: no adapter");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for (name, start) in [("a.svg", "<svg "), ("b.HTML", "<!DOCTYPE html>")] {
        let out = folder.path().join(name).display().to_string();
        let output = path_tracer(&[
            "schedule",
            "cornell-box",
            "--size",
            "40x24",
            "--pool-blocks",
            "3",
            "--schedule",
            "never",
            "--schedule",
            "block,threshold=0,check_every=1,roulette=block-max",
            "--out",
            &out,
        ]);
        let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let drawing = fs::read_to_string(&out).expect("a drawing");
        assert!(drawing.starts_with(start), "{name}");
        let runs: Vec<&str> = stdout.lines().filter_map(|line| line.strip_prefix("schedule: ")?.split(": ").nth(1)).collect();
        assert_eq!(runs.len(), 2, "{stdout}");
        runs.iter().for_each(|run| assert!(drawing.contains(&format!(">{run}, ")), "{name}: {run}"));
    }
}

/// False, with a word, where there is no adapter.
fn has_adapter() -> bool {
    if String::from_utf8_lossy(&path_tracer(&["adapters", "--json"]).stdout).trim() != "[]" {
        return true;
    }
    assert!(std::env::var_os("WAVEPOOL_NO_SKIP").is_none(), "no adapter");
    println!("skipped: no adapter");
    false
}

/// A small render that succeeds; what it printed to stdout.
fn rendered(arguments: &[&str]) -> String {
    let mut all = vec!["render", "cornell-box", "--size", "40x24"];
    if !arguments.contains(&"--samples") {
        all.extend(["--samples", "2"]);
    }
    all.extend(arguments);
    let output = path_tracer(&all);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn hash_of(stdout: &str) -> String {
    stdout.lines().find_map(|line| line.strip_prefix("image-hash: ")).expect("a hash").to_owned()
}

/// Kills: lines beside the JSON, a quiet command that talks, a format whose pixels are others than those of its neighbour.
#[test]
fn formats_agree_and_json_is_alone() {
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let said = json(&rendered(&["--out", &path("a.exr"), "--json"]));
    assert_eq!((said["width"].as_u64(), said["height"].as_u64(), said["samples"].as_u64()), (Some(40), Some(24), Some(2)));
    assert_eq!((said["file"].as_str(), said["complete"].as_bool()), (Some(path("a.exr").as_str()), Some(true)));
    assert!(said["warnings"].is_array() && said["seconds"].is_number());
    assert_eq!(rendered(&["--out", &path("a.pfm"), "--quiet"]), "");
    assert_eq!(Some(hash_of(&rendered(&["--out", &path("a.npy")])).as_str()), said["hash"].as_str());
    rendered(&["--out", &path("half.exr"), "--half"]);
    rendered(&["--out", &path("deep.png"), "--bits", "16"]);
    rendered(&["--out", &path("agx.png"), "--tone-map", "agx"]);
    let relmse = |name: &str| {
        let output = path_tracer(&["compare", &path(name), &path("a.exr"), "--json"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        json(&String::from_utf8_lossy(&output.stdout))["relmse"].as_f64().expect("a number")
    };
    assert_eq!((relmse("a.pfm"), relmse("a.npy")), (0.0, 0.0));
    // Light above white is clipped in a PNG.
    assert!(relmse("half.exr") > 0.0 && relmse("half.exr") < 1e-6 && relmse("deep.png") < 1.0 && relmse("agx.png") > 0.01);
}

/// Kills: a check that passes whatever it finds, exit code 1 without a check, sizes that do not agree compared all the same.
#[test]
fn comparing_is_a_check_when_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let pfm = |name: &str, header: &str, values: &[f32]| {
        let bytes: Vec<u8> = header.bytes().chain(values.iter().flat_map(|value| value.to_le_bytes())).collect();
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("written");
        path.display().to_string()
    };
    let one = pfm("one.pfm", "PF\n1 1\n-1\n", &[1.0; 3]);
    let two = pfm("two.pfm", "PF\n1 1\n-1\n", &[1.5; 3]);
    let odd = pfm("odd.pfm", "PF\n1 1\n-1\n", &[1.0, f32::NAN, 1.0]);
    let wide = pfm("wide.pfm", "PF\n2 1\n-1\n", &[1.0; 6]);
    let code = |arguments: &[&str]| path_tracer(&[&["compare"], arguments].concat()).status.code();
    assert_eq!(code(&[&two, &one]), Some(0));
    assert_eq!(code(&[&two, &one, "--max-relmse", "0.2476"]), Some(0));
    assert_eq!(code(&[&two, &one, "--max-relmse", "0.2475"]), Some(1));
    assert_eq!(code(&[&one, &one, "--max-relmse", "0"]), Some(0));
    assert_eq!((code(&[&odd, &one]), code(&[&odd, &one, "--max-relmse", "1"])), (Some(0), Some(1)));
    refuses(&["compare", &wide, &one], 1, &["wide.pfm", "2x1", "1x1"]);
    refuses(&["compare", "nothing.exr", &one], 1, &["nothing.exr"]);
    refuses(&["compare", &one, "picture.gif"], 1, &["picture.gif", ".exr, .hdr, .png, .pfm or .npy"]);
    let said = String::from_utf8_lossy(&path_tracer(&["compare", &two, &one]).stdout).into_owned();
    for part in ["MSE:             2.5", "relMSE:          2.475248e-1", "+50.0000 %", "from 0,0", "0 values of the picture"] {
        assert!(said.contains(part), "`{part}` is not in: {said}");
    }
}

/// Kills: a camera option without effect, a field of view across the width, a message that does not list the cameras.
#[test]
fn a_camera_can_be_chosen() {
    refuses(&["render", "cornell-box", "--camera", "nobody"], 2, &["--camera nobody", "the scene has '"]);
    refuses(&["render", "cornell-box", "--look-from", "0,1,5", "--look-at", "0,1,5"], 2, &["--look-at 0,1,5"]);
    assert_eq!(path_tracer(&["render", "cornell-box", "--look-from", "0,1,5"]).status.code(), Some(2));
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("a.png").display().to_string();
    let hash = |arguments: &[&str]| hash_of(&rendered(&[arguments, &["--out", &out]].concat()));
    let cameras = json(&String::from_utf8_lossy(&path_tracer(&["info", "cornell-box", "--json"]).stdout))["cameras"].clone();
    let (name, degrees) = (cameras[0]["name"].as_str().expect("a name"), cameras[0]["vertical_fov_degrees"].as_f64().expect("an angle"));
    let plain = hash(&[]);
    assert_eq!(hash(&["--camera", name]), plain);
    assert_ne!(hash(&["--fov", &format!("{}", degrees * 0.5)]), plain);
    assert_ne!(hash(&["--look-from", "-0.2,1,3", "--look-at", "0,1,0"]), plain);
}

/// Kills: a preview that is not complete, one that changes the picture, a viewer that is sent nothing.
#[test]
fn looking_on_changes_nothing() {
    refuses(&["render", "cornell-box", "--preview", "a.gif"], 1, &["a.gif"]);
    let nobody = ["render", "cornell-box", "--tev", "127.0.0.1:1"];
    refuses(&nobody, 1, &["tev at 127.0.0.1:1"]);
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let viewer = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut listener.accept().expect("a caller").0, &mut bytes).expect("bytes");
        bytes
    });
    let samples = ["--samples", "64"];
    let watched = ["--preview", &path("p.pfm"), "--tev", &address, "--every", "0.02s"];
    let hash = hash_of(&rendered(&[&samples[..], &watched, &["--out", &path("a.exr")]].concat()));
    assert_eq!(hash_of(&rendered(&[&samples[..], &["--out", &path("b.exr")]].concat())), hash);
    let output = path_tracer(&["compare", &path("p.pfm"), &path("b.exr"), "--json"]);
    let relmse = json(&String::from_utf8_lossy(&output.stdout))["relmse"].as_f64().expect("a number");
    assert!(relmse > 0.0 && relmse < 1.0, "{relmse}");
    // One packet that creates the picture, one for the preview and one for the finished picture at least.
    let bytes = viewer.join().expect("received");
    let packet = 4 + 2 + "Cornell box\0".len() + 4 + 6 + 16 + 48 + 40 * 24 * 12;
    assert!(bytes.len() > 2 * packet, "{} bytes", bytes.len());
    refuses(&["render", "cornell-box", "--schedule", "auto", "--preview", &path("q.png")], 2, &["--schedule auto", "--preview"]);
}

/// Kills: random numbers by the place in the part, a camera of the part's size, rows of another width, work outside of the part; under
/// schedules that hand out tiles, lanes or whole walks.
#[test]
fn a_part_shows_what_the_whole_shows_there() {
    for part in ["30,0,11x4", "0,24,1x1", "4294967295,0,1x1"] {
        refuses(&["render", "cornell-box", "--size", "40x24", "--crop", part], 2, &[&format!("--crop {part}"), "40x24"]);
    }
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let values = |arguments: &[&str]| {
        let out = folder.path().join("a.npy");
        rendered(&[arguments, &["--out", &out.display().to_string()]].concat());
        let bytes = fs::read(&out).expect("an array");
        bytes[128..].chunks_exact(12).map(<[u8]>::to_vec).collect::<Vec<_>>()
    };
    let whole = values(&[]);
    let part: Vec<Vec<u8>> = (3..23).flat_map(|y| whole[y * 40 + 7..y * 40 + 7 + 30].to_vec()).collect();
    for schedule in ["block,order=depth-max", "compaction,every=2", "megakernel-regen", "persistent"] {
        assert!(values(&["--crop", "7,3,30x20", "--schedule", schedule]) == part, "{schedule}");
    }
    for schedule in ["block", "per-lane"] {
        assert!(values(&["--crop", "7,3,30x20", "--schedule", schedule, "--checked"]) == part, "{schedule}, checked");
    }
    let said = json(&rendered(&["--crop", "7,3,30x20", "--out", &folder.path().join("a.exr").display().to_string(), "--json"]));
    assert_eq!((said["width"].as_u64(), said["height"].as_u64()), (Some(30), Some(20)));
    assert_eq!(said["warnings"].as_array().map(Vec::len), Some(0));
    let out = folder.path().join("b.png").display().to_string();
    let said = json(&rendered(&["--crop", "7,3,30x20", "--schedule", "block,roulette=block-max", "--out", &out, "--json"]));
    assert!(said["warnings"].to_string().contains("--crop"), "{said}");
}

/// Kills: a scene's content miscounted, an object that is no JSON, warnings that are not told.
#[test]
fn a_scene_is_described() {
    let said = String::from_utf8_lossy(&path_tracer(&["info", "cornell-box"]).stdout).into_owned();
    for part in ["triangles:", "cameras:", "materials:", "environment:", "memory:", "emissive triangles"] {
        assert!(said.contains(part), "`{part}` is not in: {said}");
    }
    let object = json(&String::from_utf8_lossy(&path_tracer(&["info", "cornell-box", "--json"]).stdout));
    assert!(object["triangles"].as_u64() > Some(10) && object["device_bytes"].as_u64() > Some(100), "{object}");
    refuses(&["info", "no-such-scene"], 1, &["no-such-scene", "built-in"]);
    refuses(&["info", "cornell-box", "--env-rotation", "90"], 2, &["--env-rotation", "no environment"]);
}

/// Kills: help without a next step, completions and pages that lack commands, escape codes where nobody wants them.
#[test]
fn a_stranger_is_told_what_to_do() {
    let text = |arguments: &[&str]| String::from_utf8_lossy(&path_tracer(arguments).stdout).into_owned();
    let help = text(&["--help"]);
    for part in ["path-tracer render cornell-box", "path-tracer info scene.glb", "compare", "Exit codes"] {
        assert!(help.contains(part), "`{part}` is not in: {help}");
    }
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = text(&["completions", shell]);
        assert!(script.contains("tone-map") && script.contains("skip-existing") && script.contains("compare"), "{shell}");
    }
    assert!(text(&["man"]).contains(".TH path-tracer"));
    assert!(text(&["man", "render"]).contains("tone\\-map"));
    refuses(&["man", "paint"], 2, &["man paint", "render", "compare"]);
    let command = |variable: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_path-tracer"));
        command.args(["--help"]).env(variable, "1").output().expect("the binary runs").stdout
    };
    assert!(!command("NO_COLOR").contains(&0x1b));
}
