// How radiance has swelled along a path inside glass. Where nothing transmits, eta_scale_absent.wgsl takes this place.

import package::path_tracer::path::Path;

fn begin_eta_scale(path: ptr<function, Path>) {
    (*path).eta_scale = 1.0;
}

fn multiply_eta_scale(path: ptr<function, Path>, factor: f32) {
    (*path).eta_scale *= factor;
}

fn current_eta_scale(path: ptr<function, Path>) -> f32 {
    return (*path).eta_scale;
}
