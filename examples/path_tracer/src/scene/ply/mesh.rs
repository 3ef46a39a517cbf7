//! The elements `vertex` and `face`, by the names of their properties.
//!
//! Key decision: faces are kept as lists of corners until all elements are read, because nothing says that vertices come first.
//!
//! **Invariant:** every corner is the number of a vertex, every position is finite.

use glam::{Vec2, Vec4};

use super::super::gltf::Warnings;
use super::super::gltf::mesh::Primitive;
use super::super::limits;
use super::super::model::Vertex;
use super::super::polygon::{self, Tally};
use super::header::{Element, Header};
use super::values::Body;
use crate::error::Fault;

/// What a number of a vertex means.
#[derive(Clone, Copy, PartialEq)]
enum Slot {
    Position(usize),
    Normal(usize),
    Uv(usize),
    /// The channel, and the value that stands for 1.
    Color(usize, f64),
    Unused,
}

/// The names in use, for each slot and axis.
fn slot(name: &str) -> Slot {
    match name {
        "x" => Slot::Position(0),
        "y" => Slot::Position(1),
        "z" => Slot::Position(2),
        "nx" => Slot::Normal(0),
        "ny" => Slot::Normal(1),
        "nz" => Slot::Normal(2),
        "s" | "u" | "texture_u" | "texture_s" => Slot::Uv(0),
        "t" | "v" | "texture_v" | "texture_t" => Slot::Uv(1),
        "red" | "r" | "diffuse_red" => Slot::Color(0, 1.0),
        "green" | "g" | "diffuse_green" => Slot::Color(1, 1.0),
        "blue" | "b" | "diffuse_blue" => Slot::Color(2, 1.0),
        "alpha" | "a" | "diffuse_alpha" => Slot::Color(3, 1.0),
        _ => Slot::Unused,
    }
}

#[derive(Default)]
struct Corners {
    corners: Vec<u32>,
    /// Where each face ends in `corners`.
    ends: Vec<usize>,
}

impl Corners {
    fn faces(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| self.corners.get(start..end).unwrap_or_default())
    }
}

/// Reads vertices and faces and computes the normals that are missing.
pub(super) fn read(header: &Header, body: &[u8], warnings: &mut Warnings) -> Result<Primitive, Fault> {
    let find = |name: &str| header.elements.iter().find(|element| element.name == name);
    let vertex = find("vertex").ok_or_else(|| Fault::invalid("header", "there is no element 'vertex'"))?;
    if vertex.count > limits::VERTICES {
        return Err(Fault::unsupported("header", format_args!("a file of {} vertices (at most {})", vertex.count, limits::VERTICES)));
    }
    let mut body = Body::new(header, body);
    let mut made = Primitive::default();
    let mut faces = Corners::default();
    let mut tally = Tally::default();
    let mut has_normals = false;
    // What stands behind the last element that is shown need not be read.
    let shown = |element: &Element| matches!(element.name.as_str(), "vertex" | "face");
    let n_read = header.elements.iter().rposition(shown).map_or(0, |last| last + 1);
    for (at, element) in header.elements.iter().enumerate() {
        match element.name.as_str() {
            "vertex" => has_normals = read_vertices(element, &mut body, &mut made.vertices, warnings)?,
            "face" => read_faces(element, &mut body, vertex.count, &mut faces, &mut tally, warnings)?,
            name => {
                warnings.push(format!("the element '{name}' is skipped"));
                if at < n_read {
                    body.read(element, |_, _, _| {}, |_, _, _, _| Ok(()))?;
                }
            }
        }
    }
    if faces.ends.is_empty() {
        warnings.push(String::from("there are no faces: a cloud of points shows nothing"));
        made.vertices.clear();
    }

    let mut shape = Vec::new();
    for face in faces.faces() {
        shape.clear();
        shape.extend(face.iter().map(|&corner| made.vertices[corner as usize].position));
        tally.cut(&shape, |places| made.triangles.push(places.map(|place| face[place])));
        if !has_normals {
            polygon::weighted_normals(&shape, |at, normal| made.vertices[face[at] as usize].normal += normal);
        }
    }
    tally.warn(warnings);
    made.vertices.iter_mut().for_each(|vertex| vertex.normal = vertex.normal.normalize_or_zero());
    let n_repaired = made.repair_normals();
    if has_normals && n_repaired > 0 {
        warnings.push(format!("{n_repaired} normals without a direction are replaced"));
    }
    Ok(made)
}

