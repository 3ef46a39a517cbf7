//! What a command says, and to whom: results to stdout, notes to stderr, or everything as one JSON object.
//!
//! **Invariant:** with `--json`, stdout is one JSON document, or a line of JSON for each picture of a series; with `--quiet`, nothing is
//! said but errors. Notes reach the JSON all the same. What many pictures have in common is noted once for people, and in every JSON.

use std::{collections::BTreeSet, fmt::Display};

use super::say;

#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct VoiceArguments {
    /// Say nothing but errors.
    #[arg(long, short)]
    quiet: bool,
    /// Say what was done as one JSON object on stdout; with --frames as one for each frame, a line each.
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
    /// Since the last conclusion.
    notes: Vec<String>,
    said: BTreeSet<String>,
}

impl Voice {
    pub(crate) fn of(arguments: VoiceArguments) -> Voice {
        Voice { is_quiet: arguments.quiet, is_json: arguments.json, notes: Vec::new(), said: BTreeSet::new() }
    }

    /// A line for people.
    pub(crate) fn say(&self, line: impl Display) {
        if !self.is_quiet && !self.is_json {
            say(line);
        }
    }

    /// A line about something that is not as it was asked for.
    pub(crate) fn note(&mut self, line: impl Display) {
        let line = line.to_string();
        if self.said.insert(line.clone()) && !self.is_quiet {
            eprintln!("note: {line}");
        }
        self.notes.push(line);
    }

    pub(crate) fn notes<'a>(&mut self, lines: impl IntoIterator<Item = &'a String>) {
        lines.into_iter().for_each(|line| self.note(line));
    }

    /// True when progress may be shown.
    pub(crate) fn shows_progress(&self) -> bool {
        !self.is_quiet
    }

    /// The object that `--json` asks for, with all notes since the last one as `warnings`.
    pub(crate) fn conclude(&mut self, mut object: serde_json::Value) {
        let notes = std::mem::take(&mut self.notes);
        if self.is_json {
            object["warnings"] = notes.into();
            say(object);
        }
    }
}
