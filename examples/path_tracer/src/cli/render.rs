//! `path-tracer render`: a scene to an image.

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use path_tracer::{
    Renderer, Settings, output,
    scene::{self, Environment, Scene},
    wavepool::{GpuContext, GpuOptions, Instruments, Schedule},
};

use super::{Failure, progress::Meter, say};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// A built-in scene (see `path-tracer scenes`) or a .glb, .gltf, .obj or .ply file.
    pub(crate) scene: String,
    /// Light the scene with an equirectangular .hdr or .exr image.
    #[arg(long, value_name = "FILE")]
    pub(crate) env: Option<PathBuf>,
    /// Pixels.
    #[arg(long, value_name = "WxH", default_value = "512x512")]
    pub(crate) size: String,
    /// Samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 64)]
    samples: u32,
    /// Number of the first sample; the next run of a series begins where the last one ended.
    #[arg(long, value_name = "N", default_value_t = 0)]
    first_sample: u32,
    /// Bounces after which a path ends.
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub(crate) depth: u32,
    /// Another seed, another noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u32,
    /// NAME[,key=value...], for example block,threshold=0.25,order=depth-max; `path-tracer schedules` lists names and keys.
    #[arg(long, value_name = "SPEC", default_value = "block")]
    pub(crate) schedule: String,
    /// Blocks of 256 lanes that are in flight at once.
    #[arg(long, value_name = "N")]
    pool_blocks: Option<u32>,
    /// Part of the name of the adapter to use.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Brightness of a PNG in stops.
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Write counters, steps, walk lengths and device times to a JSON file, and print a summary.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Write every launch to a trace file for Perfetto (ui.perfetto.dev) or chrome://tracing.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// After every step, count lanes and results again and compare; slow.
    #[arg(long)]
    checked: bool,
    /// Blocks of a bank, at most; a pool of more has several.
    #[arg(long, value_name = "N")]
    bank_blocks: Option<u32>,
    /// .png or .exr; the scene's name with .png when not given.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Arguments {
    pub(crate) fn settings(&self) -> Result<Settings, Failure> {
        let (width, height) = parse_size(&self.size)?;
        if self.samples == 0 {
            return Err(Failure::Usage("--samples 0: at least 1".into()));
        }
        if self.first_sample.checked_add(self.samples).is_none() {
            return Err(Failure::Usage(format!("--first-sample {}: the last sample would exceed {}", self.first_sample, u32::MAX)));
        }
        if !self.exposure.is_finite() {
            return Err(Failure::Usage(format!("--exposure {}: not a finite number", self.exposure)));
        }
        let mut schedule: Schedule =
            self.schedule.parse().map_err(|error| Failure::Usage(format!("--schedule {}: {error}", self.schedule)))?;
        match self.pool_blocks {
            Some(0) => return Err(Failure::Usage("--pool-blocks 0: at least 1".into())),
            blocks => schedule.pool_blocks = blocks,
        }
        if self.bank_blocks == Some(0) {
            return Err(Failure::Usage("--bank-blocks 0: at least 1".into()));
        }
        schedule.bank_blocks = self.bank_blocks;
        let wants_statistics = self.stats.is_some() || self.trace.is_some();
        let observed = if wants_statistics { Instruments::statistics() } else { Instruments::default() };
        let markers = std::env::var_os("WAVEPOOL_MARKERS").is_some_and(|value| value == "1");
        let instruments = Instruments { checked: self.checked, markers, ..observed };
        Ok(Settings {
            width,
            height,
            samples: self.samples,
            first_sample: self.first_sample,
            depth: self.depth,
            seed: self.seed,
            schedule,
            instruments,
            ..Settings::default()
        })
    }

    /// The scene with its environment, lit by something; says on stdout what had to be assumed.
    pub(crate) fn load(&self) -> Result<Scene, Failure> {
        load(&self.scene, self.env.as_deref())
    }
}

/// A built-in scene or a file, with its environment and lit by something.
pub(crate) fn load(name: &str, env: Option<&Path>) -> Result<Scene, Failure> {
    let mut scene = match scene::builtin(name) {
        Some(scene) => scene,
        None => load_file(name)?,
    };
    if let Some(path) = env {
        let (environment, warnings) = scene::load_environment(path)?;
        scene.environment = Some(environment);
        scene.warnings.extend(warnings);
    }
    if !scene.has_light() {
        scene.environment = Some(Environment::plain_sky());
        scene.warnings.push("the scene has no light: lit by a plain sky".into());
    }
    Ok(scene)
}

