// The tick: the one work-group between two steps that decides what runs next. It retires blocks whose lanes are all dead, lets a
// finished pass be resolved, asks the regeneration policy, hands tiles to dead blocks, and writes the indirect arguments.
// Assignment follows the order of the blocks by prefix sums, never the order of atomics.
// Source: Frolov and Galaktionov, Low overhead path regeneration, 2016.

var<workgroup> wf_live_lanes: atomic<u32>;
var<workgroup> wf_killed_lanes: atomic<u32>;
var<workgroup> wf_new_lanes: atomic<u32>;
// Blocks that receive a tile, the queue's head (pass, position), and the step in which they are born. Through work-group memory, because
// a work-group barrier says nothing about storage.
var<workgroup> wf_assignment: vec4u;

@compute @workgroup_size(WF_TICK_LANES)
fn wf_tick(@builtin(local_invocation_index) lane: u32) {
    let first = wf_first_block(lane);
    let end = wf_first_block(lane + 1u);
    if (lane == 0u) {
        atomicStore(&wf_live_lanes, 0u);
        atomicStore(&wf_killed_lanes, 0u);
        atomicStore(&wf_new_lanes, 0u);
    }
    wf_open_tick(lane);
    workgroupBarrier();

    // Count the live blocks, and retire those whose last lane has died. Few do in any one tick, so that is a loop of its own: lanes that
    // run in lock-step pay for the work of each.
    var live = 0u;
    var live_lanes = 0u;
    for (var chunk = first; chunk < end; chunk += 32u) {
        let chunk_blocks = min(end - chunk, 32u);
        var died = 0u;
        for (var i = 0u; i < chunk_blocks; i++) {
            let block = chunk + i;
            let count = wf_live_count(block);
            let lanes = max(count, WF_ALL_DEAD) - WF_ALL_DEAD;
            let goes_on = lanes > 0u;
            died |= select(0u, 1u << i, count != WF_NO_TILE && !goes_on);
            if (goes_on) {
                live += 1u;
                live_lanes += lanes;
                wf_tile_goes_on(block, lanes);
                wf_gamble(block, lanes);
            }
        }
        while (died != 0u) {
            wf_retire(chunk + firstTrailingBit(died));
            died &= died - 1u;
        }
    }
    atomicAdd(&wf_live_lanes, live_lanes);
    let before = wf_sums_before(lane, vec2u(live, end - first - live));
    if (lane == 0u) {
        wf_decide(wf_segments_before(WF_SEGMENTS));
    }
    workgroupBarrier();
    wf_order_passes(lane);

    // List the live blocks and those that receive a tile, both in block order.
    let assignment = wf_assignment;
    var dead = before.y;
    var listed = before.x + min(before.y, assignment.x);
    for (var block = first; block < end; block++) {
        let is_dead = wf_live_count(block) == WF_NO_TILE;
        let is_new = is_dead && dead < assignment.x;
        if (is_new) {
            wf_set_new_block(dead, block);
        }
        if (is_new || !is_dead) {
            wf_set_live_block(listed, block);
            listed += 1u;
        }
        dead += select(0u, 1u, is_dead);
    }
    storageBarrier();
    workgroupBarrier();

    // Hand out the tiles.
    var new_lanes = 0u;
    for (var rank = lane; rank < assignment.x; rank += WF_TICK_LANES) {
        let block = wf_new_block(rank);
        let place = assignment.z + rank;
        let tile = wf_queued_tile(place);
        let lanes = wf_tile_items(tile);
        wf_assign(block, tile, assignment.y + place / wf_control.tiles, assignment.w);
        wf_tile_begins(block, lanes);
        wf_gamble_begins(block);
        atomicStore(&wf_counters[wf_live_counter(block)], lanes + WF_ALL_DEAD);
        atomicStore(&wf_counters[wf_killed_counter(block)], 0u);
        wf_record_assignment(rank, block, tile);
        new_lanes += lanes;
    }
    atomicAdd(&wf_new_lanes, new_lanes);
    for (var bank = lane; bank < wf_control.banks; bank += WF_TICK_LANES) {
        wf_bank_starts[bank] = wf_bank_start(bank);
    }
    workgroupBarrier();
    for (var bank = lane; bank <= wf_control.banks; bank += WF_TICK_LANES) {
        wf_launch_bank(bank);
    }
    if (lane == 0u) {
        let new_lanes = atomicLoad(&wf_new_lanes);
        if (assignment.z + assignment.x >= wf_control.tiles) {
            wf_control.order_slot = 1u - wf_control.order_slot;
        }
        wf_control.items_started = wf_add_64(wf_control.items_started, new_lanes);
        wf_control.items_killed = wf_add_64(wf_control.items_killed, atomicLoad(&wf_killed_lanes));
        let lanes = atomicLoad(&wf_live_lanes) + new_lanes;
        wf_control.lane_steps = wf_add_64(wf_control.lane_steps, lanes);
        wf_record_step(lanes, assignment.x, wf_count_bank_launches());
        wf_control.record_assignments += select(0u, assignment.x, wf_control.record > 0u);
    }
}

