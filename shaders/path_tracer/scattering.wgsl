// What a surface does to light in all: the lobes of one material; in scenes that have trees of materials, those of a tree.

import package::math::onb::to_local;
import package::path_tracer::bsdf::{BsdfValue, FramedSample};
@if(!material_trees) import package::path_tracer::bsdf::{choose_lobes, evaluate_bsdf, sample_bsdf};
@if(material_trees) import package::path_tracer::lobes::{Lobes, evaluate_tree, lobes_at, sample_tree};
@if(!material_trees) import package::path_tracer::material_bsdf::bsdf_at;
import package::path_tracer::records::Material;
import package::path_tracer::scene_access::Triangle;
import package::path_tracer::surface::Surface;

// Towards a light above the true plane.
fn evaluate_scattering(triangle: Triangle, material: Material, barycentrics: vec2f, surface: Surface, wo: vec3f, wi: vec3f) -> BsdfValue {
    @if(material_trees) {
        var lobes: Lobes;
        lobes_at(&lobes, triangle, material, barycentrics, surface, wo);
        return evaluate_tree(&lobes, surface, wo, wi);
    }
    @else {
        let bsdf = bsdf_at(triangle, material, barycentrics, surface.is_front);
        let local = to_local(surface.frame, wo);
        return evaluate_bsdf(bsdf, choose_lobes(bsdf, local), local, to_local(surface.frame, wi));
    }
}

// `words` are those of the scattering event.
fn sample_scattering(triangle: Triangle, material: Material, barycentrics: vec2f, surface: Surface, wo: vec3f, words: vec4u) -> FramedSample {
    @if(material_trees) {
        var lobes: Lobes;
        lobes_at(&lobes, triangle, material, barycentrics, surface, wo);
        return sample_tree(&lobes, surface, wo, words);
    }
    @else {
        let bsdf = bsdf_at(triangle, material, barycentrics, surface.is_front);
        return FramedSample(sample_bsdf(bsdf, to_local(surface.frame, wo), words), surface.frame);
    }
}
