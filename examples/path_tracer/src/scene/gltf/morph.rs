//! Morph targets: displacements of vertices, weighted and added.
//!
//! Key decision: targets are read one after the other and only when their weight is not zero, so a face with a hundred targets costs no
//! more memory than one. Directions are normalised once, after all displacements.
//!
//! Source: glTF 2.0 specification, section 3.7.2.2.

use std::collections::BTreeMap;

use glam::{Vec2, Vec4};
use serde_json::Value;

use super::Warnings;
use super::accessor::Accessors;
use super::animation::Pose;
use super::json::{self, Document};
use super::mesh::{Budget, perpendicular};
use crate::error::Fault;
use crate::scene::Vertex;

/// The weights of a node's morph targets up to the last that is not zero: those of the pose, of the node, of the mesh, or none.
pub(super) fn weights(document: &Document, node: usize, mesh: usize, pose: &Pose, warnings: &mut Warnings) -> Result<Vec<f32>, Fault> {
    let Some(mesh) = document.meshes.get(mesh) else { return Ok(Vec::new()) };
    // All primitives of a mesh have the same targets.
    let n_targets = mesh.primitives.first().map_or(0, |primitive| primitive.targets.len());
    let own = &document.nodes[node].weights;
    let rest = if own.is_empty() { &mesh.weights } else { own };
    let mut weights = pose.of(node).and_then(|moved| moved.weights.as_ref()).unwrap_or(rest).clone();
    if !weights.is_empty() && weights.len() != n_targets {
        warnings.push(format!("node {node}: {} weights for {n_targets} morph targets; missing ones are 0", weights.len()));
    }
    if let Some(weight) = weights.iter().find(|weight| !weight.is_finite()) {
        return Err(Fault::invalid("weights", format_args!("{weight} is not finite")));
    }
    // Zeros at the end say nothing; without them equal lists are equal, however long they were.
    weights.truncate(n_targets);
    while weights.last() == Some(&0.0) {
        weights.pop();
    }
    Ok(weights)
}

/// Which numbers of a vertex a target moves: the attributes that the primitive itself has.
#[derive(Clone, Copy)]
pub(super) struct Moves {
    pub(super) normals: bool,
    pub(super) tangents: bool,
    /// False when the second set of texture coordinates is a copy of the first.
    pub(super) second_uv: bool,
}

/// Adds the displacements to the vertices.
pub(super) fn apply(
    vertices: &mut [Vertex],
    targets: &[Value],
    weights: &[f32],
    moves: Moves,
    accessors: &Accessors<'_>,
    budget: &mut Budget,
) -> Result<(), Fault> {
    let mut any = false;
    for (number, (target, &weight)) in targets.iter().zip(weights).enumerate().filter(|(_, (_, weight))| **weight != 0.0) {
        budget.spend(vertices.len(), 0)?;
        any = true;
        add(vertices, target, weight, moves, accessors).map_err(|f| f.within(format_args!("target {number}")))?;
    }
    if !any {
        return Ok(());
    }
    for vertex in vertices.iter_mut() {
        if moves.normals {
            vertex.normal = vertex.normal.normalize_or_zero();
        }
        if moves.tangents {
            let tangent = vertex.tangent.truncate().normalize_or(perpendicular(vertex.normal));
            vertex.tangent = tangent.extend(vertex.tangent.w);
        }
        vertex.color = vertex.color.max(Vec4::ZERO);
    }
    let whole = |vertex: &Vertex| {
        let directions = vertex.normal.is_finite() && vertex.tangent.is_finite();
        vertex.position.is_finite() && directions && vertex.uv.iter().all(|uv| uv.is_finite()) && vertex.color.is_finite()
    };
    match vertices.iter().position(|vertex| !whole(vertex)) {
        Some(index) => Err(Fault::invalid("targets", format_args!("vertex {index} is not finite after the displacement"))),
        None => Ok(()),
    }
}

fn add(vertices: &mut [Vertex], target: &Value, weight: f32, moves: Moves, accessors: &Accessors<'_>) -> Result<(), Fault> {
    let attributes: BTreeMap<String, usize> = json::part(target)?;
    let mut each = |name: &str, widths: &[usize], add: &mut dyn FnMut(&mut Vertex, Vec4)| -> Result<(), Fault> {
        let Some(&index) = attributes.get(name) else { return Ok(()) };
        let table = accessors.table(index, widths).map_err(|f| f.within(name))?;
        if table.len() != vertices.len() {
            let what = format!("{} elements for {} positions", table.len(), vertices.len());
            return Err(Fault::invalid(format_args!("{name}, accessor {index}"), what));
        }
        for (vertex, row) in vertices.iter_mut().zip(table.rows([0.0; 4])) {
            add(vertex, Vec4::from_array(row) * weight);
        }
        Ok(())
    };
    each("POSITION", &[3], &mut |vertex, d| vertex.position += d.truncate())?;
    if moves.normals {
        each("NORMAL", &[3], &mut |vertex, d| vertex.normal += d.truncate())?;
    }
    if moves.tangents {
        each("TANGENT", &[3], &mut |vertex, d| vertex.tangent += d.truncate().extend(0.0))?;
    }
    each("TEXCOORD_0", &[2], &mut |vertex, d| {
        vertex.uv[0] += Vec2::new(d.x, d.y);
        if !moves.second_uv {
            vertex.uv[1] = vertex.uv[0];
        }
    })?;
    if moves.second_uv {
        each("TEXCOORD_1", &[2], &mut |vertex, d| vertex.uv[1] += Vec2::new(d.x, d.y))?;
    }
    each("COLOR_0", &[3, 4], &mut |vertex, d| vertex.color += d)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: another order of the three sources of weights, and a list that is longer or shorter than that of the targets.
    #[test]
    fn weights_come_from_the_animation_then_the_node_then_the_mesh() {
        let document = |node: &str, mesh: &str| -> Document {
            let text = format!(r#"{{"nodes":[{{"mesh":0{node}}}],"meshes":[{{"primitives":[{{"targets":[{{}},{{}}]}}]{mesh}}}]}}"#);
            serde_json::from_str(&text).unwrap()
        };
        let read = |document: &Document, pose: &Pose| weights(document, 0, 0, pose, &mut Warnings::default()).unwrap();
        let (node, mesh) = (r#","weights":[0.25,0.5]"#, r#","weights":[1,2]"#);
        assert!(read(&document("", ""), &Pose::default()).is_empty());
        assert_eq!(read(&document("", mesh), &Pose::default()), [1.0, 2.0]);
        assert_eq!(read(&document(node, mesh), &Pose::default()), [0.25, 0.5]);
        assert_eq!(read(&document(node, mesh), &Pose::of_weights(0, vec![9.0])), [9.0]);
        assert_eq!(read(&document("", mesh), &Pose::of_weights(0, vec![9.0, 8.0, 7.0])), [9.0, 8.0]);
    }
}