// What the block's counter says: WF_NO_TILE, or WF_ALL_DEAD and one more for every lane that lives.
fn wf_live_count(block: u32) -> u32 {
    return atomicLoad(&wf_counters[wf_live_counter(block)]);
}

// Takes the tile from a block whose lanes are all dead.
fn wf_retire(block: u32) {
    wf_tile_ended(block);
    atomicAdd(&wf_retired[wf_block_pass(block) % wf_control.ring], 1u);
    atomicAdd(&wf_killed_lanes, atomicLoad(&wf_counters[wf_killed_counter(block)]));
    wf_set_block_tile(block, WF_NONE);
    atomicStore(&wf_counters[wf_live_counter(block)], WF_NO_TILE);
}

fn wf_record_assignment(rank: u32, block: u32, tile: u32) {
    if (wf_control.record > 0u) {
        let assignments = wf_control.record * WF_RECORD_PER_STEP;
        let place = assignments + (wf_control.record_assignments + rank) * WF_RECORD_PER_ASSIGNMENT;
        wf_record[place] = wf_block_birth(block);
        wf_record[place + 1u] = block;
        wf_record[place + 2u] = wf_block_pass(block);
        wf_record[place + 3u] = tile;
    }
}

// Takes the decisions of this tick from the number of live and dead blocks.
fn wf_decide(count: vec2u) {
    wf_close_passes(wf_control.tiles);

    // Hand out tiles of all passes whose results have a place in the ring.
    let open_passes = min(wf_control.passes, wf_control.resolved + wf_control.ring);
    let queued = (open_passes - wf_control.next_pass) * wf_control.tiles - wf_control.next_position;
    var assigned = 0u;
    if (count.y > 0u && queued > 0u && (count.x == 0u || wf_regenerate(count.x, count.y, wf_control.step))) {
        assigned = min(count.y, queued);
        wf_control.regenerations += 1u;
    }
    let step = wf_control.step + select(0u, 1u, count.x + assigned > 0u);
    wf_assignment = vec4u(assigned, wf_control.next_pass, wf_control.next_position, step);
    let position = wf_control.next_position + assigned;
    wf_control.next_pass += position / wf_control.tiles;
    wf_control.next_position = position % wf_control.tiles;

    let live = count.x + assigned;
    wf_control.new_blocks = assigned;
    wf_control.live_blocks = live;
    // Tiles go to the lowest dead blocks, so the fill grows only when none of its blocks is dead.
    wf_filled = max(select(wf_control.filled_blocks, 0u, count.x == 0u), live);
    wf_control.filled_blocks = wf_filled;
    wf_control.block_steps = wf_add_64(wf_control.block_steps, live);
    wf_control.step = step;
    wf_bank_starts[wf_control.banks] = vec2u(live, assigned);
}

fn wf_set_block_tile(block: u32, tile: u32) {
    wf_control.words[wf_block_tile_word(block)] = tile;
}

fn wf_assign(block: u32, tile: u32, pass_index: u32, birth: u32) {
    wf_control.words[wf_block_tile_word(block)] = tile;
    wf_control.words[wf_block_pass_word(block)] = pass_index;
    wf_control.words[wf_block_birth_word(block)] = birth;
}
