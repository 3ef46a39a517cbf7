//! A primitive of a mesh in its own space: attributes, triangles, and whatever the file left to be computed.
//!
//! Key decision: everything that depends on the mesh alone happens here once, however many nodes show it; [`super::bake`] only moves
//! finished primitives into the world.
//!
//! **Invariant:** positions are finite, normals have unit length or are zero when no triangle could give one, indices are in range.

use glam::{Vec2, Vec3, Vec4};

use super::super::limits;
use super::super::model::Vertex;
use super::Warnings;
use super::accessor::{Accessors, Table};
use super::json;
use super::morph::{self, Moves};
use super::tangents;
use super::topology::Mode;
use crate::error::Fault;

/// Vertices and triangles with one material, in the space of the mesh.
#[derive(Default)]
pub(in crate::scene) struct Primitive {
    pub(in crate::scene) vertices: Vec<Vertex>,
    pub(in crate::scene) triangles: Vec<[u32; 3]>,
    pub(in crate::scene) material: u32,
    /// For each vertex the one of the file that it comes from.
    pub(in crate::scene) sources: Vec<u32>,
    /// True when the file has no normals, so that every triangle has vertices of its own.
    pub(in crate::scene) flat: bool,
}

/// What a primitive has to know about its material.
#[derive(Clone, Copy)]
pub(super) struct MaterialUse {
    /// Into the scene's materials.
    pub(super) index: u32,
    /// The set of texture coordinates whose directions it needs, if it needs a tangent space.
    pub(super) tangent_uv_set: Option<u32>,
}

/// Vertices and triangles that may still be made.
pub(super) struct Budget {
    vertices: usize,
    triangles: usize,
}

impl Default for Budget {
    fn default() -> Budget {
        Budget { vertices: limits::VERTICES, triangles: limits::TRIANGLES }
    }
}

impl Budget {
    pub(super) fn spend(&mut self, n_vertices: usize, n_triangles: usize) -> Result<(), Fault> {
        let left = |have: usize, n: usize, what: &str| {
            let too_many = || Fault::unsupported("size", format_args!("a scene with so many {what}"));
            have.checked_sub(n).ok_or_else(too_many)
        };
        self.vertices = left(self.vertices, n_vertices, "vertices")?;
        self.triangles = left(self.triangles, n_triangles, "triangles")?;
        Ok(())
    }
}

/// Reads a primitive, its morph targets added with `weights`; `None` when it shows nothing.
pub(super) fn read(
    primitive: &json::Primitive,
    material: MaterialUse,
    weights: &[f32],
    accessors: &Accessors<'_>,
    budget: &mut Budget,
    place: &str,
    warnings: &mut Warnings,
) -> Result<Option<Primitive>, Fault> {
    let Some(mode) = Mode::of(primitive.mode.unwrap_or(4))? else {
        warnings.push(format!("{place}: points and lines are left out"));
        return Ok(None);
    };
    let Some(&position) = primitive.attributes.get("POSITION") else {
        warnings.push(format!("{place}: there are no positions, so it is left out"));
        return Ok(None);
    };
    const DRACO: &str = "KHR_draco_mesh_compression";
    if primitive.extensions.contains_key(DRACO) && !accessors.has_bytes(position)? {
        return Err(Fault::unsupported("POSITION", DRACO));
    }
    let positions = accessors.table(position, &[3]).map_err(|f| f.within("POSITION"))?;
    if let Some(index) = positions.rows([0.0; 3]).position(|p| !Vec3::from_array(p).is_finite()) {
        return Err(Fault::invalid(format_args!("POSITION, accessor {position}"), format_args!("vertex {index} is not finite")));
    }

    // The triangles, before any vertex is built, so that the budget is asked first.
    let indices = match primitive.indices {
        Some(index) => accessors.indices(index).map_err(|f| f.within("indices"))?,
        None => (0..u32::try_from(positions.len()).unwrap_or(u32::MAX)).collect(),
    };
    if let Some(index) = indices.iter().find(|&&index| index as usize >= positions.len()) {
        return Err(Fault::invalid("indices", format_args!("vertex {index} does not exist, there are {}", positions.len())));
    }
    let left_over = mode.n_left_over(indices.len());
    if left_over > 0 {
        warnings.push(format!("{place}: the last {left_over} indices make no triangle"));
    }
    let n_triangles = mode.n_triangles(indices.len());
    if n_triangles == 0 {
        return Ok(None);
    }
    let flat = !primitive.attributes.contains_key("NORMAL");
    // Flat shading and tangents may split every vertex into one for each corner.
    let splits = flat || material.tangent_uv_set.is_some();
    budget.spend(if splits { positions.len().max(3 * n_triangles) } else { positions.len() }, n_triangles)?;

    let with_tangents = material.tangent_uv_set.is_some();
    let mut vertices = read_vertices(primitive, &positions, accessors, with_tangents, place, warnings)?;
    let has = |name: &str| primitive.attributes.contains_key(name);
    let moves = Moves { normals: !flat, tangents: with_tangents && has("TANGENT"), second_uv: has("TEXCOORD_1") };
    morph::apply(&mut vertices, &primitive.targets, weights, moves, accessors, budget)?;
    let sources = (0..u32::try_from(vertices.len()).unwrap_or(u32::MAX)).collect();
    let mut made = Primitive { vertices, triangles: mode.triangles(&indices), material: material.index, sources, flat };
    if flat {
        made.split_flat();
    } else {
        let repaired = made.repair_normals();
        if repaired > 0 {
            warnings.push(format!("{place}: {repaired} normals without a direction are replaced"));
        }
    }
    if let Some(uv_set) = material.tangent_uv_set {
        // The format says that tangents of a mesh without normals are to be ignored.
        if (!moves.tangents || flat) && !tangents::generate(&mut made, uv_set.min(1) as usize) {
            warnings.push(format!("{place}: {}", tangents::CROWDED));
        }
    }
    Ok(Some(made))
}

