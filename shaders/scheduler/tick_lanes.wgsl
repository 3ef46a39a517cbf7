// The tick where lanes receive items one by one: it counts the lanes that live, lets a finished pass be resolved, asks the regeneration
// policy, says how many dead lanes receive an item, and writes the indirect arguments. Which lane gets which item follows from the order of
// the lanes: by prefix sums over the blocks here, and over the lanes of a block in `generate`.
// Sources: Novak, Havran and Dachsbacher, Path regeneration for interactive path tracing, 2010 (lanes in place); van Antwerpen, Improving
// SIMD efficiency for parallel Monte Carlo light transport on the GPU, 2011 (packed lanes).

// Lanes that receive an item, the queue's head (pass, place), and the step in which they are born.
var<workgroup> wf_assignment: vec4u;
// 1 when the lists of live lanes are made anew.
var<workgroup> wf_packs: u32;
var<workgroup> wf_new_lanes: atomic<u32>;
// One more than the last block that runs.
var<workgroup> wf_top: atomic<u32>;

@compute @workgroup_size(WF_TICK_LANES)
fn wf_tick(@builtin(local_invocation_index) lane: u32) {
    let first = wf_first_block(lane);
    let end = wf_first_block(lane + 1u);
    if (lane == 0u) {
        atomicStore(&wf_new_lanes, 0u);
        atomicStore(&wf_top, 0u);
    }
    wf_open_tick(lane);
    workgroupBarrier();

    var live = 0u;
    for (var block = first; block < end; block++) {
        live += wf_live_lanes_of(block);
        for (var slot = 0u; slot < wf_control.ring; slot++) {
            let done = atomicExchange(&wf_counters[wf_done_counter(block, slot)], 0u);
            if (done > 0u) {
                atomicAdd(&wf_retired[slot], done);
            }
        }
    }
    var before = wf_sums_before(lane, vec2u(live, 256u * (end - first) - live));
    let lanes = wf_segments_before(WF_SEGMENTS);
    if (lane == 0u) {
        wf_decide(lanes);
    }
    workgroupBarrier();
    let assignment = wf_assignment;

    // Which blocks run, and which are visited before: to give their dead lanes items, or to list their lanes.
    var counts = vec2u(0u);
    var top = 0u;
    for (var block = first; block < end; block++) {
        let lanes_of = wf_live_lanes_of(block);
        wf_control.words[wf_live_before_word(block)] = before.x;
        wf_control.words[wf_dead_before_word(block)] = before.y;
        before += vec2u(lanes_of, 256u - lanes_of);
        let runs = wf_runs(block);
        counts += runs;
        top = select(top, block + 1u, runs.x > 0u);
    }
    atomicMax(&wf_top, top);
    var place = wf_sums_before(lane, counts);
    let totals = wf_segments_before(WF_SEGMENTS);
    for (var block = first; block < end; block++) {
        let runs = wf_runs(block);
        if (runs.x > 0u) {
            wf_set_live_block(place.x, block);
        }
        if (runs.y > 0u) {
            wf_set_new_block(place.y, block);
        }
        place += runs;
    }
    atomicAdd(&wf_new_lanes, wf_items_given(lane));
    if (lane == 0u) {
        wf_control.live_blocks = totals.x;
        wf_control.new_blocks = totals.y;
        wf_filled = max(select(wf_control.filled_blocks, 0u, lanes.x == 0u), atomicLoad(&wf_top));
        wf_control.filled_blocks = wf_filled;
        wf_control.block_steps = wf_add_64(wf_control.block_steps, totals.x);
        wf_bank_starts[wf_control.banks] = totals;
    }
    storageBarrier();
    workgroupBarrier();
    for (var bank = lane; bank < wf_control.banks; bank += WF_TICK_LANES) {
        wf_bank_starts[bank] = wf_bank_start(bank);
        wf_pack_bank(bank, lanes.x);
    }
    storageBarrier();
    workgroupBarrier();
    for (var bank = lane; bank <= wf_control.banks; bank += WF_TICK_LANES) {
        wf_launch_bank(bank);
    }
    if (lane == 0u) {
        let new_lanes = atomicLoad(&wf_new_lanes);
        wf_control.items_started = wf_add_64(wf_control.items_started, new_lanes);
        wf_control.lane_steps = wf_add_64(wf_control.lane_steps, lanes.x + new_lanes);
        wf_record_step(lanes.x + new_lanes, assignment.x, wf_count_bank_launches());
    }
}

