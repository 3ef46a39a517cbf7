//! The command `path-tracer` as a stranger meets it: messages, exit codes, what happens to files.

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
    refuses(&["render", "cornell-box", "--out", "picture.gif"], 1, &["picture.gif", ".png or .exr"]);
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
    refuses(&["explain", "cornell-box", "--schedule", "auto"], 2, &["--schedule auto", "one can be explained"]);
    for command in ["render", "explain", "scenes", "adapters", "schedule", "schedules"] {
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
    assert!(stages.contains("fn wf_megakernel(") && stages.contains("fn next_bounce(") && stages.contains("const BVH_STACK: u32 = "));
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
