// Takes the place of found_weight.wgsl where no light can be picked: all that is run into counts, and the state keeps no density.

import package::path_tracer::path::Path;

fn remember_pdf(path: ptr<function, Path>, pdf: f32) {}

fn found_weight(path: ptr<function, Path>, light_pdf: f32) -> f32 {
    return 1.0;
}
