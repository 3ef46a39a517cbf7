// Point, spot and directional lights.
// Source: glTF extension KHR_lights_punctual (inverse square, range window, squared ramp between the cone's cosines).

import package::path_tracer::light_sample::LightSample;
import package::path_tracer::records::{Light, PUNCTUAL_DIRECTIONAL, PUNCTUAL_SPOT};
import package::path_tracer::scene_access::load_punctual;

fn sample_punctual_light(light: Light, reference: vec3f) -> LightSample {
    let punctual = load_punctual(light.index);
    if punctual.kind == PUNCTUAL_DIRECTIONAL {
        return LightSample(reference, true, -punctual.direction, punctual.intensity, 1.0, true);
    }
    let offset = punctual.position - reference;
    let square = max(dot(offset, offset), 7.888609052210118e-31);
    let wi = offset * inverseSqrt(square);
    let part = square * punctual.inverse_range * punctual.inverse_range;
    var strength = clamp(1.0 - part * part, 0.0, 1.0) / square;
    if punctual.kind == PUNCTUAL_SPOT {
        let ramp = clamp(-dot(wi, punctual.direction) * punctual.spot_scale + punctual.spot_offset, 0.0, 1.0);
        strength *= ramp * ramp;
    }
    return LightSample(punctual.position, false, wi, punctual.intensity * strength, 1.0, true);
}
