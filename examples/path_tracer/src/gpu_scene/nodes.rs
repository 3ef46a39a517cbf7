//! The nodes of a hierarchy as the kernels read them.
//!
//! Key decision: corners of boxes are rounded outward to a grid of 16 bits over the normalised scene, so that a node is one row instead of
//! two: what a walk costs is mostly what it reads. Where the grid is too coarse (a village on a plain of a thousand times its size) the
//! walk would enter too many boxes, and the corners stay as they are; which it is, the areas of all boxes decide.
//!
//! **Invariant:** a box on the grid holds the exact one with at least a quarter of a cell around it, as the module `bvh_node` needs.

use glam::DVec3;
use obvhs::bvh2::node::Bvh2Node;

/// Cells per unit of normalised length: a little less than half of 2^16, so that corners at 1 have room around them.
pub const GRID_CELLS: u32 = 32512;
/// The cell of the origin.
pub const GRID_HALF: u32 = 32768;
/// Cells that lie between a box and its rounded one on each side, at least.
const PAD: f64 = 0.25;
/// The grid is fine enough when this part of the rays that enter a box on it would have entered the exact one: more boxes are entered then,
/// each for half of what it cost to read.
const LEAST_AIM: f64 = 0.75;

/// Rows of the buffer of nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeRows {
    /// One row per node when compact, two otherwise.
    pub rows: Vec<[u32; 4]>,
    /// True when corners lie on the grid.
    pub is_compact: bool,
}

/// A node in one word: first child or triangle in the low 28 bits, number of triangles in the high 4.
pub fn word(node: &Bvh2Node) -> u32 {
    node.first_index | node.prim_count << 28
}

/// Rounded outward to cells of the grid.
fn on_grid(node: &Bvh2Node) -> [[u32; 3]; 2] {
    let cell = |value: f32| f64::from(value) * f64::from(GRID_CELLS) + f64::from(GRID_HALF);
    [
        node.min.to_array().map(|value| (cell(value) - PAD).floor() as u32),
        node.max.to_array().map(|value| (cell(value) + PAD).ceil() as u32),
    ]
}

/// The chance that a ray through the rounded box of a node goes through the exact one, in the mean over all nodes; 1 without any. Nodes count
/// alike, whatever their size: rays are many where there is much to see.
fn aim(nodes: &[Bvh2Node]) -> f64 {
    let area = |size: DVec3| size.x * size.y + size.y * size.z + size.z * size.x;
    let chance = |node: &Bvh2Node| {
        let [low, high] = on_grid(node).map(|corner| DVec3::from(corner.map(f64::from)));
        area((node.max - node.min).as_dvec3() * f64::from(GRID_CELLS)) / area(high - low)
    };
    if nodes.is_empty() { 1.0 } else { nodes.iter().map(chance).sum::<f64>() / nodes.len() as f64 }
}

impl NodeRows {
    /// Packs the nodes of a hierarchy over corners in [-1, 1].
    pub fn pack(nodes: &[Bvh2Node]) -> NodeRows {
        if aim(nodes) >= LEAST_AIM { NodeRows::compact(nodes) } else { NodeRows::exact(nodes) }
    }

    fn compact(nodes: &[Bvh2Node]) -> NodeRows {
        // A word for each axis, so that a ray takes its near plane by one shift and its far plane by another.
        let row = |node: &Bvh2Node| {
            let [low, high] = on_grid(node);
            [low[0] | high[0] << 16, low[1] | high[1] << 16, low[2] | high[2] << 16, word(node)]
        };
        NodeRows { rows: nodes.iter().map(row).collect(), is_compact: true }
    }

    fn exact(nodes: &[Bvh2Node]) -> NodeRows {
        let rows = |node: &Bvh2Node| {
            let [[a, b, c], [d, e, f]] = [node.min, node.max].map(|corner| corner.to_array().map(f32::to_bits));
            [[a, b, c, 0], [d, e, f, word(node)]]
        };
        NodeRows { rows: nodes.iter().flat_map(rows).collect(), is_compact: false }
    }

