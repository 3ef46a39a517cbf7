// Walks the binary hierarchy, near child first, with a stack whose size the host has proven sufficient.
// A node on its way through the walk is one word: first in the low 28 bits, count in the high 4; count 0 is an inner node whose children
// are neighbours. How a node lies in its buffer is the business of `bvh_node`.
//
// A lane walks inner nodes until it has a leaf, and lanes in lock-step meet there: each of the two loops is one piece of code.
// Whatever is read costs lanes in lock-step a turn each, so nothing is read that only few of them want: a triangle's number in the scene
// and its alpha are asked for when it would be the closest.
//
// Among hits at exactly the same distance the triangle with the lower index in the scene wins, whatever the order of the walk.
// Alpha is asked here: a triangle that is not there for this ray is no hit and consumes no bounce.

@if(alpha) import package::path_tracer::alpha::is_present;
import package::path_tracer::bvh_node::{child_of_node, ray_for_boxes, ENTER_SLACK};
import package::path_tracer::intersect_triangle::{intersect_triangle, shear_of_ray};
import package::path_tracer::records::{NONE, TRIANGLE_ALPHA};
import package::path_tracer::scene_access::{triangle_corners, triangle_id, triangle_material, view};
import package::path_tracer::walk_stack::{WALK_ENDS, empty_stack, pop_node, push_node};

const NODE_FIRST_MASK: u32 = 0x0fffffffu;
const NODE_COUNT_SHIFT: u32 = 28u;

struct Hit {
    triangle: u32,
    barycentrics: vec2f,
    t: f32,
}

// The closest hit with t in (0, t_max), or any when `any_hit`; `left` is the triangle that the ray starts on, which a straight ray
// cannot meet again. `key` seeds the choice of transparent triangles.
fn traverse(origin: vec3f, direction: vec3f, t_max: f32, left: u32, key: vec4u, any_hit: bool) -> Hit {
    var best = Hit(NONE, vec2f(0.0), t_max);
    if view.bvh_root == NONE {
        return best;
    }
    let boxes = ray_for_boxes(origin, direction);
    let ray = shear_of_ray(direction);
    // The distance to a triangle carries an error that its box does not know; a little slack keeps ties independent of the order.
    let size = max(abs(origin), vec3f(1.0));
    let reach = abs(direction);
    let slack = ENTER_SLACK * max(size.x, max(size.y, size.z)) / max(reach.x, max(reach.y, reach.z));
    var stack = empty_stack();
    var node = view.bvh_root;
    loop {
        while (node >> NODE_COUNT_SHIFT) == 0u {
            let limit = best.t + slack;
            let child0 = child_of_node(node, boxes, limit);
            let child1 = child_of_node(node + 1u, boxes, limit);
            let second_first = child1.is_met && (!child0.is_met || child1.enter < child0.enter);
            if child0.is_met && child1.is_met {
                push_node(&stack, select(child1.node, child0.node, second_first));
            }
            if child0.is_met || child1.is_met {
                node = select(child0.node, child1.node, second_first);
            } else {
                node = pop_node(&stack);
            }
        }
        if node == WALK_ENDS {
            break;
        }
        let first = node & NODE_FIRST_MASK;
        let end = first + (node >> NODE_COUNT_SHIFT);
        for (var slot = first; slot < end; slot += 1u) {
            let corners = triangle_corners(slot);
            let hit = intersect_triangle(corners[0], corners[1], corners[2], origin, ray);
            if hit.found && hit.t <= best.t && slot != left {
                var closest = hit.t < best.t;
                if !closest && best.triangle != NONE {
                    closest = triangle_id(slot) < triangle_id(best.triangle);
                }
                @if(alpha) if closest && (triangle_material(slot) & TRIANGLE_ALPHA) != 0u {
                    closest = is_present(slot, triangle_id(slot), hit.barycentrics, key);
                }
                if closest {
                    best = Hit(slot, hit.barycentrics, hit.t);
                }
            }
        }
        if any_hit && best.triangle != NONE {
            return best;
        }
        node = pop_node(&stack);
    }
    return best;
}
