// Mean and sum of squared deviations of the tile's sums, updated pass by pass.
fn wf_tile_estimate(memory: vec2u, sum: f32, passes: u32) -> vec3u {
    if (passes == 1u) {
        return vec3u(bitcast<u32>(sum), 0u, 0u);
    }
    let mean = bitcast<f32>(memory.x);
    let away = sum - mean;
    let new_mean = mean + away / f32(passes);
    // Never below zero but for rounding.
    let squares = abs(bitcast<f32>(memory.y) + away * (sum - new_mean));
    let word = bitcast<u32>(squares);
    return vec3u(bitcast<u32>(new_mean), word, word >> 21u);
}
