// From a material's numbers and textures to the lobes at one point.
// Source: glTF 2.0, appendix B, with the base under the coat as bsdf.wgsl has it. Transmission is smooth: roughness widens only the
// opaque share (the host warns where a file asks for more).

import package::path_tracer::bsdf::Bsdf;
@if(interfaces) import package::path_tracer::coat::{Coat, coat_mean_transmittance, coat_of};
@if(transmission) import package::path_tracer::glass::Glass;
@if(interfaces) import package::path_tracer::microfacet::Microfacets;
import package::path_tracer::records::{Material, MATERIAL_COAT, MATERIAL_SOLID, NONE};
import package::path_tracer::scene_access::Triangle;
import package::path_tracer::texture::base_color_at;
@if(textures) import package::path_tracer::texture::{sample_texture, texture_coordinates};

fn bsdf_at(triangle: Triangle, material: Material, barycentrics: vec2f, is_front: bool) -> Bsdf {
    let color = base_color_at(material, triangle.vertices, barycentrics).xyz;
    var metallic = material.metallic;
    var roughness = material.roughness;
    @if(textures) if material.metallic_roughness_texture != NONE {
        let uv = texture_coordinates(triangle.vertices, barycentrics);
        let stored = sample_texture(material.metallic_roughness_texture, uv, false);
        metallic *= stored.z;
        roughness *= stored.y;
    }
    let dielectric = (1.0 - metallic) * (1.0 - material.transmission);
    var bsdf: Bsdf;
    bsdf.diffuse = dielectric * color;
    @if(transmission) {
        let is_solid = (material.flags & MATERIAL_SOLID) != 0u;
        bsdf.glass_share = (1.0 - metallic) * material.transmission;
        bsdf.glass = Glass(color, select(material.eta, 1.0 / material.eta, is_solid && !is_front), is_solid);
    }
    @if(interfaces) if (material.flags & MATERIAL_COAT) == 0u {
        bsdf.coat = Coat(-1.0, 0u, 0u, 0.0);
        bsdf.facets = Microfacets(metallic * color, metallic, roughness * roughness);
    } else {
        bsdf.coat = coat_of(material.f0, roughness);
        bsdf.facets = Microfacets(metallic * color + vec3f(dielectric * material.f0), metallic + dielectric, roughness * roughness);
        bsdf.diffuse = color * (dielectric / coat_mean_transmittance(bsdf.coat));
    }
    return bsdf;
}
