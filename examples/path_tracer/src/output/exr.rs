//! EXR: the pixels as they were rendered, with everything that is known of them.
//!
//! Key decision: one part with all channels in ZIP blocks of 16 lines, which every program reads, and names joined by dots, from which
//! programs make layers. Floats equal the picture's bit for bit. Halves are for what is looked at; numbers that are counted or computed
//! with (depth, position, variance, numbers of things) keep their 32 bits even then.

use std::io;
use std::path::Path;

use ::exr::image::{AnyChannel, AnyChannels, FlatSamples};
use ::exr::meta::attribute::{AttributeValue, Chromaticities, Text};
use ::exr::prelude::{Encoding, Image, IntegerBounds, Layer, LayerAttributes, Vec2, WritableImage};
use half::f16;

use super::{Options, Picture, atomic, picture};
use crate::error::Error;
use crate::layers::Values;

/// Layers whose values are looked at more than computed with.
const LOOKED_AT: [&str; 2] = ["albedo", "normal"];

/// Primaries and white of Rec. 709.
///
/// **Source:** ITU-R BT.709-6, item 1.3.
const REC_709: Chromaticities =
    Chromaticities { red: Vec2(0.64, 0.33), green: Vec2(0.30, 0.60), blue: Vec2(0.15, 0.06), white: Vec2(0.3127, 0.3290) };

/// Writes a checked picture.
///
/// # Errors
/// When the operating system refuses.
pub(super) fn write(path: &Path, picture: &Picture, options: &Options) -> Result<Vec<String>, Error> {
    let mut clamped = 0u64;
    let mut floats = |values: Vec<f32>, is_half: bool| match is_half {
        true => FlatSamples::F16(values.into_iter().map(|value| to_half(value, &mut clamped)).collect()),
        false => FlatSamples::F32(values),
    };
    let mut channels = Vec::new();
    for (index, name) in ["R", "G", "B"].into_iter().enumerate() {
        channels.push(AnyChannel::new(name, floats(picture.color.iter().map(|color| color[index]).collect(), options.half)));
    }
    if let Some(alpha) = &picture.alpha {
        channels.push(AnyChannel::new("A", floats(alpha.clone(), options.half)));
    }
    for (name, layer, channel) in picture.channels() {
        let samples = match &channel.values {
            Values::F32(values) => floats(values.clone(), options.half && LOOKED_AT.contains(&layer.name.as_str())),
            Values::U32(values) => FlatSamples::U32(values.clone()),
        };
        channels.push(AnyChannel::new(text(&name), samples));
    }
    let (width, height) = (picture.width as usize, picture.height as usize);
    let layer =
        Layer::new((width, height), attributes(picture), Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels.into_iter().collect()));
    let mut image = Image::from_layer(layer);
    image.attributes.chromaticities = Some(REC_709);
    if let Some(part) = picture.part {
        image.attributes.display_window = IntegerBounds::from_dimensions((part.whole_width as usize, part.whole_height as usize));
    }
    atomic::write(path, |writer| image.write().to_buffered(writer).map_err(io::Error::other)).map_err(|e| Error::write(path, e))?;
    Ok((clamped > 0).then(|| format!("{clamped} values are beyond the range of halves and became {}", f16::MAX)).into_iter().collect())
}

/// The nearest half; finite values stay finite.
fn to_half(value: f32, clamped: &mut u64) -> f16 {
    let half = f16::from_f32(value);
    if half.is_infinite() && value.is_finite() {
        *clamped += 1;
        return if value > 0.0 { f16::MAX } else { f16::MIN };
    }
    half
}

