// What a node of the hierarchy holds, and a conservative ray-box test: never misses a box that the exact ray meets.
// Source: Williams et al., JGT 10(1), 2005; Ize, Robust BVH Ray Traversal, JCGT 2(2), 2013, with a larger margin because WGSL rounds
// sums and products either way and allows a reciprocal 2.5 units in the last place.
//
// With `compact_nodes` a node is one row: six corners on a grid over the normalised scene, 16 bits each, then the node's word. The corners
// were rounded outward by at least a quarter of a cell. On an axis, t = q (cell / d) + (low - o) / d carries at most 5.5 units of
// 2^-23 (|q cell / d| + |(low - o) / d|), which is less than (3.02 + |o|) / 46.9 of a cell, and cell itself 2.5 units, which is less than a
// hundredth: the quarter covers both up to |o| = 8. Farther away
// it is less than 2^-19 of t, on either side; the margin of 2^-18 covers both.
//
// Otherwise a node is two rows: (low, nothing), (high, the node's word). There 2 (1 + 2.5 + 1) 2^-23 < 2^-19.

@if(compact_nodes) import constants::{GRID_HALF, GRID_CELLS};
import package::path_tracer::scene_access::bvh_row;

@if(compact_nodes) const BOX_MARGIN: f32 = 1.000003814697265625;
@if(!compact_nodes) const BOX_MARGIN: f32 = 1.0000019073486328;
// How much farther than a hit a box may seem to begin that holds another hit at the same distance: what both carry as errors, relative.
@if(compact_nodes) const ENTER_SLACK: f32 = 3.8146972656e-6;
@if(!compact_nodes) const ENTER_SLACK: f32 = 1.9073486328e-6;

// A ray as the boxes want it. Compact: t of a plane is `scale` times its number plus `offset`, and a word of a box holds the plane where the
// ray enters at the shift `near`, the other one at `far`. Otherwise `scale` is the reciprocal of the direction and `offset` is the origin.
struct BoxRay {
    scale: vec3f,
    offset: vec3f,
    @if(compact_nodes) near: vec3u,
    @if(compact_nodes) far: vec3u,
}

// A node's word, where the ray enters its box, and whether it does so before the limit.
struct Child {
    enter: f32,
    node: u32,
    is_met: bool,
}

// Reciprocals of a direction; components too small to divide by are replaced, keeping their sign.
fn safe_reciprocal(direction: vec3f) -> vec3f {
    let smallest = vec3f(7.888609052210118e-31);
    let signed_smallest = select(smallest, -smallest, direction < vec3f(0.0));
    return 1.0 / select(direction, signed_smallest, abs(direction) < smallest);
}

fn ray_for_boxes(origin: vec3f, direction: vec3f) -> BoxRay {
    let reciprocal = safe_reciprocal(direction);
    @if(compact_nodes) let cell = 1.0 / f32(GRID_CELLS);
    @if(compact_nodes) let near = select(vec3u(0u), vec3u(16u), reciprocal < vec3f(0.0));
    @if(compact_nodes) return BoxRay(reciprocal * cell, (vec3f(-f32(GRID_HALF) * cell) - origin) * reciprocal, near, 16u - near);
    @if(!compact_nodes) return BoxRay(reciprocal, origin);
}

// `near` and `far` are the distances to the planes where a ray enters and leaves on each axis. They are compared as integers: among floats that
// are not negative that is the same order, a negative one is less, which is all that is asked here, and nobody has to think of NaN.
fn child_met(near: vec3f, far: vec3f, limit: f32, node: u32) -> Child {
    let enter = bitcast<vec3i>(near);
    let leave = bitcast<vec3i>(far);
    let t_enter = bitcast<f32>(max(max(enter.x, enter.y), max(enter.z, 0)));
    let t_leave = bitcast<f32>(min(min(leave.x, leave.y), leave.z)) * BOX_MARGIN;
    return Child(t_enter, node, t_enter <= t_leave && t_enter <= limit);
}

@if(compact_nodes) fn child_of_node(index: u32, ray: BoxRay, limit: f32) -> Child {
    let row = bvh_row(index);
    let near = vec3f((row.xyz >> ray.near) & vec3u(0xffffu));
    let far = vec3f((row.xyz >> ray.far) & vec3u(0xffffu));
    return child_met(near * ray.scale + ray.offset, far * ray.scale + ray.offset, limit, row.w);
}

@if(!compact_nodes) fn child_of_node(index: u32, ray: BoxRay, limit: f32) -> Child {
    let low = bitcast<vec3f>(bvh_row(2u * index).xyz);
    let high = bvh_row(2u * index + 1u);
    let a = (low - ray.offset) * ray.scale;
    let b = (bitcast<vec3f>(high.xyz) - ray.offset) * ray.scale;
    let is_backward = ray.scale < vec3f(0.0);
    return child_met(select(a, b, is_backward), select(b, a, is_backward), limit, high.w);
}
