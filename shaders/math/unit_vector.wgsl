// A direction in one word: the octahedron unfolded to a square, 16 bits per side, the nearest of the grid points around.
// The word 0 holds the zero vector, for "no direction". What is not finite, or shorter than 2^-100, becomes the zero vector; any other
// length becomes 1. The largest error is 4.4e-5 rad.
// Source: Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, JCGT 3(2), 2014 (oct32P); the metric that
// chooses the grid point is ours.

// Half the number of steps along a side.
const UNIT_VECTOR_STEPS: i32 = 32767;

// False for what the format has to change by more than rounding: neither zero nor of length 1 up to 1e-3.
fn unit_vector_fits(v: vec3f) -> bool {
    let bits = bitcast<vec3u>(v) & vec3u(0x7fffffffu);
    if (all(bits == vec3u(0u))) {
        return true;
    }
    return all(bits < vec3u(0x40000000u)) && abs(dot(v, v) - 1.0) < 0.002;
}

fn encode_unit_vector(v: vec3f) -> u32 {
    let signed_bits = bitcast<vec3u>(v);
    let bits = signed_bits & vec3u(0x7fffffffu);
    let largest = max(max(bits.x, bits.y), bits.z);
    if (largest >= 0x7f800000u || largest < 0x0d800000u) {
        return 0u;
    }
    // A power of two brings the largest component close to 1.
    let scaled = bitcast<vec3f>(bits) * bitcast<f32>((254u - min(largest >> 23u, 253u)) << 23u);
    var place = scaled.xy / (scaled.x + scaled.y + scaled.z) * f32(UNIT_VECTOR_STEPS);
    if (signed_bits.z > 0x80000000u) {
        place = f32(UNIT_VECTOR_STEPS) - place.yx;
    }
    let corner = clamp(floor(place), vec2f(0.0), vec2f(f32(UNIT_VECTOR_STEPS - 1)));
    let side = vec2i(corner) + unit_vector_nearest(place - corner);
    // At the rim of the square two points are one direction: the sign along the rim is left out.
    let is_negative = (signed_bits.xy > vec2u(0x80000000u)) & (side.yx < vec2i(UNIT_VECTOR_STEPS));
    let stored = vec2u(select(side, -side, is_negative) + 32768);
    return stored.x | (stored.y << 16u);
}

fn decode_unit_vector(word: u32) -> vec3f {
    if (word == 0u) {
        return vec3f(0.0);
    }
    let place = max(vec2i(vec2u(word & 0xffffu, word >> 16u)) - 32768, vec2i(-UNIT_VECTOR_STEPS));
    let side = abs(place);
    let z = UNIT_VECTOR_STEPS - side.x - side.y;
    let folded = (UNIT_VECTOR_STEPS - side.yx) * select(vec2i(1), vec2i(-1), place < vec2i(0));
    let xy = select(place, folded, z < 0);
    return vec3f(vec3i(xy, z)) / sqrt(f32(xy.x * xy.x + xy.y * xy.y + z * z));
}

// Which corner of the grid's cell is nearest to a place in it. On the octahedron a step (x, y) also moves z by -(x + y).
fn unit_vector_nearest(place: vec2f) -> vec2i {
    var best = vec2i(0);
    var least = unit_vector_distance(place);
    for (var candidate = 1; candidate < 4; candidate++) {
        let corner = vec2i(candidate & 1, candidate >> 1u);
        let distance = unit_vector_distance(place - vec2f(corner));
        if (distance < least) {
            least = distance;
            best = corner;
        }
    }
    return best;
}

fn unit_vector_distance(offset: vec2f) -> f32 {
    let sum = offset.x + offset.y;
    return dot(offset, offset) + sum * sum;
}
