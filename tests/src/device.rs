//! The device that a test binary runs on, and the same binary once more on other drivers and widths.
//!
//! Key decision: the Vulkan loader chooses drivers when an instance is made, by environment variables; a process cannot change its mind.
//! So every other driver gets a process of its own: the test binary runs itself.
//!
//! Mesa's software driver keeps compiled shaders on disk and does not tell widths apart there (25.0: the key is made of the driver, its
//! flags, the processor and the shader). A process of 128 bits would run what one of 256 bits has compiled, so every width has a cache of its own.

use std::{ops::ControlFlow, path::PathBuf, process::Command, sync::OnceLock};

use wavepool::{Film, GpuContext, Program, Progress, Report, Schedule, Scheduler, policy::WorkSource};

/// Set in a process that another one started: the name of its level.
const LEVEL: &str = "WAVEPOOL_LEVEL";
/// Set there too: its number and how many levels there are, as `2/4`.
const PLACE: &str = "WAVEPOOL_LEVEL_PLACE";
/// Where Debian's chromium keeps SwiftShader.
const SWIFTSHADER: &str = "/usr/lib/chromium/vk_swiftshader_icd.json";
/// Mesa's software driver runs as many lanes at once as this many bits hold: subgroups of 4, 8 or 16.
const LAVAPIPE_WIDTHS: [(&str, &str); 3] =
    [("lavapipe at 128 bits", "128"), ("lavapipe at 256 bits", "256"), ("lavapipe at 512 bits", "512")];
const SWIFTSHADER_LEVEL: &str = "SwiftShader";

/// A driver with its settings, which only a new process can choose.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Level {
    /// As it appears in messages.
    pub name: String,
    variables: Vec<(&'static str, String)>,
    /// What the adapter must call itself.
    adapter: &'static str,
}

/// Prints why a test does not run, or fails when skips are forbidden.
///
/// # Panics
/// When `WAVEPOOL_NO_SKIP=1`.
pub fn skip(reason: &str) {
    assert!(std::env::var_os("WAVEPOOL_NO_SKIP").is_none_or(|value| value != "1"), "skips are forbidden here: {reason}");
    eprintln!("skipped: {reason}");
}

/// The adapter of this process; `None` after a printed skip.
///
/// # Panics
/// When there is no adapter and `WAVEPOOL_NO_SKIP=1`.
pub fn gpu() -> Option<&'static GpuContext> {
    static CONTEXT: OnceLock<Option<GpuContext>> = OnceLock::new();
    let context = CONTEXT.get_or_init(|| match GpuContext::headless() {
        Ok(context) => {
            eprintln!("adapter: {}", context.facts);
            Some(context)
        }
        Err(error) => {
            eprintln!("{error}");
            None
        }
    });
    if context.is_none() {
        skip("no GPU adapter");
    }
    context.as_ref()
}

/// The level that this process was started for; `None` in the process that a person has started.
pub fn level() -> Option<String> {
    std::env::var(LEVEL).ok()
}

/// The number of this process's level, and how many levels there are.
pub fn place_among_levels() -> (usize, usize) {
    let text = std::env::var(PLACE).unwrap_or_default();
    let parsed = text.split_once('/').and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
    parsed.unwrap_or((0, 1))
}

/// The levels to be had here: the widths of lavapipe where that is the adapter, else the adapter as it is; and SwiftShader. What is
/// missing is skipped aloud.
///
/// # Panics
/// When something is missing and `WAVEPOOL_NO_SKIP=1`.
pub fn levels() -> Vec<Level> {
    let Some(gpu) = gpu() else { return Vec::new() };
    let of = |name: &str, variables, adapter| Level { name: name.to_owned(), variables, adapter };
    let mut levels: Vec<Level> = match gpu.facts.is_llvmpipe() {
        true => LAVAPIPE_WIDTHS.iter().map(|(name, bits)| of(name, variables_of_width(bits), "llvmpipe")).collect(),
        false => vec![of(&gpu.facts.name, Vec::new(), "")],
    };
    levels.extend(swiftshader());
    levels
}

/// A width and a cache of its own, beside the test binaries.
fn variables_of_width(bits: &str) -> Vec<(&'static str, String)> {
    let binary = std::env::current_exe().expect("a running program has a file");
    let cache = binary.with_file_name(format!("shaders-of-{bits}-bits"));
    vec![("LP_NATIVE_VECTOR_WIDTH", bits.to_owned()), ("MESA_SHADER_CACHE_DIR", cache.display().to_string())]
}

