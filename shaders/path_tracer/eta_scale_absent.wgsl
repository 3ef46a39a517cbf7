// Takes the place of eta_scale.wgsl where nothing transmits: radiance never swells and the state does not keep it.

import package::path_tracer::path::Path;

fn begin_eta_scale(path: ptr<function, Path>) {}

fn multiply_eta_scale(path: ptr<function, Path>, factor: f32) {}

fn current_eta_scale(path: ptr<function, Path>) -> f32 {
    return 1.0;
}
