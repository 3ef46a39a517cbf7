//! Triangles of one material as a binary PLY file.

use std::io::{self, Write};

use crate::scene::{Scene, Triangle};

/// Which side is written.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Side {
    Front,
    /// Turned around, and so many metres behind the front.
    Back(f32),
}

/// Writes the triangles with normals and the texture coordinates of one set; vertices that they do not use are left out.
pub(super) fn write(out: &mut impl Write, scene: &Scene, triangles: &[Triangle], uv_set: usize, side: Side) -> io::Result<()> {
    let mut place_of = vec![u32::MAX; scene.vertices.len()];
    let mut used = Vec::new();
    for corner in triangles.iter().flat_map(|triangle| triangle.vertices) {
        let place = &mut place_of[corner as usize];
        if *place == u32::MAX {
            *place = used.len() as u32;
            used.push(corner);
        }
    }
    let properties = ["x", "y", "z", "nx", "ny", "nz", "u", "v"].map(|name| format!("property float {name}\n")).concat();
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{properties}element face {}\nproperty list uchar int vertex_indices\n\
         end_header\n",
        used.len(),
        triangles.len()
    )?;
    for corner in used {
        let vertex = &scene.vertices[corner as usize];
        let (position, normal) = match side {
            Side::Front => (vertex.position, vertex.normal),
            Side::Back(distance) => (vertex.position - distance * vertex.normal, -vertex.normal),
        };
        let numbers = position.to_array().into_iter().chain(normal.to_array()).chain(vertex.uv[uv_set].to_array());
        for number in numbers {
            out.write_all(&number.to_le_bytes())?;
        }
    }
    for triangle in triangles {
        out.write_all(&[3])?;
        let [a, b, c] = triangle.vertices;
        for corner in if side == Side::Front { [a, b, c] } else { [a, c, b] } {
            out.write_all(&place_of[corner as usize].to_le_bytes())?;
        }
    }
    Ok(())
}
