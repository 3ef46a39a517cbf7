//! `path-tracer render`: a scene to an image, or an animation to images. What can be chosen; `session` does it.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

use path_tracer::{
    Crop, LayerRequest, Settings, output,
    wavepool::{Instruments, Schedule},
};

use super::{
    Failure,
    frames::{FrameArguments, Shot},
    picture::PictureArguments,
    scene::SceneArguments,
    session::Session,
    value::{self, Region, Size},
    view::ViewArguments,
    voice::VoiceArguments,
    watch::WatchArguments,
};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    #[command(flatten)]
    pub(crate) frames: FrameArguments,
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
    /// Leave the background empty: the environment still lights the scene, but is not seen directly, and an alpha says how much of a pixel
    /// something covers; for .exr (colour multiplied by it) and .png (not multiplied).
    #[arg(long)]
    transparent: bool,
    /// Blocks of 256 lanes that are in flight at once.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = value::positive)]
    pool_blocks: Option<u32>,
    /// Blocks of a bank, at most; a pool of more has several.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = value::positive)]
    bank_blocks: Option<u32>,
    /// Part of the name of the adapter to use.
    #[arg(long, value_name = "NAME")]
    pub(crate) adapter: Option<String>,
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
    #[command(flatten)]
    pub(crate) watch: WatchArguments,
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
            transparent: self.transparent,
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
pub(crate) fn command_line() -> String {
    let quoted = |word: OsString| {
        let word = word.to_string_lossy();
        let is_plain = |c: char| c.is_alphanumeric() || "._/=,:+-".contains(c);
        if !word.is_empty() && word.chars().all(is_plain) { word.into_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
    };
    std::env::args_os().skip(1).map(quoted).collect::<Vec<_>>().join(" ")
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let settings = arguments.settings()?;
    let whole = Shot {
        frame: None,
        time: arguments.scene.time(),
        out: arguments.picture.out.clone().unwrap_or_else(|| default_output(&arguments.scene.scene)),
        stats: arguments.stats.clone(),
        trace: arguments.trace.clone(),
    };
    let mut shots = arguments.frames.shots(whole).peekable();
    // One file of a series stands for all: they have one folder and one ending.
    if let Some(shot) = shots.peek() {
        output::check_writable(&shot.out)?;
        for file in [&shot.stats, &shot.trace].into_iter().flatten() {
            output::check_place(file)?;
        }
    }
    let mut session = Session::new(arguments, settings);
    shots.try_for_each(|shot| session.shoot(&shot).map_err(|failure| failure.in_frame(shot.frame)))
}
