// Tile orders by keys that the device keeps: the largest first, ties by tile index. The order of a pass is fixed in the tick that hands out
// the last tile of the pass before it.

const WF_KEYS_PER_LANE: u32 = WF_KEYS / WF_TICK_LANES;

// Tiles per key, then the place of the next tile of that key.
var<workgroup> wf_buckets: array<atomic<u32>, WF_KEYS>;
var<workgroup> wf_round_keys: array<u32, WF_TICK_LANES>;
// Tiles to sort, 0 when no pass ends.
var<workgroup> wf_sort_tiles: u32;

fn wf_queued_tile(place: u32) -> u32 {
    let tiles = wf_control.tiles;
    // Passes that begin in the same tick have the same order: nothing is learnt between them.
    let is_next = place >= tiles;
    let slot = select(wf_control.order_slot, 1u - wf_control.order_slot, is_next);
    return wf_control.words[wf_order_word(slot) + place % tiles];
}

// Sorts when this tick hands out the last tile of a pass. The tick then turns the two
// orders around.
fn wf_order_passes(lane: u32) {
    // Estimates of tiles that ended in this very tick were written by other lanes.
    storageBarrier();
    if (lane == 0u) {
        let handed_out = wf_assignment.z + wf_assignment.x;
        wf_sort_tiles = select(0u, wf_control.tiles, wf_assignment.x > 0u && handed_out >= wf_control.tiles);
    }
    let tiles = workgroupUniformLoad(&wf_sort_tiles);
    if (tiles > 0u) {
        wf_sort(lane, tiles);
    }
}

fn wf_sort(lane: u32, tiles: u32) {
    // Gather the keys.
    for (var tile = lane; tile < tiles; tile += WF_TICK_LANES) {
        atomicStore(&wf_counters[wf_sort_key(tile)], atomicLoad(&wf_counters[wf_estimate(tile)]) & (WF_KEYS - 1u));
    }
    for (var key = lane; key < WF_KEYS; key += WF_TICK_LANES) {
        atomicStore(&wf_buckets[key], 0u);
    }
    storageBarrier();
    workgroupBarrier();
    wf_raise_keys(lane);

    // Count the tiles of each key, and sum over the larger keys.
    for (var tile = lane; tile < tiles; tile += WF_TICK_LANES) {
        atomicAdd(&wf_buckets[atomicLoad(&wf_counters[wf_sort_key(tile)])], 1u);
    }
    workgroupBarrier();
    var counts: array<u32, WF_KEYS_PER_LANE>;
    var sum = 0u;
    for (var i = 0u; i < WF_KEYS_PER_LANE; i++) {
        counts[i] = atomicLoad(&wf_buckets[WF_KEYS - 1u - WF_KEYS_PER_LANE * lane - i]);
        sum += counts[i];
    }
    var start = wf_sums_before(lane, vec2u(sum, 0u)).x;
    for (var i = 0u; i < WF_KEYS_PER_LANE; i++) {
        atomicStore(&wf_buckets[WF_KEYS - 1u - WF_KEYS_PER_LANE * lane - i], start);
        start += counts[i];
    }
    workgroupBarrier();

    // Place the tiles, as many at a time as there are invocations, equal keys in the order of their tiles.
    let order = wf_order_word(1u - wf_control.order_slot);
    for (var round = 0u; round < tiles; round += WF_TICK_LANES) {
        let tile = round + lane;
        var key = WF_NONE;
        if (tile < tiles) {
            key = atomicLoad(&wf_counters[wf_sort_key(tile)]);
        }
        wf_round_keys[lane] = key;
        workgroupBarrier();
        var place = 0u;
        if (tile < tiles) {
            place = atomicLoad(&wf_buckets[key]);
            for (var other = 0u; other < lane; other++) {
                place += select(0u, 1u, wf_round_keys[other] == key);
            }
        }
        workgroupBarrier();
        if (tile < tiles) {
            wf_control.words[order + place] = tile;
            atomicAdd(&wf_buckets[key], 1u);
        }
        workgroupBarrier();
    }
    storageBarrier();
}
