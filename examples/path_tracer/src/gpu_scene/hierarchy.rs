//! The bounding volume hierarchy over the packed triangles.
//!
//! Key decision: `obvhs` builds it; the triangles are put in the order of its leaves so that a leaf is a range. [`nodes`](super::nodes) packs
//! it. The depth is measured here and becomes the size of the kernel's stack. Where many triangles lie in one place, a tree by surface areas
//! degenerates into a list; then the triangles are halved by their places instead, which is slower to walk and never deep.
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
/// A stack of this size is kept in registers.
pub const SHORT_STACK: u32 = 8;
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
    /// When there are more nodes than an index holds, or the tree is too deep for the stack.
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
        let (mut nodes, mut order) = (built.nodes, built.primitive_indices);
        if depth(&nodes) > STACK_LIMIT {
            (nodes, order) = halved(corners);
        }
        let root = nodes.first().map_or(NONE, word);
        let depth = depth(&nodes);
        if depth > STACK_LIMIT {
            return Err(Error::TooDeep { depth, limit: STACK_LIMIT });
        }
        Ok(Hierarchy { nodes, order, root, depth })
    }
}

/// A tree whose inner nodes have half of their triangles on each side, along the longest axis of their middles; of 2^28 triangles it is 28
/// deep, wherever they lie.
fn halved(corners: &[[Vec3; 3]]) -> (Vec<Bvh2Node>, Vec<u32>) {
    // Halves before the sum, because corners may lie at the end of the number range.
    let middle = |triangle: u32| {
        let [a, b, c] = corners[triangle as usize];
        0.5 * a.min(b).min(c) + 0.5 * a.max(b).max(c)
    };
    let mut order: Vec<u32> = (0..corners.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut open = vec![(0usize, 0usize, corners.len())];
    while let Some((node, begin, end)) = open.pop() {
        let part = &mut order[begin..end];
        let around = |(min, max): (Vec3, Vec3), point: Vec3| (min.min(point), max.max(point));
        let nothing = (Vec3::MAX, Vec3::MIN);
        let (min, max) = part.iter().flat_map(|&triangle| corners[triangle as usize]).fold(nothing, around);
        let (first_index, prim_count) = if part.len() <= LEAF_LIMIT as usize {
            (begin, part.len())
        } else {
            let (low, high) = part.iter().map(|&triangle| middle(triangle)).fold(nothing, around);
            let axis = (0.5 * high - 0.5 * low).max_position();
            let half = part.len() / 2;
            part.select_nth_unstable_by(half, |&a, &b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(&b)));
            let children = nodes.len();
            nodes.extend([Bvh2Node::default(); 2]);
            open.extend([(children, begin, begin + half), (children + 1, begin + half, end)]);
            (children, 0)
        };
        nodes[node] = Bvh2Node { min, max, prim_count: prim_count as u32, first_index: first_index as u32 };
    }
    (nodes, order)
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

    // Kills: a scene that is refused because many of its triangles lie in one place; boxes that do not hold what is below them, halves that
    // lose or repeat a triangle, a root that is taken for a leaf.
    #[test]
    fn triangles_in_one_place_are_halved() {
        for count in [500, 3000] {
            let mut corners = vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; count];
            corners.extend(row_of_triangles(20));
            let hierarchy = Hierarchy::build(&corners).expect("halved");
            assert!(hierarchy.depth <= STACK_LIMIT, "{}", hierarchy.depth);
            let (nodes, mut order) = halved(&corners);
            assert!(depth(&nodes) <= 10 && (nodes[0].prim_count, nodes[0].first_index) == (0, 1));
            for node in &nodes {
                let holds = |min: Vec3, max: Vec3| node.min.cmple(min).all() && node.max.cmpge(max).all();
                let first = node.first_index as usize;
                match node.prim_count as usize {
                    0 => assert!(nodes[first..first + 2].iter().all(|child| holds(child.min, child.max))),
                    n => {
                        assert!(n <= LEAF_LIMIT as usize);
                        let inside = order[first..first + n].iter().flat_map(|&triangle| corners[triangle as usize]);
                        inside.for_each(|corner| assert!(holds(corner, corner)));
                    }
                }
            }
            order.sort_unstable();
            assert!(order.iter().copied().eq(0..corners.len() as u32));
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
