//! What the tests of schedules are run on: small programs, built-in scenes and a real file, all behind one call.

use std::{path::PathBuf, sync::Mutex};

use path_tracer::{
    Renderer, Settings,
    scene::{self, Scene},
};
use wavepool::{Film, ImageTiles, Instruments, Program, Report, Schedule, Scheduler};
use wavepool_tests::{
    border,
    device::{gpu, patient, skip},
    programs,
};

/// A program, or a scene for the path tracer.
pub(crate) enum Subject {
    Program(Box<Program>),
    Scene(Box<Scene>),
}

/// Makes a subject, unless what it needs is missing.
type Make = fn() -> Option<Subject>;

/// Everything by name.
pub(crate) const SUBJECTS: [(&str, Make); 6] = [
    ("collatz", || program(programs::collatz)),
    ("hops", || program(programs::hops)),
    ("border", || program(border::program)),
    ("cornell-box", || Some(built_in("cornell-box"))),
    ("mirror-corridor", || Some(built_in("mirror-corridor"))),
    ("FlightHelmet", flight_helmet),
];

fn program(make: fn() -> Program) -> Option<Subject> {
    Some(Subject::Program(Box::new(make())))
}

/// A scene of the path tracer's list.
pub(crate) fn built_in(name: &str) -> Subject {
    let mut scene = scene::builtin(name).expect("it is in the list");
    scene.reframe(40.0 / 56.0);
    Subject::Scene(Box::new(scene))
}

/// A real file under a real panorama; a printed skip without `WAVEPOOL_ASSETS`.
pub(crate) fn flight_helmet() -> Option<Subject> {
    static SKIPPED: Mutex<bool> = Mutex::new(false);
    let Some(assets) = std::env::var_os("WAVEPOOL_ASSETS").map(PathBuf::from) else {
        let mut is_skipped = SKIPPED.lock().expect("nobody panics here");
        if !std::mem::replace(&mut is_skipped, true) {
            skip("WAVEPOOL_ASSETS is not set");
        }
        return None;
    };
    let mut scene = scene::load(&assets.join("gltf/FlightHelmet/FlightHelmet.gltf")).expect("the file loads");
    let (environment, _) = scene::load_environment(&assets.join("env/small/rle.hdr")).expect("the panorama loads");
    scene.environment = Some(environment);
    scene.reframe(40.0 / 56.0);
    Some(Subject::Scene(Box::new(scene)))
}

impl Subject {
    /// Stages of a step.
    pub(crate) fn stages(&self) -> usize {
        match self {
            Subject::Program(program) => program.stages().count(),
            Subject::Scene(scene) => Renderer::program(scene).map_or(0, |program| program.stages().count()),
        }
    }

    /// Walks all pixels of an image; failures name the schedule.
    pub(crate) fn run(&self, image: ImageTiles, samples: u32, schedule: &Schedule, instruments: Instruments) -> (Film, Report) {
        let (film, report) = self.try_run(image, samples, schedule, instruments).unwrap_or_else(|error| panic!("{schedule}: {error}"));
        assert_eq!(report.passes, samples, "{schedule}: the run was given up");
        (film, report)
    }

    fn try_run(&self, image: ImageTiles, samples: u32, schedule: &Schedule, instruments: Instruments) -> Result<(Film, Report), String> {
        let gpu = gpu().expect("asked before");
        match self {
            Subject::Program(program) => {
                let builder = Scheduler::builder(program, image).schedule(schedule).instruments(instruments);
                let mut scheduler = builder.build_on(gpu).map_err(|error| error.to_string())?;
                scheduler.run_with(0, samples, patient()).map_err(|error| error.to_string())
            }
            Subject::Scene(scene) => {
                let mut settings = Settings::new(image.width, image.height, samples);
                (settings.depth, settings.schedule, settings.instruments) = (12, schedule.clone(), instruments);
                let mut renderer = Renderer::new(gpu, scene, &settings).map_err(|error| error.to_string())?;
                let rendering = renderer.render(patient()).map_err(|error| error.to_string())?;
                Ok((rendering.film, rendering.report))
            }
        }
    }
}