/// Appends the vertices; true when they have normals.
fn read_vertices(element: &Element, body: &mut Body<'_>, vertices: &mut Vec<Vertex>, warnings: &mut Warnings) -> Result<bool, Fault> {
    let slots: Vec<Slot> = element
        .properties
        .iter()
        .map(|property| match (property.length, slot(&property.name)) {
            (Some(_), _) => Slot::Unused,
            (None, Slot::Color(channel, _)) => Slot::Color(channel, property.number.full()),
            (None, slot) => slot,
        })
        .collect();
    let has = |wanted: Slot| slots.contains(&wanted);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if !has(Slot::Position(axis)) {
            return Err(Fault::invalid("header", format_args!("the element 'vertex' has no property '{name}'")));
        }
    }
    for (property, _) in element.properties.iter().zip(&slots).filter(|(_, slot)| **slot == Slot::Unused) {
        warnings.push(format!("the property '{}' of 'vertex' is skipped", property.name));
    }
    let has_normals = (0..3).all(|axis| has(Slot::Normal(axis)));
    let has_uv = (0..2).all(|axis| has(Slot::Uv(axis)));
    let colors = |channel: usize| slots.iter().any(|slot| matches!(slot, Slot::Color(found, _) if *found == channel));
    let has_colors = (0..3).all(colors);
    if has_colors {
        warnings.push(String::from(polygon::COLORS_WARNING));
    }

    body.check_size(element)?;
    vertices.reserve_exact(element.count);
    let blank = Vertex { color: Vec4::ONE, ..Vertex::default() };
    let mut n_bad = 0usize;
    let mut bad_position = None;
    let set = |index: usize, at: usize, value: f64| {
        if vertices.len() <= index {
            vertices.push(blank);
        }
        let Some(vertex) = vertices.get_mut(index) else { return };
        let number = value as f32;
        if !number.is_finite() {
            match slots[at] {
                Slot::Position(_) => bad_position = bad_position.or(Some((index, value))),
                Slot::Unused => {}
                Slot::Normal(_) | Slot::Uv(_) | Slot::Color(..) => n_bad += 1,
            }
            return;
        }
        match slots[at] {
            Slot::Position(axis) => vertex.position[axis] = number,
            Slot::Normal(axis) if has_normals => vertex.normal[axis] = number,
            // The picture stands upright: t grows upwards in the file and downwards in the scene.
            Slot::Uv(0) if has_uv => vertex.uv[0].x = number,
            Slot::Uv(_) if has_uv => vertex.uv[0].y = 1.0 - number,
            Slot::Color(3, full) => vertex.color.w = ((value / full) as f32).clamp(0.0, 1.0),
            Slot::Color(channel, full) if has_colors => vertex.color[channel] = polygon::linear((value / full) as f32),
            _ => {}
        }
    };
    body.read(element, set, |_, _, _, _| Ok(()))?;
    if let Some((index, value)) = bad_position {
        return Err(Fault::invalid(format_args!("element vertex {index}"), format_args!("the position {value:e} is not finite")));
    }
    vertices.iter_mut().for_each(|vertex| {
        vertex.uv[0] = if vertex.uv[0].is_finite() { vertex.uv[0] } else { Vec2::ZERO };
        vertex.uv[1] = vertex.uv[0];
    });
    if n_bad > 0 {
        warnings.push(format!("{n_bad} numbers of normals, texture coordinates or colours are not finite and become zero"));
    }
    Ok(has_normals)
}

/// Appends the corners of all faces.
fn read_faces(
    element: &Element,
    body: &mut Body<'_>,
    n_vertices: usize,
    faces: &mut Corners,
    tally: &mut Tally,
    warnings: &mut Warnings,
) -> Result<(), Fault> {
    let is_corners = |name: &str| matches!(name, "vertex_indices" | "vertex_index");
    let at = element.properties.iter().position(|property| property.length.is_some() && is_corners(&property.name));
    let at = at.ok_or_else(|| Fault::invalid("header", "the element 'face' has no list 'vertex_indices'"))?;
    if element.properties[at].number.is_float() {
        return Err(Fault::invalid("header", "the list 'vertex_indices' is not of integers"));
    }
    for (_, property) in element.properties.iter().enumerate().filter(|(index, _)| *index != at) {
        warnings.push(format!("the property '{}' of 'face' is skipped", property.name));
    }
    body.read(
        element,
        |_, _, _| {},
        |_, property, values, _| {
            if property != at {
                return Ok(());
            }
            let start = faces.corners.len();
            for value in values {
                if !(value >= 0.0 && value < n_vertices as f64) {
                    return Err(format!("vertex {value} does not exist, there are {n_vertices}"));
                }
                // Whole, not negative and less than a count that fits.
                faces.corners.push(value as u32);
            }
            faces.ends.push(faces.corners.len());
            tally.polygon(faces.corners.len() - start).map_err(|_| format!("there are more than {} triangles", limits::TRIANGLES))
        },
    )
}
