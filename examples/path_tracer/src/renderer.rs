//! The renderer: a scene and settings in, a film out.
//!
//! Key decision: what a scene does not call for is not part of its program: features remove it from the WGSL and from the state, and a
//! scene that offers no light to pick loses the stages that would pick one.

use std::ops::ControlFlow;

use wavepool::{
    Film, GpuContext, ImageTiles, Instruments, Program, Progress, Report, Resources, Schedule, Scheduler, profile::Statistics,
    shader::SourceModule, wgpu,
};

use crate::{
    Crop, Error,
    crop::CropTiles,
    film_layers::FilmLayers,
    gpu_scene::{GpuScene, LayerRequest, LightStrategy, PackOptions, ProgramModule, exhaustive::EXHAUSTIVE_TRIANGLES},
    layers::Layer,
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
    /// The part of the picture to render; all of it when `None`. The film has all pixels all the same, those outside without samples.
    pub crop: Option<Crop>,
    /// What to find out beside the colour, which does not depend on it.
    pub layers: LayerRequest,
    /// Where a camera's ray leaves the scene the picture is empty: the environment lights the scene and is seen in mirrors and through glass,
    /// but not directly, and [`Rendering::alpha`] says how much of a pixel something covers.
    ///
    /// **Cost:** no state and no stage; two words of the film per pixel.
    pub transparent: bool,
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
            crop: None,
            layers: LayerRequest::NONE,
            transparent: false,
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
    layers: FilmLayers,
    warnings: Vec<String>,
}

/// What has been rendered.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// Sums of radiance, linear Rec. 709: leaves 0, 1, 2 are red, green and blue.
    pub film: Film,
    /// What the scheduler did.
    pub report: Report,
    layers: FilmLayers,
}

impl Rendering {
    /// What was asked for beside the colour, in the order of [`LayerRequest`], and last the number of `samples`; row 0 at the top.
    pub fn layers(&self) -> Vec<Layer> {
        self.layers.of(&self.film)
    }

    /// The share of a pixel's samples whose camera ray met something, exact, row 0 at the top; `None` unless the picture is transparent.
    ///
    /// Surfaces that are there with a probability (blended alpha) count as often as they are there. [`pixels`](Self::pixels) are multiplied
    /// by it already: a sample that meets nothing has no radiance.
    pub fn alpha(&self) -> Option<Vec<f32>> {
        self.layers.alpha(&self.film)
    }

    /// Mean radiance, row 0 at the top.
    pub fn pixels(&self) -> Vec<[f32; 3]> {
        (0..self.film.pixels()).map(|pixel| [0, 1, 2].map(|channel| self.film.mean(pixel, channel) as f32)).collect()
    }
}

/// Whoever looks on while a picture is made.
pub trait Observer {
    /// What should happen next; asked between submissions.
    fn wish(&mut self, progress: &Progress) -> Wish;

    /// What there is, after [`Wish::Show`]: complete samples, without a report.
    fn show(&mut self, so_far: &Rendering);
}

/// What an [`Observer`] wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Nothing.
    GoOn,
    /// To see what there is. A schedule that chooses among several has nothing to show before the end.
    Show,
    /// No more samples.
    Stop,
}

impl Renderer {
    /// Packs the scene, uploads it and compiles the kernels.
    ///
    /// # Errors
    /// [`Error`] of the packing (a limit of the buffers) or of the scheduler.
    pub fn new(gpu: &GpuContext, scene: &Scene, settings: &Settings) -> Result<Self, Error> {
        let packed = pack(scene, settings, &SceneForm::on(gpu))?;
        let program = Self::program_of(&packed)?;
        let resources = upload(&gpu.device, &packed)?;
        let (width, height) = (settings.width, settings.height);
        let builder = match settings.crop {
            None => Scheduler::builder(&program, ImageTiles { width, height }),
            Some(crop) => Scheduler::builder(&program, CropTiles::new(crop, [width, height])),
        };
        let mut scheduler = builder.schedule(&settings.schedule).resources(&resources).instruments(settings.instruments).build_on(gpu)?;
        scheduler.set_seed(settings.seed);
        let layers = FilmLayers { request: settings.layers, transparent: settings.transparent, normalisation: packed.normalisation };
        Ok(Renderer { scheduler, settings: settings.clone(), layers, warnings: packed.facts.warnings })
    }

    /// The program that a scene calls for.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn program(scene: &Scene) -> Result<Program, Error> {
        Self::program_with(scene, &Settings::default())
    }

    /// The program that a scene and settings call for.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn program_with(scene: &Scene, settings: &Settings) -> Result<Program, Error> {
        Self::program_of(&pack(scene, settings, &SceneForm::PLAIN)?)
    }

    /// The program of a scene that has been packed.
    ///
    /// # Errors
    /// When modules and stages do not fit together.
    pub fn program_of(packed: &GpuScene) -> Result<Program, Error> {
        program_from(packed, packed.program_modules(), &packed.features())
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
        Ok(Rendering { film, report, layers: self.layers })
    }

    /// Renders all samples before somebody's eyes; the film does not depend on how often they look.
    ///
    /// # Errors
    /// Those of [`Scheduler::run_with`].
    pub fn render_observed(&mut self, observer: &mut dyn Observer) -> Result<Rendering, Error> {
        if !self.settings.schedule.candidates.is_empty() {
            return self.render(|progress| match observer.wish(progress) {
                Wish::Stop => ControlFlow::Break(()),
                Wish::GoOn | Wish::Show => ControlFlow::Continue(()),
            });
        }
        let mut run = self.scheduler.begin(self.settings.first_sample, self.settings.samples)?;
        loop {
            let mut wish = Wish::GoOn;
            run.drive(|progress| {
                wish = observer.wish(progress);
                if wish == Wish::GoOn { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            })?;
            if wish != Wish::Show || run.is_done() {
                break;
            }
            observer.show(&Rendering { film: run.film()?, report: Report::default(), layers: self.layers });
        }
        let (film, report) = run.finish()?;
        Ok(Rendering { film, report, layers: self.layers })
    }
}

