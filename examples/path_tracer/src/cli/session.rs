//! Pictures one after another: what they share is made once.
//!
//! Key decision: a picture alone goes the same way as each of a series. Device, kernels, environment and those who look on stay from one to
//! the next; the scene is read again, because anything in it may move.
//!
//! **Invariant:** a file of a series is a finished frame; of a picture alone, Ctrl-C keeps what is finished.
//! **Invariant:** what a frame shows depends on its number alone, not on the frames around it or on who renders them.

use path_tracer::{
    LayerRequest, Observer, Renderer, Rendering, Settings, Wish,
    output::{self, Facts, Options, Picture},
    scene::{Bounds, Scene, framing::FRAMED},
    wavepool::{GpuContext, GpuOptions, Progress},
};

use super::{
    Failure,
    frames::Shot,
    progress::Meter,
    render::{Arguments, command_line},
    scene::Loader,
    stop,
    voice::Voice,
    watch::Watch,
};

/// Everything that outlives a picture.
pub(crate) struct Session<'a> {
    arguments: &'a Arguments,
    settings: Settings,
    loader: Loader<'a>,
    voice: Voice,
    equipment: Option<Equipment>,
    /// The box around the scene in its rest pose, once somebody has asked.
    rest: Option<Option<Bounds>>,
}

/// What is there from the first picture on.
struct Equipment {
    gpu: GpuContext,
    watch: Watch,
}

impl<'a> Session<'a> {
    pub(crate) fn new(arguments: &'a Arguments, settings: Settings) -> Session<'a> {
        let voice = Voice::of(arguments.voice);
        Session { arguments, settings, loader: arguments.scene.loader(), voice, equipment: None, rest: None }
    }

    /// Renders a picture and writes it.
    pub(crate) fn shoot(&mut self, shot: &Shot) -> Result<(), Failure> {
        if stop::is_asked() {
            return Err(Failure::Stopped(format!("stopped before {}", shot.out.display())));
        }
        if self.arguments.frames.skip_existing && shot.out.exists() {
            self.voice.say(format_args!("{}{} is there already", title(shot), shot.out.display()));
            self.voice.conclude(serde_json::json!({ "frame": shot.frame, "file": shot.out.display().to_string(), "skipped": true }));
            return Ok(());
        }
        let mut scene = self.stage(shot)?;
        let is_first = self.equipment.is_none();
        let equipment = match self.equipment.take() {
            Some(equipment) => equipment,
            None => self.begin(&scene)?,
        };
        let Equipment { gpu, watch } = self.equipment.insert(equipment);
        let (settings, voice) = (&self.settings, &mut self.voice);
        let mut renderer = Renderer::new(gpu, &scene, settings)?;
        self.loader.take_back(&mut scene);
        voice.notes(renderer.warnings());
        if is_first {
            voice.say(format_args!("scene:      {}, {} triangles", scene.name, scene.triangles.len()));
            voice.say(format_args!("adapter:    {}", gpu.facts));
            voice.say(format_args!("schedule:   {}", renderer.schedule()));
        }

        let facts = facts(settings, &scene.name, shot, &renderer, gpu);
        let meter = voice.shows_progress().then(|| Meter::new(items(settings), title(shot)));
        let mut onlooker = Onlooker { settings, facts, options: self.arguments.picture.options(), meter, watch, voice: &mut *voice };
        stop::listen()?;
        let rendering = renderer.render_observed(&mut onlooker)?;
        onlooker.meter.iter().for_each(Meter::finish);
        let passes = rendering.report.passes;
        let is_complete = passes == settings.samples;
        match shot.frame {
            Some(frame) if !is_complete => {
                return Err(Failure::Stopped(format!("stopped in frame {frame}, which is not written; those before it are")));
            }
            _ if passes == 0 => return Err(Failure::Stopped("stopped before the first sample was finished; nothing is written".into())),
            _ => {}
        }
        let picture = onlooker.picture(&rendering);
        let options = onlooker.options;
        onlooker.watch.send(&picture, onlooker.voice);
        voice.notes(&output::write_picture(&shot.out, &picture, &options)?);

        let made = Made { shot, settings, scene: &scene.name, adapter: &gpu.facts.to_string(), renderer: &renderer, rendering: &rendering };
        made.tell(voice);
        voice.notes(&rendering.report.notes);
        made.write_statistics(voice)?;
        made.conclude(voice);
        if is_complete {
            return Ok(());
        }
        Err(Failure::Stopped(format!("stopped after {passes} of {} samples; {} shows them", settings.samples, shot.out.display())))
    }

    /// Reads the scene as the shot wants it, and sets up the camera.
    fn stage(&mut self, shot: &Shot) -> Result<Scene, Failure> {
        let mut scene = self.loader.load(shot.time)?;
        let mut bounds = scene.bounds();
        if shot.frame.is_some() {
            if scene.animations.is_empty() {
                return Err(Failure::Usage(format!("--frames: {} has no animation", self.arguments.scene.scene)));
            }
            // A camera that nobody has placed stands still, and stands where it would for any other frames.
            if scene.cameras.iter().any(|camera| camera.name == FRAMED) {
                bounds = match self.rest {
                    Some(bounds) => bounds,
                    None => *self.rest.insert(self.loader.rest_bounds()?),
                };
            }
        }
        scene.reframe_around(bounds, self.settings.width as f32 / self.settings.height as f32);
        self.settings.camera = self.arguments.view.camera(&scene)?.or_else(|| scene.cameras.first().cloned());
        self.voice.notes(self.arguments.view.notes(&scene));
        Ok(scene)
    }

    /// Everything that is begun once, in the order in which it can be refused.
    fn begin(&mut self, scene: &Scene) -> Result<Equipment, Failure> {
        let settings = &self.settings;
        if settings.crop.is_some() && settings.schedule.roulette.as_ref().is_some_and(|roulette| roulette.scope().is_shared()) {
            let what = "lanes share draws of this roulette with others than in the whole picture; pixels are as good, but not the same";
            self.voice.note(format_args!("--crop: {what}"));
        }
        let watch = self.arguments.watch.begin(&scene.name)?;
        if watch.is_on() && !settings.schedule.candidates.is_empty() {
            let what = "nobody can look on (--preview, --tev) while schedules take turns";
            return Err(Failure::Usage(format!("--schedule {}: {what}", settings.schedule)));
        }
        let gpu = GpuContext::new(&GpuOptions { adapter: self.arguments.adapter.clone(), ..GpuOptions::default() })?;
        Ok(Equipment { gpu, watch })
    }
}

/// What stands before everything about a frame.
fn title(shot: &Shot) -> String {
    shot.frame.map_or_else(String::new, |frame| format!("{:12}", format!("frame {frame}:")))
}

fn facts(settings: &Settings, scene: &str, shot: &Shot, renderer: &Renderer, gpu: &GpuContext) -> Facts {
    let mut texts = vec![
        ("command", format!("path-tracer {}", command_line())),
        ("scene", scene.to_owned()),
        ("seed", settings.seed.to_string()),
        ("firstSample", settings.first_sample.to_string()),
        ("schedule", renderer.schedule()),
        ("adapter", gpu.facts.to_string()),
    ];
    texts.extend(shot.frame.map(|frame| ("frame", frame.to_string())));
    texts.extend(shot.time.map(|time| ("time", time.to_string())));
    let texts = texts.into_iter().map(|(name, text)| (name.to_owned(), text)).collect();
    Facts { camera: settings.camera.clone(), texts }
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
    watch: &'a mut Watch,
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
        let alpha = rendering.alpha();
        let picture = Picture { facts, layers, alpha, ..Picture::of_color(self.settings.width, self.settings.height, rendering.pixels()) };
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

/// A picture that is on the disk.
struct Made<'a> {
    shot: &'a Shot,
    settings: &'a Settings,
    scene: &'a str,
    adapter: &'a str,
    renderer: &'a Renderer,
    rendering: &'a Rendering,
}

impl Made<'_> {
    fn hash(&self) -> String {
        format!("{:016x}", self.rendering.film.hash())
    }