fn attributes(picture: &Picture) -> LayerAttributes {
    let camera = picture.facts.camera.as_ref();
    // A part keeps its place within the whole, to which pictures of the world relate too.
    let (width, height) = picture.part.map_or((picture.width, picture.height), |part| (part.whole_width, part.whole_height));
    let aspect = width as f32 / height as f32;
    let corner = picture.part.map_or((0, 0), |part| (part.x, part.y));
    let mut attributes = LayerAttributes {
        layer_position: Vec2(i32::try_from(corner.0).unwrap_or(0), i32::try_from(corner.1).unwrap_or(0)),
        software_name: Some(text(picture::SOFTWARE)),
        // Vectors are rows there, so that their matrix by rows is ours by columns.
        world_to_camera: camera.map(|camera| picture::world_to_camera(camera).to_cols_array()),
        world_to_normalized_device: camera.map(|camera| picture::world_to_picture(camera, aspect).to_cols_array()),
        ..LayerAttributes::default()
    };
    for (name, value) in &picture.facts.texts {
        attributes.other.insert(text(name), AttributeValue::Text(text(value)));
    }
    attributes
}

/// A text of the file, which holds UTF-8; a line.
fn text(content: &str) -> Text {
    Text::from_slice_unchecked(picture::line(content).as_bytes())
}

#[cfg(test)]
mod tests {
    use ::exr::prelude::read_all_flat_layers_from_file;
    use glam::{Mat4, vec3};

    use super::*;
    use crate::layers::{Channel, Layer};
    use crate::output::write_picture;
    use crate::scene::{Camera, Projection, load_environment};

    fn written(picture: &Picture, options: &Options) -> (::exr::image::FlatImage, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let notes = write_picture(&path, picture, options).unwrap();
        (read_all_flat_layers_from_file(&path).unwrap(), notes)
    }

    fn channel(image: &::exr::image::FlatImage, name: &str) -> FlatSamples {
        let found = image.layer_data[0].channel_data.list.iter().find(|channel| channel.name.to_string() == name);
        found.unwrap_or_else(|| panic!("{name} is not there")).sample_data.clone()
    }

    fn layer(name: &str, channels: &[(&str, Values)]) -> Layer {
        let channels = channels.iter().map(|(name, values)| Channel { name: (*name).into(), values: values.clone() });
        Layer { name: name.into(), channels: channels.collect() }
    }

    fn everything() -> Picture {
        let plane = |start: f32| Values::F32(vec![start, start + 0.25, start + 0.1]);
        Picture {
            alpha: Some(vec![1.0, 0.5, 0.0]),
            layers: vec![
                layer("albedo", &[("R", plane(0.1)), ("G", plane(0.2)), ("B", plane(0.3))]),
                layer("Z", &[("", plane(1e5))]),
                layer("position", &[("X", plane(-7.0)), ("Y", plane(8.0)), ("Z", plane(9.0))]),
                layer("object", &[("", Values::U32(vec![0, 7, u32::MAX]))]),
                layer("variance", &[("R", plane(1e-9))]),
            ],
            ..Picture::of_color(3, 1, vec![[1.0, 2.0, 3.0], [1e-30, 1e30, 0.1], [70_000.0, f32::INFINITY, -0.0]])
        }
    }

