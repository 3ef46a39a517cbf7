//! Tangents for normal maps whose mesh has none.
//!
//! Key decision: MikkTSpace, because normal maps are baked against it; any other tangents make seams. It wants v to grow upwards, so it
//! is shown `1 - v`, and the sign it returns is the one that glTF wants.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::Vec4;

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

/// Gives every vertex a tangent; vertices whose triangles disagree are split.
pub(in crate::scene) fn generate(primitive: &mut Primitive, uv_set: usize) {
    let tangents = vec![Vec4::ZERO; primitive.triangles.len() * 3];
    let mut corners = Corners { primitive, uv_set, tangents };
    // The error has no variants yet; corners that got no tangent have the fallback below.
    let _ = generate_tangents(&mut corners);
    let tangents = corners.tangents;

    let mut vertices: Vec<Vertex> = Vec::with_capacity(primitive.vertices.len());
    let mut known: HashMap<(u32, [u32; 4]), u32> = HashMap::with_capacity(primitive.vertices.len());
    for (index, tangent) in primitive.triangles.as_flattened_mut().iter_mut().zip(tangents) {
        let old = primitive.vertices[*index as usize];
        let usable = tangent.is_finite() && tangent.truncate().length_squared() > 0.5;
        let tangent = if usable { tangent } else { perpendicular(old.normal).extend(1.0) };
        *index = *known.entry((*index, tangent.to_array().map(f32::to_bits))).or_insert_with(|| {
            vertices.push(Vertex { tangent, ..old });
            // At most three for each triangle, and those are capped far below.
            u32::try_from(vertices.len() - 1).unwrap_or(u32::MAX)
        });
    }
    primitive.vertices = vertices;
}
