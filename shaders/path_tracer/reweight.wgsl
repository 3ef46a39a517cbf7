// Roulette: a survivor stands for those who did not survive.

import package::path_tracer::path::Path;

fn reweight(path: ptr<function, Path>, inverse_p: f32) {
    (*path).beta *= inverse_p;
}
