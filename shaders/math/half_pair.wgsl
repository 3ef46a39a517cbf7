// Two numbers in one word, as IEEE binary16, rounded to nearest even. Integers throughout, so that every device agrees.
// What is stored is finite: beyond 65504 it is 65504 with the sign, and what is not a number is 0. The word 0 holds zeros.

// Bits of 65504.
const HALF_PAIR_MOST: u32 = 0x477fe000u;

// False for what the format has to change by more than rounding.
fn half_pair_fits(v: vec2f) -> bool {
    return all((bitcast<vec2u>(v) & vec2u(0x7fffffffu)) <= vec2u(HALF_PAIR_MOST));
}

fn encode_half_pair(v: vec2f) -> u32 {
    let bits = bitcast<vec2u>(v);
    return half_pair_encode_one(bits.x) | (half_pair_encode_one(bits.y) << 16u);
}

fn decode_half_pair(word: u32) -> vec2f {
    return vec2f(half_pair_decode_one(word & 0xffffu), half_pair_decode_one(word >> 16u));
}

fn half_pair_encode_one(bits: u32) -> u32 {
    let magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u) {
        return 0u;
    }
    let kept = min(magnitude, HALF_PAIR_MOST);
    let exponent = kept >> 23u;
    // Normal numbers lose 13 bits and 112 from the exponent; smaller ones are multiples of 2^-24, and the shift says how many.
    let is_normal = exponent >= 113u;
    let value = select((kept & 0x7fffffu) | 0x800000u, kept - 0x38000000u, is_normal);
    let shift = select(min(126u - min(exponent, 126u), 25u), 13u, is_normal);
    let half_unit = (1u << (shift - 1u)) - 1u;
    let rounded = (value + half_unit + ((value >> shift) & 1u)) >> shift;
    return rounded | ((bits >> 16u) & 0x8000u);
}

fn half_pair_decode_one(word: u32) -> f32 {
    // Words that stand for infinities and worse are never stored.
    let magnitude = min(word & 0x7fffu, 0x7bffu);
    let small = bitcast<u32>(f32(magnitude) * 5.9604644775390625e-8);
    let bits = select(small, (magnitude << 13u) + 0x38000000u, magnitude >= 0x400u);
    return bitcast<f32>(bits | ((word & 0x8000u) << 16u));
}
