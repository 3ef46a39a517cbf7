// What a surface does to light: a mixture of smooth glass (share `glass_share`), a reflecting interface, and Lambert below it. What no
// material of the scene has is not there: Lambert alone has one member.
//
// The diffuse base under the coat is rho/pi (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), E the coat's own albedo (Kulla and Conty, 2017):
// reciprocal, and together with the coat it returns all light when rho is 1, at every roughness. glTF's sample formula, 1 - F(v.h),
// returns up to twice the light at grazing angles.

import package::math::disk::cosine_hemisphere;
import package::math::mis::PDF_MIN;
import package::math::onb::Frame;
import package::math::random::unit_f32;
import package::math::vector::max_component;
@if(interfaces) import package::path_tracer::coat::{Coat, coat_transmittance};
@if(transmission) import package::path_tracer::glass::{Glass, sample_glass};
import package::path_tracer::lobe_choice::{lobe_ticks, ticks_to_probability};
@if(interfaces) import package::path_tracer::microfacet::{Microfacets, ALPHA_MIRROR, evaluate_microfacets, microfacet_fresnel, sample_microfacets};

const INVERSE_PI: f32 = 0.3183098861837907;

struct Bsdf {
    // Albedo of the base, the share of the mixture and 1 / (1 - E_avg) multiplied in.
    diffuse: vec3f,
    @if(interfaces) coat: Coat,
    // The share of the mixture multiplied in.
    @if(interfaces) facets: Microfacets,
    @if(transmission) glass_share: f32,
    @if(transmission) glass: Glass,
}

struct BsdfValue {
    f_cosine: vec3f,
    pdf: f32,
}

struct BsdfSample {
    // Local frame.
    wi: vec3f,
    // f cos / pdf; zero when there is no continuation.
    weight: vec3f,
    // 0 for a direction that nothing else can find.
    pdf: f32,
    eta_scale: f32,
    // To the other side of the surface.
    transmits: bool,
}

// A sample and the frame in which its direction lies.
struct FramedSample {
    drawn: BsdfSample,
    frame: Frame,
}

// Choice of lobes for one view direction, in 65536ths: glass against the rest, the interface against the base.
struct LobeChoice {
    glass: u32,
    interface_part: u32,
}

@if(interfaces) fn is_mirror(bsdf: Bsdf) -> bool {
    return bsdf.facets.alpha < ALPHA_MIRROR;
}

// Largest component of what the interface (x) and the base (y) reflect of light from one direction.
fn opaque_weights(bsdf: Bsdf, wo: vec3f) -> vec2f {
    var weights = vec2f(0.0, max_component(bsdf.diffuse));
    @if(interfaces) {
        weights.x = max_component(microfacet_fresnel(bsdf.facets, wo.z));
        weights.y *= coat_transmittance(bsdf.coat, wo.z);
    }
    return weights;
}

// About how much comes back of light from one direction, in any direction; 0 only when nothing does.
fn bsdf_strength(bsdf: Bsdf, wo: vec3f) -> f32 {
    let weights = opaque_weights(bsdf, wo);
    @if(transmission) return bsdf.glass_share + weights.x + weights.y;
    @else return weights.x + weights.y;
}

fn choose_lobes(bsdf: Bsdf, wo: vec3f) -> LobeChoice {
    let weights = opaque_weights(bsdf, wo);
    var glass = 0u;
    @if(transmission) glass = lobe_ticks(bsdf.glass_share, weights.x + weights.y);
    return LobeChoice(glass, lobe_ticks(weights.x, weights.y));
}

// Everything that light sampling can find, for directions above the surface.
fn evaluate_bsdf(bsdf: Bsdf, choice: LobeChoice, wo: vec3f, wi: vec3f) -> BsdfValue {
    if wi.z <= 0.0 {
        return BsdfValue(vec3f(0.0), 0.0);
    }
    let opaque_probability = 1.0 - ticks_to_probability(choice.glass);
    let interface_probability = ticks_to_probability(choice.interface_part);
    var through = 1.0;
    @if(interfaces) through = coat_transmittance(bsdf.coat, wo.z) * coat_transmittance(bsdf.coat, wi.z);
    let cosine_pdf = wi.z * INVERSE_PI;
    var value = BsdfValue(bsdf.diffuse * (through * cosine_pdf), (1.0 - interface_probability) * cosine_pdf);
    @if(interfaces) if choice.interface_part > 0u && !is_mirror(bsdf) {
        let reflected = evaluate_microfacets(bsdf.facets, wo, wi);
        value.f_cosine += reflected.f_cosine;
        value.pdf += interface_probability * reflected.pdf;
    }
    value.pdf *= opaque_probability;
    return value;
}

// `words`: x chooses the lobe, y and z the direction.
fn sample_bsdf(bsdf: Bsdf, wo: vec3f, words: vec4u) -> BsdfSample {
    let choice = choose_lobes(bsdf, wo);
    let high = words.x >> 16u;
    let low = words.x & 0xffffu;
    @if(transmission) if high < choice.glass {
        let drawn = sample_glass(bsdf.glass, wo, low);
        let share = bsdf.glass_share / ticks_to_probability(choice.glass);
        return BsdfSample(drawn.wi, drawn.weight * share, 0.0, drawn.eta_scale, drawn.transmits);
    }
    let u = vec2f(unit_f32(words.y), unit_f32(words.z));
    var wi = vec3f(0.0);
    let takes_interface = low < choice.interface_part;
    @if(interfaces) if takes_interface {
        if is_mirror(bsdf) {
            let probability = (1.0 - ticks_to_probability(choice.glass)) * ticks_to_probability(choice.interface_part);
            return BsdfSample(vec3f(-wo.xy, wo.z), microfacet_fresnel(bsdf.facets, wo.z) / probability, 0.0, 1.0, false);
        }
        wi = sample_microfacets(bsdf.facets, wo, u);
    }
    if !takes_interface {
        wi = cosine_hemisphere(u);
        // Lambert alone needs no division: its weight is its albedo, to the last bit.
        if choice.glass == 0u && choice.interface_part == 0u {
            return BsdfSample(wi, bsdf.diffuse, max(wi.z * INVERSE_PI, PDF_MIN), 1.0, false);
        }
    }
    let value = evaluate_bsdf(bsdf, choice, wo, wi);
    if value.pdf < PDF_MIN {
        return BsdfSample(wi, vec3f(0.0), 0.0, 1.0, false);
    }
    return BsdfSample(wi, value.f_cosine / value.pdf, value.pdf, 1.0, false);
}
