// Smooth dielectrics: a solid refracts, a thin sheet reflects between its two faces and lets the rest pass straight.
// A camera path that enters a denser medium carries less by eta^2, because radiance swells there by the same factor; the square is kept
// apart in `eta_scale` too, so that roulette can undo it.

import package::math::fresnel::{fresnel_dielectric, ETA_MIN_STEP};
import package::math::vector::max_component;
import package::path_tracer::lobe_choice::{lobe_ticks, ticks_to_probability};

struct Glass {
    // Multiplies what passes.
    tint: vec3f,
    // Index beyond the surface over the index on the viewer's side.
    eta: f32,
    is_solid: bool,
}

struct GlassSample {
    wi: vec3f,
    weight: vec3f,
    eta_scale: f32,
    transmits: bool,
}

fn glass_reflectance(glass: Glass, cosine: f32) -> f32 {
    if abs(glass.eta - 1.0) <= ETA_MIN_STEP {
        return 0.0;
    }
    let once = fresnel_dielectric(cosine, glass.eta);
    return select(2.0 * once / (1.0 + once), once, glass.is_solid);
}

// `word` holds 16 random bits.
fn sample_glass(glass: Glass, wo: vec3f, word: u32) -> GlassSample {
    let reflectance = glass_reflectance(glass, wo.z);
    let passing = (1.0 - reflectance) * glass.tint;
    let ticks = lobe_ticks(reflectance, max_component(passing));
    let probability = ticks_to_probability(ticks);
    if word < ticks {
        return GlassSample(vec3f(-wo.xy, wo.z), vec3f(reflectance / probability), 1.0, false);
    }
    let weight = passing / (1.0 - probability);
    if !glass.is_solid || abs(glass.eta - 1.0) <= ETA_MIN_STEP {
        return GlassSample(-wo, weight, 1.0, true);
    }
    let squared = glass.eta * glass.eta;
    let sine2 = dot(wo.xy, wo.xy) / squared;
    let wi = vec3f(-wo.xy / glass.eta, -sqrt(max(0.0, 1.0 - sine2)));
    return GlassSample(wi, weight / squared, squared, true);
}
