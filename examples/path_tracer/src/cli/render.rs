//! `path-tracer render`: a scene to an image.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

use path_tracer::{
    Crop, LayerRequest, Observer, Renderer, Rendering, Settings, Wish,
    output::{self, Facts, Options, Picture},
    wavepool::{GpuContext, GpuOptions, Instruments, Progress, Report, Schedule},
};

use super::{
    Failure,
    picture::PictureArguments,
    progress::Meter,
    scene::SceneArguments,
    stop,
    value::{self, Region, Size},
    view::ViewArguments,
    voice::{Voice, VoiceArguments},
    watch::{Watch, WatchArguments},
};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    #[command(flatten)]
    pub(crate) view: ViewArguments,
    /// Pixels.
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = value::size)]
    size: Size,
    /// Render this part of the picture only, with the same pixels as in the whole; an .exr keeps its place.
    #[arg(long, value_name = "X,Y,WxH", allow_hyphen_values = true, value_parser = value::region)]
    crop: Option<Region>,
    /// Samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 64, allow_negative_numbers = true, value_parser = value::positive)]
    samples: u32,
    /// Number of the first sample; the next run of a series begins where the last one ended.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true, value_parser = value::whole)]
    first_sample: u32,
    /// Bounces after which a path ends.
    #[arg(long, value_name = "N", default_value_t = 16, allow_negative_numbers = true, value_parser = value::whole)]
    depth: u32,
    /// Another seed, another noise.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true, value_parser = value::whole)]
    seed: u32,
    /// NAME[,key=value...], for example block,threshold=0.25,order=depth-max; `path-tracer schedules` lists names and keys.
    #[arg(long, value_name = "SPEC", default_value = "block", value_parser = schedule)]
    schedule: Schedule,
    /// What to find out beside the colour, for an .exr: NAME[,NAME...] of albedo, normal, depth, position, object, material, variance, or all.
    #[arg(long, value_name = "NAMES", default_value = "none", value_parser = layers)]
    layers: LayerRequest,
    /// Blocks of 256 lanes that are in flight at once.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = value::positive)]
    pool_blocks: Option<u32>,
    /// Blocks of a bank, at most; a pool of more has several.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = value::positive)]
    bank_blocks: Option<u32>,
    /// Part of the name of the adapter to use.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    #[command(flatten)]
    picture: PictureArguments,
    #[command(flatten)]
    watch: WatchArguments,
    /// Write counters, steps, walk lengths and device times to a JSON file, and print a summary.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Write every launch to a trace file for Perfetto (ui.perfetto.dev) or chrome://tracing.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// After every step, count lanes and results again and compare; slow.
    #[arg(long)]
    checked: bool,
    #[command(flatten)]
    pub(crate) voice: VoiceArguments,
}

fn layers(text: &str) -> Result<LayerRequest, String> {
    text.parse().map_err(|error: path_tracer::gpu_scene::Error| error.to_string())
}

fn schedule(text: &str) -> Result<Schedule, String> {
    text.parse().map_err(|error: path_tracer::wavepool::Error| error.to_string())
}

impl Arguments {
    pub(crate) fn settings(&self) -> Result<Settings, Failure> {
        if self.first_sample.checked_add(self.samples).is_none() {
            return Err(Failure::Usage(format!("--first-sample {}: the last sample would exceed {}", self.first_sample, u32::MAX)));
        }
        let crop = self.crop.map(|region| Crop { x: region.x, y: region.y, width: region.size.width, height: region.size.height });
        if let Some(crop) = crop {
            let ends = [crop.x.checked_add(crop.width), crop.y.checked_add(crop.height)];
            let sides = [self.size.width, self.size.height];
            if ends.iter().zip(sides).any(|(end, side)| end.is_none_or(|end| end > side)) {
                let Crop { x, y, width, height } = crop;
                return Err(Failure::Usage(format!("--crop {x},{y},{width}x{height}: it should lie within the {} pixels", self.size)));
            }
        }
        let mut schedule = self.schedule.clone();
        (schedule.pool_blocks, schedule.bank_blocks) = (self.pool_blocks, self.bank_blocks);
        let wants_statistics = self.stats.is_some() || self.trace.is_some();
        let observed = if wants_statistics { Instruments::statistics() } else { Instruments::default() };
        let markers = std::env::var_os("WAVEPOOL_MARKERS").is_some_and(|value| value == "1");
        let instruments = Instruments { checked: self.checked, markers, ..observed };
        Ok(Settings {
            width: self.size.width,
            height: self.size.height,
            samples: self.samples,
            first_sample: self.first_sample,
            depth: self.depth,
            seed: self.seed,
            schedule,
            crop,
            layers: self.layers,
            instruments,
            ..Settings::default()
        })
    }
}

