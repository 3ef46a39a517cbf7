//! `path-tracer sheet`: an overview of many scenes in one picture.
//!
//! Key decision: what cannot be shown is a grey cell with its reason and not the end of the work; the exit code says that there are such cells.

use std::{
    collections::HashSet,
    ffi::OsStr,
    fs,
    ops::ControlFlow,
    path::{Path, PathBuf},
    time::Instant,
};

use path_tracer::{
    Renderer, Settings,
    output::{
        Options, Picture,
        sheet::{self, Sheet},
    },
    scene::{self, Environment, LoadOptions},
    wavepool::{GpuContext, GpuOptions},
};
use serde_json::{Value, json};

use super::{
    Failure,
    picture::ToneMapName,
    scene::load_in,
    stop,
    value::{self, Size},
    voice::{Voice, VoiceArguments},
};

/// What a stranger should know before and after.
const AFTER_HELP: &str = "\
Exit codes: 0 all are shown, 3 some are not. Without a sheet: 1 it could not be made, 2 wrong usage. Ctrl-C: 130, with what is finished.";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Folders, with all scenes below them in order; scene files (.glb, .gltf, .obj, .ply); built-in scenes; panoramas (.hdr, .exr),
    /// which are shown as pictures.
    #[arg(required = true, value_name = "FOLDER|FILE")]
    places: Vec<String>,
    /// The sheet, a .png.
    #[arg(long, value_name = "FILE.png")]
    out: PathBuf,
    /// Pictures side by side; about as wide as high when not given.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = value::positive)]
    columns: Option<u32>,
    /// Pixels of one picture.
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = value::size)]
    size: Size,
    /// Samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 16, allow_negative_numbers = true, value_parser = value::positive)]
    samples: u32,
    /// Bounces after which a path ends.
    #[arg(long, value_name = "N", default_value_t = 8, allow_negative_numbers = true, value_parser = value::whole)]
    depth: u32,
    /// Light all scenes with an equirectangular .hdr or .exr image; otherwise those without a light get a plain sky.
    #[arg(long, value_name = "FILE")]
    env: Option<PathBuf>,
    /// Brightness in stops.
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = value::finite)]
    exposure: f32,
    /// How light above white is shown.
    #[arg(long, value_name = "MAP", default_value = "agx")]
    tone_map: ToneMapName,
    /// Part of the name of the adapter to use.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    #[command(flatten)]
    voice: VoiceArguments,
}

/// Something that gets a cell.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    /// As `load` takes it.
    name: String,
    /// From the folder that was given.
    caption: String,
}

/// What became of a cell.
struct Shown {
    picture: Picture,
    /// For people, behind the caption.
    line: String,
    warnings: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut voice = Voice::of(arguments.voice);
    sheet::check_writable(&arguments.out)?;
    let mut entries = Vec::new();
    for place in &arguments.places {
        entries.extend(collect(place)?);
    }
    // Read once, and before anything else: one message instead of a sheet of grey cells.
    let panorama = arguments.env.as_deref().map(scene::load_environment).transpose()?;
    let (environment, said) = panorama.map_or((None, Vec::new()), |(environment, said)| (Some(environment), said));
    let cell = [arguments.size.width, arguments.size.height];
    let too_large = |what: String| Failure::Usage(format!("--size {}: {what}", arguments.size));
    let mut sheet = Sheet::new(entries.len(), cell, arguments.columns).map_err(too_large)?;
    let gpu = GpuContext::new(&GpuOptions { adapter: arguments.adapter.clone(), ..GpuOptions::default() })?;
    voice.say(format_args!("adapter:  {}", gpu.facts));
    let options = Options { exposure: arguments.exposure, tone_map: arguments.tone_map.into(), ..Options::default() };
    said.iter().for_each(|warning| voice.note(format_args!("{warning}")));
    stop::listen()?;

    let mut cells: Vec<Value> = Vec::new();
    let mut n_failed = 0;
    for (index, Entry { name, caption }) in entries.iter().enumerate() {
        let begun = Instant::now();
        let shown = if stop::is_asked() { Err(stopped()) } else { show(arguments, &gpu, name, environment.as_ref()) };
        let seconds = begun.elapsed().as_secs_f64();
        match shown {
            Ok(Shown { picture, line, warnings }) => {
                sheet.show(index, caption, &picture, &options);
                voice.say(format_args!("shown:    {caption}: {line}, {seconds:.1} s"));
                warnings.iter().for_each(|warning| voice.note(format_args!("{caption}: {warning}")));
                cells.push(json!({ "file": name, "error": null, "seconds": seconds }));
            }
            Err(Failure::Stopped(_)) => break,
            Err(failure) => {
                n_failed += 1;
                let why = failure.to_string();
                let why = why.lines().next().unwrap_or_default();
                let reason = why.strip_prefix(name).and_then(|rest| rest.strip_prefix(": ")).unwrap_or(why);
                sheet.refuse(index, caption, reason);
                voice.say(format_args!("failed:   {caption}: {reason}"));
                cells.push(json!({ "file": name, "error": why, "seconds": seconds }));
            }
        }
    }
    sheet.write(&arguments.out)?;
    let [width, height] = sheet.size();
    let n_shown = cells.len() - n_failed;
    voice.say(format_args!("sheet:    {}, {width}x{height}, {n_shown} shown, {n_failed} failed", arguments.out.display()));
    let (n, is_complete) = (entries.len(), cells.len() == entries.len());
    voice.conclude(json!({
        "file": arguments.out.display().to_string(),
        "width": width,
        "height": height,
        "complete": is_complete,
        "failed": n_failed,
        "cells": cells,
        "adapter": gpu.facts.to_string(),
    }));
    let out = arguments.out.display();
    match (is_complete, n_failed) {
        (false, _) => Err(Failure::Stopped(format!("stopped after {} of {n}; {out} shows them", n_shown + n_failed))),
        (true, 0) => Ok(()),
        (true, _) => Err(Failure::Partial(format!("{out}: {n_failed} of {n} are not shown"))),
    }
}

