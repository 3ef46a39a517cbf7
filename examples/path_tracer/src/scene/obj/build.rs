//! From statements to vertices and triangles, material by material.
//!
//! Key decision: corners that agree in everything share a vertex, except on flat faces, where nothing can be shared. Without `vn` a face
//! is flat, unless a smoothing group says with which faces it forms one surface.
//!
//! **Invariant:** a scene is never larger than its limits, and that is asked before a vertex is made.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};

use super::super::gltf::mesh::Primitive;
use super::super::gltf::{Warnings, tangents};
use super::super::limits;
use super::super::model::{Scene, Triangle, Vertex};
use super::super::polygon;
use super::geometry::{Corner, Face, Geometry, NONE};
use super::material::Materials;
use crate::error::Fault;

/// Where a normal comes from, and from which one there.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Source {
    File(u32),
    Group(u32),
}

/// Appends everything that the geometry shows to the scene.
pub(super) fn build(
    mut geometry: Geometry,
    materials: &mut Materials<'_>,
    scene: &mut Scene,
    warnings: &mut Warnings,
) -> Result<(), Fault> {
    let mut order: Vec<usize> = (0..geometry.faces.len()).collect();
    order.sort_by_key(|&face| geometry.faces[face].material);
    let mut tally = std::mem::take(&mut geometry.tally);
    let (mut shape, mut face_vertices) = (Vec::new(), Vec::new());
    let smooth = smooth_normals(&geometry, &mut shape);
    let mut n_repaired = 0usize;
    for faces in order.chunk_by(|&a, &b| geometry.faces[a].material == geometry.faces[b].material) {
        let name = faces.first().and_then(|&face| geometry.materials.get(geometry.faces[face].material as usize));
        let material = materials.make(name.map_or("", String::as_str), warnings)?;
        let mut made = Primitive { material: index(scene.materials.len())?, ..Primitive::default() };
        let mut known: HashMap<(u32, u32, Source), u32> = HashMap::new();
        for &face in faces {
            let corners = corners(&geometry, face);
            positions(&geometry, corners, &mut shape);
            let flat = polygon::area_vector(&shape).normalize_or_zero().as_vec3();
            face_vertices.clear();
            for corner in corners {
                let source = match (corner.normal, geometry.faces[face].smoothing) {
                    (NONE, 0) => None,
                    (NONE, group) => Some(Source::Group(group)),
                    (normal, _) => Some(Source::File(normal)),
                };
                let new = index(made.vertices.len())?;
                let vertex = match source {
                    Some(source) => *known.entry((corner.position, corner.uv, source)).or_insert(new),
                    None => new,
                };
                if vertex == new {
                    if scene.vertices.len() + made.vertices.len() >= limits::VERTICES {
                        return Err(Fault::unsupported("size", format_args!("a scene of more than {} vertices", limits::VERTICES)));
                    }
                    let normal = match source {
                        None => flat,
                        Some(Source::File(normal)) => geometry.normals.get(normal as usize).copied().unwrap_or_default(),
                        Some(Source::Group(group)) => {
                            smooth.get(&(corner.position, group)).copied().unwrap_or_default().normalize_or_zero()
                        }
                    };
                    made.vertices.push(vertex_of(&geometry, corner, normal));
                }
                face_vertices.push(vertex);
            }
            tally.cut(&shape, |places| made.triangles.push(places.map(|place| face_vertices[place])));
        }
        drop(known);
        n_repaired += made.repair_normals();
        let normal_texture = material.normal_texture;
        if normal_texture.is_some_and(|texture| !tangents::generate(&mut made, texture.uv_set.min(1) as usize)) {
            warnings.push(format!("material '{}': {}", material.name, tangents::CROWDED));
        }
        scene.materials.push(material);
        append(scene, made)?;
    }
    tally.warn(warnings);
    if n_repaired > 0 {
        warnings.push(format!("{n_repaired} normals without a direction are replaced"));
    }
    Ok(())
}

fn index(count: usize) -> Result<u32, Fault> {
    u32::try_from(count).map_err(|_| Fault::unsupported("size", "a scene with so many parts"))
}

fn corners(geometry: &Geometry, face: usize) -> &[Corner] {
    let end = |face: &Face| face.end;
    let start = face.checked_sub(1).and_then(|before| geometry.faces.get(before)).map_or(0, end);
    geometry.corners.get(start..geometry.faces.get(face).map_or(start, end)).unwrap_or_default()
}

fn positions(geometry: &Geometry, corners: &[Corner], shape: &mut Vec<Vec3>) {
    shape.clear();
    shape.extend(corners.iter().map(|corner| geometry.positions[corner.position as usize]));
}

/// Sums of weighted normals for each position in each smoothing group that needs them.
fn smooth_normals(geometry: &Geometry, shape: &mut Vec<Vec3>) -> HashMap<(u32, u32), Vec3> {
    let mut sums: HashMap<(u32, u32), Vec3> = HashMap::new();
    for (index, face) in geometry.faces.iter().enumerate().filter(|(_, face)| face.smoothing != 0) {
        let corners = corners(geometry, index);
        // A face with normals of its own still shapes the surface that its neighbours belong to.
        positions(geometry, corners, shape);
        polygon::weighted_normals(shape, |at, normal| *sums.entry((corners[at].position, face.smoothing)).or_default() += normal);
    }
    sums
}

fn vertex_of(geometry: &Geometry, corner: &Corner, normal: Vec3) -> Vertex {
    let at = corner.position as usize;
    let uv = geometry.uvs.get(corner.uv as usize).copied().unwrap_or(Vec2::ZERO);
    let color = geometry.colors.get(at).map_or(Vec4::ONE, |color| Vec3::from_array(color.to_array().map(polygon::linear)).extend(1.0));
    Vertex { position: geometry.positions[at], normal, tangent: Vec4::ZERO, uv: [uv; 2], color }
}

/// Moves a finished part into the scene.
fn append(scene: &mut Scene, mut made: Primitive) -> Result<(), Fault> {
    if scene.vertices.len().saturating_add(made.vertices.len()) > limits::VERTICES {
        return Err(Fault::unsupported("size", format_args!("a scene of more than {} vertices", limits::VERTICES)));
    }
    let base = index(scene.vertices.len())?;
    let material = made.material;
    scene.triangles.extend(made.triangles.iter().map(|t| Triangle { vertices: t.map(|v| base + v), material }));
    if scene.vertices.is_empty() {
        scene.vertices = made.vertices;
    } else {
        scene.vertices.append(&mut made.vertices);
    }
    Ok(())
}