/// The scene's name in the current folder.
fn default_output(scene: &str) -> PathBuf {
    let stem = Path::new(scene).file_stem().unwrap_or_default();
    PathBuf::from(stem).with_extension("png")
}

/// What was typed, such that a shell understands it again.
fn command_line() -> String {
    let quoted = |word: OsString| {
        let word = word.to_string_lossy();
        let is_plain = |c: char| c.is_alphanumeric() || "._/=,:+-".contains(c);
        if !word.is_empty() && word.chars().all(is_plain) { word.into_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
    };
    std::env::args_os().skip(1).map(quoted).collect::<Vec<_>>().join(" ")
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut voice = Voice::of(arguments.voice);
    let mut settings = arguments.settings()?;
    let out = arguments.picture.out.clone().unwrap_or_else(|| default_output(&arguments.scene.scene));
    output::check_writable(&out)?;
    for file in [&arguments.stats, &arguments.trace].into_iter().flatten() {
        output::check_place(file)?;
    }
    let mut scene = arguments.scene.load()?;
    scene.reframe(settings.width as f32 / settings.height as f32);
    settings.camera = arguments.view.camera(&scene)?.or_else(|| scene.cameras.first().cloned());
    voice.notes(&scene.warnings);
    if settings.crop.is_some() && settings.schedule.roulette.as_ref().is_some_and(|roulette| roulette.scope().is_shared()) {
        voice
            .note("--crop: lanes share draws of this roulette with others than in the whole picture; pixels are as good, but not the same");
    }
    let watch = arguments.watch.begin(&scene.name)?;
    if watch.is_on() && !settings.schedule.candidates.is_empty() {
        let what = "nobody can look on (--preview, --tev) while schedules take turns";
        return Err(Failure::Usage(format!("--schedule {}: {what}", settings.schedule)));
    }

    let gpu = GpuContext::new(&GpuOptions { adapter: arguments.adapter.clone() })?;
    let mut renderer = Renderer::new(&gpu, &scene, &settings)?;
    voice.notes(renderer.warnings());
    voice.say(format_args!("scene:      {}, {} triangles", scene.name, scene.triangles.len()));
    voice.say(format_args!("adapter:    {}", gpu.facts));
    voice.say(format_args!("schedule:   {}", renderer.schedule()));

    let facts = Facts {
        camera: settings.camera.clone(),
        texts: [
            ("command", format!("path-tracer {}", command_line())),
            ("scene", scene.name.clone()),
            ("seed", settings.seed.to_string()),
            ("firstSample", settings.first_sample.to_string()),
            ("schedule", renderer.schedule()),
            ("adapter", gpu.facts.to_string()),
        ]
        .map(|(name, text)| (name.to_owned(), text))
        .into(),
    };
    let meter = voice.shows_progress().then(|| Meter::new(items(&settings)));
    let mut onlooker = Onlooker { settings: &settings, facts, options: arguments.picture.options(), meter, watch, voice: &mut voice };
    stop::listen()?;
    let rendering = renderer.render_observed(&mut onlooker)?;
    let ((width, height), passes) = (size(&settings), rendering.report.passes);
    onlooker.meter.iter().for_each(Meter::finish);
    if passes == 0 {
        return Err(Failure::Stopped("stopped before the first sample was finished; nothing is written".into()));
    }
    let picture = onlooker.picture(&rendering);
    let options = onlooker.options;
    onlooker.watch.send(&picture, onlooker.voice);
    voice.notes(&output::write_picture(&out, &picture, &options)?);

    tell(&voice, &settings, &renderer, &rendering.report);
    voice.notes(&rendering.report.notes);
    if arguments.stats.is_some() || arguments.trace.is_some() {
        let mut statistics = renderer.statistics(&rendering)?;
        statistics.command = command_line();
        if let Some(path) = &arguments.stats {
            output::write_json(path, &statistics.to_json())?;
        }
        if let Some(path) = &arguments.trace {
            output::write_json(path, &statistics.trace())?;
        }
        voice.say(statistics.summary().trim_end());
    }
    let hash = format!("{:016x}", rendering.film.hash());
    voice.say(format_args!("image:      {}", out.display()));
    voice.say(format_args!("image-hash: {hash}"));
    let is_complete = passes == settings.samples;
    voice.conclude(serde_json::json!({
        "file": out.display().to_string(),
        "scene": scene.name,
        "width": width,
        "height": height,
        "samples": passes,
        "complete": is_complete,
        "seconds": rendering.report.elapsed.as_secs_f64(),
        "hash": hash,
        "schedule": renderer.schedule(),
        "adapter": gpu.facts.to_string(),
    }));
    if is_complete {
        return Ok(());
    }
    Err(Failure::Stopped(format!("stopped after {passes} of {} samples; {} shows them", settings.samples, out.display())))
}

/// Paths of the whole picture.
fn items(settings: &Settings) -> u64 {
    let (width, height) = size(settings);
    u64::from(width) * u64::from(height) * u64::from(settings.samples)
}

/// Of what is rendered.
fn size(settings: &Settings) -> (u32, u32) {
    settings.crop.map_or((settings.width, settings.height), |crop| (crop.width, crop.height))
}

/// Shows progress and what there is, and listens to Ctrl-C.
struct Onlooker<'a> {
    settings: &'a Settings,
    facts: Facts,
    options: Options,
    meter: Option<Meter>,
    watch: Watch,
    voice: &'a mut Voice,
}