fn wf_live_lanes_of(block: u32) -> u32 {
    return atomicLoad(&wf_counters[wf_live_counter(block)]);
}

// 1 when a block runs in the next step, 1 when `generate` visits it.
fn wf_runs(block: u32) -> vec2u {
    let lanes = wf_live_lanes_of(block);
    let receives = lanes < 256u && wf_dead_before(block) < wf_assignment.x;
    let runs = lanes > 0u || receives;
    let is_visited = select(receives, runs && wf_packs > 0u, WF_PACKS);
    return vec2u(select(0u, 1u, runs), select(0u, 1u, is_visited));
}

// Takes the decisions of this tick from the number of live and dead lanes.
fn wf_decide(count: vec2u) {
    wf_close_passes(wf_control.pass_items);
    let places = wf_control.tiles * 256u;
    let open_passes = min(wf_control.passes, wf_control.resolved + wf_control.ring);
    let queued = (open_passes - wf_control.next_pass) * places - wf_control.next_position;
    let answer = count.x == 0u || wf_regenerate(count.x, count.y, wf_control.step);
    var assigned = 0u;
    if (answer && count.y > 0u && queued > 0u) {
        assigned = min(count.y, queued);
        wf_control.regenerations += 1u;
    }
    // A list without gaps, to which nothing is added, is good as it is.
    let packs = assigned > 0u || count.x == 0u || (answer && count.x < wf_control.listed);
    if (packs) {
        wf_control.listed = count.x + assigned;
    }
    wf_packs = select(0u, 1u, packs);
    let step = wf_control.step + select(0u, 1u, count.x + assigned > 0u);
    wf_control.step = step;
    wf_assignment = vec4u(assigned, wf_control.next_pass, wf_control.next_position, step);
    wf_control.given = assigned;
    wf_control.given_pass = wf_control.next_pass;
    wf_control.given_position = wf_control.next_position;
    let position = wf_control.next_position + assigned;
    wf_control.next_pass += position / places;
    wf_control.next_position = position % places;
}

// Makes room in the list of a bank: for the lanes that live, then for those that receive an item.
fn wf_pack_bank(bank: u32, live: u32) {
    if (wf_packs == 0u) {
        return;
    }
    let first = bank * wf_control.bank_blocks;
    let next = first + wf_control.bank_blocks;
    var end = vec2u(live, wf_control.pool_blocks * 256u - live);
    if (next < wf_control.pool_blocks) {
        end = vec2u(wf_live_before(next), wf_dead_before(next));
    }
    let front = end.x - wf_live_before(first);
    wf_control.words[WF_BANK_FRONT + bank] = front;
    let given = min(end.y, wf_assignment.x) - min(wf_dead_before(first), wf_assignment.x);
    wf_control.words[WF_BANK_LISTED + bank] = front + given;
}

// Items among the places of the queue that are given away, each tile by one invocation: places of partial tiles may have none.
fn wf_items_given(lane: u32) -> u32 {
    let begin = wf_assignment.z;
    let end = begin + wf_assignment.x;
    var items = 0u;
    for (var queued = begin / 256u + lane; queued * 256u < end; queued += WF_TICK_LANES) {
        let low = max(begin, queued * 256u) - queued * 256u;
        let high = min(end - queued * 256u, 256u);
        let tile = wf_queued_tile(queued);
        let of_tile = wf_tile_items(tile);
        if (of_tile == 256u) {
            items += high - low;
        } else if (high - low == 256u) {
            items += of_tile;
        } else {
            for (var index = low; index < high; index++) {
                items += select(0u, 1u, wf_tile_pixel(tile, index) != WF_NONE);
            }
        }
    }
    return items;
}
