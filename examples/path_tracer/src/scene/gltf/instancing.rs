//! EXT_mesh_gpu_instancing: many copies of a node's mesh, each with a place of its own.
//!
//! Key decision: the copies are made one by one while they are baked; only the three tables of the file are held.

use std::collections::BTreeMap;

use glam::{DMat4, DQuat, DVec3};
use serde::Deserialize;

use super::Warnings;
use super::accessor::{Accessors, Table};
use super::json::{Node, extension};
use crate::error::Fault;

const NAME: &str = "EXT_mesh_gpu_instancing";

#[derive(Default, Deserialize)]
#[serde(default)]
struct Source {
    attributes: BTreeMap<String, usize>,
}

/// The transforms of the copies, relative to their node.
pub(super) struct Instances {
    count: usize,
    translations: Option<Table>,
    rotations: Option<Table>,
    scales: Option<Table>,
}

/// How many copies the node has, before their tables are read; `None` for a node without the extension.
pub(super) fn count(node: &Node, accessors: &Accessors<'_>) -> Result<Option<usize>, Fault> {
    let Some(source) = extension::<Source>(&node.extensions, NAME)? else { return Ok(None) };
    let Some((name, &first)) = source.attributes.iter().next() else { return Ok(None) };
    accessors.count(first).map(Some).map_err(|f| f.within(format_args!("{NAME}, {name}")))
}

/// The copies of a node; `None` for a node without the extension.
pub(super) fn read(node: &Node, place: &str, accessors: &Accessors<'_>, warnings: &mut Warnings) -> Result<Option<Instances>, Fault> {
    let Some(count) = count(node, accessors)? else { return Ok(None) };
    let source = extension::<Source>(&node.extensions, NAME)?.unwrap_or_default();
    for name in source.attributes.keys().filter(|name| !["TRANSLATION", "ROTATION", "SCALE"].contains(&name.as_str())) {
        warnings.push(format!("{place}: the attribute {name} of its instances is left out"));
    }
    let table = |name: &str, width: usize| -> Result<Option<Table>, Fault> {
        let Some(&index) = source.attributes.get(name) else { return Ok(None) };
        let outer = |f: Fault| f.within(format_args!("{NAME}, {name}"));
        let table = accessors.table(index, &[width]).map_err(outer)?;
        if table.len() != count {
            return Err(outer(Fault::invalid(format_args!("accessor {index}"), format_args!("{} elements, not {count}", table.len()))));
        }
        Ok(Some(table))
    };
    Ok(Some(Instances { count, translations: table("TRANSLATION", 3)?, rotations: table("ROTATION", 4)?, scales: table("SCALE", 3)? }))
}

impl Instances {
    /// The transforms, in order.
    pub(super) fn transforms(&self) -> impl Iterator<Item = DMat4> + '_ {
        let vector = |table: &Option<Table>, index: usize, fill: DVec3| match table {
            Some(table) => DVec3::from_array(table.row(index, [0.0; 3]).map(f64::from)),
            None => fill,
        };
        (0..self.count).map(move |index| {
            let rotation = match &self.rotations {
                Some(table) => DQuat::from_array(table.row(index, [0.0; 4]).map(f64::from)),
                None => DQuat::IDENTITY,
            };
            // Rotations may be normalized integers, whose length is only nearly one.
            let rotation = if rotation.length() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
            let translation = vector(&self.translations, index, DVec3::ZERO);
            DMat4::from_scale_rotation_translation(vector(&self.scales, index, DVec3::ONE), rotation, translation)
        })
    }
}
