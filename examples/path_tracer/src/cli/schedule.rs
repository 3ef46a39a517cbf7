//! `path-tracer schedule`: which block did what in which step, drawn from real runs of a scene under several schedules.

use std::{ops::ControlFlow, path::PathBuf};

use path_tracer::{
    Renderer, Settings, output,
    scene::LoadOptions,
    wavepool::{GpuContext, GpuOptions, ImageTiles, Instruments, Schedule},
};
use wavepool_lab::drawing::{self, Chart};

use super::{
    Failure, say,
    scene::load,
    value::{self, Size},
};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// A built-in scene (see `path-tracer scenes`) or a .glb, .gltf, .obj or .ply file.
    scene: String,
    /// Light the scene with an equirectangular .hdr or .exr image.
    #[arg(long, value_name = "FILE")]
    env: Option<PathBuf>,
    /// Pixels; a tile has 16x16 of them.
    #[arg(long, value_name = "WxH", default_value = "64x64", value_parser = value::size)]
    size: Size,
    /// Samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 2, allow_negative_numbers = true, value_parser = value::positive)]
    samples: u32,
    /// Bounces after which a path ends.
    #[arg(long, value_name = "N", default_value_t = 16, allow_negative_numbers = true, value_parser = value::whole)]
    depth: u32,
    /// Another seed, another noise.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true, value_parser = value::whole)]
    seed: u32,
    /// As in `path-tracer render`; given several times, schedules stand side by side. Without it: never, block with the paper's
    /// settings, block without a threshold, block with tiles in order of depth.
    #[arg(long, value_name = "SPEC")]
    schedule: Vec<String>,
    /// Blocks of 256 lanes that are in flight at once; up to 16 of them are told in words too.
    #[arg(long, value_name = "N", default_value_t = 8, allow_negative_numbers = true, value_parser = value::positive)]
    pool_blocks: u32,
    /// Part of the name of the adapter to use.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// .svg for a still, .html for a page that steps through time.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// What is drawn when no schedule is named.
const DEFAULTS: [&str; 4] = ["never", "block", "block,threshold=0,check_every=1", "block,order=depth-max"];

impl Arguments {
    fn schedules(&self) -> Result<Vec<Schedule>, Failure> {
        let texts: Vec<&str> =
            if self.schedule.is_empty() { DEFAULTS.to_vec() } else { self.schedule.iter().map(String::as_str).collect() };
        let read = |text: &str| {
            let wrong = |error: &dyn std::fmt::Display| Failure::Usage(format!("--schedule {text}: {error}"));
            let schedule: Schedule = text.parse().map_err(|error| wrong(&error))?;
            drawing::check(&schedule).map_err(|error| wrong(&error))?;
            Ok(schedule.with_pool_blocks(self.pool_blocks))
        };
        texts.into_iter().map(read).collect()
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Size { width, height } = arguments.size;
    let schedules = arguments.schedules()?;
    let format = output::drawing::check_writable(&arguments.out)?;
    let mut scene = load(&arguments.scene, arguments.env.as_deref(), &LoadOptions::default())?;
    scene.reframe(width as f32 / height as f32);
    scene.warnings.iter().for_each(|warning| eprintln!("note: {warning}"));

    let gpu = GpuContext::new(&GpuOptions { adapter: arguments.adapter.clone(), ..GpuOptions::default() })?;
    say(format_args!("adapter:  {}", gpu.facts));
    let instruments = Instruments { steps: true, lengths: true, ..Instruments::default() };
    let settings =
        Settings { samples: arguments.samples, depth: arguments.depth, seed: arguments.seed, instruments, ..Settings::default() };
    let mut charts = Vec::new();
    for schedule in schedules {
        let mut renderer = Renderer::new(&gpu, &scene, &Settings { width, height, schedule: schedule.clone(), ..settings.clone() })?;
        let report = renderer.render(|_| ControlFlow::Continue(()))?.report;
        report.notes.iter().for_each(|note| eprintln!("note: {note}"));
        let chart = match schedule.regeneration.grain().is_by_lane() {
            true => {
                let stages = renderer.scheduler().layout().kernels.len();
                Chart::of_items(&report, stages, &schedule, &ImageTiles { width, height })
            }
            false => Chart::of_run(&report, renderer.scheduler().plan()),
        };
        let chart = chart.map_err(|error| Failure::Runtime(error.to_string()))?;
        say(format_args!("schedule: {}: {} steps, {} launches", report.schedule, report.steps, report.launches));
        charts.push(chart);
    }
    let title = format!("{}, {width}x{height}, {} sample(s), depth {}\n{}", scene.name, arguments.samples, arguments.depth, gpu.facts);
    let text = match format {
        output::drawing::Format::Svg => drawing::svg(&title, &charts),
        output::drawing::Format::Html => drawing::html(&title, &charts),
    };
    output::drawing::write(&arguments.out, &text)?;
    say(format_args!("drawing:  {}", arguments.out.display()));
    Ok(())
}
