//! The node graph: which nodes a scene shows and where they stand in the world.
//!
//! Key decision: parents are counted before anything is visited. A graph where every node has one parent at most and every node hangs
//! below a root is a forest, so the walk needs neither marks nor a depth limit, and its stack lives on the heap.

use std::collections::HashSet;

use glam::{DMat4, DQuat, DVec3};

use super::Warnings;
use super::animation::Pose;
use super::json::Document;
use crate::error::Fault;

/// A node that is shown.
pub(super) struct Placed {
    pub(super) node: usize,
    pub(super) world_from_node: DMat4,
}

/// The nodes of a file in a pose.
pub(super) struct Graph {
    /// The nodes of the scene that the file asks for, parents first.
    pub(super) placed: Vec<Placed>,
    /// For each node of the file, shown or not: joints may hang outside of the scene.
    worlds: Vec<DMat4>,
}

impl Graph {
    /// Where a node stands, shown or not.
    pub(super) fn world_from_node(&self, node: usize) -> Result<DMat4, Fault> {
        self.worlds.get(node).copied().ok_or_else(|| Fault::invalid(format_args!("node {node}"), "it does not exist"))
    }
}

/// Puts the nodes of the scene that the file asks for into the world.
pub(super) fn place(document: &Document, pose: &Pose, warnings: &mut Warnings) -> Result<Graph, Fault> {
    let parents = parents(document)?;
    let all_roots = || (0..document.nodes.len()).filter(|&n| parents[n].is_none());
    let roots: Vec<usize> = match (document.scene.unwrap_or(0), document.scenes.is_empty()) {
        (0, true) if document.scene.is_none() => all_roots().collect(),
        (scene, _) => scene_roots(document, scene, &parents)?,
    };
    let mut worlds = vec![DMat4::IDENTITY; document.nodes.len()];
    let mut walk = |roots: &[usize], visit: &mut dyn FnMut(usize, DMat4) -> Result<(), Fault>, warnings: &mut Warnings| {
        let mut open: Vec<(usize, DMat4)> = roots.iter().rev().map(|&root| (root, DMat4::IDENTITY)).collect();
        while let Some((index, world_from_parent)) = open.pop() {
            let world_from_node = world_from_parent * local(document, index, pose, warnings);
            worlds[index] = world_from_node;
            visit(index, world_from_node)?;
            open.extend(document.nodes[index].children.iter().rev().map(|&child| (child, world_from_node)));
        }
        Ok(())
    };
    let mut placed = Vec::new();
    let mut show = |node: usize, world_from_node: DMat4| {
        if !world_from_node.is_finite() {
            return Err(Fault::invalid(format_args!("node {node}"), "the transform is not finite"));
        }
        placed.push(Placed { node, world_from_node });
        Ok(())
    };
    walk(&roots, &mut show, warnings)?;
    // A scene shows whole trees, so what is left are whole trees too.
    let is_shown: HashSet<usize> = roots.into_iter().collect();
    let hidden: Vec<usize> = all_roots().filter(|root| !is_shown.contains(root)).collect();
    walk(&hidden, &mut |_, _| Ok(()), &mut Warnings::default())?;
    Ok(Graph { placed, worlds })
}

fn scene_roots(document: &Document, scene: usize, parents: &[Option<usize>]) -> Result<Vec<usize>, Fault> {
    let place = format!("scene {scene}");
    let list = document.scenes.get(scene).ok_or_else(|| Fault::invalid(&place, "it does not exist"))?;
    let mut roots = list.nodes.clone();
    for &root in &roots {
        match parents.get(root) {
            None => return Err(Fault::invalid(place, format_args!("node {root} does not exist"))),
            Some(Some(parent)) => return Err(Fault::invalid(place, format_args!("node {root} is a child of node {parent}"))),
            Some(None) => {}
        }
    }
    roots.sort_unstable();
    if let Some(pair) = roots.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Fault::invalid(place, format_args!("node {} is listed twice", pair[0])));
    }
    Ok(list.nodes.clone())
}

/// The parent of each node, after the check that the graph is a forest.
fn parents(document: &Document) -> Result<Vec<Option<usize>>, Fault> {
    let mut parents = vec![None; document.nodes.len()];
    for (index, node) in document.nodes.iter().enumerate() {
        for &child in &node.children {
            let place = format!("node {index}");
            match parents.get_mut(child) {
                None => return Err(Fault::invalid(place, format_args!("child {child} does not exist"))),
                Some(Some(other)) => {
                    return Err(Fault::invalid(place, format_args!("child {child} is a child of node {other} already")));
                }
                Some(parent) => *parent = Some(index),
            }
        }
    }
    // Nodes on a cycle have a parent each and hang below no root: those that the walk from the roots misses.
    let mut reached = vec![false; document.nodes.len()];
    let mut open: Vec<usize> = (0..parents.len()).filter(|&n| parents[n].is_none()).collect();
    while let Some(index) = open.pop() {
        reached[index] = true;
        open.extend(&document.nodes[index].children);
    }
    match reached.iter().position(|&reached| !reached) {
        Some(index) => Err(Fault::invalid(format_args!("node {index}"), "it is its own ancestor, or hangs below such a node")),
        None => Ok(parents),
    }
}

