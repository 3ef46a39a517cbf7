// The reflecting interface of a surface: metal, or the dielectric coat of glTF's metallic-roughness model.

import package::math::ggx::{ggx_distribution, ggx_lambda, sample_visible_normal};
import package::math::fresnel::schlick_weight;

// Narrower distributions are mirrors: in evaluation, sampling and densities alike.
const ALPHA_MIRROR: f32 = 0.001;
// A view closer to the horizon is treated as being there.
const COSINE_MIN: f32 = 1e-6;

// Reflectance at normal incidence and at the horizon, and the width.
struct Microfacets {
    f0: vec3f,
    f90: f32,
    alpha: f32,
}

struct MicrofacetValue {
    // Reflected part of the light times the cosine.
    f_cosine: vec3f,
    pdf: f32,
}

fn microfacet_fresnel(facets: Microfacets, cosine: f32) -> vec3f {
    return facets.f0 + (vec3f(facets.f90) - facets.f0) * schlick_weight(cosine);
}

// Both directions in the upper half of the local frame.
fn evaluate_microfacets(facets: Microfacets, wo_raw: vec3f, wi: vec3f) -> MicrofacetValue {
    let wo = vec3f(wo_raw.xy, max(wo_raw.z, COSINE_MIN));
    let sum = wo + wi;
    let square = dot(sum, sum);
    if wi.z < COSINE_MIN || square < 1e-12 {
        return MicrofacetValue(vec3f(0.0), 0.0);
    }
    let h = sum * inverseSqrt(square);
    let lambda_o = ggx_lambda(wo, facets.alpha);
    let lambda_i = ggx_lambda(wi, facets.alpha);
    let density = ggx_distribution(h, facets.alpha) / (4.0 * wo.z);
    let masked = density / (1.0 + lambda_o + lambda_i);
    return MicrofacetValue(microfacet_fresnel(facets, dot(wo, h)) * masked, density / (1.0 + lambda_o));
}

// A direction that may lie below the surface; the caller discards it then.
fn sample_microfacets(facets: Microfacets, wo_raw: vec3f, u: vec2f) -> vec3f {
    let wo = vec3f(wo_raw.xy, max(wo_raw.z, COSINE_MIN));
    let h = sample_visible_normal(wo, facets.alpha, u);
    return normalize(2.0 * dot(wo, h) * h - wo);
}
