// Adds the results of one finished pass to the film, each pixel by its own lane, passes in order.
// Floats are summed in three levels of 256 terms each, so that no sum of many small terms loses them; integers carry into a second word.
// A result that is not finite adds zero and is counted; a result that is missing adds nothing and is counted.

@compute @workgroup_size(256)
fn wf_resolve(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let tile = group.x + group.y * WF_MAX_GROUPS;
    if (tile < wf_control.tiles) {
        wf_note_results(tile, lane, wf_resolve_item(tile, lane));
    }
}

// Adds one result; what it returns is for orders that look at results, see `wf_resolve_leaves`.
fn wf_resolve_item(tile: u32, lane: u32) -> f32 {
    if (wf_tile_pixel(tile, lane) == WF_NONE) {
        return 0.0;
    }
    let place = tile * 256u + lane;
    let plane = wf_control.tiles * 256u;
    let pass_index = wf_control.resolve_pass;
    let result = (pass_index % wf_control.ring) * WF_RESULT_PLANES * plane + place;
    if (wf_results[result] != pass_index + 1u) {
        atomicAdd(&wf_counters[WF_MISSING], 1u);
        return 0.0;
    }
    let samples = wf_film[place] + 1u;
    wf_film[place] = samples;
    return wf_resolve_leaves(result, place, plane, samples);
}

// Returns the term that counts.
fn wf_sum_f32(result: u32, film: u32, plane: u32, samples: u32) -> f32 {
    let word = wf_results[result];
    var term = bitcast<f32>(word);
    if ((word & 0x7f800000u) == 0x7f800000u) {
        atomicAdd(&wf_counters[WF_NOT_FINITE], 1u);
        term = 0.0;
    }
    let low = bitcast<f32>(wf_film[film]) + term;
    if (samples % 256u != 0u) {
        wf_film[film] = bitcast<u32>(low);
        return term;
    }
    wf_film[film] = 0u;
    let middle = bitcast<f32>(wf_film[film + plane]) + low;
    if (samples % 65536u != 0u) {
        wf_film[film + plane] = bitcast<u32>(middle);
        return term;
    }
    wf_film[film + plane] = 0u;
    let high = bitcast<f32>(wf_film[film + 2u * plane]) + middle;
    wf_film[film + 2u * plane] = bitcast<u32>(high);
    return term;
}

fn wf_sum_u32(result: u32, film: u32, plane: u32) {
    let low = wf_film[film] + wf_results[result];
    wf_film[film] = low;
    if (low < wf_results[result]) {
        wf_film[film + plane] += 1u;
    }
}