/// The transform of a node relative to its parent; what the pose says replaces what the file says.
fn local(document: &Document, index: usize, pose: &Pose, warnings: &mut Warnings) -> DMat4 {
    let node = &document.nodes[index];
    let moved = pose.of(index).cloned().unwrap_or_default();
    if let Some(matrix) = &node.matrix {
        if moved.translation.is_some() || moved.rotation.is_some() || moved.scale.is_some() {
            warnings.push(format!("node {index}: it has a matrix, so its animation is left out"));
        }
        return DMat4::from_cols_array(matrix);
    }
    let translation = moved.translation.or(node.translation.map(DVec3::from_array)).unwrap_or(DVec3::ZERO);
    let scale = moved.scale.or(node.scale.map(DVec3::from_array)).unwrap_or(DVec3::ONE);
    let rotation = moved.rotation.or(node.rotation.map(DQuat::from_array)).unwrap_or(DQuat::IDENTITY);
    let length = rotation.length();
    let rotation = if length > 0.0 && length.is_finite() {
        rotation / length
    } else {
        warnings.push(format!("node {index}: the rotation has no length and is left out"));
        DQuat::IDENTITY
    };
    DMat4::from_scale_rotation_translation(scale, rotation, translation)
}

#[cfg(test)]
mod tests {
    use super::super::container::parse;
    use super::*;

    fn placed(nodes: &str) -> Result<Vec<Placed>, Fault> {
        let text = format!(r#"{{"asset":{{"version":"2.0"}},{nodes}}}"#);
        place(&parse(text.as_bytes())?, &Pose::default(), &mut Warnings::default()).map(|graph| graph.placed)
    }

    // Kills: a walk that never ends on a cycle, and one that shows a shared child twice.
    #[test]
    fn only_forests_are_shown() {
        assert!(placed(r#""nodes":[{"children":[1]},{"children":[0]}]"#).is_err(), "cycle");
        assert!(placed(r#""nodes":[{"children":[0]}]"#).is_err(), "self");
        assert!(placed(r#""nodes":[{"children":[2]},{"children":[2]},{}]"#).is_err(), "two parents");
        assert!(placed(r#""nodes":[{"children":[1,1]},{}]"#).is_err(), "twice the same child");
        assert!(placed(r#""nodes":[{"children":[7]}]"#).is_err(), "out of range");
        assert!(placed(r#""scene":0,"scenes":[{"nodes":[0,0]}],"nodes":[{}]"#).is_err(), "root twice");
        assert!(placed(r#""scene":0,"scenes":[{"nodes":[1]}],"nodes":[{"children":[1]},{}]"#).is_err(), "root with a parent");
        assert!(placed(r#""scene":3,"nodes":[{}]"#).is_err(), "scene out of range");
    }

    // Kills: recursion, which overflows the stack on a chain like this one.
    #[test]
    fn depth_costs_no_stack() {
        let mut nodes = String::from(r#""nodes":["#);
        for child in 1..200_000 {
            nodes.push_str(&format!(r#"{{"children":[{child}]}},"#));
        }
        nodes.push_str("{}]");
        assert_eq!(placed(&nodes).unwrap().len(), 200_000);
    }

    // Kills: child before parent in the product, and a scale that is applied after the rotation.
    #[test]
    fn transforms_are_chained_from_the_root() {
        let nodes = r#""nodes":[{"children":[1],"translation":[1,0,0],"scale":[2,1,1]},{"rotation":[0,0,0.70710678,0.70710678]}]"#;
        let placed = placed(nodes).unwrap();
        let moved = placed[1].world_from_node.transform_point3(DVec3::new(0.0, -1.0, 0.0));
        assert!(moved.abs_diff_eq(DVec3::new(3.0, 0.0, 0.0), 1e-6), "{moved}");
    }

    // Kills: a joint outside of the scene that stands at the origin, or without its own parents.
    #[test]
    fn hidden_nodes_stand_somewhere_too() {
        let nodes = r#""scene":0,"scenes":[{"nodes":[0]}],
            "nodes":[{},{"children":[2],"translation":[1,0,0]},{"translation":[0,2,0]}]"#;
        let text = format!(r#"{{"asset":{{"version":"2.0"}},{nodes}}}"#);
        let graph = place(&parse(text.as_bytes()).unwrap(), &Pose::default(), &mut Warnings::default()).unwrap();
        assert_eq!(graph.placed.len(), 1);
        assert_eq!(graph.world_from_node(2).unwrap().w_axis.truncate(), DVec3::new(1.0, 2.0, 0.0));
        assert!(graph.world_from_node(3).is_err());
    }

    // Kills: showing every node although the file names a scene, and nothing when it names none.
    #[test]
    fn the_default_scene_is_chosen() {
        let count = |text: &str| placed(text).unwrap().len();
        assert_eq!(count(r#""nodes":[{},{"children":[2]},{}]"#), 3);
        assert_eq!(count(r#""scenes":[{"nodes":[0]},{"nodes":[0,1]}],"nodes":[{},{}]"#), 1);
        assert_eq!(count(r#""scene":1,"scenes":[{"nodes":[0]},{"nodes":[0,1]}],"nodes":[{},{}]"#), 2);
    }
}
