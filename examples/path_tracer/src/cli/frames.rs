//! Options that ask for the frames of an animation, and what the files of frames are called.
//!
//! Key decision: numbers, ends and names are those of Blender: a range includes both ends, a run of `#` in a name is the number with at least
//! as many digits, and frame N shows the moment N / fps. So the frames of an exported animation are the frames of the file it came from.

use std::{
    ffi::OsString,
    fmt,
    path::{Path, PathBuf},
};

use super::{Failure, value};

#[derive(Debug, clap::Args)]
pub(crate) struct FrameArguments {
    /// Render these frames of an animation, both ends included: 1..24 are 24 pictures, 7 is one. Frame N shows second N / fps. Files are
    /// numbered: the number takes the place of the last run of # in a name, or stands before its ending as .0001.
    #[arg(long, value_name = "A..B", allow_hyphen_values = true, value_parser = range, conflicts_with = "time")]
    pub(crate) frames: Option<Frames>,
    /// Frames per second.
    #[arg(long, value_name = "N", default_value_t = 24.0, allow_negative_numbers = true, requires = "frames", value_parser = value::rate)]
    fps: f64,
    /// Leave out frames whose picture is there already, to go on with what was stopped; without it they are rendered again.
    #[arg(long, requires = "frames")]
    pub(crate) skip_existing: bool,
}

/// Frames in a row, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Frames {
    first: i32,
    last: i32,
}

impl fmt::Display for Frames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.first, self.last)
    }
}

/// `A..B`, `A..=B` or `A`.
fn range(text: &str) -> Result<Frames, String> {
    let read = || {
        let (first, last) = text.split_once("..").unwrap_or((text, text));
        let (first, last) = (first.parse().ok()?, last.strip_prefix('=').filter(|_| text.contains("..")).unwrap_or(last).parse().ok()?);
        (first <= last).then_some(Frames { first, last })
    };
    read().ok_or_else(|| String::from("expected A..B, the first and the last frame, both of them included, or one frame"))
}

/// One picture to make: what it shows, and where everything about it goes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shot {
    /// Its number, when it is one of several.
    pub(crate) frame: Option<i32>,
    /// Seconds at which animations are shown.
    pub(crate) time: Option<f32>,
    pub(crate) out: PathBuf,
    pub(crate) stats: Option<PathBuf>,
    pub(crate) trace: Option<PathBuf>,
}

impl FrameArguments {
    /// For commands that speak of one moment.
    pub(crate) fn refuse(&self, command: &str) -> Result<(), Failure> {
        match self.frames {
            Some(frames) => Err(Failure::Usage(format!("--frames {frames}: {command} takes one moment, which --time chooses"))),
            None => Ok(()),
        }
    }

    /// All shots that the whole becomes: itself, or one for each frame.
    pub(crate) fn shots(&self, whole: Shot) -> impl Iterator<Item = Shot> {
        let numbers = self.frames.map(|frames| frames.first..=frames.last);
        let of_frame = {
            let whole = whole.clone();
            move |frame: i32| {
                let file = |path: &PathBuf| numbered(path, frame);
                let (out, stats, trace) = (file(&whole.out), whole.stats.as_ref().map(file), whole.trace.as_ref().map(file));
                Shot { frame: Some(frame), time: Some(self.seconds(frame)), out, stats, trace }
            }
        };
        let alone = self.frames.is_none().then_some(whole);
        numbers.into_iter().flatten().map(of_frame).chain(alone)
    }

    /// The moment of a frame.
    fn seconds(&self, frame: i32) -> f32 {
        (f64::from(frame) / self.fps) as f32
    }
}

/// The name of a frame's file: the number in place of the last `####`, or before the ending.
fn numbered(path: &Path, frame: i32) -> PathBuf {
    let sign = if frame < 0 { "-" } else { "" };
    let number = |width: usize| format!("{sign}{:0width$}", frame.unsigned_abs());
    let pattern = path.file_name().and_then(|name| name.to_str()).and_then(|name| {
        let end = name.rfind('#')? + 1;
        let start = name[..end].trim_end_matches('#').len();
        Some(format!("{}{}{}", &name[..start], number(end - start), &name[end..]))
    });
    let name = pattern.map_or_else(
        || {
            let mut name = OsString::from(path.file_stem().unwrap_or_default());
            name.push(format!(".{}", number(4)));
            if let Some(ending) = path.extension() {
                name.push(".");
                name.push(ending);
            }
            name
        },
        OsString::from,
    );
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a last frame that is left out, as Rust's ranges have it, or counted twice; ranges that run backwards, half of a range.
    #[test]
    fn both_ends_of_a_range_are_rendered() {
        let whole = Shot { frame: None, time: None, out: "a.exr".into(), stats: None, trace: Some("t.json".into()) };
        let shots = |text: &str, fps| {
            let arguments = FrameArguments { frames: Some(range(text).expect(text)), fps, skip_existing: false };
            let shots: Vec<Shot> = arguments.shots(whole.clone()).collect();
            shots.into_iter().map(|shot| (shot.frame, shot.time)).collect::<Vec<_>>()
        };
        assert_eq!(shots("0..2", 2.0), [(Some(0), Some(0.0)), (Some(1), Some(0.5)), (Some(2), Some(1.0))]);
        assert_eq!(shots("-1..=0", 24.0), [(Some(-1), Some(-1.0 / 24.0)), (Some(0), Some(0.0))]);
        assert_eq!(shots("30", 30.0), [(Some(30), Some(1.0))]);
        assert_eq!(shots("2147483647..2147483647", 1.0).len(), 1);
        for text in ["", "..", "1..", "..2", "2..1", "1...3", "1..2..3", "1.5..2", "=3", "1..==3", "a..b"] {
            assert!(range(text).is_err(), "{text}");
        }
        let none = FrameArguments { frames: None, fps: 24.0, skip_existing: false };
        assert_eq!(none.shots(whole.clone()).collect::<Vec<_>>(), std::slice::from_ref(&whole));
        let one = FrameArguments { frames: range("3").ok(), ..none };
        let shot = one.shots(whole).next().expect("a shot");
        assert_eq!((shot.out, shot.stats, shot.trace), ("a.0003.exr".into(), None, Some("t.0003.json".into())));
    }

    // Kills: a number after the ending, digits cut off, signs in the middle of zeros, `#` of a folder taken for those of the name.
    #[test]
    fn files_are_numbered_as_in_blender() {
        let cases = [
            ("a.exr", 1, "a.0001.exr"),
            ("out/a.b.exr", 123_456, "out/a.b.123456.exr"),
            ("a_####.exr", 7, "a_0007.exr"),
            ("a_##.exr", 123, "a_123.exr"),
            ("#.png", 7, "7.png"),
            ("s#1_###.png", 7, "s#1_007.png"),
            ("shot##/a.png", -7, "shot##/a.-0007.png"),
            ("\u{e4}#\u{f6}.png", 7, "\u{e4}7\u{f6}.png"),
            ("plain", 7, "plain.0007"),
        ];
        for (name, frame, expected) in cases {
            assert_eq!(numbered(Path::new(name), frame), PathBuf::from(expected), "{name}");
        }
    }
}