/// A name without a known ending that is no file was meant as a built-in scene.
fn load_file(name: &str) -> Result<Scene, Failure> {
    let path = Path::new(name);
    if path.extension().is_none() && !path.exists() {
        let names: Vec<&str> = scene::BUILTIN.iter().map(|(name, _)| *name).collect();
        return Err(Failure::Runtime(format!("{name}: no such file, and no built-in scene; these are: {}", names.join(", "))));
    }
    Ok(scene::load(path)?)
}

/// The largest side; 2^32 pixels are beyond every film.
const LARGEST_SIDE: u32 = 32_768;

pub(crate) fn parse_size(text: &str) -> Result<(u32, u32), Failure> {
    let side = |part: &str| part.parse::<u32>().ok().filter(|side| (1..=LARGEST_SIDE).contains(side));
    text.split_once('x')
        .and_then(|(width, height)| Some((side(width)?, side(height)?)))
        .ok_or_else(|| Failure::Usage(format!("--size {text}: expected WIDTHxHEIGHT, each 1 to {LARGEST_SIDE}")))
}

/// The scene's name in the current folder.
fn default_output(scene: &str) -> PathBuf {
    let stem = Path::new(scene).file_stem().unwrap_or_default();
    PathBuf::from(stem).with_extension("png")
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let settings = arguments.settings()?;
    let out = arguments.out.clone().unwrap_or_else(|| default_output(&arguments.scene));
    output::check_writable(&out)?;
    for file in [&arguments.stats, &arguments.trace].into_iter().flatten() {
        output::check_place(file)?;
    }
    let mut scene = arguments.load()?;
    scene.reframe(settings.width as f32 / settings.height as f32);
    scene.warnings.iter().for_each(|warning| eprintln!("note: {warning}"));

    let gpu = GpuContext::new(&GpuOptions { adapter: arguments.adapter.clone() })?;
    let mut renderer = Renderer::new(&gpu, &scene, &settings)?;
    renderer.warnings().iter().for_each(|warning| eprintln!("note: {warning}"));
    say(format_args!("scene:      {}, {} triangles", scene.name, scene.triangles.len()));
    say(format_args!("adapter:    {}", gpu.facts));
    say(format_args!("schedule:   {}", renderer.schedule()));

    let items = u64::from(settings.width) * u64::from(settings.height) * u64::from(settings.samples);
    let meter = Meter::new(items);
    let rendering = renderer.render(|progress| {
        meter.update(progress);
        ControlFlow::Continue(())
    })?;
    meter.finish();
    output::write(&out, settings.width, settings.height, &rendering.pixels(), arguments.exposure)?;

    let report = &rendering.report;
    let seconds = report.elapsed.as_secs_f64();
    let (width, height, passes) = (settings.width, settings.height, report.passes);
    say(format_args!("rendered:   {width}x{height}, {passes} samples in {seconds:.1} s, {:.3} Msamples/s", items as f64 / seconds / 1e6));
    say(format_args!(
        "pool:       {} blocks in {} bank(s), {} bytes of state per lane; results of {} passes at once",
        report.pool_blocks,
        report.banks,
        renderer.scheduler().layout().bytes_per_lane(),
        report.ring
    ));
    say(format_args!(
        "work:       {} steps, {} launches, {} regenerations, {} of {} paths ended by roulette",
        report.steps, report.launches, report.regenerations, report.items_killed, report.items_started
    ));
    for decision in &report.decisions {
        let (first, last) = (decision.first_pass, decision.first_pass + decision.passes);
        say(format_args!("auto:       samples {first}..{last} by {}: {}", decision.schedule, decision.reason));
    }
    if report.not_finite > 0 {
        say(format_args!("ledger:     {} components of samples were not finite and count as zero", report.not_finite));
    }
    report.notes.iter().for_each(|note| eprintln!("note: {note}"));
    if arguments.stats.is_some() || arguments.trace.is_some() {
        let mut statistics = renderer.statistics(&rendering)?;
        statistics.command = std::env::args().skip(1).collect::<Vec<_>>().join(" ");
        if let Some(path) = &arguments.stats {
            output::write_json(path, &statistics.to_json())?;
        }
        if let Some(path) = &arguments.trace {
            output::write_json(path, &statistics.trace())?;
        }
        say(statistics.summary().trim_end());
    }
    say(format_args!("image:      {}", out.display()));
    say(format_args!("image-hash: {:016x}", rendering.film.hash()));
    Ok(())
}
