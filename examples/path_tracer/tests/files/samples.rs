//! Small good files of every format, made here, with as many features as fit.

use std::io::Cursor;

pub(crate) use exr::compression::Compression;
use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer};
use exr::math::Vec2;
use exr::meta::attribute::{IntegerBounds, LineOrder};
use exr::meta::header::{ImageAttributes, LayerAttributes};

/// A good file with one part replaced; the part must be there.
pub(crate) fn with(good: Vec<u8>, from: &str, to: &str) -> Vec<u8> {
    let at = good.windows(from.len()).position(|part| part == from.as_bytes()).unwrap_or_else(|| panic!("`{from}` is not there"));
    [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat()
}

/// A picture of two texels.
pub(crate) fn png() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_raw(2, 1, vec![200, 100, 50, 255, 10, 20, 30, 128]).expect("eight bytes");
    picture.write_to(&mut bytes, image::ImageFormat::Png).expect("encoded");
    bytes.into_inner()
}

/// A grey JPEG of 16 x 8 texels.
pub(crate) fn jpeg() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image::RgbImage::from_pixel(16, 8, image::Rgb([90, 120, 150])).write_to(&mut bytes, image::ImageFormat::Jpeg).expect("encoded");
    bytes.into_inner()
}

fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |group: &[u8]| {
        let bits = group.iter().fold(0u32, |bits, &byte| bits << 8 | u32::from(byte)) << (8 * (3 - group.len()));
        (0..=group.len()).map(|digit| char::from(ALPHABET[(bits >> (18 - 6 * digit) & 63) as usize])).collect::<String>()
    };
    bytes.chunks(3).map(digits).collect()
}

/// Positions, normals and texture coordinates of a square, its indices, a sparse replacement, and a picture.
fn buffer(picture: &[u8]) -> Vec<u8> {
    let numbers = [
        0.0f32, 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., // positions
        0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1., // normals
        0., 1., 1., 1., 1., 0., 0., 0., // texture coordinates
        0.5, 0.5, 0.25, // the new third position
    ];
    let mut bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()));
    bytes.extend([2, 0, 0, 0]);
    bytes.extend(picture);
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

/// The JSON of a scene over [`buffer`]; `uri` is how its buffer is given.
fn gltf_text(uri: &str, n_bytes: usize, picture: &[u8]) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"name":"s","nodes":[0,2,3]}}],
"nodes":[{{"name":"n","children":[1],"translation":[1,2,3],"scale":[2,-1,1]}},{{"mesh":0,"rotation":[0,0.6,0,0.8]}},
{{"camera":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1]}},{{"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":0}},
{{"attributes":{{"POSITION":4}},"mode":5,"material":1}}]}}],
"materials":[{{"name":"m","pbrMetallicRoughness":{{"baseColorFactor":[1,0.5,0.25,1],"roughnessFactor":0.5,
"baseColorTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"offset":[0.5,0],"scale":[2,2]}}}}}}}},
"normalTexture":{{"index":0,"scale":0.5}},"alphaMode":"MASK","alphaCutoff":0.25}},
{{"emissiveFactor":[1,1,1],"extras":{{"material_tree":{{"over":"m","fresnel":1.5,"weight":0.5,"weight_texture":{{"index":0}},
"under":{{"mix":[{{"weight":0.25,"of":0}},{{"of":{{"over":"m","curve":[0.1,0.9,5],"under":"m"}}}}]}}}}}},"extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":4}},
"KHR_materials_transmission":{{"transmissionFactor":1}},"KHR_materials_ior":{{"ior":1.4}},"KHR_materials_volume":{{"thicknessFactor":1}}}}}}],
"textures":[{{"source":0,"sampler":0}}],"samplers":[{{"wrapS":33071,"wrapT":33648,"magFilter":9728}}],
"images":[{{"bufferView":6,"mimeType":"image/png"}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.8,"znear":0.1}}}}],
"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","intensity":40,"range":9,"spot":{{"outerConeAngle":0.7}}}}]}}}},
"extensionsUsed":["KHR_lights_punctual","KHR_texture_transform","KHR_materials_ior"],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},{{"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"}},
{{"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"}},{{"bufferView":4,"componentType":5123,"count":6,"type":"SCALAR"}},
{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","sparse":{{"count":1,"indices":{{"bufferView":5,"componentType":5121}},
"values":{{"bufferView":3}}}}}}],
"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":48}},{{"buffer":0,"byteOffset":96,"byteLength":32}},
{{"buffer":0,"byteOffset":128,"byteLength":12}},{{"buffer":0,"byteOffset":140,"byteLength":12}},{{"buffer":0,"byteOffset":152,"byteLength":4}},
{{"buffer":0,"byteOffset":156,"byteLength":{}}}],"buffers":[{{{uri}"byteLength":{n_bytes}}}]}}"#,
        picture.len()
    )
}

/// A `.gltf` whose buffer is in the text.
pub(crate) fn gltf(picture: &[u8]) -> Vec<u8> {
    let bytes = buffer(picture);
    let uri = format!(r#""uri":"data:application/octet-stream;base64,{}","#, base64(&bytes));
    gltf_text(&uri, bytes.len(), picture).into_bytes()
}

/// The same scene as a `.glb`.
pub(crate) fn glb(picture: &[u8]) -> Vec<u8> {
    let bin = buffer(picture);
    container(gltf_text("", bin.len(), picture).into_bytes(), &bin)
}

/// A `.glb` of its two chunks; `bin` fills whole words.
pub(crate) fn container(mut json: Vec<u8>, bin: &[u8]) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |n: usize| u32::try_from(n).expect("small").to_le_bytes();
    let parts: [&[u8]; 9] =
        [b"glTF", &word(2), &word(28 + json.len() + bin.len()), &word(json.len()), b"JSON", &json, &word(bin.len()), b"BIN\0", bin];
    parts.concat()
}

