// All lights as one: an integer table picks one of them in proportion to its power.

import package::path_tracer::alias_table::pick_alias;
@if(environment) import package::path_tracer::environment::sample_environment;
@if(punctual_lights) import package::path_tracer::light_punctual::sample_punctual_light;
import package::path_tracer::light_sample::LightSample;
@if(triangle_lights) import package::path_tracer::light_triangle::sample_triangle_light;
import package::path_tracer::records::{LIGHT_ENVIRONMENT, LIGHT_PUNCTUAL, LIGHT_TRIANGLE};
import package::path_tracer::scene_access::{load_light, view};

// `words` and `inner_words` are the two light dimensions of a scattering event.
fn sample_one_light(reference: vec3f, words: vec4u, inner_words: vec4u) -> LightSample {
    let light = load_light(pick_alias(view.light_alias, view.light_alias_log2, words.x, words.y));
    var result = LightSample(reference, true, vec3f(0.0, 1.0, 0.0), vec3f(0.0), 0.0, false);
    @if(triangle_lights) if light.kind == LIGHT_TRIANGLE {
        result = sample_triangle_light(light, reference, words.zw);
    }
    @if(punctual_lights) if light.kind == LIGHT_PUNCTUAL {
        result = sample_punctual_light(light, reference);
    }
    @if(environment) if light.kind == LIGHT_ENVIRONMENT {
        let drawn = sample_environment(words.zw, inner_words.xy);
        result = LightSample(reference, true, drawn.direction, drawn.radiance, drawn.pdf, false);
    }
    result.pdf *= light.pmf;
    return result;
}
