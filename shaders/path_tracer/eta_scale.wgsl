// How radiance has swelled along a path inside glass. Where nothing transmits it never does, and the state does not keep it.

import package::path_tracer::path::Path;

@if(transmission) fn begin_eta_scale(path: ptr<function, Path>) {
    (*path).eta_scale = 1.0;
}

@if(transmission) fn multiply_eta_scale(path: ptr<function, Path>, factor: f32) {
    (*path).eta_scale *= factor;
}

fn current_eta_scale(path: ptr<function, Path>) -> f32 {
    @if(transmission) return (*path).eta_scale;
    @else return 1.0;
}
