//! A picture in memory: colour, what stands beside it, and what is known of how it came to be.
//!
//! Key decision: a format that cannot hold a part of a picture leaves it out and says so; which part that is, is decided here and not by
//! every writer for itself.
//!
//! **Invariant:** a picture that passed [`Picture::check`] has one value per pixel in every plane, and no two channels of one name.

use std::collections::BTreeSet;

use glam::{Mat4, Vec4};

use super::tone_map::ToneMap;
use crate::{
    layers::{Channel, Layer, Values},
    scene::{Camera, Projection},
};

/// Who wrote it, as files say it.
pub(super) const SOFTWARE: &str = concat!("wavepool path-tracer ", env!("CARGO_PKG_VERSION"));

/// A text as files hold it: one line.
pub(super) fn line(content: &str) -> String {
    content.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// What is to be written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Mean radiance, linear Rec. 709, row 0 at the top; with [`alpha`](Self::alpha), already multiplied by it.
    pub color: Vec<[f32; 3]>,
    /// The share of a pixel that something covers, 0 to 1.
    pub alpha: Option<Vec<f32>>,
    /// Further planes.
    pub layers: Vec<Layer>,
    /// How it came to be.
    pub facts: Facts,
    /// Where it lies in the whole picture, when it is a part of one.
    pub part: Option<Part>,
}

/// A place in a larger picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Left column.
    pub x: u32,
    /// Upper row.
    pub y: u32,
    /// Columns of the whole.
    pub whole_width: u32,
    /// Rows of the whole.
    pub whole_height: u32,
}

/// What is known of a picture besides its pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// Whence it was seen.
    pub camera: Option<Camera>,
    /// Names and texts: `command`, `seed`, `film-hash`. Written in this order where order exists.
    pub texts: Vec<(String, String)>,
}

/// How a picture is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Of a PNG.
    pub bits: Bits,
    /// Of a PNG, in stops.
    pub exposure: f32,
    /// Of a PNG.
    pub tone_map: ToneMap,
    /// 16-bit floats in an EXR, where a channel bears it.
    pub half: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options { bits: Bits::Eight, exposure: 0.0, tone_map: ToneMap::None, half: false }
    }
}

/// Bits of a channel of a PNG.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bits {
    /// 0 to 255.
    Eight,
    /// 0 to 65,535.
    Sixteen,
}

impl Picture {
    /// Colour alone.
    pub fn of_color(width: u32, height: u32, color: Vec<[f32; 3]>) -> Picture {
        Picture { width, height, color, ..Picture::default() }
    }

    /// The part of it that begins at column `x` and row `y`; what lies outside of the picture is cut off.
    pub fn cropped(self, x: u32, y: u32, width: u32, height: u32) -> Picture {
        let (x, y) = (x.min(self.width), y.min(self.height));
        let (width, height) = (width.min(self.width - x), height.min(self.height - y));
        let cut = Cut { x: x as usize, y: y as usize, width: width as usize, height: height as usize, stride: self.width as usize };
        let layer = |layer: Layer| Layer {
            channels: layer.channels.into_iter().map(|channel| Channel { values: cut.values(&channel.values), ..channel }).collect(),
            ..layer
        };
        Picture {
            width,
            height,
            color: cut.plane(&self.color),
            alpha: self.alpha.map(|alpha| cut.plane(&alpha)),
            layers: self.layers.into_iter().map(layer).collect(),
            facts: self.facts,
            part: Some(Part { x, y, whole_width: self.width, whole_height: self.height }),
        }
    }

    /// All channels beside colour and alpha, with their names in a file.
    pub(super) fn channels(&self) -> impl Iterator<Item = (String, &Layer, &Channel)> {
        self.layers.iter().flat_map(|layer| layer.channels.iter().map(move |channel| (layer.full_name(channel), layer, channel)))
    }