fn stopped() -> Failure {
    Failure::Stopped(String::from("stopped"))
}

/// The picture of a cell.
fn show(arguments: &Arguments, gpu: &GpuContext, name: &str, environment: Option<&Environment>) -> Result<Shown, Failure> {
    let path = Path::new(name);
    if kind(path) == Some(Kind::Panorama) {
        let (environment, warnings) = scene::load_environment(path)?;
        let line = format!("panorama, {}x{}", environment.width, environment.height);
        let picture = Picture::of_color(environment.width, environment.height, environment.texels);
        return Ok(Shown { picture, line, warnings });
    }
    let Size { width, height } = arguments.size;
    let mut scene = load_in(name, environment.map(|environment| (environment.clone(), Vec::new())), &LoadOptions::default())?;
    scene.reframe(width as f32 / height as f32);
    let settings = Settings { width, height, samples: arguments.samples, depth: arguments.depth, ..Settings::default() };
    let mut renderer = Renderer::new(gpu, &scene, &settings)?;
    let rendering = renderer.render(|_| if stop::is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })?;
    if rendering.report.passes < settings.samples {
        return Err(stopped());
    }
    let picture = Picture::of_color(width, height, rendering.pixels());
    let mut warnings = scene.warnings;
    warnings.extend(renderer.warnings().iter().cloned());
    warnings.extend(rendering.report.notes);
    Ok(Shown { picture, line: format!("{} triangles", scene.triangles.len()), warnings })
}

/// What a file is, by the ending of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Scene,
    Panorama,
}

fn kind(path: &Path) -> Option<Kind> {
    match path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase).as_deref() {
        Some("glb" | "gltf" | "obj" | "ply") => Some(Kind::Scene),
        Some("hdr" | "exr") => Some(Kind::Panorama),
        _ => None,
    }
}

/// What a place of the command line stands for: the files below a folder, otherwise itself.
fn collect(place: &str) -> Result<Vec<Entry>, Failure> {
    let top = Path::new(place);
    if !top.is_dir() {
        return Ok(vec![Entry { name: String::from(place), caption: String::from(place) }]);
    }
    let mut found = Vec::new();
    let mut seen = HashSet::new();
    let mut open = vec![top.to_path_buf()];
    while let Some(folder) = open.pop() {
        let refused = |error: std::io::Error| Failure::Runtime(format!("{}: {error}", folder.display()));
        // A link may lead back to a folder above it.
        if !seen.insert(fs::canonicalize(&folder).map_err(refused)?) {
            continue;
        }
        for entry in fs::read_dir(&folder).map_err(refused)? {
            let path = entry.map_err(refused)?.path();
            if path.is_dir() {
                open.push(path);
            } else if kind(&path).is_some() {
                let caption = path.strip_prefix(top).unwrap_or(&path).display().to_string();
                found.push(Entry { name: path.display().to_string(), caption });
            }
        }
    }
    if found.is_empty() {
        return Err(Failure::Runtime(format!("{place}: there is no scene in this folder (.glb, .gltf, .obj, .ply, .hdr or .exr)")));
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: files out of order or of other kinds, folders that are not walked or walked for ever, captions that repeat the folder.
    #[test]
    fn a_folder_stands_for_what_is_below_it() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["b.GLB", "a.txt", "c/z.hdr", "c/d/a.obj", "empty/x.bin"] {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, b"").expect("written");
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(folder.path(), folder.path().join("c/again")).expect("linked");
        let text = folder.path().display().to_string();
        let captions: Vec<String> = collect(&text).expect("found").into_iter().map(|entry| entry.caption).collect();
        assert_eq!(captions, ["b.GLB", "c/d/a.obj", "c/z.hdr"]);
        let none = collect(&folder.path().join("empty").display().to_string()).map_err(|failure| failure.to_string());
        assert!(none.is_err_and(|text| text.contains("empty: there is no scene")));
        assert_eq!(collect("no-such.glb").expect("itself").len(), 1);
    }
}
