//! Compressed buffer views: a compressed file shows what its uncompressed twin shows.

use glam::Vec3;
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    IndexEncoding, VertexEncoding, encode_filter_oct, encode_index_buffer, encode_index_sequence, encode_vertex_buffer,
};

use super::super::super::LoadOptions;
use super::super::super::model::Scene;
use super::of_bytes;

const CORNERS: [[f32; 3]; 5] = [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.], [4., 4., 0.], [2., 6., 1.]];
const INDICES: [u32; 9] = [0, 1, 2, 2, 1, 3, 2, 3, 4];

/// Positions, octahedral normals and indices, each a compressed view of its own.
struct File {
    positions: Vec<u8>,
    normals: Vec<u8>,
    indices: Vec<u8>,
    extension: &'static str,
    mode: &'static str,
    count: usize,
}

impl File {
    fn new(extension: &'static str, mode: &'static str, version: u8) -> File {
        let mut workspace = Workspace::default();
        let vertices = VertexEncoding::new(version, 2).unwrap();
        let bytes: Vec<u8> = CORNERS.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let positions = encode_vertex_buffer(&bytes, CORNERS.len(), 12, vertices, &mut workspace).unwrap();
        let directions = [[0.0f32, 0.0, 1.0, 0.0]; CORNERS.len()];
        let filtered = encode_filter_oct(CORNERS.len(), 4, 8, directions.as_flattened(), &mut workspace).unwrap();
        let normals = encode_vertex_buffer(&filtered, CORNERS.len(), 4, vertices, &mut workspace).unwrap();
        let indices = match mode {
            "TRIANGLES" => encode_index_buffer(&INDICES, IndexEncoding::DEFAULT, &mut workspace).unwrap(),
            _ => encode_index_sequence(&INDICES, IndexEncoding::DEFAULT, &mut workspace).unwrap(),
        };
        File { positions, normals, indices, extension, mode, count: CORNERS.len() }
    }

    fn read(&self) -> Result<Scene, String> {
        let bytes = [self.positions.as_slice(), &self.normals, &self.indices].concat();
        let mut at = 0;
        let mut view = |part: &[u8], stride: usize, count: usize, mode: &str, filter: &str| {
            let start = at;
            at += part.len();
            let name = self.extension;
            let own = if mode == "ATTRIBUTES" { format!(r#""byteStride":{stride},"#) } else { String::new() };
            format!(
                r#"{{"buffer":1,"byteLength":{},{own}"extensions":{{"{name}":{{"buffer":0,"byteOffset":{start},"byteLength":{},
                    "byteStride":{stride},"count":{count},"mode":"{mode}"{filter}}}}}}}"#,
                stride.saturating_mul(count),
                part.len()
            )
        };
        let views = [
            view(&self.positions, 12, self.count, "ATTRIBUTES", ""),
            view(&self.normals, 4, self.count, "ATTRIBUTES", r#","filter":"OCTAHEDRAL""#),
            view(&self.indices, 2, INDICES.len(), self.mode, r#","filter":"NONE""#),
        ];
        let rest = format!(
            r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1}},"indices":2}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":5}},
                {{"bufferView":1,"componentType":5120,"normalized":true,"type":"VEC3","count":5}},
                {{"bufferView":2,"componentType":5123,"type":"SCALAR","count":9}}],
            "extensionsRequired":["{}"]"#,
            self.extension
        );
        of_bytes(&bytes, &views, &rest, &LoadOptions::default())
    }
}

// Kills: a filter that is not applied, a mode or a version of the codec that is not known, indices of the wrong width, and the fallback
// buffer, which has no bytes, read instead.
#[test]
fn all_modes_show_the_uncompressed_mesh() {
    for (extension, version) in [("EXT_meshopt_compression", 0), ("KHR_meshopt_compression", 1)] {
        for mode in ["TRIANGLES", "INDICES"] {
            let scene = File::new(extension, mode, version).read().unwrap();
            let positions: Vec<[f32; 3]> = scene.vertices.iter().map(|vertex| vertex.position.to_array()).collect();
            assert_eq!(positions, CORNERS, "{mode} {version}");
            assert!(scene.vertices.iter().all(|vertex| vertex.normal.abs_diff_eq(Vec3::Z, 1e-2)), "{mode} {version}");
            let corners = |list: &[[u32; 3]]| {
                // The codec may begin a triangle at any of its corners.
                let first_least = |t: &[u32; 3]| (0..3).map(|i| [t[i], t[(i + 1) % 3], t[(i + 2) % 3]]).min().unwrap_or_default();
                list.iter().map(first_least).collect::<Vec<_>>()
            };
            let found: Vec<[u32; 3]> = scene.triangles.iter().map(|triangle| triangle.vertices).collect();
            let (expected, _) = INDICES.as_chunks::<3>();
            assert_eq!(corners(&found), corners(expected), "{mode} {version}");
        }
    }
}

// Kills: a panic or a picture of rubbish from a stream that is cut, and an allocation of what a broken count asks for.
#[test]
fn broken_streams_are_refused() {
    for length in 0..File::new("EXT_meshopt_compression", "TRIANGLES", 0).positions.len() {
        let mut cut = File::new("EXT_meshopt_compression", "TRIANGLES", 0);
        cut.positions.truncate(length);
        assert!(cut.read().is_err(), "{length}");
    }
    for count in [1 << 20, 1 << 40, usize::MAX] {
        let text = File { count, ..File::new("EXT_meshopt_compression", "TRIANGLES", 0) }.read().map(|scene| scene.vertices.len());
        assert!(text.as_ref().is_err_and(|text| text.contains("meshopt")), "{count}: {text:?}");
    }
    let whole = File::new("EXT_meshopt_compression", "TRIANGLES", 0);
    let text = File { mode: "SQUARES", ..whole }.read().unwrap_err();
    assert!(text.contains("bufferView 2") && text.contains("'SQUARES' is unknown"), "{text}");
}