    /// The module's invariant; the text says what is wrong.
    pub(super) fn check(&self) -> Result<(), String> {
        let pixels = u64::from(self.width) * u64::from(self.height);
        let fills = |what: &str, n: usize| {
            let is_full = n > 0 && n as u64 == pixels;
            if is_full { Ok(()) } else { Err(format!("{n} {what} do not fill {} x {}", self.width, self.height)) }
        };
        fills("pixels", self.color.len())?;
        if let Some(alpha) = &self.alpha {
            fills("values of A", alpha.len())?;
        }
        let mut names: BTreeSet<String> = ["R", "G", "B", "A"].map(String::from).into();
        for (name, _, channel) in self.channels() {
            let n = match &channel.values {
                Values::F32(values) => values.len(),
                Values::U32(values) => values.len(),
            };
            fills(&format!("values of {name}"), n)?;
            if name.is_empty() || !name.is_ascii() || name.len() > 255 {
                return Err(format!("channel name '{name}': allowed are 1 to 255 characters of ASCII"));
            }
            if names.contains(&name) {
                return Err(format!("two channels are called {name}"));
            }
            names.insert(name);
        }
        Ok(())
    }

    /// A note for a format that holds colour and, where `with_alpha`, alpha.
    pub(super) fn left_out(&self, with_alpha: bool, format: &str) -> Option<String> {
        let alpha = (self.alpha.is_some() && !with_alpha).then(|| String::from("A"));
        let names: Vec<String> = alpha.into_iter().chain(self.layers.iter().map(|layer| layer.name.clone())).collect();
        (!names.is_empty()).then(|| format!("{format} has no place for {}; an .exr has", names.join(", ")))
    }
}

/// Takes a part out of planes.
struct Cut {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
    stride: usize,
}

impl Cut {
    /// Rows that a plane does not have, or not whole, are left out.
    fn plane<T: Copy>(&self, plane: &[T]) -> Vec<T> {
        let rows = (self.y..self.y + self.height).map(|y| y * self.stride + self.x);
        rows.flat_map(|start| plane.get(start..start + self.width).unwrap_or_default()).copied().collect()
    }

    fn values(&self, values: &Values) -> Values {
        match values {
            Values::F32(values) => Values::F32(self.plane(values)),
            Values::U32(values) => Values::U32(self.plane(values)),
        }
    }
}

/// From the world to the camera's space as OpenEXR has it: left-handed, +X right, +Y up, +Z into the picture.
///
/// **Source:** OpenEXR, standard attributes, `worldToCamera`.
pub(super) fn world_to_camera(camera: &Camera) -> Mat4 {
    Mat4::from_scale(glam::vec3(1.0, 1.0, -1.0)) * camera.world_from_camera.inverse()
}

