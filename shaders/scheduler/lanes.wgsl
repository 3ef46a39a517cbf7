// Where lanes receive items: which lanes of a block are dead, as one bit each.

var<workgroup> wf_dead_bits: array<atomic<u32>, 8>;

// How many lanes before this one are dead; called by all lanes of a work-group together.
fn wf_dead_lanes_before(lane: u32, is_dead: bool) -> u32 {
    if (lane < 8u) {
        atomicStore(&wf_dead_bits[lane], 0u);
    }
    workgroupBarrier();
    if (is_dead) {
        atomicOr(&wf_dead_bits[lane / 32u], 1u << (lane % 32u));
    }
    workgroupBarrier();
    var before = countOneBits(atomicLoad(&wf_dead_bits[lane / 32u]) & ((1u << (lane % 32u)) - 1u));
    for (var word = 0u; word < lane / 32u; word++) {
        before += countOneBits(atomicLoad(&wf_dead_bits[word]));
    }
    return before;
}

// The item at a place of the queue, counted from the first that is given away in this step.
fn wf_given_item(rank: u32) -> vec3u {
    let place = wf_control.given_position + rank;
    let queued = place / 256u;
    let pass_index = wf_control.given_pass + queued / wf_control.tiles;
    return vec3u(wf_tile_at(pass_index, queued % wf_control.tiles), place % 256u, pass_index);
}
