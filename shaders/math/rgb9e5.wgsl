// Three numbers of at least zero in one word: nine bits each and a shared exponent, rounded to nearest. Integers throughout.
// What is stored is finite: negative numbers and what is not a number are 0, and beyond 65408 it is 65408. The word 0 holds zeros.
// Source: the format of OpenGL's EXT_texture_shared_exponent.

// Bits of 65408.
const RGB9E5_MOST: u32 = 0x477f8000u;

// False for what the format has to change by more than rounding.
fn rgb9e5_fits(v: vec3f) -> bool {
    let bits = bitcast<vec3u>(v);
    return all((bits <= vec3u(RGB9E5_MOST)) | (bits == vec3u(0x80000000u)));
}

fn encode_rgb9e5(v: vec3f) -> u32 {
    let bits = bitcast<vec3u>(v);
    // A sign makes a word larger than that of infinity, as NaN does.
    let kept = select(min(bits, vec3u(RGB9E5_MOST)), vec3u(0u), bits > vec3u(0x7f800000u));
    var exponent = max(max(max(kept.x, kept.y), kept.z) >> 23u, 111u) - 111u;
    var parts = rgb9e5_parts(kept, exponent);
    if (any(parts > vec3u(511u))) {
        exponent += 1u;
        parts = rgb9e5_parts(kept, exponent);
    }
    return parts.x | (parts.y << 9u) | (parts.z << 18u) | (exponent << 27u);
}

fn decode_rgb9e5(word: u32) -> vec3f {
    let parts = vec3u(word, word >> 9u, word >> 18u) & vec3u(511u);
    // Exact: nine bits times a power of two.
    return vec3f(parts) * bitcast<f32>(((word >> 27u) + 103u) << 23u);
}

// Multiples of 2^(exponent - 24), nearest to the numbers with these bits.
fn rgb9e5_parts(bits: vec3u, exponent: u32) -> vec3u {
    let shift = min(vec3u(exponent + 126u) - (bits >> vec3u(23u)), vec3u(25u));
    let value = (bits & vec3u(0x7fffffu)) | vec3u(0x800000u);
    return (value + (vec3u(1u) << (shift - 1u))) >> shift;
}