/// From the world to the picture: (0, 0) at its upper left, (1, 1) at its lower right corner, after division by w. The third coordinate,
/// which readers discard, is 1 - 1/depth, respectively the depth of parallel rays.
///
/// **Source:** OpenEXR, standard attributes, `worldToNDC`.
pub(super) fn world_to_picture(camera: &Camera, aspect: f32) -> Mat4 {
    let (half_height, is_parallel) = match camera.projection {
        Projection::Perspective { vertical_fov } => ((vertical_fov * 0.5).tan(), false),
        Projection::Orthographic { half_height } => (half_height, true),
    };
    let (x, y) = (0.5 / (half_height * aspect), -0.5 / half_height);
    let from_camera = if is_parallel {
        Mat4::from_cols(Vec4::X * x, Vec4::Y * y, Vec4::Z, Vec4::new(0.5, 0.5, 0.0, 1.0))
    } else {
        Mat4::from_cols(Vec4::X * x, Vec4::Y * y, Vec4::new(0.5, 0.5, 1.0, 1.0), -Vec4::Z)
    };
    from_camera * world_to_camera(camera)
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;

    fn layer(name: &str, values: Values) -> Layer {
        Layer { name: name.into(), channels: vec![Channel { name: String::new(), values }] }
    }

    // Kills: a plane that is too short reaching an encoder, a channel that replaces the colour or another channel.
    #[test]
    fn pictures_that_do_not_fit_are_refused() {
        let picture = Picture::of_color(2, 1, vec![[0.0; 3]; 2]);
        assert_eq!(picture.check(), Ok(()));
        let with = |layers: Vec<Layer>| Picture { layers, ..picture.clone() }.check().unwrap_err();
        assert!(with(vec![layer("Z", Values::F32(vec![1.0]))]).contains("1 values of Z"));
        assert!(with(vec![layer("R", Values::F32(vec![1.0; 2]))]).contains("two channels are called R"));
        let twice = layer("samples", Values::U32(vec![1; 2]));
        assert!(with(vec![twice.clone(), twice]).contains("called samples"));
        assert!(Picture { alpha: Some(vec![1.0]), ..picture.clone() }.check().is_err());
        assert!(Picture::of_color(0, 0, Vec::new()).check().is_err());
        assert!(Picture::of_color(u32::MAX, u32::MAX, Vec::new()).check().is_err());
    }

    // Kills: rows by the part's own width, a layer or the alpha left whole, a part that forgets where it was.
    #[test]
    fn a_part_is_cut_out_of_every_plane() {
        let numbers: Vec<u32> = (0..12).collect();
        let picture = Picture {
            alpha: Some(numbers.iter().map(|i| *i as f32).collect()),
            layers: vec![layer("object", Values::U32(numbers.clone()))],
            ..Picture::of_color(4, 3, numbers.iter().map(|i| [*i as f32; 3]).collect())
        };
        let part = picture.clone().cropped(1, 1, 2, 9);
        assert_eq!((part.width, part.height, part.check()), (2, 2, Ok(())));
        assert_eq!(part.color.iter().map(|color| color[0]).collect::<Vec<_>>(), [5.0, 6.0, 9.0, 10.0]);
        assert_eq!(part.alpha, Some(vec![5.0, 6.0, 9.0, 10.0]));
        assert_eq!(part.layers, [layer("object", Values::U32(vec![5, 6, 9, 10]))]);
        assert_eq!(part.part, Some(Part { x: 1, y: 1, whole_width: 4, whole_height: 3 }));
        assert!(picture.cropped(4, 0, 1, 1).check().is_err());
    }

    // Kills: a camera space that looks along -Z, rows counted from below, an aspect on the wrong axis, a field of view across the width.
    #[test]
    fn corners_of_the_picture_are_where_openexr_has_them() {
        let turned = Mat4::from_translation(vec3(1.0, 2.0, 3.0)) * Mat4::from_rotation_y(0.7) * Mat4::from_rotation_x(-0.3);
        let camera = |projection| Camera { name: String::new(), world_from_camera: turned, projection };
        let perspective = camera(Projection::Perspective { vertical_fov: std::f32::consts::FRAC_PI_2 });
        let seen = |point: Vec3| world_to_camera(&perspective).project_point3(turned.transform_point3(point));
        assert!((seen(vec3(0.5, 0.25, -4.0)) - vec3(0.5, 0.25, 4.0)).length() < 1e-5);
        // At a depth of 2, a picture twice as wide as high spans 4 to both sides and 2 upwards.
        let place = |camera: &Camera, point: Vec3| world_to_picture(camera, 2.0).project_point3(turned.transform_point3(point)).truncate();
        for (x, y, expected) in [(-4.0, 2.0, (0.0, 0.0)), (4.0, -2.0, (1.0, 1.0)), (2.0, 0.0, (0.75, 0.5))] {
            let at = place(&perspective, vec3(x, y, -2.0));
            assert!((at - glam::Vec2::from(expected)).length() < 1e-5, "{x} {y}: {at}");
        }
        let parallel = camera(Projection::Orthographic { half_height: 3.0 });
        assert!((place(&parallel, vec3(6.0, 3.0, -7.0)) - glam::vec2(1.0, 0.0)).length() < 1e-5);
        assert!(world_to_picture(&perspective, 2.0).determinant().abs() > 1e-6);
    }
}
