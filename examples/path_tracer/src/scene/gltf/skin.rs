//! Skinned meshes: every vertex follows a weighted mixture of joints.
//!
//! Key decision: the matrices of a vertex are mixed first and the vertex is moved once (linear blend skinning, which the format asks for).
//! The result is in the world already; the transform of the node that carries the mesh has no say.
//!
//! **Invariant:** the weights of a vertex add up to one, whatever the file's rounding.
//!
//! Source: glTF 2.0 specification, section 3.7.3.

use glam::DMat4;
use serde::Deserialize;

use super::Warnings;
use super::accessor::Accessors;
use super::json::{self, Document};
use super::nodes::Graph;
use crate::error::Fault;

/// Sets of four joints that a vertex may have.
const JOINT_SETS: usize = 16;

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Source {
    inverse_bind_matrices: Option<usize>,
    joints: Vec<usize>,
}

/// Where each joint takes what is bound to it.
pub(super) struct Skin {
    world_from_bind: Vec<DMat4>,
}

impl Skin {
    /// Reads a skin in the pose of the graph.
    pub(super) fn read(document: &Document, index: usize, accessors: &Accessors<'_>, graph: &Graph) -> Result<Skin, Fault> {
        let place = || format!("skin {index}");
        let source = document.skins.get(index).ok_or_else(|| Fault::invalid(place(), "it does not exist"))?;
        let source: Source = json::part(source).map_err(|f| f.within(place()))?;
        let inverse_bind = match source.inverse_bind_matrices {
            Some(accessor) => Some(accessors.table(accessor, &[16]).map_err(|f| f.within("inverseBindMatrices").within(place()))?),
            None => None,
        };
        if let Some(table) = inverse_bind.as_ref().filter(|table| table.len() < source.joints.len()) {
            let what = format!("{} matrices for {} joints", table.len(), source.joints.len());
            return Err(Fault::invalid(place(), what));
        }
        let mut world_from_bind = Vec::with_capacity(source.joints.len());
        for (number, &joint) in source.joints.iter().enumerate() {
            let world_from_joint = graph.world_from_node(joint).map_err(|f| f.within(format_args!("joint {number}")).within(place()))?;
            let joint_from_bind = match &inverse_bind {
                Some(table) => DMat4::from_cols_array(&table.row(number, [0.0; 16]).map(f64::from)),
                None => DMat4::IDENTITY,
            };
            let matrix = world_from_joint * joint_from_bind;
            if !matrix.is_finite() {
                return Err(Fault::invalid(place(), format_args!("the matrix of joint {number} is not finite")));
            }
            world_from_bind.push(matrix);
        }
        Ok(Skin { world_from_bind })
    }

    /// The matrix of every vertex of the file's primitive; `None` when it is not bound to joints.
    pub(super) fn mix(
        &self,
        primitive: &json::Primitive,
        accessors: &Accessors<'_>,
        place: &str,
        warnings: &mut Warnings,
    ) -> Result<Option<Vec<DMat4>>, Fault> {
        let n_sets = (0..).take_while(|set| primitive.attributes.contains_key(&format!("JOINTS_{set}"))).count();
        if n_sets == 0 {
            warnings.push(format!("{place}: it has no joints for its skin and stays where its node is"));
            return Ok(None);
        }
        if n_sets > JOINT_SETS {
            return Err(Fault::unsupported("JOINTS", format_args!("a vertex with {n_sets} sets of joints (at most {JOINT_SETS})")));
        }
        // What is shown has positions, and their number was checked when the mesh was read.
        let n_vertices = primitive.attributes.get("POSITION").map_or(Ok(0), |&position| accessors.count(position))?;
        let mut mixed = vec![DMat4::ZERO; n_vertices];
        let mut sums = vec![0.0; n_vertices];
        let mut first_joints = Vec::new();
        for set in 0..n_sets {
            let table = |name: &str| {
                let name = format!("{name}_{set}");
                let missing = || Fault::invalid(&name, "it does not exist");
                let index = *primitive.attributes.get(&name).ok_or_else(missing)?;
                accessors.table(index, &[4]).map_err(|f| f.within(&name))
            };
            let (joints, weights) = (table("JOINTS")?, table("WEIGHTS")?);
            if set == 0 {
                first_joints = joints.rows([0.0; 4]).map(|[joint, ..]| joint).collect();
            }
            if joints.len() != mixed.len() || weights.len() != mixed.len() {
                let what = format!("{} joints and {} weights for {} vertices", joints.len(), weights.len(), mixed.len());
                return Err(Fault::invalid(format_args!("JOINTS_{set}"), what));
            }
            for (vertex, (joints, weights)) in joints.rows([0.0; 4]).zip(weights.rows([0.0; 4])).enumerate() {
                for (joint, weight) in joints.into_iter().zip(weights).filter(|&(_, weight)| weight > 0.0 && weight.is_finite()) {
                    let weight = f64::from(weight);
                    mixed[vertex] += self.joint(joint, vertex)? * weight;
                    sums[vertex] += weight;
                }
            }
        }
        let mut n_loose = 0usize;
        for (vertex, ((matrix, &sum), &first)) in mixed.iter_mut().zip(&sums).zip(&first_joints).enumerate() {
            if sum > 0.0 {
                *matrix *= 1.0 / sum;
            } else {
                n_loose += 1;
                *matrix = self.joint(first, vertex)?;
            }
        }
        if n_loose > 0 {
            warnings.push(format!("{place}: {n_loose} vertices without a weight follow their first joint"));
        }
        Ok(Some(mixed))
    }

    /// Joints are small integers, which `f32` holds exactly.
    fn joint(&self, joint: f32, vertex: usize) -> Result<DMat4, Fault> {
        let missing = || {
            let what = format!("vertex {vertex} follows joint {joint}, there are {}", self.world_from_bind.len());
            Fault::invalid("JOINTS", what)
        };
        let index = if joint >= 0.0 && joint.fract() == 0.0 { joint as usize } else { usize::MAX };
        self.world_from_bind.get(index).copied().ok_or_else(missing)
    }
}
