// The point where a path met a triangle: its place, its planes, and the frame in which its material works.
//
// Sides: front is where the triangle's corners run counter-clockwise. Both planes' normals are turned towards the viewer; a
// single-sided surface seen from behind is present and shaded the same way, but emits from its front only.

@if(normal_maps) import constants::VERTEX_TANGENT_ROW;
import package::math::offset::{hit_point_error, inset_point};
import package::math::onb::{Frame, frame_around};
import package::math::triangle::triangle_plane;
import package::math::vector::{max_component, normalize_or};
import package::path_tracer::records::{Material, NONE};
import package::path_tracer::scene_access::Triangle;
import package::path_tracer::texture::interpolate_row;
import package::path_tracer::triangle_front::towards_front;
@if(normal_maps) import package::path_tracer::texture::{sample_texture, texture_coordinates};

struct Surface {
    position: vec3f,
    // Of the plane, on the viewer's side.
    normal: vec3f,
    // How far the computed position may be off in each coordinate.
    error: vec3f,
    is_front: bool,
    // Around the shading normal, on the viewer's side.
    frame: Frame,
}

// `wo` points back to the viewer.
fn surface_at(triangle: Triangle, material: Material, barycentrics: vec2f, wo: vec3f) -> Surface {
    let e1 = triangle.v1 - triangle.v0;
    let e2 = triangle.v2 - triangle.v0;
    let shape = triangle_plane(e1, e2);
    let plane = towards_front(triangle, shape.normal);
    let error = hit_point_error(triangle.v0, e1, e2);
    let interpolated = triangle.v0 + barycentrics.x * e1 + barycentrics.y * e2;
    let position = inset_point(interpolated, barycentrics, e1, e2, shape.normal, shape.area, max_component(error));
    let is_front = dot(plane, wo) >= 0.0;
    let normal = select(-plane, plane, is_front);
    let frame = shading_frame(triangle, material, barycentrics, normal, is_front, wo);
    return Surface(position, normal, error, is_front, frame);
}

// The frame that a material's normal map gives; `normal` is that of the plane, on the viewer's side.
fn shading_frame(triangle: Triangle, material: Material, barycentrics: vec2f, normal: vec3f, is_front: bool, wo: vec3f) -> Frame {
    let shading = shading_normal(triangle, material, barycentrics, select(-normal, normal, is_front));
    return frame_around(face_viewer(select(-shading, shading, is_front), normal, wo));
}

// The interpolated normal with the normal map applied, on the side of the front.
fn shading_normal(triangle: Triangle, material: Material, barycentrics: vec2f, plane: vec3f) -> vec3f {
    var normal = normalize_or(interpolate_row(triangle.vertices, 0u, barycentrics).xyz, plane);
    @if(normal_maps) if material.normal_texture != NONE {
        let tangent = interpolate_row(triangle.vertices, VERTEX_TANGENT_ROW, barycentrics);
        let along = normalize_or(tangent.xyz - normal * dot(normal, tangent.xyz), frame_around(normal).tangent);
        let across = cross(normal, along) * select(-1.0, 1.0, tangent.w >= 0.0);
        let uv = texture_coordinates(triangle.vertices, barycentrics);
        let stored = sample_texture(material.normal_texture, uv, false).xyz * 2.0 - 1.0;
        let bent = stored * vec3f(material.normal_scale, material.normal_scale, 1.0);
        normal = normalize_or(along * bent.x + across * bent.y + normal * bent.z, normal);
    }
    // Files whose normals point to the back of their triangles exist.
    return select(-normal, normal, dot(normal, plane) >= 0.0);
}

// A shading normal that the viewer sees from behind, or more at a slant than the plane, is bent until it is just visible.
fn face_viewer(shading: vec3f, normal: vec3f, wo: vec3f) -> vec3f {
    let visible = min(0.0078125, dot(normal, wo));
    let cosine = dot(shading, wo);
    if cosine >= visible {
        return shading;
    }
    return normalize_or(shading + (visible - cosine) * wo, normal);
}
