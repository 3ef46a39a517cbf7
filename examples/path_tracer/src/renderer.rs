//! The renderer: a scene and settings in, a film out.
//!
//! Key decision: a scene that offers no light to sample loses the stages that would sample it; what a scene does not call for is not
//! launched.

use std::ops::ControlFlow;

use wavepool::{
    Film, GpuContext, ImageTiles, Instruments, KernelCache, Program, Progress, Report, Resources, Schedule, Scheduler, profile::Statistics,
    shader::SourceModule, wgpu,
};

use crate::{
    Error,
    gpu_scene::{GpuScene, LightStrategy, PackOptions},
    scene::{Camera, Scene, framing::frame},
};

/// What to render besides the scene.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Number of the first sample; others follow it.
    pub first_sample: u32,
    /// Scattering events after which a path ends.
    pub depth: u32,
    /// Keys all random numbers.
    pub seed: u32,
    /// How the work is scheduled; the image does not depend on it.
    pub schedule: Schedule,
    /// How light is found; the expected image does not depend on it.
    pub light_strategy: LightStrategy,
    /// The camera; the scene's first one when `None`.
    pub camera: Option<Camera>,
    /// What to observe; the image does not depend on it.
    pub instruments: Instruments,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            width: 512,
            height: 512,
            samples: 64,
            first_sample: 0,
            depth: 16,
            seed: 0,
            schedule: Schedule::block(),
            light_strategy: LightStrategy::Mis,
            camera: None,
            instruments: Instruments::default(),
        }
    }
}

impl Settings {
    /// An image of the given size and number of samples.
    pub fn new(width: u32, height: u32, samples: u32) -> Self {
        Settings { width, height, samples, ..Settings::default() }
    }
}

/// A scene on a device, ready to render.
#[derive(Debug)]
pub struct Renderer {
    scheduler: Scheduler,
    settings: Settings,
    warnings: Vec<String>,
}

/// What has been rendered.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// Sums of radiance, linear Rec. 709: leaves 0, 1, 2 are red, green and blue.
    pub film: Film,
    /// What the scheduler did.
    pub report: Report,
}

impl Rendering {
    /// Mean radiance, row 0 at the top.
    pub fn pixels(&self) -> Vec<[f32; 3]> {
        (0..self.film.pixels()).map(|pixel| [0, 1, 2].map(|channel| self.film.mean(pixel, channel) as f32)).collect()
    }
}

impl Renderer {
    /// Packs the scene, uploads it and compiles the kernels.
    ///
    /// # Errors
    /// [`Error`] of the packing (a limit of the buffers) or of the scheduler.
    pub fn new(gpu: &GpuContext, scene: &Scene, settings: &Settings) -> Result<Self, Error> {
        Self::on(&gpu.device, &gpu.queue, &gpu.cache, scene, settings)
    }

    /// As [`new`](Self::new), on a borrowed device; kernels that `cache` holds are not compiled again.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn on(device: &wgpu::Device, queue: &wgpu::Queue, cache: &KernelCache, scene: &Scene, settings: &Settings) -> Result<Self, Error> {
        let limits = device.limits();
        let binding_limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let packed = pack(scene, settings, binding_limit)?;
        let program = program_of(&packed)?;
        let resources = upload(device, &packed)?;
        let source = ImageTiles { width: settings.width, height: settings.height };
        let mut scheduler = Scheduler::builder(&program, source)
            .schedule(&settings.schedule)
            .resources(&resources)
            .instruments(settings.instruments)
            .cache(cache)
            .build(device, queue)?;
        scheduler.set_seed(settings.seed);
        Ok(Renderer { scheduler, settings: settings.clone(), warnings: packed.facts.warnings })
    }

    /// The program that a scene calls for.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn program(scene: &Scene) -> Result<Program, Error> {
        program_of(&pack(scene, &Settings::default(), u64::from(u32::MAX))?)
    }

    /// What packing had to change, one line each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The schedule in use, printed.
    pub fn schedule(&self) -> String {
        self.settings.schedule.to_string()
    }

    /// The scheduler, for its plan, layout and WGSL.
    pub fn scheduler(&self) -> &Scheduler {
        &self.scheduler
    }

    /// Everything that is known about a rendering.
    ///
    /// # Errors
    /// Those of [`Scheduler::statistics`].
    pub fn statistics(&self, rendering: &Rendering) -> Result<Statistics, Error> {
        Ok(self.scheduler.statistics(&rendering.report)?)
    }

    /// The scheduler itself, to run it step by step.
    pub fn scheduler_mut(&mut self) -> &mut Scheduler {
        &mut self.scheduler
    }

    /// Renders all samples; `observe` sees the progress and may stop, which leaves complete samples in the film.
    ///
    /// # Errors
    /// Those of [`Scheduler::run_with`].
    pub fn render(&mut self, observe: impl FnMut(&Progress) -> ControlFlow<()>) -> Result<Rendering, Error> {
        let (film, report) = self.scheduler.run_with(self.settings.first_sample, self.settings.samples, observe)?;
        Ok(Rendering { film, report })
    }
}

/// Stages of a step; the two in the middle look for light and need some that can be picked.
const STAGES: [&str; 5] = ["trace", "gather_emission", "sample_light", "trace_shadow", "next_bounce"];
const LIGHT_STAGES: [&str; 2] = ["sample_light", "trace_shadow"];

fn pack(scene: &Scene, settings: &Settings, binding_limit: u64) -> Result<GpuScene, Error> {
    let aspect = settings.width as f32 / settings.height.max(1) as f32;
    let camera = settings.camera.clone().or_else(|| scene.cameras.first().cloned()).unwrap_or_else(|| frame(scene.bounds(), aspect));
    let options = PackOptions {
        width: settings.width,
        height: settings.height,
        max_depth: settings.depth,
        seed: settings.seed,
        light_strategy: settings.light_strategy,
        binding_limit,
        ..PackOptions::default()
    };
    Ok(GpuScene::pack(scene, &camera, &options)?)
}

fn program_of(packed: &GpuScene) -> Result<Program, Error> {
    let stages = STAGES.iter().filter(|stage| packed.facts.has_samplable_lights || !LIGHT_STAGES.contains(stage));
    let mut roots: Vec<&str> = stages.copied().collect();
    let mut builder = roots.iter().fold(Program::builder("path_tracer"), |builder, stage| builder.stage(stage));
    roots.extend(["generate", "finish", "survival", "reweight"]);
    for module in packed.program_modules() {
        let is_root = module.path.strip_prefix("path_tracer::").is_some_and(|name| roots.contains(&name));
        let module = SourceModule { package: "path_tracer".into(), path: module.path, file: module.file, text: module.text };
        builder = if is_root { builder.module(module) } else { builder.library(module) };
    }
    Ok(builder.build()?)
}

fn upload(device: &wgpu::Device, packed: &GpuScene) -> Result<Resources, Error> {
    let storage = wgpu::BufferUsages::STORAGE;
    let parts = [
        ("view", &packed.view, wgpu::BufferUsages::UNIFORM),
        ("bvh", &packed.bvh, storage),
        ("triangles", &packed.triangles, storage),
        ("tables", &packed.tables, storage),
        ("texels", &packed.texels, storage),
    ];
    parts.into_iter().try_fold(Resources::new(), |resources, (name, contents, usage)| {
        Ok(resources.buffer(name, &wavepool::upload(device, name, contents, usage)?))
    })
}