fn read_vertices(
    primitive: &json::Primitive,
    positions: &Table,
    accessors: &Accessors<'_>,
    with_tangents: bool,
    place: &str,
    warnings: &mut Warnings,
) -> Result<Vec<Vertex>, Fault> {
    let blank = Vertex { color: Vec4::ONE, ..Vertex::default() };
    let mut vertices: Vec<Vertex> = positions.rows([0.0; 3]).map(|p| Vertex { position: Vec3::from_array(p), ..blank }).collect();
    let mut n_bad = 0usize;
    let mut each = |name: &str, widths: &[usize], set: &mut dyn FnMut(&mut Vertex, [f32; 4])| -> Result<bool, Fault> {
        let Some(&index) = primitive.attributes.get(name) else { return Ok(false) };
        let table = accessors.table(index, widths).map_err(|f| f.within(name))?;
        if table.len() != vertices.len() {
            let what = format!("{} elements for {} positions", table.len(), vertices.len());
            return Err(Fault::invalid(format_args!("{name}, accessor {index}"), what));
        }
        for (vertex, row) in vertices.iter_mut().zip(table.rows([0.0, 0.0, 0.0, 1.0])) {
            // Numbers that only colour the picture do not make the file unreadable.
            n_bad += usize::from(!row.iter().all(|x| x.is_finite()));
            set(vertex, row.map(|x| if x.is_finite() { x } else { 0.0 }));
        }
        Ok(true)
    };
    each("NORMAL", &[3], &mut |vertex, [x, y, z, _]| vertex.normal = Vec3::new(x, y, z).normalize_or_zero())?;
    if with_tangents {
        each("TANGENT", &[4], &mut |vertex, [x, y, z, w]| {
            let tangent = Vec3::new(x, y, z).normalize_or(perpendicular(vertex.normal));
            vertex.tangent = tangent.extend(if w < 0.0 { -1.0 } else { 1.0 });
        })?;
    }
    each("TEXCOORD_0", &[2], &mut |vertex, [u, v, ..]| vertex.uv = [Vec2::new(u, v); 2])?;
    each("TEXCOORD_1", &[2], &mut |vertex, [u, v, ..]| vertex.uv[1] = Vec2::new(u, v))?;
    each("COLOR_0", &[3, 4], &mut |vertex, color| vertex.color = Vec4::from_array(color).max(Vec4::ZERO))?;
    if n_bad > 0 {
        warnings.push(format!("{place}: {n_bad} normals, tangents, texture coordinates or colours are not finite and become zero"));
    }
    Ok(vertices)
}

impl Primitive {
    /// The normal of a triangle, zero when it has no area.
    fn face_normal(&self, triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = triangle.map(|v| self.vertices[v as usize].position.as_dvec3());
        (b - a).cross(c - a).normalize_or_zero().as_vec3()
    }

    /// Gives every triangle vertices of its own, with the normal of the triangle.
    fn split_flat(&mut self) {
        let mut vertices = Vec::with_capacity(3 * self.triangles.len());
        for &triangle in &self.triangles {
            let normal = self.face_normal(triangle);
            vertices.extend(triangle.map(|v| Vertex { normal, ..self.vertices[v as usize] }));
        }
        self.sources = self.triangles.as_flattened().iter().map(|&v| self.sources[v as usize]).collect();
        self.vertices = vertices;
        self.triangles = (0..self.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    }

    /// Replaces normals of length zero by that of a triangle at the vertex; returns how many there were.
    pub(in crate::scene) fn repair_normals(&mut self) -> usize {
        let bad: Vec<bool> = self.vertices.iter().map(|v| v.normal == Vec3::ZERO).collect();
        let n_bad = bad.iter().filter(|&&bad| bad).count();
        if n_bad > 0 {
            for index in 0..self.triangles.len() {
                let triangle = self.triangles[index];
                let normal = self.face_normal(triangle);
                for vertex in triangle.into_iter().filter(|&v| bad[v as usize] && normal != Vec3::ZERO) {
                    self.vertices[vertex as usize].normal = normal;
                }
            }
        }
        n_bad
    }
}

/// Some unit vector at a right angle to `normal`.
pub(super) fn perpendicular(normal: Vec3) -> Vec3 {
    let axis = if normal.x.abs() < 0.9 { Vec3::X } else { Vec3::Y };
    axis.cross(normal).normalize_or(Vec3::Z)
}
