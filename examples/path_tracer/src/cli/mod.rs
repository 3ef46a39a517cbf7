//! The command line: arguments in, one function per command.

mod adapters;
mod explain;
mod export;
mod progress;
mod render;
mod scenes;
mod schedule;
mod schedules;

use std::fmt;

use clap::{Parser, Subcommand};

/// A path tracer that schedules its work with wavepool.
#[derive(Debug, Parser)]
#[command(name = "path-tracer", version, max_term_width = 120, after_help = "Try first:  path-tracer render cornell-box")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a built-in scene or a glTF file to PNG or EXR.
    Render(render::Arguments),
    /// List the built-in scenes.
    Scenes,
    /// List the GPU adapters, best first.
    Adapters(adapters::Arguments),
    /// Show what a scene needs: stages, the table of leaves and stages, the plan of a step.
    Explain(explain::Arguments),
    /// Write a scene for another renderer.
    Export(export::Arguments),
    /// Draw what schedules do with a scene: blocks across, steps down, every tile in its colour.
    Schedule(schedule::Arguments),
    /// List the schedules and their keys.
    Schedules,
}

/// Why a command failed.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The command was not understood.
    Usage(String),
    /// It was understood, but could not be done.
    Runtime(String),
}

impl Failure {
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Failure::Usage(_) => 2,
            Failure::Runtime(_) => 1,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Usage(text) | Failure::Runtime(text) => f.write_str(text),
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
    match Arguments::parse().command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Scenes => scenes::run(),
        Command::Adapters(arguments) => adapters::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Schedule(arguments) => schedule::run(&arguments),
        Command::Schedules => schedules::run(),
    }
}

/// Writes a line to stdout; a reader that has gone away (`| head`) is no error.
pub(crate) fn say(line: impl fmt::Display) {
    use std::io::Write as _;
    let _ = writeln!(std::io::stdout(), "{line}");
}
