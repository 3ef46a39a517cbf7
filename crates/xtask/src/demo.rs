//! `cargo xtask demo`: from a fresh checkout to a picture.

use std::{
    fs,
    io::{BufRead as _, BufReader},
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use crate::{
    process::{self, Failure},
    setup,
};

const SCENE: &str = "cornell-box";
/// Chosen so that two cores of a software driver need about a minute.
const SIZE: u32 = 256;
const SAMPLES: u32 = 64;
const PICTURE: &str = "out/cornell-box.png";

/// Sets up, renders and says where the picture is.
///
/// # Errors
/// When there is no adapter, the renderer fails, or the picture is not one.
pub(crate) fn run(root: &Path, agreed: bool) -> Result<(), Failure> {
    let adapters = setup::set_up(root, agreed)?;
    let picture = root.join(PICTURE);
    fs::create_dir_all(root.join("out")).map_err(|why| Failure::step(format!("cannot make the folder `out`: {why}")))?;
    // An older picture would hide that the renderer wrote none.
    if picture.exists() {
        fs::remove_file(&picture).map_err(|why| Failure::step(format!("cannot replace {PICTURE}: {why}")))?;
    }
    println!("rendering {SCENE}, {SIZE}x{SIZE} pixels, {SAMPLES} samples each");
    let (size, samples) = (format!("{SIZE}x{SIZE}"), SAMPLES.to_string());
    let start = Instant::now();
    let said = run_and_listen(&mut process::cargo(
        root,
        &[
            "run",
            "--quiet",
            "--package",
            "path_tracer",
            "--bin",
            "path-tracer",
            "--",
            "render",
            SCENE,
            "--size",
            &size,
            "--samples",
            &samples,
            "--out",
            PICTURE,
        ],
    ))?;
    let took = start.elapsed();
    check_picture(&picture)?;
    println!();
    println!("adapter: {}", adapter_named_in(&said).unwrap_or_else(|| adapters[0].label()));
    println!("speed:   {}", speed(SIZE * SIZE * SAMPLES, took));
    println!("picture: {}", picture.display());
    Ok(())
}

/// Runs the renderer, passes its standard output on line by line, and returns it.
fn run_and_listen(command: &mut Command) -> Result<String, Failure> {
    let failed = |why: std::io::Error| Failure::step(format!("the renderer could not be run: {why}"));
    let mut child = command.stdout(Stdio::piped()).spawn().map_err(failed)?;
    let mut said = String::new();
    if let Some(stdout) = child.stdout.take() {
        for line in BufReader::new(stdout).lines() {
            let line = line.map_err(failed)?;
            println!("{line}");
            said += &line;
            said.push('\n');
        }
    }
    let status = child.wait().map_err(failed)?;
    if status.success() { Ok(said) } else { Err(Failure::step(format!("`path-tracer render {SCENE}` failed ({status})"))) }
}

/// The adapter that the renderer says it used; on a machine with several, the list alone does not tell.
fn adapter_named_in(said: &str) -> Option<String> {
    said.lines().find_map(|line| {
        let (key, value) = line.trim().split_once(':')?;
        (key.trim() == "adapter").then(|| value.trim().to_owned())
    })
}

fn speed(samples: u32, took: Duration) -> String {
    let seconds = took.as_secs_f64().max(1e-3);
    format!(
        "{:.2} million samples/s ({samples} samples in {seconds:.1} s, start and shader compilation included)",
        f64::from(samples) / seconds / 1e6
    )
}

fn check_picture(picture: &Path) -> Result<(), Failure> {
    let bytes = fs::read(picture).map_err(|why| Failure::step(format!("the renderer succeeded without writing {PICTURE}: {why}")))?;
    if is_png(&bytes) { Ok(()) } else { Err(Failure::step(format!("{PICTURE} is not a complete PNG file"))) }
}

/// True for a file that begins and ends as PNG files do.
fn is_png(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x89PNG\r\n\x1a\n") && bytes.ends_with(b"IEND\xae\x42\x60\x82")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: the first adapter of the list reported although the renderer used another.
    #[test]
    fn the_renderer_names_its_adapter() {
        let said = "scene:   cornell-box\nadapter: llvmpipe (LLVM 15: 256 bits)\nimage-hash: 0123456789abcdef\n";
        assert_eq!(adapter_named_in(said).as_deref(), Some("llvmpipe (LLVM 15: 256 bits)"));
        assert_eq!(adapter_named_in("image-hash: 0\n"), None);
    }

    /// Kills: an empty or truncated file announced as a picture.
    #[test]
    fn a_truncated_picture_is_none() {
        let whole = [&b"\x89PNG\r\n\x1a\n"[..], b"...", b"\0\0\0\0IEND\xae\x42\x60\x82"].concat();
        assert!(is_png(&whole));
        assert!(!is_png(&whole[..whole.len() - 1]));
        assert!(!is_png(b""));
    }

    /// Kills: a speed in samples per millisecond, or a division by zero.
    #[test]
    fn speed_counts_samples_per_second() {
        assert!(speed(4_194_304, Duration::from_secs(4)).starts_with("1.05 million samples/s"));
        assert!(speed(1, Duration::ZERO).contains("0.00 million"));
    }
}
