//! Files made here by the crate that reads them, and by hand where it does not write.

use std::io::Cursor;

use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer};
use exr::math::Vec2;
use exr::meta::attribute::{IntegerBounds, LineOrder};
use exr::meta::header::{ImageAttributes, LayerAttributes};

use super::*;

const WIDTH: usize = 12;
const HEIGHT: usize = 10;

/// The value of a texel in a channel; a half holds it exactly.
fn value(index: usize, channel: usize) -> f32 {
    (index % WIDTH) as f32 + 16.0 * (index / WIDTH) as f32 + 256.0 * channel as f32
}

type Part = Layer<AnyChannels<FlatSamples>>;

/// A part whose channels are numbered in the order of `names`, at a place in the display window.
fn part(name: &str, names: &[&str], half: bool, compression: Compression, blocks: Blocks, position: (i32, i32)) -> Part {
    let samples = |channel: usize| {
        let values = (0..WIDTH * HEIGHT).map(|index| value(index, channel));
        if half { FlatSamples::F16(values.map(f16::from_f32).collect()) } else { FlatSamples::F32(values.collect()) }
    };
    let channels = names.iter().enumerate().map(|(channel, name)| AnyChannel::new(*name, samples(channel))).collect();
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let attributes = LayerAttributes::named(name).with_position(Vec2(position.0, position.1));
    Layer::new((WIDTH, HEIGHT), attributes, encoding, AnyChannels::sort(channels))
}

fn file(parts: Vec<Part>, display: IntegerBounds) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layers(ImageAttributes::new(display), parts).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn plain(names: &[&str], half: bool, compression: Compression) -> Vec<u8> {
    file(vec![part("a", names, half, compression, Blocks::ScanLines, (0, 0))], bounds((0, 0), (WIDTH, HEIGHT)))
}

fn bounds(position: (i32, i32), size: (usize, usize)) -> IntegerBounds {
    IntegerBounds::new(position, size)
}

fn text(result: Result<Panorama, Fault>) -> String {
    result.map(|panorama| panorama.texels.len()).unwrap_err().in_named("a.exr").to_string()
}

fn named(names: &[&str], layer: &str) -> Option<Vec<Role>> {
    roles(&names.iter().map(|&name| String::from(name)).collect::<Vec<_>>(), layer)
}

// Kills: colours by position instead of name (files sort them B, G, R), and grey from a chroma file.
#[test]
fn channels_are_found_by_name() {
    let (r, g, b, none) = (Role::Color(0, 0), Role::Color(1, 1), Role::Color(2, 2), Role::Unused);
    assert!(named(&["A", "B", "G", "R"], "") == Some(vec![none, b, g, r]));
    assert!(named(&["L.B", "L.G", "L.R"], "L.") == Some(vec![b, g, r]));
    assert!(named(&["Y"], "") == Some(vec![Role::Color(0, 2)]));
    assert!(named(&["BY", "RY", "Y"], "").is_none());
    assert!(named(&["R", "G"], "").is_none());
}

// Kills: a bound on sizes that refuses honest files, halves read as floats, tiles at the wrong place, luminance in one channel only.
#[test]
fn every_compression_and_layout_says_the_same() {
    let lossless = [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::ZIP16, Compression::PIZ];
    let expected: Vec<[f32; 3]> = (0..WIDTH * HEIGHT).map(|index| [0, 1, 2].map(|channel| value(index, channel))).collect();
    for compression in lossless.into_iter().chain([Compression::PXR24]) {
        for half in [false, true] {
            let found = read(&plain(&["R", "G", "B"], half, compression)).unwrap();
            assert_eq!(
                (found.width, found.height, found.texels),
                (WIDTH as u32, HEIGHT as u32, expected.clone()),
                "{compression:?} {half}"
            );
            assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        }
    }
    for compression in [Compression::B44, Compression::B44A] {
        let found = read(&plain(&["R", "G", "B"], true, compression)).unwrap().texels;
        let worst =
            found.iter().zip(&expected).flat_map(|(a, b)| (0..3).map(move |c| (a[c] - b[c]).abs() / (b[c] + 16.0))).fold(0.0, f32::max);
        assert!(worst < 0.4, "{compression:?}: {worst}");
    }
    let tiled = part("a", &["R", "G", "B"], true, Compression::ZIP16, Blocks::Tiles(Vec2(5, 3)), (0, 0));
    assert_eq!(read(&file(vec![tiled], bounds((0, 0), (WIDTH, HEIGHT)))).unwrap().texels, expected);
    let grey = read(&plain(&["Y"], true, Compression::ZIP16)).unwrap().texels;
    assert!(grey.iter().enumerate().all(|(index, texel)| *texel == [value(index, 0); 3]));
}

