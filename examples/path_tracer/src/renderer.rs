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
mod tests {
    use glam::{Vec3, Vec4};
    use wavepool::policy::RouletteScope;

    use super::*;
    use crate::scene::{AlphaMode, Environment, LightKind, Material, PunctualLight, Triangle, Vertex};

    fn lit_triangle(material: Material) -> Scene {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let light = PunctualLight {
            kind: LightKind::Point,
            position: Vec3::Z,
            direction: Vec3::ZERO,
            intensity: Vec3::ONE,
            range: f32::INFINITY,
            profile: None,
        };
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

    /// The builtin scenes, and one that calls for next to nothing.
    fn scenes() -> Vec<Scene> {
        let built_in = crate::scene::BUILTIN.iter().map(|(name, _)| crate::scene::builtin(name).expect("it is in the list"));
        built_in.chain([lit_triangle(Material { ior: 1.0, ..Material::default() }), Scene::default()]).collect()
    }

    // Kills: a word of code, a leaf of the state or of the film, a row of a table, for layers or an alpha that nobody has asked for. The
    // program is compared with one whose modules have lost every line that speaks of them and which knows of no such feature.
    #[test]
    fn without_a_request_there_are_no_layers_and_no_alpha() {
        let speaks_of_layers = |text: &str| ["layer_", "delta_surfaces", "transparent"].iter().any(|word| text.contains(word));
        for scene in scenes() {
            let packed = pack(&scene, &Settings::default(), &SceneForm::PLAIN).expect("packs");
            let program = Renderer::program_of(&packed).unwrap_or_else(|error| panic!("{error}"));
            let mut modules = packed.program_modules();
            let before = modules.len();
            modules.retain(|module| !module.path.contains("layer") && module.path != "path_tracer::delta_bsdf");
            assert_eq!(before - modules.len(), 5);
            for module in &mut modules {
                let mut lines: Vec<&str> = module.text.lines().collect();
                lines.retain(|line| !(line.contains("@if") && speaks_of_layers(line)));
                let is_left = |line: &&str| line.split("//").next().is_some_and(speaks_of_layers);
                assert_eq!(lines.iter().copied().find(is_left), None, "{}: without a condition", module.file);
                module.text = lines.join("\n").into();
            }
            let mut features = packed.features();
            features.retain(|(name, _)| !speaks_of_layers(name));
            let bare = program_from(&packed, modules, &features).unwrap_or_else(|error| panic!("{error}"));

            let (scope, image) = (Some(RouletteScope::Lane), ImageTiles { width: 16, height: 16 });
            assert_eq!(program.layout(scope).table(), bare.layout(scope).table(), "{}", scene.name);
            for schedule in [Schedule::block(), Schedule::megakernel()] {
                let texts = |program: &Program| {
                    let parts = program.wgsl(&image, &schedule).unwrap_or_else(|error| panic!("{error}"));
                    parts.map(|(_, text)| text.split_whitespace().collect::<Vec<_>>().join(" "))
                };
                assert!(texts(&program) == texts(&bare), "{}: {schedule}", scene.name);
                assert!(!texts(&program)[0].contains("fn gather_layers"), "{}", scene.name);
            }
            // Nor do the buffers hold anything for them.
            let numbered = pack(&scene, &Settings { first_sample: 9, ..Settings::default() }, &SceneForm::PLAIN).expect("packs");
            assert_eq!(numbered, packed, "{}", scene.name);
        }
    }

    // Kills: a combination of layers and effects that does not compile, a layer with the state of another, state for the variance.
    #[test]
    fn every_request_gets_its_own_leaves() {
        let components = [3, 3, 1, 3, 1, 1, 0];
        let names = ["layer_albedo", "layer_normal", "layer_depth", "layer_position", "layer_object", "layer_material"];
        for scene in scenes() {
            let plain = Renderer::program(&scene).unwrap_or_else(|error| panic!("{error}"));
            let leaves_of = |program: &Program| program.layout(Some(RouletteScope::Lane)).leaves.len();
            let follows = pack(&scene, &Settings::default(), &SceneForm::PLAIN).expect("packs").facts.effects.delta_surfaces;
            for set in 1..128_u32 {
                // All of them for one scene, single ones and all together for the others.
                if !(scene.name == "cornell-box" || set.is_power_of_two() || set == 127) {
                    continue;
                }
                let chosen: Vec<&str> = (0..7).filter(|bit| set >> bit & 1 == 1).map(|bit| LayerRequest::NAMES[bit]).collect();
                let request: LayerRequest = chosen.join(",").parse().expect("layers");
                let settings = Settings { layers: request, ..Settings::default() };
                let program = Renderer::program_with(&scene, &settings).unwrap_or_else(|error| panic!("{request}: {error}"));
                assert_eq!(program.stages().any(|stage| stage == LAYER_STAGE), request.needs_stage(), "{request}");
                let layout = program.layout(Some(RouletteScope::Lane));
                let expected: usize = (0..7).filter(|bit| set >> bit & 1 == 1).map(|bit| components[bit]).sum();
                let hits = usize::from(request.depth || request.position);
                let settled = usize::from(follows && (request.albedo || request.normal));
                assert_eq!(leaves_of(&program) - leaves_of(&plain), expected + hits + settled, "{}: {request}", scene.name);
                for (bit, name) in names.iter().enumerate() {
                    let is_there = layout.leaves.iter().any(|leaf| leaf.path.split('.').nth(1) == Some(name));
                    assert_eq!(is_there, set >> bit & 1 == 1, "{request}: {name}");
                }
            }
        }
    }

    // Kills: state, a stage or a table for an alpha, which needs none; a combination with layers or effects that does not compile.
    #[test]
    fn an_alpha_takes_a_leaf_of_the_film_and_nothing_else() {
        for scene in scenes() {
            for layers in [LayerRequest::NONE, LayerRequest::ALL] {
                let [opaque, transparent] = [false, true].map(|transparent| {
                    let settings = Settings { layers, transparent, ..Settings::default() };
                    let packed = pack(&scene, &settings, &SceneForm::PLAIN).expect("packs");
                    let program = Renderer::program_of(&packed).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
                    let parts = [packed.view, packed.bvh, packed.triangles, packed.tables, packed.texels];
                    (program, parts)
                });
                let stages = |program: &Program| program.stages().map(str::to_owned).collect::<Vec<_>>();
                assert_eq!(stages(&transparent.0), stages(&opaque.0), "{}", scene.name);
                let leaves = |program: &Program| {
                    let layout = program.layout(Some(RouletteScope::Lane));
                    layout.leaves.iter().map(|leaf| leaf.path.clone()).collect::<Vec<_>>()
                };
                assert_eq!(leaves(&transparent.0), leaves(&opaque.0), "{}", scene.name);
                assert!(transparent.1 == opaque.1, "{}", scene.name);
            }
        }
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
        let amber = Material { solid: true, attenuation_color: Vec3::splat(0.5), attenuation_distance: 1.0, ..glass.materials[0].clone() };
        let amber = lit_triangle(amber);
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
            ("amber", amber, parts(&[&lit[..], &["eta_scale"]].concat(), &["fn sample_punctual_light(", "fn sample_glass(", "fn absorb("])),
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
            "fn absorb(",
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
