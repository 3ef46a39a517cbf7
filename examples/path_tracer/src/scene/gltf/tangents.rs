//! Tangents for normal maps whose mesh has none.
//!
//! Key decision: MikkTSpace, because normal maps are baked against it; any other tangents make seams. It wants v to grow upwards, so it
//! is shown `1 - v`, and the sign it returns is the one that glTF wants.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::Vec4;

use super::super::guard::guarded;
use super::super::model::Vertex;
use super::mesh::{Primitive, perpendicular};

struct Corners<'a> {
    primitive: &'a Primitive,
    uv_set: usize,
    /// Three for each triangle.
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> &Vertex {
        &self.primitive.vertices[self.primitive.triangles[face][corner] as usize]
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.primitive.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.vertex(face, corner).position.to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.vertex(face, corner).normal.to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.vertex(face, corner).uv[self.uv_set];
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        self.tangents[3 * face + corner] = space.map_or(Vec4::ZERO, |space| Vec4::from_array(space.tangent_encoded()));
    }
}

/// What a caller says when [`generate`] gave up.
pub(in crate::scene) const CROWDED: &str = "too many triangles meet at one vertex: the normal texture lies in an arbitrary direction";

/// MikkTSpace compares all triangles at a vertex with each other, and goes around the vertex by recursion; this tells whether the former
/// ends in time and the latter fits the stack of a thread.
///
/// An honest mesh has six triangles at a vertex, so 18 comparisons for each triangle.
fn is_affordable(primitive: &Primitive, uv_set: usize) -> bool {
    const ANY_MESH: u64 = 100_000_000;
    const FOR_EACH_TRIANGLE: u64 = 256;
    const AT_A_VERTEX: u64 = 4096;
    let mut meetings: HashMap<[u32; 8], u64> = HashMap::with_capacity(primitive.vertices.len());
    for &index in primitive.triangles.as_flattened() {
        let vertex = &primitive.vertices[index as usize];
        let ([x, y, z], [nx, ny, nz], uv) = (vertex.position.to_array(), vertex.normal.to_array(), vertex.uv[uv_set]);
        // Adding zero makes minus zero the same as zero, as it is there.
        *meetings.entry([x, y, z, nx, ny, nz, uv.x, uv.y].map(|number| (number + 0.0).to_bits())).or_default() += 1;
    }
    let comparisons = meetings.values().fold(0u64, |sum, count| sum.saturating_add(count.saturating_mul(*count)));
    let most = meetings.values().copied().max().unwrap_or(0);
    most <= AT_A_VERTEX && comparisons <= ANY_MESH.max(FOR_EACH_TRIANGLE.saturating_mul(primitive.triangles.len() as u64))
}

/// Gives every vertex a tangent; vertices whose triangles disagree are split. False when too many triangles meet at one vertex: then the
/// tangents are just at right angles to the normals.
pub(in crate::scene) fn generate(primitive: &mut Primitive, uv_set: usize) -> bool {
    if !is_affordable(primitive, uv_set) {
        primitive.vertices.iter_mut().for_each(|vertex| vertex.tangent = perpendicular(vertex.normal).extend(1.0));
        return false;
    }
    let tangents = vec![Vec4::ZERO; primitive.triangles.len() * 3];
    let mut corners = Corners { primitive, uv_set, tangents };
    // The error has no variants yet, and the crate asserts what it believes; corners that got no tangent have the fallback below.
    let _ = guarded(|| Ok(generate_tangents(&mut corners).is_ok()));
    let tangents = corners.tangents;

    let mut vertices: Vec<Vertex> = Vec::with_capacity(primitive.vertices.len());
    let mut sources = Vec::with_capacity(primitive.vertices.len());
    let mut known: HashMap<(u32, [u32; 4]), u32> = HashMap::with_capacity(primitive.vertices.len());
    for (index, tangent) in primitive.triangles.as_flattened_mut().iter_mut().zip(tangents) {
        let old = primitive.vertices[*index as usize];
        // Readers that ask for no sources have none.
        let source = primitive.sources.get(*index as usize).copied().unwrap_or(*index);
        let usable = tangent.is_finite() && tangent.truncate().length_squared() > 0.5;
        let tangent = if usable { tangent } else { perpendicular(old.normal).extend(1.0) };
        *index = *known.entry((*index, tangent.to_array().map(f32::to_bits))).or_insert_with(|| {
            vertices.push(Vertex { tangent, ..old });
            sources.push(source);
            // At most three for each triangle, and those are capped far below.
            u32::try_from(vertices.len() - 1).unwrap_or(u32::MAX)
        });
    }
    primitive.vertices = vertices;
    primitive.sources = sources;
    true
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    // Kills: time that grows with the square of the triangles at a vertex, recursion that overflows the stack of a thread, and bounds that
    // an honest pole exceeds.
    #[test]
    fn crowds_are_told_from_meshes() {
        let at = |position: Vec3, uv: Vec2| Vertex { position, normal: Vec3::Z, uv: [uv; 2], ..Vertex::default() };
        let fans = |n_fans: u32, n: u32| {
            let mut made = Primitive::default();
            for fan in 0..n_fans {
                let (base, middle) = (made.vertices.len() as u32, Vec3::Z * fan as f32);
                let rim = (0..=n).map(|i| Vec2::from_angle(i as f32 / n as f32 * 6.0)).map(|p| at(middle + p.extend(0.0), p));
                made.vertices.extend(std::iter::once(at(middle, Vec2::ZERO)).chain(rim));
                made.triangles.extend((1..=n).map(|i| [base, base + i, base + i + 1]));
            }
            made
        };
        assert!(generate(&mut fans(1, 4000), 0));
        for mut crowd in [fans(1, 5000), fans(20, 4000)] {
            assert!(!generate(&mut crowd, 0));
            assert!(crowd.vertices.iter().all(|vertex| vertex.tangent.truncate().dot(vertex.normal) == 0.0 && vertex.tangent.w == 1.0));
        }
    }
}
