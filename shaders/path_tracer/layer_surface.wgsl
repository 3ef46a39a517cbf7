// What layers ask of a surface, one material or a tree of several.

@if(delta_surfaces) import package::path_tracer::delta_bsdf::is_delta;
@if(material_trees && layer_albedo) import constants::TREE_TABLE;
@if(material_trees && layer_albedo) import package::math::onb::to_local;
@if(material_trees && delta_surfaces) import package::path_tracer::lobes::{Lobes, lobes_at};
@if(material_trees && layer_albedo) import package::path_tracer::lobes::{lobe_share, tree_lobe_count};
@if(!material_trees && delta_surfaces) import package::path_tracer::material_bsdf::bsdf_at;
import package::path_tracer::records::Material;
@if(material_trees && layer_albedo) import package::path_tracer::records::{LOBE_ROWS, unpack_lobe};
import package::path_tracer::scene_access::Triangle;
@if(material_trees && layer_albedo) import package::path_tracer::scene_access::{load_material, table_row};
import package::path_tracer::surface::Surface;
@if(layer_albedo) import package::path_tracer::texture::base_color_at;

// All light goes on in single directions.
@if(delta_surfaces) fn is_delta_surface(triangle: Triangle, material: Material, barycentrics: vec2f, surface: Surface, wo: vec3f) -> bool {
    @if(material_trees) {
        var lobes: Lobes;
        lobes_at(&lobes, triangle, material, barycentrics, surface, wo);
        var n_delta = 0u;
        for (var index = 0u; index < lobes.count; index += 1u) {
            n_delta += u32(is_delta(lobes.bsdfs[index]));
        }
        return n_delta > 0u && n_delta == lobes.count;
    }
    @else return is_delta(bsdf_at(triangle, material, barycentrics, surface.is_front));
}

// Base colours by their shares.
@if(layer_albedo) fn surface_albedo(triangle: Triangle, material: Material, barycentrics: vec2f, surface: Surface, wo: vec3f) -> vec3f {
    @if(material_trees) if material.tree != 0u {
        var albedo = vec3f(0.0);
        let cosine = to_local(surface.frame, wo).z;
        let count = tree_lobe_count(material);
        for (var index = 0u; index < count; index += 1u) {
            let lobe = unpack_lobe(table_row(TREE_TABLE + material.tree + index * LOBE_ROWS));
            let share = lobe_share(lobe, triangle, barycentrics, cosine);
            albedo += share * base_color_at(load_material(lobe.material), triangle.vertices, barycentrics).xyz;
        }
        return albedo;
    }
    return base_color_at(material, triangle.vertices, barycentrics).xyz;
}
