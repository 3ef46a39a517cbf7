// Finds what a ray meets: through the binary hierarchy, near child first, with a stack whose size the host has proven sufficient, or, in a scene
// of few triangles, by asking all of them (`exhaustive`, see `gpu_scene::exhaustive`).
// A node on its way through the walk is one word: first in the low 28 bits, count in the high 4; count 0 is an inner node whose children
// are neighbours. How a node lies in its buffer is the business of `bvh_node`.
//
// A lane walks inner nodes until it has a leaf, and lanes in lock-step meet there: each of the two loops is one piece of code.
// Whatever is read costs lanes in lock-step a turn each, so nothing is read that only few of them want: a triangle's number in the scene
// and its alpha are asked for when it would be the closest.

@if(exhaustive) import package::path_tracer::all_triangles::meet_all_triangles;
@if(!exhaustive) import package::path_tracer::bvh_node::{child_of_node, ray_for_boxes, ENTER_SLACK};
import package::path_tracer::intersect_triangle::shear_of_ray;
@if(exhaustive) import package::path_tracer::meet_triangle::{Hit, MeetingRay};
@if(!exhaustive) import package::path_tracer::meet_triangle::{Hit, MeetingRay, meet_triangle};
import package::path_tracer::records::NONE;
@if(!exhaustive) import package::path_tracer::scene_access::view;
@if(!exhaustive) import package::path_tracer::walk_stack::{WALK_ENDS, empty_stack, pop_node, push_node};

@if(!exhaustive) const NODE_FIRST_MASK: u32 = 0x0fffffffu;
@if(!exhaustive) const NODE_COUNT_SHIFT: u32 = 28u;

// The closest hit with t in (0, t_max), or any when `any_hit`; `left` and `key` as in `MeetingRay`.
fn traverse(origin: vec3f, direction: vec3f, t_max: f32, left: u32, key: vec4u, any_hit: bool) -> Hit {
    var best = Hit(NONE, vec2f(0.0), t_max);
    let ray = MeetingRay(origin, shear_of_ray(direction), left, key);
    @if(exhaustive) meet_all_triangles(ray, &best);
    @if(!exhaustive) walk_hierarchy(ray, direction, any_hit, &best);
    return best;
}

@if(!exhaustive) fn walk_hierarchy(ray: MeetingRay, direction: vec3f, any_hit: bool, best: ptr<function, Hit>) {
    if view.bvh_root == NONE {
        return;
    }
    let boxes = ray_for_boxes(ray.origin, direction);
    // The distance to a triangle carries an error that its box does not know; a little slack keeps ties independent of the order.
    let size = max(abs(ray.origin), vec3f(1.0));
    let reach = abs(direction);
    let slack = ENTER_SLACK * max(size.x, max(size.y, size.z)) / max(reach.x, max(reach.y, reach.z));
    var stack = empty_stack();
    var node = view.bvh_root;
    loop {
        while (node >> NODE_COUNT_SHIFT) == 0u {
            let limit = (*best).t + slack;
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
            meet_triangle(slot, ray, best);
        }
        if any_hit && (*best).triangle != NONE {
            return;
        }
        node = pop_node(&stack);
    }
}
