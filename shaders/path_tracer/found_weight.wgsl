// How much light counts that a path ran into, where light sampling might have found it too. Where no light can be picked all of it
// counts, and the state keeps no density.

import constants::{LIGHT_STRATEGY, STRATEGY_LIGHTS, STRATEGY_MIS};
@if(samplable_lights) import package::math::mis::power_heuristic;
import package::path_tracer::path::Path;

// Keeps the density with which the path's direction was drawn; 0 when nothing else could have found it.
@if(samplable_lights) fn remember_pdf(path: ptr<function, Path>, pdf: f32) {
    (*path).bsdf_pdf = pdf;
}

// `light_pdf` is what light sampling would have had, selection included.
@if(samplable_lights) fn found_weight(path: ptr<function, Path>, light_pdf: f32) -> f32 {
    if (*path).bsdf_pdf == 0.0 || light_pdf <= 0.0 {
        return 1.0;
    }
    if LIGHT_STRATEGY == STRATEGY_MIS {
        return power_heuristic((*path).bsdf_pdf, light_pdf);
    }
    return select(1.0, 0.0, LIGHT_STRATEGY == STRATEGY_LIGHTS);
}

@else fn found_weight(path: ptr<function, Path>, light_pdf: f32) -> f32 {
    return 1.0;
}
