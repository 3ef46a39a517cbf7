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
import package::path_tracer::scene_access::bvh;

@if(compact_nodes) const BOX_MARGIN: f32 = 1.000003814697265625;
@if(!compact_nodes) const BOX_MARGIN: f32 = 1.0000019073486328;
// How much farther than a hit a box may seem to begin that holds another hit at the same distance: what both carry as errors, relative.
@if(compact_nodes) const ENTER_SLACK: f32 = 3.8146972656e-6;
@if(!compact_nodes) const ENTER_SLACK: f32 = 1.9073486328e-6;

// A ray as the boxes want it. Compact: t of a plane is `scale` times its number plus `offset`. Otherwise `scale` is the reciprocal of the
// direction and `offset` is the origin.
struct BoxRay {
    scale: vec3f,
    offset: vec3f,
}

// A node's word, and where the ray enters its box: above the limit when it does not.
struct Child {
    enter: f32,
    node: u32,
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
    @if(compact_nodes) return BoxRay(reciprocal * cell, (vec3f(-f32(GRID_HALF) * cell) - origin) * reciprocal);
    @if(!compact_nodes) return BoxRay(reciprocal, origin);
}

// `a` and `b` are the distances to opposite planes.
fn enter_slabs(a: vec3f, b: vec3f, limit: f32) -> f32 {
    let near = min(a, b);
    let far = max(a, b);
    let t_enter = max(max(near.x, near.y), max(near.z, 0.0));
    let t_leave = min(min(far.x, far.y), far.z) * BOX_MARGIN;
    return select(3.0e38, t_enter, t_enter <= min(t_leave, limit));
}

@if(compact_nodes) fn child_of_node(index: u32, ray: BoxRay, limit: f32) -> Child {
    let row = bvh[index];
    let low = vec3f(vec3u(row.x & 0xffffu, row.x >> 16u, row.y & 0xffffu));
    let high = vec3f(vec3u(row.y >> 16u, row.z & 0xffffu, row.z >> 16u));
    return Child(enter_slabs(low * ray.scale + ray.offset, high * ray.scale + ray.offset, limit), row.w);
}

@if(!compact_nodes) fn child_of_node(index: u32, ray: BoxRay, limit: f32) -> Child {
    let low = bitcast<vec3f>(bvh[2u * index].xyz);
    let high = bvh[2u * index + 1u];
    let a = (low - ray.offset) * ray.scale;
    let b = (bitcast<vec3f>(high.xyz) - ray.offset) * ray.scale;
    return Child(enter_slabs(a, b, limit), high.w);
}
