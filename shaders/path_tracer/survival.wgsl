// Roulette: how likely a path should survive. Never below its throughput, so that no survivor weighs more than one, and blind to the
// swelling of radiance inside glass.

import package::math::vector::max_component;
import package::path_tracer::eta_scale::current_eta_scale;
import package::path_tracer::path::Path;
import package::path_tracer::scene_access::view;

fn survival(path: ptr<function, Path>) -> f32 {
    if (*path).depth < view.roulette_depth {
        return 1.0;
    }
    let throughput = max_component((*path).beta);
    return clamp(max(throughput, throughput * current_eta_scale(path)), view.roulette_floor, 1.0);
}