/// An `.hdr` of 16 x 8 texels: 0 flat, 1 run-length encoded in the old way, 2 in the new way.
pub(crate) fn hdr(kind: usize) -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=0.5\n\n-Y 8 +X 16\n".to_vec();
    for line in 0..8u8 {
        match kind {
            0 => bytes.extend((0..16u8).flat_map(|x| [x * 9, 100 + line, 7, 128 + x % 3])),
            1 => bytes.extend([100 + line, 50, 25, 129, 1, 1, 1, 14, 9, 8, 7, 127]),
            _ => {
                bytes.extend([2, 2, 0, 16]);
                for channel in 0..4u8 {
                    // Ten times the same byte, then six that differ.
                    bytes.extend([128 + 10, 120 + channel, 6, 1 + line, 2, 3, 4, 5, 6]);
                }
            }
        }
    }
    bytes
}

/// An EXR of 16 x 8 texels.
pub(crate) fn exr(compression: Compression, tiled: bool) -> Vec<u8> {
    let samples = |scale: f32| FlatSamples::F16((0..16 * 8).map(|at| half::f16::from_f32(scale * (at % 50) as f32)).collect());
    let channels = [("R", 1.0), ("G", 2.0), ("B", 0.5)].into_iter().map(|(name, scale)| AnyChannel::new(name, samples(scale))).collect();
    let blocks = if tiled { Blocks::Tiles(Vec2(8, 8)) } else { Blocks::ScanLines };
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let attributes = LayerAttributes::named("a").with_position(Vec2(1, 1));
    let layer: Layer<AnyChannels<FlatSamples>> = Layer::new((16, 8), attributes, encoding, AnyChannels::sort(channels));
    let mut bytes = Cursor::new(Vec::new());
    let display = IntegerBounds::new((0, 0), (18, 10));
    Image::from_layers(ImageAttributes::new(display), vec![layer]).write().to_buffered(&mut bytes).expect("encoded");
    bytes.into_inner()
}

/// A PLY of a square and a triangle: 0 text, 1 little endian, 2 big endian.
pub(crate) fn ply(kind: usize) -> Vec<u8> {
    let name = ["ascii", "binary_little_endian", "binary_big_endian"][kind];
    let mut bytes = format!(
        "ply\nformat {name} 1.0\ncomment made\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nproperty float s\n\
        property float t\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\nproperty list uchar int vertex_indices\n\
        property uchar flags\nelement edge 1\nproperty int vertex1\nend_header\n"
    )
    .into_bytes();
    let vertices = [[0.0f32, 0., 0., 0., 0.], [1., 0., 0., 1., 0.], [1., 1., 0., 1., 1.], [0., 1., 0., 0., 1.], [0., 0., 1., 0.5, 0.5]];
    let faces: [&[i32]; 2] = [&[0, 1, 2, 3], &[0, 1, 4]];
    if kind == 0 {
        for [x, y, z, s, t] in vertices {
            bytes.extend(format!("{x} {y} {z} {s} {t} 255 128 0\n").bytes());
        }
        for face in faces {
            let corners: Vec<String> = face.iter().map(i32::to_string).collect();
            bytes.extend(format!("{} {} 7\n", corners.len(), corners.join(" ")).bytes());
        }
        bytes.extend(b"3\n");
        return bytes;
    }
    let order = |mut word: [u8; 4]| {
        if kind == 2 {
            word.reverse();
        }
        word
    };
    for vertex in vertices {
        vertex.iter().for_each(|number| bytes.extend(order(number.to_le_bytes())));
        bytes.extend([255, 128, 0]);
    }
    for face in faces {
        bytes.push(u8::try_from(face.len()).expect("small"));
        face.iter().for_each(|corner| bytes.extend(order(corner.to_le_bytes())));
        bytes.push(7);
    }
    bytes.extend(order(3i32.to_le_bytes()));
    bytes
}

/// An OBJ file that uses [`MTL`].
pub(crate) const OBJ: &str = "# made\nmtllib m.mtl\no square\nv 0 0 0 1 0.5 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    vn 0 0 1\ng a\nusemtl wood\nf 1/1/1 2/2/1 3/3/1 \\\n4/4/1\ns 1\nf 1/1 2/2 5/3\nf -5 -1 -2\nusemtl glass\ns off\nf 1 4 5\nl 1 2\nvp 1\n";
/// Its library; the textures are `a.png`.
pub(crate) const MTL: &str = "newmtl wood\nKa 1 1 1\nKd 0.5 0.25 0.125\nKs 0.5 0.5 0.5\nNs 30\nd 0.75\nmap_Kd -s 2 2 -o 0.5 0 a.png\nmap_d a.png\n\
    norm -bm 0.5 a.png\nnewmtl glass\nKd 0 0 0\nTf 0.9 1 0.9\nNi 1.5\nillum 7\nKe 0.1 0 0\nPr 0.1\nPm 0\n";