/// Stages of a step; some look for light and need some that can be picked, one notes layers and needs a request for them.
const STAGES: [&str; 6] = ["trace", LAYER_STAGE, "gather_emission", "sample_light", "trace_shadow", "next_bounce"];
const LIGHT_STAGES: [&str; 2] = ["sample_light", "trace_shadow"];
const LAYER_STAGE: &str = "gather_layers";

/// What a device asks of a packed scene; the bits of a picture are the same in every form.
struct SceneForm {
    binding_limit: u64,
    uniform_limit: u64,
    exhaustive_limit: u32,
}

impl SceneForm {
    /// For any device.
    const PLAIN: SceneForm = SceneForm { binding_limit: u32::MAX as u64, uniform_limit: 0, exhaustive_limit: 0 };

    fn on(gpu: &GpuContext) -> SceneForm {
        let limits = gpu.device.limits();
        let plain = SceneForm { binding_limit: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size), ..SceneForm::PLAIN };
        // What `placement` says of software drivers was seen on two of Vulkan; of others nothing is known.
        if !gpu.facts.is_software() || gpu.facts.backend != wgpu::Backend::Vulkan.to_string() {
            return plain;
        }
        let has_int64 = gpu.device.features().contains(wgpu::Features::SHADER_INT64);
        let uniform_limit = if has_int64 { limits.max_uniform_buffer_binding_size } else { 0 };
        let exhaustive_limit = if gpu.facts.is_llvmpipe() { EXHAUSTIVE_TRIANGLES } else { 0 };
        SceneForm { uniform_limit, exhaustive_limit, ..plain }
    }
}

fn pack(scene: &Scene, settings: &Settings, form: &SceneForm) -> Result<GpuScene, Error> {
    let aspect = settings.width as f32 / settings.height.max(1) as f32;
    let camera = settings.camera.clone().or_else(|| scene.cameras.first().cloned()).unwrap_or_else(|| frame(scene.bounds(), aspect));
    let options = PackOptions {
        width: settings.width,
        height: settings.height,
        max_depth: settings.depth,
        seed: settings.seed,
        light_strategy: settings.light_strategy,
        layers: settings.layers,
        transparent: settings.transparent,
        first_sample: settings.first_sample,
        binding_limit: form.binding_limit,
        uniform_limit: form.uniform_limit,
        exhaustive_limit: form.exhaustive_limit,
        ..PackOptions::default()
    };
    Ok(GpuScene::pack(scene, &camera, &options)?)
}

fn program_from(packed: &GpuScene, modules: Vec<ProgramModule>, features: &[(&'static str, bool)]) -> Result<Program, Error> {
    let is_called_for = |stage: &&&str| match **stage {
        LAYER_STAGE => packed.layers().needs_stage(),
        stage => packed.facts.effects.samplable_lights || !LIGHT_STAGES.contains(&stage),
    };
    let mut roots: Vec<&str> = STAGES.iter().filter(is_called_for).copied().collect();
    let mut builder = roots.iter().fold(Program::builder("path_tracer"), |builder, stage| builder.stage(stage));
    // Where more than the radiance is asked for, another module declares `finish`.
    let finish = if packed.brings_more_than_radiance() { "finish_layers" } else { "finish" };
    roots.extend(["generate", finish, "survival", "reweight", "queue_key"]);
    for (name, is_on) in features {
        builder = builder.feature(name, *is_on);
    }
    for (name, value) in packed.constants() {
        builder = builder.constant(name, *value);
    }
    for module in modules {
        let is_root = module.path.strip_prefix("path_tracer::").is_some_and(|name| roots.contains(&name));
        let module = SourceModule { package: "path_tracer".into(), path: module.path, file: module.file, text: module.text };
        builder = if is_root { builder.module(module) } else { builder.library(module) };
    }
    Ok(builder.build()?)
}

fn upload(device: &wgpu::Device, packed: &GpuScene) -> Result<Resources, Error> {
    let (storage, uniform) = (wgpu::BufferUsages::STORAGE, wgpu::BufferUsages::UNIFORM);
    let rows = if packed.facts.uniform_rows { uniform } else { storage };
    let parts = [
        ("view", &packed.view, uniform),
        ("bvh", &packed.bvh, rows),
        ("triangles", &packed.triangles, rows),
        ("tables", &packed.tables, rows),
        ("texels", &packed.texels, storage),
    ];
    parts.into_iter().try_fold(Resources::new(), |resources, (name, contents, usage)| {
        Ok(resources.buffer(name, &wavepool::upload(device, name, contents, usage)?))
    })
}

#[cfg(test)]
mod tests;