impl Onlooker<'_> {
    fn picture(&self, rendering: &Rendering) -> Picture {
        let mut facts = self.facts.clone();
        let samples = rendering.film.samples().iter().copied().max().unwrap_or(0);
        facts.texts.push(("samples".into(), samples.to_string()));
        facts.texts.push(("filmHash".into(), format!("{:016x}", rendering.film.hash())));
        // `samples` alone is no layer that somebody has asked for.
        let layers = if self.settings.layers == LayerRequest::NONE { Vec::new() } else { rendering.layers() };
        let picture = Picture { facts, layers, ..Picture::of_color(self.settings.width, self.settings.height, rendering.pixels()) };
        match self.settings.crop {
            None => picture,
            Some(crop) => picture.cropped(crop.x, crop.y, crop.width, crop.height),
        }
    }
}

impl Observer for Onlooker<'_> {
    fn wish(&mut self, progress: &Progress) -> Wish {
        self.meter.iter().for_each(|meter| meter.update(progress));
        match (stop::is_asked(), progress.passes_done > 0 && self.watch.is_due()) {
            (true, _) => Wish::Stop,
            (false, true) => Wish::Show,
            (false, false) => Wish::GoOn,
        }
    }

    fn show(&mut self, so_far: &Rendering) {
        let picture = self.picture(so_far);
        self.watch.show(&picture, &self.options, self.voice);
    }
}

/// What was done, for people.
fn tell(voice: &Voice, settings: &Settings, renderer: &Renderer, report: &Report) {
    let seconds = report.elapsed.as_secs_f64();
    let ((width, height), passes) = (size(settings), report.passes);
    let rate = f64::from(width) * f64::from(height) * f64::from(passes) / seconds / 1e6;
    voice.say(format_args!("rendered:   {width}x{height}, {passes} samples in {seconds:.1} s, {rate:.3} Msamples/s"));
    voice.say(format_args!(
        "pool:       {} blocks in {} bank(s), {} bytes of state per lane; results of {} passes at once",
        report.pool_blocks,
        report.banks,
        renderer.scheduler().layout().bytes_per_lane(),
        report.ring
    ));
    voice.say(format_args!(
        "work:       {} steps, {} launches, {} regenerations, {} of {} paths ended by roulette",
        report.steps, report.launches, report.regenerations, report.items_killed, report.items_started
    ));
    for decision in &report.decisions {
        let (first, last) = (decision.first_pass, decision.first_pass + decision.passes);
        voice.say(format_args!("auto:       samples {first}..{last} by {}: {}", decision.schedule, decision.reason));
    }
    if report.not_finite > 0 {
        voice.say(format_args!("ledger:     {} components of samples were not finite and count as zero", report.not_finite));
    }
}