    // Kills: half floats, rows upside down, and swapped channels; odd sizes leave a short last block. Tiles in an order of chance, which
    // are other bytes every time.
    #[test]
    fn a_picture_comes_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let pixels: Vec<[f32; 3]> = (0..7 * 19).map(|i| [i as f32 / 3.0, 1.0e-30 * i as f32, 1.0e10]).collect();
        write_picture(&path, &Picture::of_color(7, 19, pixels.clone()), &Options::default()).unwrap();
        let (read, warnings) = load_environment(&path).unwrap();
        assert_eq!((read.width, read.height, read.texels), (7, 19, pixels));
        assert!(warnings.is_empty());
        let encoding = read_all_flat_layers_from_file(&path).unwrap().layer_data[0].encoding;
        assert_eq!(encoding, Encoding::SMALL_LOSSLESS);
    }

    // Kills: a layer left out or under another name, numbers of things as floats.
    #[test]
    fn every_layer_is_there_under_its_name() {
        let (image, notes) = written(&everything(), &Options::default());
        let names: Vec<String> = image.layer_data[0].channel_data.list.iter().map(|channel| channel.name.to_string()).collect();
        let expected =
            "A B G R Z albedo.B albedo.G albedo.R object position.X position.Y position.Z variance.R".split(' ').collect::<Vec<_>>();
        assert_eq!(names, expected);
        assert_eq!(channel(&image, "object"), FlatSamples::U32(vec![0, 7, u32::MAX]));
        assert_eq!(channel(&image, "position.Y"), FlatSamples::F32(vec![8.0, 8.25, 8.1]));
        assert_eq!(channel(&image, "A"), FlatSamples::F32(vec![1.0, 0.5, 0.0]));
        assert!(notes.is_empty());
    }

    // Kills: depth, positions or variances in halves; a finite value that becomes infinite without a word.
    #[test]
    fn halves_are_for_what_is_looked_at() {
        let (image, notes) = written(&everything(), &Options { half: true, ..Options::default() });
        let halves = |values: [f32; 3]| FlatSamples::F16(values.map(f16::from_f32).to_vec());
        assert_eq!(channel(&image, "R"), halves([1.0, 0.0, 65_504.0]));
        assert_eq!(channel(&image, "G"), halves([2.0, 65_504.0, f32::INFINITY]));
        assert_eq!(channel(&image, "albedo.G"), halves([0.2, 0.45, 0.3]));
        for name in ["Z", "position.X", "variance.R"] {
            assert!(matches!(channel(&image, name), FlatSamples::F32(_)), "{name}");
        }
        assert_eq!(channel(&image, "object"), FlatSamples::U32(vec![0, 7, u32::MAX]));
        assert_eq!(notes, ["2 values are beyond the range of halves and became 65504"]);
    }

    // Kills: a part that is moved to the corner, or shown as a whole picture.
    #[test]
    fn a_part_keeps_its_place() {
        let picture = Picture::of_color(5, 4, (0..20).map(|i| [i as f32; 3]).collect()).cropped(2, 1, 3, 2);
        let (image, _) = written(&picture, &Options::default());
        assert_eq!(image.attributes.display_window, IntegerBounds::from_dimensions((5, 4)));
        assert_eq!((image.layer_data[0].attributes.layer_position, image.layer_data[0].size), (Vec2(2, 1), Vec2(3, 2)));
        assert_eq!(channel(&image, "G"), FlatSamples::F32(vec![7.0, 8.0, 9.0, 12.0, 13.0, 14.0]));
    }

    // Kills: matrices for vectors in columns, attributes under names that no program knows, an owner, texts that are cut.
    #[test]
    fn attributes_say_where_from_and_how() {
        let world_from_camera = Mat4::from_translation(vec3(1.0, 2.0, 3.0));
        let projection = Projection::Perspective { vertical_fov: std::f32::consts::FRAC_PI_2 };
        let mut picture = everything();
        picture.facts.camera = Some(Camera { name: "c".into(), world_from_camera, projection });
        let command = format!("render a.glb --out \u{e4}.exr {}", "x".repeat(4000));
        picture.facts.texts = vec![("command".into(), command.clone()), ("seed".into(), "7\n".into())];
        let (image, _) = written(&picture, &Options::default());
        assert_eq!(image.attributes.chromaticities, Some(REC_709));
        let attributes = &image.layer_data[0].attributes;
        assert_eq!(attributes.owner, None);
        let matrix = attributes.world_to_camera.unwrap();
        assert_eq!(&matrix[12..], &[-1.0, -2.0, 3.0, 1.0]);
        assert_eq!(attributes.world_to_normalized_device.map(|matrix| matrix[11]), Some(-1.0));
        let said = |name: &str| match &attributes.other[&text(name)] {
            AttributeValue::Text(value) => String::from_utf8(value.as_slice().to_vec()).unwrap(),
            other => panic!("{other:?}"),
        };
        assert_eq!((said("command"), said("seed")), (command, String::from("7 ")));
    }
}