// Kills: a bound on sizes that refuses the flattest honest pictures, or one that believes every header.
#[test]
fn sizes_are_compared_with_what_bytes_can_hold() {
    for compression in [Compression::RLE, Compression::ZIP16, Compression::PIZ, Compression::PXR24, Compression::B44A] {
        let flat = |_: usize| FlatSamples::F16(vec![f16::ONE; 1024 * 512]);
        let channels = ["R", "G", "B"].iter().enumerate().map(|(at, name)| AnyChannel::new(*name, flat(at))).collect();
        let encoding = Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
        let layer = Layer::new((1024, 512), LayerAttributes::named("a"), encoding, AnyChannels::sort(channels));
        let bytes = file(vec![layer], bounds((0, 0), (1024, 512)));
        assert!(read(&bytes).unwrap().texels.iter().all(|texel| *texel == [1.0; 3]), "{compression:?}");
    }
    let promised = |side: i32| text(read(&header(0, 0, side, &[])));
    assert!(promised(4096).contains("bytes cannot hold 4096 x 4096 texels"), "{}", promised(4096));
    assert!(promised(1 << 24).contains("16777216 x 16777216 texels are too many (at most 134217728)"), "{}", promised(1 << 24));
}

// Kills: room for a tile of any size that a header names, and a bound that refuses tiles larger than their picture.
#[test]
fn tiles_are_compared_with_the_file() {
    let tiled = |side: usize| {
        let made = part("a", &["R", "G", "B"], true, Compression::ZIP16, Blocks::Tiles(Vec2(side, side)), (0, 0));
        read(&file(vec![made], bounds((0, 0), (WIDTH, HEIGHT))))
    };
    assert_eq!(tiled(1024).unwrap().texels[1], [1.0, 257.0, 513.0]);
    let words = text(tiled(30_000));
    assert!(words.contains("blocks of 30000 x 30000 texels are too large for"), "{words}");
}

// Kills: the last part with colours, layers that win over plain names, and parts or layers that are chosen without a word.
#[test]
fn parts_and_layers_are_chosen_and_named() {
    let at = |name: &str, names: &[&str]| part(name, names, true, Compression::ZIP1, Blocks::ScanLines, (0, 0));
    let whole = bounds((0, 0), (WIDTH, HEIGHT));
    let parts = vec![at("depth", &["Z"]), at("beauty", &["Q", "R", "G", "B"]), at("later", &["R", "G", "B"])];
    let found = read(&file(parts, whole)).unwrap();
    assert_eq!(found.texels[0], [256.0, 512.0, 768.0]);
    assert_eq!(found.warnings, ["part 1 'beauty' of 3 is shown"]);
    let layered = read(&file(vec![at("a", &["Z", "beauty.R", "beauty.G", "beauty.B", "other.R"])], whole)).unwrap();
    assert_eq!(
        (layered.texels[0], layered.warnings),
        ([256.0, 512.0, 768.0], vec![String::from("the channels of the layer 'beauty' are shown")])
    );
    let both = read(&file(vec![at("a", &["a.R", "a.G", "a.B", "R", "G", "B"])], whole)).unwrap();
    assert_eq!((both.texels[0], both.warnings.len()), ([768.0, 1024.0, 1280.0], 0));
    let words = text(read(&file(vec![at("a", &["Z", "N.X"])], whole)));
    assert!(words.contains("N.X, Z (R, G, B or Y are read)"), "{words}");
}

