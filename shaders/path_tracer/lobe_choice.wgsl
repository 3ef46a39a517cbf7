// Choosing between two lobes with a probability that the draw realises exactly: whole 65536ths against 16 random bits.

// How many of 65536 draws go to the first weight; both keep at least one when both can contribute.
fn lobe_ticks(first: f32, second: f32) -> u32 {
    if first <= 0.0 {
        return 0u;
    }
    if second <= 0.0 {
        return 65536u;
    }
    return clamp(u32(first / (first + second) * 65536.0 + 0.5), 1u, 65535u);
}

fn ticks_to_probability(ticks: u32) -> f32 {
    return f32(ticks) * 1.52587890625e-5;
}
