// A ray and one triangle: is it closer than what the ray has met so far?
//
// Among hits at exactly the same distance the triangle with the lower index in the scene wins, whatever the order of the walk. Without a
// hierarchy triangles come in that order, so that the first one wins.
// Alpha is asked here: a triangle that is not there for this ray is no hit and consumes no bounce.

@if(alpha && !exhaustive) import package::path_tracer::alpha::is_present;
import package::path_tracer::intersect_triangle::{RayShear, intersect_triangle};
@if(!exhaustive) import package::path_tracer::records::NONE;
@if(alpha && !exhaustive) import package::path_tracer::records::TRIANGLE_ALPHA;
import package::path_tracer::scene_access::triangle_corners;
@if(!exhaustive) import package::path_tracer::scene_access::triangle_id;
@if(alpha && !exhaustive) import package::path_tracer::scene_access::triangle_material;

struct Hit {
    triangle: u32,
    barycentrics: vec2f,
    t: f32,
}

// A ray as the test wants it. `left` is the triangle that it starts on, which a straight ray cannot meet again; `key` seeds the choice of
// transparent triangles.
struct MeetingRay {
    origin: vec3f,
    shear: RayShear,
    left: u32,
    key: vec4u,
}

fn meet_triangle(slot: u32, ray: MeetingRay, best: ptr<function, Hit>) {
    let corners = triangle_corners(slot);
    let hit = intersect_triangle(corners[0], corners[1], corners[2], ray.origin, ray.shear);
    @if(exhaustive) {
        if hit.found && hit.t < (*best).t && slot != ray.left {
            *best = Hit(slot, hit.barycentrics, hit.t);
        }
    }
    @if(!exhaustive) {
        if hit.found && hit.t <= (*best).t && slot != ray.left {
            var closest = hit.t < (*best).t;
            if !closest && (*best).triangle != NONE {
                closest = triangle_id(slot) < triangle_id((*best).triangle);
            }
            @if(alpha) if closest && (triangle_material(slot) & TRIANGLE_ALPHA) != 0u {
                closest = is_present(slot, triangle_id(slot), hit.barycentrics, ray.key);
            }
            if closest {
                *best = Hit(slot, hit.barycentrics, hit.t);
            }
        }
    }
}
