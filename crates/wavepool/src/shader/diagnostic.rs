//! A message that points into the file the user wrote.

use std::{fmt, ops::Range};

use codespan_reporting::{
    diagnostic::{Diagnostic as Report, Label, LabelStyle},
    files::SimpleFiles,
    term,
};

/// A mistake in WGSL: where it is and what it is. `Display` prints file, line, column, the line itself and a caret.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The file as given to the program builder; empty when the message points nowhere.
    pub file: String,
    /// Counted from 1.
    pub line: usize,
    /// Counted from 1, in characters.
    pub column: usize,
    /// One line.
    pub message: String,
    rendered: String,
}

/// Bytes of a file, and what to say about them.
pub(super) struct Place<'a> {
    pub(super) file: &'a str,
    pub(super) text: &'a str,
    pub(super) span: Range<usize>,
    pub(super) label: &'a str,
}

impl Diagnostic {
    /// Points at `span` (bytes) of `text`.
    pub(crate) fn new(file: &str, text: &str, span: Range<usize>, message: &str, label: &str, notes: &[String]) -> Self {
        Self::labelled(file, text, &[(span, label)], message, notes)
    }

    /// Points at several places of `text`; the first is where the mistake is.
    pub(crate) fn labelled(file: &str, text: &str, labels: &[(Range<usize>, &str)], message: &str, notes: &[String]) -> Self {
        let places: Vec<Place> = labels.iter().map(|(span, label)| Place { file, text, span: span.clone(), label }).collect();
        Self::across(&places, message, notes)
    }

    /// Points at places of several files; the first is where the mistake is.
    pub(super) fn across(places: &[Place], message: &str, notes: &[String]) -> Self {
        let Some(first) = places.first() else { return Self::nowhere(message.to_owned()) };
        let before = &first.text[..first.text.floor_char_boundary(first.span.start)];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        let mut files = SimpleFiles::new();
        let mut known: Vec<(&Place, usize)> = Vec::new();
        let mut labels = Vec::new();
        for place in places {
            let same = known.iter().find(|(other, _)| other.file == place.file && other.text == place.text);
            let id = same.map_or_else(|| files.add(place.file, place.text), |(_, id)| *id);
            known.push((place, id));
            let start = place.text.floor_char_boundary(place.span.start);
            let range = start..place.text.ceil_char_boundary(place.span.end.max(start));
            let style = if labels.is_empty() { LabelStyle::Primary } else { LabelStyle::Secondary };
            labels.push(Label::new(style, id, range).with_message(place.label));
        }
        let report = Report::error().with_message(message).with_labels(labels).with_notes(notes.to_vec());
        let config = term::Config { tab_width: 4, ..term::Config::default() };
        let rendered = term::emit_into_string(&config, &files, &report)
            .map_or_else(|_| format!("error: {message} ({}:{line}:{column})", first.file), |text| text.trim_end().to_owned());
        Diagnostic { file: first.file.to_owned(), line, column, message: message.to_owned(), rendered }
    }

    /// Points nowhere: something is missing altogether.
    pub(crate) fn nowhere(message: String) -> Self {
        Diagnostic { file: String::new(), line: 0, column: 0, rendered: format!("error: {message}"), message }
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.rendered)
    }
}
