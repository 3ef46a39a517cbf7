//! What a command says, and to whom: results to stdout, notes to stderr, or everything as one JSON object.
//!
//! **Invariant:** with `--json`, stdout is one JSON document; with `--quiet`, nothing is said but errors. Notes reach the JSON all the
//! same.

use std::fmt::Display;

use super::say;

#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct VoiceArguments {
    /// Say nothing but errors.
    #[arg(long, short)]
    quiet: bool,
    /// Say what was done as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

impl VoiceArguments {
    pub(crate) fn wants_json(self) -> bool {
        self.json
    }
}

#[derive(Debug)]
pub(crate) struct Voice {
    is_quiet: bool,
    is_json: bool,
    notes: Vec<String>,
}

impl Voice {
    pub(crate) fn of(arguments: VoiceArguments) -> Voice {
        Voice { is_quiet: arguments.quiet, is_json: arguments.json, notes: Vec::new() }
    }

    /// A line for people.
    pub(crate) fn say(&self, line: impl Display) {
        if !self.is_quiet && !self.is_json {
            say(line);
        }
    }

    /// A line about something that is not as it was asked for.
    pub(crate) fn note(&mut self, line: impl Display) {
        if !self.is_quiet {
            eprintln!("note: {line}");
        }
        self.notes.push(line.to_string());
    }

    pub(crate) fn notes<'a>(&mut self, lines: impl IntoIterator<Item = &'a String>) {
        lines.into_iter().for_each(|line| self.note(line));
    }

    /// True when progress may be shown.
    pub(crate) fn shows_progress(&self) -> bool {
        !self.is_quiet
    }

    /// The object that `--json` asks for, with all notes as `warnings`.
    pub(crate) fn conclude(&self, mut object: serde_json::Value) {
        if self.is_json {
            object["warnings"] = self.notes.clone().into();
            say(object);
        }
    }
}