// Kills: data windows that are stretched over the sphere or shifted to its corner, offsets with the wrong sign, and rows that are cut
// on the wrong side.
#[test]
fn data_windows_lie_where_they_say() {
    let windows = [((3, 1), (0, 0), (20, 14)), ((-2, -3), (0, 0), (9, 5)), ((105, 100), (100, 100), (11, 12)), ((0, 0), (4, 4), (12, 10))];
    for (data, display, size) in windows {
        let made = part("a", &["R", "G", "B"], true, Compression::ZIP16, Blocks::ScanLines, data);
        let found = read(&file(vec![made], bounds(display, size))).unwrap();
        assert_eq!((found.width as usize, found.height as usize), size);
        for (index, texel) in found.texels.iter().enumerate() {
            let x = (index % size.0) as i32 + display.0 - data.0;
            let y = (index / size.0) as i32 + display.1 - data.1;
            let inside = (0..WIDTH as i32).contains(&x) && (0..HEIGHT as i32).contains(&y);
            let expected = if inside { [0, 1, 2].map(|c| value(y as usize * WIDTH + x as usize, c)) } else { [0.0; 3] };
            assert_eq!(*texel, expected, "{data:?} in {display:?}: {x} {y}");
        }
        assert!(
            found.warnings[0].contains("12 x 10 texels of the display window") && found.warnings[0].contains("black"),
            "{:?}",
            found.warnings
        );
    }
    // Far outside, or in a window that nobody would draw: the data are the picture.
    for (data, size) in [((500, 0), (20, 10)), ((0, 0), (2000, 1000))] {
        let made = part("a", &["R", "G", "B"], true, Compression::ZIP16, Blocks::ScanLines, data);
        let found = read(&file(vec![made], bounds((0, 0), size))).unwrap();
        assert_eq!((found.width as usize, found.texels[1]), (WIDTH, [1.0, 257.0, 513.0]));
        assert!(found.warnings[0].contains("shown as the whole"), "{:?}", found.warnings);
    }
}

fn attribute(name: &str, kind: &str, bytes: &[u8]) -> Vec<u8> {
    [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

/// A header by hand, for three half channels over a square.
fn header(flags: u8, compression: u8, side: i32, more: &[Vec<u8>]) -> Vec<u8> {
    let window: Vec<u8> = [0, 0, side - 1, side - 1].iter().flat_map(|n| n.to_le_bytes()).collect();
    let channels: Vec<u8> =
        ["B", "G", "R"].iter().flat_map(|name| [name.as_bytes(), b"\0\x01\0\0\0\0\0\0\0\x01\0\0\0\x01\0\0\0"].concat()).collect();
    let mut bytes = vec![0x76, 0x2F, 0x31, 0x01, 2, flags, 0, 0];
    bytes.extend(attribute("channels", "chlist", &[channels, vec![0]].concat()));
    bytes.extend(attribute("compression", "compression", &[compression]));
    bytes.extend(attribute("dataWindow", "box2i", &window));
    bytes.extend(attribute("displayWindow", "box2i", &window));
    bytes.extend(attribute("lineOrder", "lineOrder", &[0]));
    bytes.extend(attribute("pixelAspectRatio", "float", &1f32.to_le_bytes()));
    bytes.extend(attribute("screenWindowCenter", "v2f", &[0; 8]));
    bytes.extend(attribute("screenWindowWidth", "float", &1f32.to_le_bytes()));
    more.iter().for_each(|attribute| bytes.extend(attribute));
    bytes.push(0);
    bytes.extend([0; 64]);
    bytes
}

// Kills: an error that says only that something is wrong, and words that stand there twice.
#[test]
fn what_is_not_read_is_refused_by_name() {
    let deep = [
        attribute("type", "string", b"deepscanline"),
        attribute("version", "int", &1i32.to_le_bytes()),
        attribute("chunkCount", "int", &4i32.to_le_bytes()),
        attribute("maxSamplesPerPixel", "int", &1i32.to_le_bytes()),
        attribute("name", "string", b"a"),
    ];
    assert_eq!(text(read(&header(8, 0, 4, &deep))), "a.exr: content: deep data is not supported");
    for (code, name) in [(10, "HTJ2K256"), (11, "HTJ2K32")] {
        let words = text(read(&header(0, code, 4, &[])));
        assert!(words.contains(name) && words.ends_with("is not supported"), "{words}");
    }
    let words = text(read(&header(0, 99, 4, &[])));
    assert!(words.contains("unknown compression method"), "{words}");
    let luma = text(read(&plain(&["Y", "RY", "BY"], true, Compression::ZIP1)));
    assert!(luma.contains("BY, RY, Y"), "{luma}");
}
