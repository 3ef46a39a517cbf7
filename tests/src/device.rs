//! The device that a test binary runs on, and the same binary once more on a second driver.
//!
//! Key decision: the Vulkan loader chooses drivers when an instance is made, by environment variables; a process cannot change its mind.
//! So the second driver gets a second process: the test binary runs itself.

use std::{ops::ControlFlow, path::PathBuf, process::Command, sync::OnceLock, time::Duration};

use wavepool::{Film, GpuContext, Program, Report, Schedule, Scheduler, policy::WorkSource};

/// Set in the process that runs on the second driver.
const SECOND: &str = "WAVEPOOL_SECOND_DRIVER";
/// Where Debian's chromium keeps SwiftShader.
const SWIFTSHADER: &str = "/usr/lib/chromium/vk_swiftshader_icd.json";

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

/// True in the process that runs on the second driver.
pub fn is_second_driver() -> bool {
    std::env::var_os(SECOND).is_some()
}

/// Runs this test binary again on SwiftShader, without the test named `this`, and asserts that all passes.
///
/// # Panics
/// When a test fails there, when another driver answers, or when SwiftShader is missing and `WAVEPOOL_NO_SKIP=1`.
pub fn run_again_on_swiftshader(this: &str) {
    if is_second_driver() {
        return;
    }
    let wish = std::env::var_os("WAVEPOOL_SWIFTSHADER").filter(|path| !path.is_empty());
    let icd = PathBuf::from(wish.unwrap_or_else(|| SWIFTSHADER.into()));
    if !icd.is_file() {
        return skip(&format!("the second driver, SwiftShader, is not at {}", icd.display()));
    }
    let binary = std::env::current_exe().expect("a running program has a file");
    let output = Command::new(binary)
        .args(["--nocapture", "--test-threads=2", "--skip", this])
        .env("VK_DRIVER_FILES", &icd)
        .env_remove("VK_ICD_FILENAMES")
        .env_remove("WAVEPOOL_ADAPTER")
        .env(SECOND, "1")
        .output()
        .expect("the test binary starts");
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    println!("{}", text.lines().map(|line| format!("  second driver: {line}")).collect::<Vec<_>>().join("\n"));
    assert!(output.status.success(), "the second driver fails: {}", output.status);
    assert!(text.contains("SwiftShader"), "another driver answered");
}

/// A run that takes longer than this never ends: the small programs here take seconds on a busy CPU.
const PATIENCE: Duration = Duration::from_secs(90);

/// Runs a program once; failures name the program and the schedule.
///
/// # Panics
/// When the library reports an error, or the run does not end.
pub fn run(gpu: &GpuContext, program: &Program, source: impl WorkSource + 'static, passes: u32, schedule: &Schedule) -> (Film, Report) {
    let outcome = scheduler(gpu, program, source, schedule)
        .run_with(0, passes, |progress| if progress.elapsed < PATIENCE { ControlFlow::Continue(()) } else { ControlFlow::Break(()) });
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
        .cache(&gpu.cache)
        .build(&gpu.device, &gpu.queue)
        .unwrap_or_else(|error| panic!("{}, {schedule}: {error}", program.name()))
}
