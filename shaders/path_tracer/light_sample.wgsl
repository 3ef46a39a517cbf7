// What every kind of light answers when asked for light at a point.

struct LightSample {
    // Where the shadow ray ends; of no meaning for a light at infinity.
    target_point: vec3f,
    is_infinite: bool,
    // Unit vector towards the light.
    wi: vec3f,
    // Radiance; irradiance across wi for a light that no other strategy can find.
    radiance: vec3f,
    // Per solid angle, selection included; 0 means nothing was drawn.
    pdf: f32,
    is_singular: bool,
}
