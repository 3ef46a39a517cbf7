// Surfaces that send light on in single directions only: mirrors, smooth glass, and a polished coat over a black base.

import package::math::vector::max_component;
import package::path_tracer::bsdf::Bsdf;
@if(interfaces) import package::path_tracer::bsdf::is_mirror;

fn is_delta(bsdf: Bsdf) -> bool {
    if max_component(bsdf.diffuse) > 0.0 {
        return false;
    }
    var is_seen_through = false;
    @if(interfaces) {
        is_seen_through = bsdf.facets.f90 > 0.0;
        if is_seen_through && !is_mirror(bsdf) {
            return false;
        }
    }
    @if(transmission) is_seen_through = is_seen_through || bsdf.glass_share > 0.0;
    return is_seen_through;
}
