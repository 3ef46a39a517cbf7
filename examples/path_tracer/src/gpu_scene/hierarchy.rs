//! The bounding volume hierarchy over the packed triangles.
//!
//! Key decision: `obvhs` builds it; the triangles are put in the order of its leaves so that a leaf is a range. [`nodes`](super::nodes) packs it. The depth is measured here and becomes the size of the kernel's stack.
//!
//! **Invariant:** a walk that pushes one child per inner node never holds more than [`Hierarchy::depth`] entries.

use glam::Vec3;
use obvhs::{
    BvhBuildParams,
    bvh2::{builder::build_bvh2_from_tris, node::Bvh2Node},
    triangle::Triangle,
};

use super::{error::Error, nodes::word, records::NONE};

/// The deepest stack that a kernel is given.
pub const STACK_LIMIT: u32 = 64;
/// A node on its way through the kernel keeps its count in four bits.
const LEAF_LIMIT: u32 = 8;
const FIRST_LIMIT: u32 = 1 << 28;

/// A hierarchy and the order in which it wants the triangles.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    /// Children of an inner node are neighbours.
    pub nodes: Vec<Bvh2Node>,
    /// Which triangle is in which slot.
    pub order: Vec<u32>,
    /// The root in the kernel's form: first in the low 28 bits, count in the high 4.
    pub root: u32,
    /// Inner nodes on the longest way down.
    pub depth: u32,
}

impl Hierarchy {
    /// Over triangles given by their corners.
    ///
    /// # Errors
    /// When there are more nodes than an index holds or the tree is too deep for the stack.
    pub fn build(corners: &[[Vec3; 3]]) -> Result<Hierarchy, Error> {
        if corners.is_empty() {
            return Ok(Hierarchy { root: NONE, ..Hierarchy::default() });
        }
        if corners.len() as u64 * 2 >= u64::from(FIRST_LIMIT) {
            return Err(Error::TooMany { what: "triangles", count: corners.len() as u64, limit: u64::from(FIRST_LIMIT / 2) });
        }
        let triangles: Vec<Triangle> =
            corners.iter().map(|[a, b, c]| Triangle { v0: (*a).into(), v1: (*b).into(), v2: (*c).into() }).collect();
        let parameters = BvhBuildParams { max_prims_per_leaf: LEAF_LIMIT, ..BvhBuildParams::medium_build() };
        let built = build_bvh2_from_tris(&triangles, parameters, &mut std::time::Duration::default());
        let root = built.nodes.first().map_or(NONE, word);
        let depth = depth(&built.nodes);
        if depth > STACK_LIMIT {
            return Err(Error::TooDeep { depth, limit: STACK_LIMIT });
        }
        Ok(Hierarchy { nodes: built.nodes, order: built.primitive_indices, root, depth })
    }
}

/// Inner nodes on the longest way from the root.
fn depth(nodes: &[Bvh2Node]) -> u32 {
    let mut deepest = 0;
    let mut open = vec![(0u32, 0u32)];
    while let Some((index, above)) = open.pop() {
        match nodes.get(index as usize) {
            Some(node) if !node.is_leaf() => {
                deepest = deepest.max(above + 1);
                open.push((node.first_index, above + 1));
                open.push((node.first_index + 1, above + 1));
            }
            _ => {}
        }
    }
    deepest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row_of_triangles(count: usize) -> Vec<[Vec3; 3]> {
        (0..count).map(|i| [Vec3::X, Vec3::Y, Vec3::Z].map(|corner| corner * 0.1 + Vec3::splat(i as f32 / count as f32))).collect()
    }

    // Kills: a leaf that lists a triangle twice or never, a leaf too large for its four bits, a stack one short.
    #[test]
    fn every_triangle_is_in_one_leaf() {
        for count in [1, 2, 3, 9, 1000] {
            let hierarchy = Hierarchy::build(&row_of_triangles(count)).expect("a small scene");
            let mut seen = vec![0; count];
            for node in hierarchy.nodes.iter().filter(|node| node.is_leaf()) {
                assert!(node.prim_count <= LEAF_LIMIT);
                for slot in node.first_index..node.first_index + node.prim_count {
                    seen[hierarchy.order[slot as usize] as usize] += 1;
                }
            }
            assert!(seen.iter().all(|&times| times == 1), "{count}: {seen:?}");
            assert_eq!(walk_height(&hierarchy), hierarchy.depth);
        }
    }

    /// The highest stack of a walk that always pushes one child and descends into the deeper one.
    fn walk_height(hierarchy: &Hierarchy) -> u32 {
        fn height(nodes: &[Bvh2Node], index: usize) -> u32 {
            let node = nodes[index];
            let first = node.first_index as usize;
            if node.is_leaf() { 0 } else { 1 + height(nodes, first).max(height(nodes, first + 1)) }
        }
        height(&hierarchy.nodes, 0)
    }

    // Kills: a root read from a hierarchy without nodes.
    #[test]
    fn nothing_has_no_root() {
        assert_eq!(Hierarchy::build(&[]).expect("nothing").root, NONE);
    }
}
