// What the camera's ray has met: where, how far away, and which thing. Distances and places are in normalised space, the host turns their
// means into metres. Numbers of things have no mean: the first sample notes them, the others add zero.

import package::path_tracer::path::Path;
import package::path_tracer::records::{NONE, TRIANGLE_MATERIAL_MASK};
@if(layer_object || layer_material) import constants::LAYER_TABLE;
import package::path_tracer::scene_access::{load_triangle, table_word, view};

fn note_first_hit(path: ptr<function, Path>) {
    let slot = (*path).hit_triangle;
    @if(layer_object || layer_material) let is_first = (*path).sample == table_word(LAYER_TABLE, 0u);
    if slot == NONE {
        @if(layer_object) (*path).layer_object = select(0u, NONE, is_first);
        @if(layer_material) (*path).layer_material = select(0u, NONE, is_first);
        return;
    }
    let triangle = load_triangle(slot);
    @if(layer_depth || layer_position) {
        let barycentrics = (*path).hit_barycentrics;
        let position = triangle.v0 + barycentrics.x * (triangle.v1 - triangle.v0) + barycentrics.y * (triangle.v2 - triangle.v0);
        (*path).layer_hits = 1u;
        @if(layer_depth) (*path).layer_depth = dot(position - view.camera_origin, view.camera_forward);
        @if(layer_position) (*path).layer_position = position;
    }
    @if(layer_object) (*path).layer_object = select(0u, table_word(LAYER_TABLE + 1u + (slot >> 2u), slot & 3u), is_first);
    @if(layer_material) (*path).layer_material = select(0u, triangle.material & TRIANGLE_MATERIAL_MASK, is_first);
}
