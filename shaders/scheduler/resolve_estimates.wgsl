// Sums the results of a tile and keeps the key that a tile order by results gives it. The order of the sum is fixed, and passes are
// resolved in order, so that the key after a number of passes is the same under every schedule.

var<workgroup> wf_values: array<f32, 256>;

// `value`: what the lane's item has added to the film, 0 without one.
fn wf_note_results(tile: u32, lane: u32, value: f32) {
    wf_values[lane] = value;
    workgroupBarrier();
    if (lane < 16u) {
        var sum = 0.0;
        for (var i = 16u * lane; i < 16u * lane + 16u; i++) {
            sum += wf_values[i];
        }
        wf_values[16u * lane] = sum;
    }
    workgroupBarrier();
    if (lane > 0u) {
        return;
    }
    var sum = 0.0;
    for (var i = 0u; i < 256u; i += 16u) {
        sum += wf_values[i];
    }
    let memory = wf_tile_memory(tile);
    let known = vec2u(atomicLoad(&wf_counters[memory]), atomicLoad(&wf_counters[memory + 1u]));
    let next = wf_tile_estimate(known, sum, wf_control.resolve_pass + 1u);
    let key = min(next.z, WF_KEYS - 1u);
    atomicStore(&wf_counters[memory], next.x);
    atomicStore(&wf_counters[memory + 1u], next.y);
    atomicStore(&wf_counters[wf_estimate(tile)], key);
    if (WF_KEEPS_KEYS) {
        let lengths = (wf_control.ring * WF_RESULT_PLANES + wf_control.passes) * wf_control.tiles * 256u;
        wf_results[lengths + wf_control.resolve_pass * wf_control.tiles + tile] = key;
    }
}
