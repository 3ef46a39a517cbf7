// What every tick does besides handing out work: passes are closed and resolved in order, decisions are written down.

// What ended in this tick, per slot of the result ring: tiles, or items where lanes receive these.
var<workgroup> wf_retired: array<atomic<u32>, WF_MAX_RING>;

// Blocks of the current fill, dead or alive: up to the last that has run since the pool was empty.
var<workgroup> wf_filled: u32;

// The first of the blocks that an invocation of the tick looks after; those of the next one follow them.
fn wf_first_block(lane: u32) -> u32 {
    let blocks = wf_control.pool_blocks;
    return min(lane * ((blocks + WF_TICK_LANES - 1u) / WF_TICK_LANES), blocks);
}

// Nothing has ended yet, and nothing is counted.
fn wf_open_tick(lane: u32) {
    if (lane < WF_MAX_RING) {
        atomicStore(&wf_retired[lane], 0u);
    }
    wf_drain_counters(lane);
}

// Takes what ended from what the passes wait for; `whole` is what a pass begins with. Resolves the oldest pass when nothing of it is
// outstanding; its slot of the ring is free from the next step on.
fn wf_close_passes(whole: u32) {
    let ring = wf_control.ring;
    for (var slot = 0u; slot < ring; slot++) {
        wf_control.words[WF_RING + slot] -= atomicLoad(&wf_retired[slot]);
    }
    let oldest = wf_control.resolved;
    var resolve_tiles = 0u;
    if (oldest < wf_control.passes && wf_control.words[WF_RING + oldest % ring] == 0u) {
        resolve_tiles = wf_control.tiles;
        wf_control.words[WF_RING + oldest % ring] = whole;
        wf_control.resolve_pass = oldest;
        wf_control.resolved = oldest + 1u;
    }
    wf_write_arguments(WF_RESOLVE_ARGUMENTS, resolve_tiles);
}

// Writes down what this tick has decided, for those who want to compare it with something.
fn wf_record_step(live_lanes: u32, handed_out: u32, groups: u32) {
    if (wf_control.record == 0u) {
        return;
    }
    let resolves = wf_arguments[WF_RESOLVE_ARGUMENTS] > 0u;
    if (wf_control.live_blocks > 0u || resolves) {
        let place = wf_control.record_steps * WF_RECORD_PER_STEP;
        wf_record[place] = wf_control.live_blocks;
        wf_record[place + 1u] = live_lanes;
        wf_record[place + 2u] = handed_out;
        wf_record[place + 3u] = select(0u, wf_control.resolve_pass + 1u, resolves);
        wf_record[place + 4u] = groups;
        wf_control.record_steps += 1u;
    }
}

fn wf_set_live_block(index: u32, block: u32) {
    wf_control.words[wf_live_block_word(index)] = block;
}

fn wf_set_new_block(index: u32, block: u32) {
    wf_control.words[wf_new_block_word(index)] = block;
}