    /// What was done, for people: a frame in one line, a picture alone at length.
    fn tell(&self, voice: &Voice) {
        let report = &self.rendering.report;
        let seconds = report.elapsed.as_secs_f64();
        if self.shot.frame.is_some() {
            let (title, file, hash) = (title(self.shot), self.shot.out.display(), self.hash());
            voice.say(format_args!("{title}{} samples in {seconds:.1} s, {file}, image-hash {hash}", report.passes));
        } else {
            self.tell_at_length(voice, seconds);
        }
        for decision in &report.decisions {
            let (first, last) = (decision.first_pass, decision.first_pass + decision.passes);
            voice.say(format_args!("auto:       samples {first}..{last} by {}: {}", decision.schedule, decision.reason));
        }
        if report.not_finite > 0 {
            voice.say(format_args!("ledger:     {} components of samples were not finite and count as zero", report.not_finite));
        }
    }

    fn tell_at_length(&self, voice: &Voice, seconds: f64) {
        let report = &self.rendering.report;
        let ((width, height), passes) = (size(self.settings), report.passes);
        let rate = f64::from(width) * f64::from(height) * f64::from(passes) / seconds / 1e6;
        voice.say(format_args!("rendered:   {width}x{height}, {passes} samples in {seconds:.1} s, {rate:.3} Msamples/s"));
        voice.say(format_args!(
            "pool:       {} blocks in {} bank(s), {} bytes of state per lane; results of {} passes at once",
            report.pool_blocks,
            report.banks,
            self.renderer.scheduler().layout().bytes_per_lane(),
            report.ring
        ));
        voice.say(format_args!(
            "work:       {} steps, {} launches, {} regenerations, {} of {} paths ended by roulette",
            report.steps, report.launches, report.regenerations, report.items_killed, report.items_started
        ));
    }

    /// The files about how it went, and a summary for people.
    fn write_statistics(&self, voice: &Voice) -> Result<(), Failure> {
        let Shot { stats, trace, .. } = self.shot;
        if stats.is_none() && trace.is_none() {
            return Ok(());
        }
        let mut statistics = self.renderer.statistics(self.rendering)?;
        statistics.command = command_line();
        if let Some(path) = stats {
            output::write_json(path, &statistics.to_json())?;
        }
        if let Some(path) = trace {
            output::write_json(path, &statistics.trace())?;
        }
        voice.say(statistics.summary().trim_end());
        Ok(())
    }

    /// The last lines about a picture alone, and the object for programs.
    fn conclude(&self, voice: &mut Voice) {
        let (report, file, hash) = (&self.rendering.report, self.shot.out.display().to_string(), self.hash());
        if self.shot.frame.is_none() {
            voice.say(format_args!("image:      {file}"));
            voice.say(format_args!("image-hash: {hash}"));
        }
        let (width, height) = size(self.settings);
        let mut object = serde_json::json!({
            "file": file,
            "scene": self.scene,
            "width": width,
            "height": height,
            "samples": report.passes,
            "complete": report.passes == self.settings.samples,
            "seconds": report.elapsed.as_secs_f64(),
            "hash": hash,
            "schedule": self.renderer.schedule(),
            "adapter": self.adapter,
        });
        if let Some(frame) = self.shot.frame {
            (object["frame"], object["time"], object["skipped"]) = (frame.into(), self.shot.time.into(), false.into());
        }
        voice.conclude(object);
    }
}
