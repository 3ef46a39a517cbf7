//! Values of options, from text.
//!
//! Key decision: a reader says what is allowed, and nothing of the option or the value, which the command line puts before it. So the same
//! reader serves many options and every message has the same form.

use std::{fmt, time::Duration};

use path_tracer::scene;

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// The largest side; 2^32 pixels are beyond every film.
const LARGEST_SIDE: u32 = 32_768;

pub(crate) fn size(text: &str) -> Result<Size, String> {
    let side = |part: &str| part.parse::<u32>().ok().filter(|side| (1..=LARGEST_SIDE).contains(side));
    text.split_once('x')
        .and_then(|(width, height)| Some(Size { width: side(width)?, height: side(height)? }))
        .ok_or_else(|| format!("expected WIDTHxHEIGHT, each 1 to {LARGEST_SIDE}"))
}

/// A whole number, zero too.
pub(crate) fn whole(text: &str) -> Result<u32, String> {
    text.parse().map_err(|_| format!("expected a whole number from 0 to {}", u32::MAX))
}

/// A whole number above zero.
pub(crate) fn positive(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|number| *number > 0).ok_or_else(|| format!("expected a whole number from 1 to {}", u32::MAX))
}

pub(crate) fn finite(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|number: &f32| number.is_finite()).ok_or_else(|| String::from("not a finite number"))
}

/// So many in a second.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    let allowed = |rate: &f64| *rate >= 1e-3 && *rate <= 1e6;
    text.parse().ok().filter(allowed).ok_or_else(|| String::from("expected a number from 0.001 to 1000000"))
}

/// A number that scales radiance or bounds an error.
pub(crate) fn not_negative(text: &str) -> Result<f32, String> {
    finite(text).ok().filter(|number| *number >= 0.0).ok_or_else(|| String::from("expected a finite number, 0 or more"))
}

/// Degrees of a field of view.
pub(crate) fn field_of_view(text: &str) -> Result<f32, String> {
    let allowed = |degrees: &f32| *degrees >= 0.01 && *degrees <= 179.0;
    finite(text).ok().filter(allowed).ok_or_else(|| String::from("expected degrees from 0.01 to 179"))
}

/// Three numbers with commas between them.
pub(crate) fn vector(text: &str) -> Result<glam::Vec3, String> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|part| finite(part.trim()).ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(glam::Vec3::new(x, y, z)),
        _ => Err(String::from("expected X,Y,Z, three finite numbers")),
    }
}

/// Seconds, minutes or hours: `10s`, `0.5s`, `2m`, `1h`.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    const LONGEST: f32 = 1e6;
    let units = [("s", 1.0), ("m", 60.0), ("h", 3600.0)];
    let read = |(unit, seconds): (&str, f32)| Some(text.strip_suffix(unit)?.parse::<f32>().ok()? * seconds);
    let seconds = units.into_iter().find_map(read).filter(|seconds| *seconds > 0.0 && *seconds <= LONGEST);
    seconds.map(Duration::from_secs_f32).ok_or_else(|| String::from("expected a time above 0, as 10s, 0.5s, 2m or 1h"))
}

/// A place among the pixels of a picture and a size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Region {
    pub(crate) x: u32,
    pub(crate) y: u32,
    pub(crate) size: Size,
}

/// `X,Y,WxH`.
pub(crate) fn region(text: &str) -> Result<Region, String> {
    let read = || {
        let mut parts = text.splitn(3, ',');
        let mut offset = || parts.next()?.parse::<u32>().ok();
        let (x, y) = (offset()?, offset()?);
        Some(Region { x, y, size: size(parts.next()?).ok()? })
    };
    read().ok_or_else(|| format!("expected X,Y,WIDTHxHEIGHT in pixels from the upper left corner, sides 1 to {LARGEST_SIDE}"))
}

/// The name of a built-in scene or a file.
pub(crate) fn known_scenes() -> String {
    scene::BUILTIN.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: numbers that are accepted by half, sides of zero, times without a unit.
    #[test]
    fn values_are_read_whole_or_not_at_all() {
        assert_eq!(size("640x480"), Ok(Size { width: 640, height: 480 }));
        for text in ["", "x", "64", "0x1", "1x0", "1x32769", "1x1x1", "-1x1", "1.5x2"] {
            assert!(size(text).is_err(), "{text}");
        }
        assert_eq!(vector("1, -2.5,3e1"), Ok(glam::Vec3::new(1.0, -2.5, 30.0)));
        for text in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,inf", "1,,3"] {
            assert!(vector(text).is_err(), "{text}");
        }
        assert_eq!(duration("0.5s"), Ok(Duration::from_millis(500)));
        assert_eq!(duration("2m"), Ok(Duration::from_secs(120)));
        for text in ["", "10", "s", "0s", "-1s", "nans", "infs", "1e30h"] {
            assert!(duration(text).is_err(), "{text}");
        }
        assert_eq!(region("3,4,5x6"), Ok(Region { x: 3, y: 4, size: Size { width: 5, height: 6 } }));
        for text in ["", "3,4", "3,4,5", "3,4,0x6", "-3,4,5x6", "3,4,5x6,7"] {
            assert!(region(text).is_err(), "{text}");
        }
        assert_eq!(rate("29.97"), Ok(29.97));
        assert!(rate("0").is_err() && rate("-24").is_err() && rate("NaN").is_err() && rate("inf").is_err());
        assert!(positive("0").is_err() && whole("0").is_ok() && whole("-1").is_err() && whole("4294967296").is_err());
        assert!(field_of_view("0").is_err() && field_of_view("180").is_err() && field_of_view("NaN").is_err());
        assert!(not_negative("-0.1").is_err() && finite("-0.1").is_ok() && finite("nan").is_err());
    }
}
