//! The command line: arguments in, one function per command.

mod adapters;
mod compare;
mod contents;
mod explain;
mod export;
mod frames;
mod manual;
mod picture;
mod progress;
mod render;
mod scene;
mod scenes;
mod schedule;
mod schedules;
mod session;
mod sheet;
mod stop;
mod value;
mod view;
mod voice;
mod watch;

use std::fmt;

use clap::{
    Parser, Subcommand,
    error::{ContextKind, ContextValue, ErrorKind},
};

/// What a stranger can do next.
const AFTER_HELP: &str = "\
Try first:
  path-tracer render cornell-box                     a built-in scene, to cornell-box.png
  path-tracer scenes                                 what else is built in
  path-tracer info scene.glb                         what is in a file of yours
  path-tracer render scene.glb --env sky.hdr --samples 256 --out picture.exr
  path-tracer render scene.glb --frames 1..48 --out frame_####.png
  path-tracer sheet folder --out sheet.png           all scenes of a folder at a glance
  path-tracer compare picture.exr reference.exr      how far two pictures are apart
  path-tracer render --help                          everything that can be chosen

Exit codes: 0 done, 1 it could not be done or a check failed, 2 wrong usage, 3 done but for some of many (`sheet`), 130 stopped by Ctrl-C.
NO_COLOR=1 turns colours off. `path-tracer completions bash` and `path-tracer man render` print what
shells and man read.";

/// A path tracer that schedules its work with wavepool.
#[derive(Debug, Parser)]
#[command(name = "path-tracer", version, max_term_width = 120, after_help = AFTER_HELP)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a built-in scene or a file (glTF, OBJ, PLY) to PNG, EXR, PFM or a NumPy array.
    Render(Box<render::Arguments>),
    /// List the built-in scenes.
    Scenes,
    /// Show what is in a scene: cameras, lights, materials, images, memory.
    Info(contents::Arguments),
    /// Compare a picture with a reference: MSE, relMSE, mean difference, worst tile.
    Compare(compare::Arguments),
    /// List the GPU adapters, best first.
    Adapters(adapters::Arguments),
    /// Show what a scene needs: stages, the table of leaves and stages, the plan of a step.
    Explain(Box<explain::Arguments>),
    /// Show many scenes small in one picture: a folder at a glance.
    Sheet(sheet::Arguments),
    /// Write a scene for another renderer.
    Export(Box<export::Arguments>),
    /// Draw what schedules do with a scene: blocks across, steps down, every tile in its colour.
    Schedule(schedule::Arguments),
    /// List the schedules and their keys.
    Schedules,
    /// Print completions for a shell.
    Completions(manual::CompletionsArguments),
    /// Print a manual page.
    Man(manual::ManArguments),
}

/// Why a command failed.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The command was not understood.
    Usage(String),
    /// It was understood, but could not be done.
    Runtime(String),
    /// It was done but for some of many.
    Partial(String),
    /// Somebody pressed Ctrl-C.
    Stopped(String),
}

impl Failure {
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Failure::Usage(_) => 2,
            Failure::Runtime(_) => 1,
            Failure::Partial(_) => 3,
            Failure::Stopped(_) => stop::EXIT_CODE,
        }
    }
}

impl Failure {
    /// The same failure, of one picture of a series.
    pub(crate) fn in_frame(self, frame: Option<i32>) -> Failure {
        match (self, frame) {
            (Failure::Runtime(text), Some(frame)) => Failure::Runtime(format!("frame {frame}: {text}")),
            (failure, _) => failure,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Usage(text) | Failure::Runtime(text) | Failure::Partial(text) | Failure::Stopped(text) => f.write_str(text),
        }
    }
}

impl From<path_tracer::Error> for Failure {
    fn from(error: path_tracer::Error) -> Self {
        Failure::Runtime(error.to_string())
    }
}

impl From<path_tracer::wavepool::Error> for Failure {
    fn from(error: path_tracer::wavepool::Error) -> Self {
        Failure::Runtime(error.to_string())
    }
}

/// Runs the command that the arguments name.
pub(crate) fn run() -> Result<(), Failure> {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => match wrong_value(&error) {
            Some(message) => return Err(Failure::Usage(message)),
            None => error.exit(),
        },
    };
    match arguments.command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Scenes => scenes::run(),
        Command::Info(arguments) => contents::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Adapters(arguments) => adapters::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Sheet(arguments) => sheet::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Schedule(arguments) => schedule::run(&arguments),
        Command::Schedules => schedules::run(),
        Command::Completions(arguments) => manual::completions(&arguments),
        Command::Man(arguments) => manual::man(&arguments),
    }
}

/// One line for a value that is not allowed: the option, the value, what is allowed.
fn wrong_value(error: &clap::Error) -> Option<String> {
    if !matches!(error.kind(), ErrorKind::ValueValidation | ErrorKind::InvalidValue) {
        return None;
    }
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let option = text(ContextKind::InvalidArg)?.split(' ').next()?;
    let value: String = text(ContextKind::InvalidValue)?.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let reason = match error.get(ContextKind::ValidValue) {
        Some(ContextValue::Strings(allowed)) if !allowed.is_empty() => format!("allowed are {}", allowed.join(", ")),
        _ => std::error::Error::source(error)?.to_string(),
    };
    Some(format!("{option} {value}: {reason}"))
}

/// Writes a line to stdout; a reader that has gone away (`| head`) is no error.
pub(crate) fn say(line: impl fmt::Display) {
    use std::io::Write as _;
    let _ = writeln!(std::io::stdout(), "{line}");
}
