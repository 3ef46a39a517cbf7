// Tile orders by what tiles took before; tiles that still run count with what they have taken so far, if that is more.
// Source: Frolov and Galaktionov, Low overhead path regeneration, 2016 (longest processing time first).

fn wf_key_of(block: u32, remembered: u32, steps: u32) -> u32 {
    let items = wf_tile_items(wf_block_tile(block));
    var lane_steps = 0u;
    if (WF_READS_LANE_STEPS) {
        lane_steps = wf_block_lane_steps(block);
    }
    return min(wf_tile_key(remembered, steps, lane_steps, items), WF_KEYS - 1u);
}

// Steps that the block's tile has taken.
fn wf_steps_taken(block: u32, steps_done: u32) -> u32 {
    return steps_done + 1u - wf_block_birth(block);
}

// Remembers what the tile took, against what was known when it began; of several passes of a tile the latest counts, whichever ends
// first.
fn wf_tile_ended(block: u32) {
    let key = wf_key_of(block, wf_block_remembered(block), wf_steps_taken(block, wf_control.step));
    let entry = (wf_block_pass(block) << WF_KEY_BITS) | key;
    atomicMax(&wf_counters[wf_estimate(wf_block_tile(block))], entry);
}

fn wf_tile_goes_on(block: u32, lanes: u32) {
    if (WF_READS_LANE_STEPS) {
        wf_control.words[wf_block_lane_steps_word(block)] += lanes;
    }
}

fn wf_tile_begins(block: u32, lanes: u32) {
    wf_control.words[wf_block_lane_steps_word(block)] = lanes;
    let key = atomicLoad(&wf_counters[wf_estimate(wf_block_tile(block))]) & (WF_KEYS - 1u);
    wf_control.words[wf_block_remembered_word(block)] = key;
}

// Raises the keys of running tiles to what they have taken already.
fn wf_raise_keys(lane: u32) {
    for (var block = lane; block < wf_control.pool_blocks; block += WF_TICK_LANES) {
        let tile = wf_block_tile(block);
        if (tile != WF_NONE) {
            atomicMax(&wf_counters[wf_sort_key(tile)], wf_key_of(block, 0u, wf_steps_taken(block, wf_assignment.w - 1u)));
        }
    }
    storageBarrier();
    workgroupBarrier();
}
