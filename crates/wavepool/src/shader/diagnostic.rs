//! A message that points into the file the user wrote.

use std::{fmt, ops::Range};

use codespan_reporting::{
    diagnostic::{Diagnostic as Report, Label, LabelStyle},
    files::SimpleFile,
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

impl Diagnostic {
    /// Points at `span` (bytes) of `text`.
    pub(crate) fn new(file: &str, text: &str, span: Range<usize>, message: &str, label: &str, notes: &[String]) -> Self {
        Self::labelled(file, text, &[(span, label)], message, notes)
    }

    /// Points at several places of `text`; the first is where the mistake is.
    pub(crate) fn labelled(file: &str, text: &str, labels: &[(Range<usize>, &str)], message: &str, notes: &[String]) -> Self {
        let start = labels.first().map_or(0, |(span, _)| text.floor_char_boundary(span.start));
        let before = &text[..start];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        let labels = labels.iter().enumerate().map(|(index, (span, label))| {
            let start = text.floor_char_boundary(span.start);
            let range = start..text.ceil_char_boundary(span.end.max(start));
            let style = if index == 0 { LabelStyle::Primary } else { LabelStyle::Secondary };
            Label::new(style, (), range).with_message(*label)
        });
        let report = Report::error().with_message(message).with_labels(labels.collect()).with_notes(notes.to_vec());
        let config = term::Config { tab_width: 4, ..term::Config::default() };
        let rendered = term::emit_into_string(&config, &SimpleFile::new(file, text), &report)
            .map_or_else(|_| format!("error: {message} ({file}:{line}:{column})"), |text| text.trim_end().to_owned());
        Diagnostic { file: file.to_owned(), line, column, message: message.to_owned(), rendered }
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