fn swiftshader() -> Option<Level> {
    let wish = std::env::var_os("WAVEPOOL_SWIFTSHADER").filter(|path| !path.is_empty());
    let icd = PathBuf::from(wish.unwrap_or_else(|| SWIFTSHADER.into()));
    if !icd.is_file() {
        skip(&format!("the second driver, SwiftShader, is not at {}", icd.display()));
        return None;
    }
    let variables = vec![("VK_DRIVER_FILES", icd.display().to_string())];
    Some(Level { name: SWIFTSHADER_LEVEL.into(), variables, adapter: "SwiftShader" })
}

impl Level {
    /// Runs this test binary again on this level, with arguments that choose tests, and asserts that all pass.
    ///
    /// # Panics
    /// When a test fails there, when none runs, or when another driver answers.
    pub fn run_again(&self, arguments: &[&str]) {
        self.run_again_as(0, 1, arguments);
    }

    /// The same, as number `index` of `count` levels.
    ///
    /// # Panics
    /// As [`run_again`](Self::run_again).
    pub fn run_again_as(&self, index: usize, count: usize, arguments: &[&str]) {
        let binary = std::env::current_exe().expect("a running program has a file");
        let mut command = Command::new(binary);
        command.args(["--nocapture", "--test-threads=2"]).args(arguments).env(LEVEL, &self.name).env(PLACE, format!("{index}/{count}"));
        if self.variables.iter().any(|(name, _)| *name == "VK_DRIVER_FILES") {
            command.env_remove("VK_ICD_FILENAMES").env_remove("WAVEPOOL_ADAPTER");
        }
        command.envs(self.variables.iter().map(|(name, value)| (name, value)));
        let output = command.output().expect("the test binary starts");
        let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        println!("{}", text.lines().map(|line| format!("  {}: {line}", self.name)).collect::<Vec<_>>().join("\n"));
        assert!(output.status.success(), "{}: {}", self.name, output.status);
        assert!(!text.contains("running 0 tests"), "{}: no test has run", self.name);
        assert!(text.contains(self.adapter), "{}: another driver answered", self.name);
    }
}

/// Runs this test binary again on SwiftShader, without the tests named here, and asserts that all passes.
///
/// # Panics
/// As [`Level::run_again`]; when SwiftShader is missing and `WAVEPOOL_NO_SKIP=1`.
pub fn run_again_on_swiftshader(without: &[&str]) {
    if level().is_some() {
        return;
    }
    let arguments: Vec<&str> = without.iter().flat_map(|name| ["--skip", name]).collect();
    swiftshader().into_iter().for_each(|level| level.run_again(&arguments));
}

/// Looks at a run without any change, after which it can only be one that never ends: a walk takes a thousand steps at most in these tests,
/// and a submission may be one step.
const PATIENCE: u32 = 5000;

/// Lets a run go on until it can only be one that never ends. Looks count, not seconds: on a busy machine a driver may compile a large kernel for
/// minutes, and a run that was given up on time has fewer passes, which looks like other bits.
pub fn patient() -> impl FnMut(&Progress) -> ControlFlow<()> {
    let (mut latest, mut looks) = ((0, 0), 0);
    move |progress| {
        let now = (progress.passes_done, progress.items_started);
        looks = if now == latest { looks + 1 } else { 0 };
        latest = now;
        if looks < PATIENCE { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}

/// Runs a program once; failures name the program and the schedule.
///
/// # Panics
/// When the library reports an error, or the run does not end.
pub fn run(gpu: &GpuContext, program: &Program, source: impl WorkSource + 'static, passes: u32, schedule: &Schedule) -> (Film, Report) {
    let outcome = scheduler(gpu, program, source, schedule).run_with(0, passes, patient());
    let (film, report) = outcome.unwrap_or_else(|error| panic!("{}, {schedule}: {error}", program.name()));
    assert!(film.pixels() == 0 || report.passes == passes, "{}, {schedule}: {} of {passes} passes", program.name(), report.passes);
    (film, report)
}

/// A scheduler that is known to be sound.
///
/// # Panics
/// When the library reports an error.
pub fn scheduler(gpu: &GpuContext, program: &Program, source: impl WorkSource + 'static, schedule: &Schedule) -> Scheduler {
    Scheduler::builder(program, source)
        .schedule(schedule)
        .build_on(gpu)
        .unwrap_or_else(|error| panic!("{}, {schedule}: {error}", program.name()))
}
