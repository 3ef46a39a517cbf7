//! Ctrl-C: the first keeps what is finished, the second ends at once.
#![cfg(unix)]

use std::{
    fs,
    io::{BufRead as _, BufReader, Read as _},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use crate::{has_adapter, json, path_tracer, triangle_that_moves};

fn started(arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_path-tracer"));
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the binary runs")
}

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs").success());
}

/// Gives up after two minutes, so that what is asserted next tells why.
fn wait_until(is_so: impl Fn() -> bool) {
    let begun = Instant::now();
    while !is_so() && begun.elapsed() < Duration::from_secs(120) {
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Kills: a picture thrown away by Ctrl-C, one that claims to be complete, an exit code that says that all is well.
#[test]
fn ctrl_c_leaves_what_is_finished() {
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let arguments = ["render", "cornell-box", "--size", "64x64", "--samples", "1000000", "--json", "--every", "0.05s"];
    let child = started(&[&arguments[..], &["--out", &path("a.exr"), "--preview", &path("p.pfm")]].concat());
    // A preview says that there is something to keep.
    wait_until(|| folder.path().join("p.pfm").exists());
    interrupt(&child);
    let output = child.wait_with_output().expect("it ends");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("stopped after") && stderr.contains("of 1000000 samples"), "{stderr}");
    let said = json(&String::from_utf8_lossy(&output.stdout));
    assert_eq!(said["complete"].as_bool(), Some(false));
    assert!(said["samples"].as_u64() > Some(0) && folder.path().join("a.exr").exists());
}

/// Kills: a second Ctrl-C that waits for what the first has asked for, or ends with another code than shells expect.
#[test]
fn a_second_ctrl_c_ends_at_once() {
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("a.exr");
    // A viewer that does not read on keeps the picture waiting, with samples that the first Ctrl-C would write.
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let arguments = ["render", "cornell-box", "--size", "1024x1024", "--depth", "0", "--samples", "1000000", "--every", "0.01s"];
    let mut child = started(&[&arguments[..], &["--out", &out.display().to_string(), "--tev", &address]].concat());
    let (mut viewer, _) = listener.accept().expect("a caller");
    viewer.read_exact(&mut [0; 4]).expect("the first packet");
    let mut stderr = BufReader::new(child.stderr.take().expect("piped"));
    let mut said = String::new();
    interrupt(&child);
    while !said.contains("Ctrl-C again") {
        assert!(stderr.read_line(&mut said).expect("text") > 0, "it has ended: {said}");
    }
    interrupt(&child);
    let code = child.wait().expect("it ends").code();
    stderr.read_to_string(&mut said).expect("text");
    assert_eq!(code, Some(130), "{said}");
    assert!(!said.contains("stopped") && !out.exists(), "it has gone on: {said}");
    drop(viewer);
}

/// Kills: an unfinished frame that is taken for a finished one by the next run, finished frames thrown away, half a file.
#[test]
fn ctrl_c_leaves_finished_frames() {
    if !has_adapter() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scene = triangle_that_moves(folder.path());
    let out = folder.path().join("a.npy").display().to_string();
    let arguments = ["render", &scene, "--size", "16x16", "--samples", "4", "--frames", "1..1000000", "--json", "--out", &out];
    let child = started(&arguments);
    wait_until(|| folder.path().join("a.0003.npy").exists());
    interrupt(&child);
    let output = child.wait_with_output().expect("it ends");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    let n_said = String::from_utf8_lossy(&output.stdout).lines().filter(|line| json(line)["complete"] == true).count();
    let entries = fs::read_dir(folder.path()).expect("listed");
    let names: Vec<String> = entries.map(|entry| entry.expect("listed").file_name().to_string_lossy().into_owned()).collect();
    let frames = names.iter().filter(|name| name.ends_with(".npy")).count();
    assert!(frames >= 3 && frames == n_said, "{frames} files, {n_said} said: {stderr}");
    assert!(names.iter().all(|name| !name.contains("tmp")), "{names:?}");
    // The next run takes them for what they are.
    let range = format!("1..{frames}");
    let again = path_tracer(&[&arguments[..6], &["--frames", &range, "--skip-existing", "--json", "--out", &out]].concat());
    let stdout = String::from_utf8_lossy(&again.stdout).into_owned();
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
    assert!(stdout.lines().count() == frames && stdout.lines().all(|line| json(line)["skipped"] == true), "{stdout}");
}