    /// Numbers that the WGSL of compact nodes asks for.
    pub(crate) fn constants(&self) -> &'static [(&'static str, u32)] {
        if self.is_compact { &[("GRID_CELLS", GRID_CELLS), ("GRID_HALF", GRID_HALF)] } else { &[] }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::gpu_scene::hierarchy::Hierarchy;

    fn hierarchy(corners: impl Iterator<Item = [Vec3; 3]>) -> Hierarchy {
        Hierarchy::build(&corners.collect::<Vec<_>>()).expect("a small scene")
    }

    /// Triangles of about this size, strewn over a cube.
    fn strewn(count: usize, size: f32) -> Vec<[Vec3; 3]> {
        let place = |index: usize, step: usize| (index * step % 1021) as f32 / 1021.0 * 2.0 - 1.0;
        let corner = |index: usize| Vec3::new(place(index, 37), place(index, 411), place(index, 733)) * (1.0 - size);
        (0..count).map(|index| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|offset| corner(index) + offset * size)).collect()
    }

    // Kills: corners rounded to the nearest cell or inward, a pad that is left out on one side, a coordinate of 1 that wraps around.
    #[test]
    fn rounded_boxes_hold_the_exact_ones_with_a_pad() {
        let walls = [[Vec3::NEG_ONE, Vec3::ONE, Vec3::X], [Vec3::ONE, Vec3::NEG_ONE, Vec3::Y]];
        let hierarchy = hierarchy(walls.into_iter().chain(strewn(500, 0.01)));
        let packed = NodeRows::compact(&hierarchy.nodes);
        assert_eq!(packed.rows.len(), hierarchy.nodes.len());
        for (node, row) in hierarchy.nodes.iter().zip(&packed.rows) {
            let cells = [row[0] & 0xffff, row[1] & 0xffff, row[2] & 0xffff, row[0] >> 16, row[1] >> 16, row[2] >> 16];
            let plane = |cell: u32| (f64::from(cell) - f64::from(GRID_HALF)) / f64::from(GRID_CELLS);
            let (pad, most) = (PAD / f64::from(GRID_CELLS), (PAD + 1.0) / f64::from(GRID_CELLS));
            for axis in 0..3 {
                let below = f64::from(node.min[axis]) - plane(cells[axis]);
                let above = plane(cells[3 + axis]) - f64::from(node.max[axis]);
                assert!(below > pad * 0.999 && below < most * 1.001, "{below} below, axis {axis}");
                assert!(above > pad * 0.999 && above < most * 1.001, "{above} above, axis {axis}");
            }
            assert_eq!(row[3], node.first_index | node.prim_count << 28);
        }
    }

    /// Where a ray enters a compact box, as the WGSL has it, and whether it does.
    fn enters(row: &[u32; 4], origin: Vec3, direction: Vec3) -> bool {
        let cell = 1.0 / GRID_CELLS as f32;
        let smallest = f32::from_bits(0x0d80_0000);
        let replaced = |value: f32| if value.abs() < smallest { if value < 0.0 { -smallest } else { smallest } } else { value };
        let reciprocal = Vec3::from_array(direction.to_array().map(replaced)).recip();
        let (scale, offset) = (reciprocal * cell, (Vec3::splat(-(GRID_HALF as f32) * cell) - origin) * reciprocal);
        let near_shift = |axis: usize| if reciprocal[axis] < 0.0 { 16 } else { 0 };
        let plane = |axis: usize, shift: u32| (row[axis] >> shift & 0xffff) as f32 * scale[axis] + offset[axis];
        let bits = |t: f32| t.to_bits() as i32;
        let near = [0, 1, 2].map(|axis| bits(plane(axis, near_shift(axis)))).into_iter().fold(0, i32::max);
        let far = [0, 1, 2].map(|axis| bits(plane(axis, 16 - near_shift(axis)))).into_iter().fold(i32::MAX, i32::min);
        f32::from_bits(near as u32) <= f32::from_bits(far as u32) * 1.000_003_8
    }

    // Kills: a margin too small for an eye far away (162 of 2800 corners are missed without one), a plane on the wrong side of the grid.
    #[test]
    fn rays_at_corners_of_flat_boxes_enter() {
        let mut missed = [0, 0];
        for (index, corners) in strewn(400, 0.05).into_iter().enumerate() {
            let hierarchy = hierarchy([corners].into_iter());
            let row = NodeRows::compact(&hierarchy.nodes).rows[0];
            let target = corners[index % 3].as_dvec3();
            for (far, distance) in [1.5, 4.0, 8.0, 9.0, 30.0, 1e3, 1e6].into_iter().enumerate() {
                // From all sides; many in the plane of the box or nearly so.
                let angle = index as f64;
                let side = DVec3::new(angle.cos(), angle.sin(), if index % 2 == 0 { 1e-5 } else { 0.7 });
                let origin = (target + side * distance).as_vec3();
                let direction = (target - origin.as_dvec3()).normalize().as_vec3();
                missed[usize::from(far > 2)] += usize::from(!enters(&row, origin, direction));
            }
        }
        assert_eq!(missed, [0, 0]);
    }

    // Kills: a grid that is used where it is too coarse, or never; rows of one form under the name of the other.
    #[test]
    fn the_grid_is_left_where_it_is_too_coarse() {
        let room = NodeRows::pack(&hierarchy(strewn(300, 0.05).into_iter()).nodes);
        assert!(room.is_compact);
        let village = strewn(300, 0.05).into_iter().map(|corners| corners.map(|corner| corner * 2e-4));
        let plain = [[Vec3::NEG_ONE, Vec3::X, Vec3::Y], [Vec3::ONE, Vec3::NEG_X, Vec3::NEG_Y]];
        let hierarchy = hierarchy(village.chain(plain));
        let packed = NodeRows::pack(&hierarchy.nodes);
        assert!(!packed.is_compact && packed.rows.len() == 2 * hierarchy.nodes.len());
        let (node, row) = (&hierarchy.nodes[3], packed.rows[7]);
        assert_eq!(row, [node.max.x.to_bits(), node.max.y.to_bits(), node.max.z.to_bits(), word(node)]);
    }
}
