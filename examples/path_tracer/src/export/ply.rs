//! Triangles of one material as a binary PLY file.

use std::io::{self, Write};

use crate::scene::{Scene, Triangle};

/// Writes the triangles with normals, the texture coordinates of one set and, when asked, colours; vertices that they do not use are left out.
pub(super) fn write(out: &mut impl Write, scene: &Scene, triangles: &[Triangle], uv_set: usize, has_colors: bool) -> io::Result<()> {
    let mut place_of = vec![u32::MAX; scene.vertices.len()];
    let mut used = Vec::new();
    for corner in triangles.iter().flat_map(|triangle| triangle.vertices) {
        let place = &mut place_of[corner as usize];
        if *place == u32::MAX {
            *place = used.len() as u32;
            used.push(corner);
        }
    }
    let mut names = vec!["x", "y", "z", "nx", "ny", "nz", "u", "v"];
    names.extend(has_colors.then_some(["r", "g", "b"]).into_iter().flatten());
    let properties: String = names.iter().map(|name| format!("property float {name}\n")).collect();
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{properties}element face {}\nproperty list uchar int vertex_indices\n\
         end_header\n",
        used.len(),
        triangles.len()
    )?;
    for corner in used {
        let vertex = &scene.vertices[corner as usize];
        let uv = vertex.uv[uv_set];
        let colors = if has_colors { vec![vertex.color.x, vertex.color.y, vertex.color.z] } else { Vec::new() };
        let numbers = vertex.position.to_array().into_iter().chain(vertex.normal.to_array()).chain(uv.to_array()).chain(colors);
        for number in numbers {
            out.write_all(&number.to_le_bytes())?;
        }
    }
    for triangle in triangles {
        out.write_all(&[3])?;
        for corner in triangle.vertices {
            out.write_all(&place_of[corner as usize].to_le_bytes())?;
        }
    }
    Ok(())
}
