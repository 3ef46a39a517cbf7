// Counter-based random numbers, keyed by what is computed and never by where or when it runs.
// Source: Jarzynski and Olano, Hash Functions for GPU Rendering, JCGT 9(3), 2020 (pcg4d).

// Four independent 32-bit words from four counters.
fn pcg4d(counters: vec4u) -> vec4u {
    var v = counters * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v = v ^ (v >> vec4u(16u));
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Uniform in [0, 1): the top 24 bits, so that no word rounds up to 1.
fn unit_f32(word: u32) -> f32 {
    return f32(word >> 8u) * 5.9604644775390625e-8;
}
