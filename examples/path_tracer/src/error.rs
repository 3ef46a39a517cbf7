//! Everything that can go wrong between the files and the renderer.
//!
//! Key decision: readers raise a `Fault`, which knows the place inside a file, and the function that opened the file turns it into an
//! [`Error`], which knows the file too. So no reader has to carry a path around.
//!
//! **Invariant:** the text of an [`Error`] is one line, whatever names the file contains, and says the file and the place in it.

use std::fmt::Display;
use std::path::Path;

/// Why a file could not be read, understood or written, or a scene not rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused to read the file.
    #[error("{file}: {reason}")]
    Read {
        /// As the user wrote it.
        file: String,
        /// The operating system's words.
        reason: String,
    },
    /// The content breaks the rules of its format.
    #[error("{file}: {place}: {what}")]
    Invalid {
        /// As the user wrote it, or the name of a built-in scene.
        file: String,
        /// Where in the file, outermost part first.
        place: String,
        /// The broken rule.
        what: String,
    },
    /// The content is fine, but needs something that this renderer does not have.
    #[error("{file}: {place}: {feature} is not supported")]
    Unsupported {
        /// As the user wrote it.
        file: String,
        /// Where in the file, outermost part first.
        place: String,
        /// What is missing.
        feature: String,
    },
    /// The ending of the file's name says nothing known.
    #[error("{file}: the name should end in {expected}")]
    Extension {
        /// As the user wrote it.
        file: String,
        /// The known endings.
        expected: &'static str,
    },
    /// The operating system refused to write the file.
    #[error("{file}: cannot write: {reason}")]
    Write {
        /// As the user wrote it.
        file: String,
        /// The operating system's words, or the encoder's.
        reason: String,
    },
    /// The scene does not fit into the tables of the kernels.
    #[error("scene: {0}")]
    Pack(#[from] crate::gpu_scene::Error),
    /// The scheduler or the device could not do it.
    #[error(transparent)]
    Scheduler(#[from] wavepool::Error),
}

impl Error {
    pub(crate) fn read(path: &Path, reason: impl Display) -> Error {
        Error::Read { file: file_text(path), reason: one_line(&reason.to_string()) }
    }

    pub(crate) fn write(path: &Path, reason: impl Display) -> Error {
        Error::Write { file: file_text(path), reason: one_line(&reason.to_string()) }
    }

    pub(crate) fn extension(path: &Path, expected: &'static str) -> Error {
        Error::Extension { file: file_text(path), expected }
    }
}

/// A defect at a place inside a file whose name is not known yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    place: String,
    what: String,
    unsupported: bool,
}

impl Fault {
    /// The content breaks the rules of its format.
    pub(crate) fn invalid(place: impl Display, what: impl Display) -> Fault {
        Fault { place: place.to_string(), what: what.to_string(), unsupported: false }
    }

    /// The content needs something that this renderer does not have.
    pub(crate) fn unsupported(place: impl Display, feature: impl Display) -> Fault {
        Fault { place: place.to_string(), what: feature.to_string(), unsupported: true }
    }

    /// The same fault, seen from the part that contains its place.
    pub(crate) fn within(self, outer: impl Display) -> Fault {
        Fault { place: format!("{outer}, {}", self.place), ..self }
    }

    pub(crate) fn in_file(self, path: &Path) -> Error {
        self.in_named(&file_text(path))
    }

    /// For scenes that come from no file.
    pub(crate) fn in_named(self, name: &str) -> Error {
        let (file, place, what) = (one_line(name), one_line(&self.place), one_line(&self.what));
        if self.unsupported { Error::Unsupported { file, place, feature: what } } else { Error::Invalid { file, place, what } }
    }
}

fn file_text(path: &Path) -> String {
    one_line(&path.display().to_string())
}

/// Replaces control characters and cuts what is longer than any honest message, because names come from files that anybody can write.
pub(crate) fn one_line(text: &str) -> String {
    const LONGEST: usize = 400;
    let mut line: String = text.chars().take(LONGEST).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().nth(LONGEST).is_some() {
        line.push_str("...");
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a name with a line break that makes a message of two lines.
    #[test]
    fn an_error_is_one_line_and_names_file_and_place() {
        let fault = Fault::invalid("primitive 0", "bad\nthing").within("mesh 2");
        let text = fault.in_file(Path::new("a.glb")).to_string();
        assert_eq!(text, "a.glb: mesh 2, primitive 0: bad thing");
    }

    // Kills: an endless name copied into an endless message.
    #[test]
    fn a_long_text_is_cut() {
        assert!(one_line(&"x".repeat(100_000)).len() < 500);
    }
}
