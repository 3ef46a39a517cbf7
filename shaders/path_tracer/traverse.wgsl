// Walks the binary hierarchy, near child first, with a stack whose size the host has proven sufficient.
// A node is two rows: (low, count), (high, first); count 0 is an inner node whose children are neighbours. A node on its way through
// the walk is one word: first in the low 28 bits, count in the high 4.
//
// Among hits at exactly the same distance the triangle with the lower index in the scene wins, whatever the order of the walk.
// Alpha is asked here: a triangle that is not there for this ray is no hit and consumes no bounce.

import constants::BVH_STACK;
@if(alpha) import package::path_tracer::alpha::is_present;
import package::path_tracer::intersect_box::{enter_box, safe_reciprocal};
import package::path_tracer::intersect_triangle::{intersect_triangle, shear_of_ray};
import package::path_tracer::records::{NONE, TRIANGLE_ALPHA, TRIANGLE_ROWS};
import package::path_tracer::scene_access::{bvh, triangles, view};

const NODE_FIRST_MASK: u32 = 0x0fffffffu;

struct Hit {
    triangle: u32,
    barycentrics: vec2f,
    t: f32,
}

// The closest hit with t in (0, t_max), or any when `any_hit`; `left` is the triangle that the ray starts on, which a straight ray
// cannot meet again. `key` seeds the choice of transparent triangles.
fn traverse(origin: vec3f, direction: vec3f, t_max: f32, left: u32, key: vec4u, any_hit: bool) -> Hit {
    var best = Hit(NONE, vec2f(0.0), t_max);
    var best_id = 0u;
    if view.bvh_root == NONE {
        return best;
    }
    let reciprocal = safe_reciprocal(direction);
    let ray = shear_of_ray(direction);
    // The distance to a triangle carries an error that its box does not know; a little slack keeps ties independent of the order.
    let size = max(abs(origin), vec3f(1.0));
    let reach = abs(direction);
    let slack = 1.9073486e-6 * max(size.x, max(size.y, size.z)) / max(reach.x, max(reach.y, reach.z));
    var stack_node: array<u32, BVH_STACK>;
    var stack_enter: array<f32, BVH_STACK>;
    var height = 0u;
    var node = view.bvh_root;
    loop {
        let first = node & NODE_FIRST_MASK;
        let count = node >> 28u;
        var descends = false;
        if count == 0u {
            let low0 = bvh[2u * first];
            let high0 = bvh[2u * first + 1u];
            let low1 = bvh[2u * first + 2u];
            let high1 = bvh[2u * first + 3u];
            let limit = best.t + slack;
            let enter0 = enter_box(bitcast<vec3f>(low0.xyz), bitcast<vec3f>(high0.xyz), origin, reciprocal, limit);
            let enter1 = enter_box(bitcast<vec3f>(low1.xyz), bitcast<vec3f>(high1.xyz), origin, reciprocal, limit);
            let child0 = high0.w | (low0.w << 28u);
            let child1 = high1.w | (low1.w << 28u);
            let second_nearer = enter1 < enter0;
            let nearer = min(enter0, enter1);
            let farther = max(enter0, enter1);
            descends = nearer <= limit;
            node = select(child0, child1, second_nearer);
            if farther <= limit {
                stack_node[height] = select(child1, child0, second_nearer);
                stack_enter[height] = farther;
                height += 1u;
            }
        } else {
            for (var slot = first; slot < first + count; slot += 1u) {
                let row0 = triangles[slot * TRIANGLE_ROWS];
                let row1 = triangles[slot * TRIANGLE_ROWS + 1u];
                let row2 = triangles[slot * TRIANGLE_ROWS + 2u];
                let hit = intersect_triangle(bitcast<vec3f>(row0.xyz), bitcast<vec3f>(row1.xyz), bitcast<vec3f>(row2.xyz), origin, ray);
                let closer = hit.t < best.t || (hit.t == best.t && best.triangle != NONE && row0.w < best_id);
                if hit.found && closer && slot != left {
                    var present = true;
                    @if(alpha) if (row1.w & TRIANGLE_ALPHA) != 0u {
                        present = is_present(slot, row0.w, hit.barycentrics, key);
                    }
                    if present {
                        best = Hit(slot, hit.barycentrics, hit.t);
                        best_id = row0.w;
                    }
                }
            }
            if any_hit && best.triangle != NONE {
                return best;
            }
        }
        while !descends && height > 0u {
            height -= 1u;
            node = stack_node[height];
            descends = stack_enter[height] <= best.t + slack;
        }
        if !descends {
            break;
        }
    }
    return best;
}
