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
    /// The part of the picture to render; all of it when `None`. The film has all pixels all the same, those outside without samples.
    pub crop: Option<Crop>,
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
        let (device, limits) = (&gpu.device, gpu.device.limits());
        let binding_limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let packed = pack(scene, settings, binding_limit)?;
        let program = program_of(&packed)?;
        let resources = upload(device, &packed)?;
        let (width, height) = (settings.width, settings.height);
        let builder = match settings.crop {
            None => Scheduler::builder(&program, ImageTiles { width, height }),
            Some(crop) => Scheduler::builder(&program, CropTiles::new(crop, [width, height])),
        };
        let mut scheduler = builder.schedule(&settings.schedule).resources(&resources).instruments(settings.instruments).build_on(gpu)?;
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
            observer.show(&Rendering { film: run.film()?, report: Report::default() });
        }
        let (film, report) = run.finish()?;
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
    let stages = STAGES.iter().filter(|stage| packed.facts.effects.samplable_lights || !LIGHT_STAGES.contains(stage));
    let mut roots: Vec<&str> = stages.copied().collect();
    let mut builder = roots.iter().fold(Program::builder("path_tracer"), |builder, stage| builder.stage(stage));
    roots.extend(["generate", "finish", "survival", "reweight", "queue_key"]);
    for (name, is_on) in packed.facts.effects.features() {
        builder = builder.feature(name, is_on);
    }
    for (name, value) in packed.constants() {
        builder = builder.constant(name, *value);
    }
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

#[cfg(test)]
mod tests {
    use glam::{Vec3, Vec4};
    use wavepool::policy::RouletteScope;

    use super::*;
    use crate::scene::{AlphaMode, Environment, LightKind, Material, PunctualLight, Triangle, Vertex};

    fn lit_triangle(material: Material) -> Scene {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let light =
            PunctualLight { kind: LightKind::Point, position: Vec3::Z, direction: Vec3::ZERO, intensity: Vec3::ONE, range: f32::INFINITY };
        Scene {
            vertices: corners.map(|position| Vertex { position, normal: Vec3::Z, color: Vec4::ONE, ..Vertex::default() }).to_vec(),
            triangles: vec![Triangle { vertices: [0, 1, 2], material: 0 }],
            materials: vec![material],
            lights: vec![light],
            ..Scene::default()
        }
    }

    /// Members of the state and the text of all stages.
    fn program_of_scene(scene: &Scene) -> (Vec<String>, String) {
        let program = Renderer::program(scene).unwrap_or_else(|error| panic!("{error}"));
        let layout = program.layout(Some(RouletteScope::Lane));
        let mut members: Vec<String> =
            layout.leaves.iter().map(|leaf| leaf.path.split('.').nth(1).unwrap_or_default().to_owned()).collect();
        members.dedup();
        let [(_, stages), ..] = program.wgsl(&ImageTiles { width: 16, height: 16 }, &Schedule::block()).expect("valid");
        (members, stages)
    }

    // Kills: an effect with state or code in a scene that does not call for it, or without them in one that does.
    #[test]
    fn a_scene_gets_the_state_and_the_code_it_calls_for() {
        let parts = |members: &[&'static str], code: &[&'static str]| (members.to_vec(), code.to_vec());
        // An index of 1 is a surface without a coat.
        let matte = Material { ior: 1.0, ..Material::default() };
        let plain = lit_triangle(matte.clone());
        let dark = Scene { lights: Vec::new(), ..plain.clone() };
        let glass = lit_triangle(Material { transmission: 0.5, ..matte.clone() });
        let veil = lit_triangle(Material { alpha: AlphaMode::Blend, ..matte.clone() });
        let metal = lit_triangle(Material { metallic: 1.0, ..matte.clone() });
        let glow = lit_triangle(Material { emissive: Vec3::ONE, ..matte });
        let sky = Environment { name: "grey".into(), width: 2, height: 1, texels: vec![[0.5; 3]; 2] };
        let sky = Scene { environment: Some(sky), ..dark.clone() };
        let lit = ["bsdf_pdf", "shadow_origin", "shadow_vector", "shadow_radiance"];
        let cases = [
            ("dark", dark, parts(&[], &[])),
            ("plain", plain, parts(&lit, &["fn sample_punctual_light("])),
            ("glass", glass, parts(&[&lit[..], &["eta_scale"]].concat(), &["fn sample_punctual_light(", "fn sample_glass("])),
            ("veil", veil, parts(&lit, &["fn sample_punctual_light(", "fn is_present("])),
            ("metal", metal, parts(&lit, &["fn sample_punctual_light(", "fn sample_microfacets("])),
            ("glow", glow, parts(&lit, &["fn sample_punctual_light(", "fn sample_triangle_light("])),
            ("sky", sky, parts(&lit, &["fn environment_towards("])),
        ];
        let all_members = [&lit[..], &["eta_scale"]].concat();
        let all_code = [
            "fn sample_punctual_light(",
            "fn sample_triangle_light(",
            "fn environment_towards(",
            "fn sample_glass(",
            "fn sample_microfacets(",
            "fn is_present(",
            "fn sample_texture(",
        ];
        for (name, scene, (members, code)) in cases {
            let (found, text) = program_of_scene(&scene);
            for member in &all_members {
                assert_eq!(found.iter().any(|other| other == member), members.contains(member), "{name}: {member} of {found:?}");
            }
            for function in &all_code {
                assert_eq!(text.contains(function), code.contains(function), "{name}: {function}");
            }
        }
    }
}
