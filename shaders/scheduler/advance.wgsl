// Advances what runs whole walks in one kernel: accounts for the tiles just launched, lets a finished pass be resolved, gives the next
// launch a run of the tile queue. A launch ends with all its walks, so a pass is finished when its last tile has been launched.

@compute @workgroup_size(WF_TICK_LANES)
fn wf_advance(@builtin(local_invocation_index) lane: u32) {
    wf_drain_counters(lane);
    if (lane > 0u) {
        return;
    }
    let tiles = wf_control.tiles;
    let launched = wf_control.new_blocks;
    if (launched > 0u) {
        wf_control.block_steps = wf_add_64(wf_control.block_steps, launched);
        wf_control.group_steps = wf_add_64(wf_control.group_steps, wf_control.live_blocks);
        wf_control.step += 1u;
    }
    let head = wf_control.next_position + launched;
    let next_pass = wf_control.next_pass + head / tiles;
    let position = head % tiles;

    // Resolve the oldest finished pass; its slot of the ring is free from the next launch on.
    var resolved = wf_control.resolved;
    var resolve_tiles = 0u;
    if (resolved < next_pass) {
        resolve_tiles = tiles;
        wf_control.resolve_pass = resolved;
        resolved += 1u;
    }

    // Hand out tiles of all passes whose results have a place in the ring. A launch that would be short waits while more passes are to be
    // resolved, one in every step.
    let most = wf_control.pool_blocks * WF_TILES_PER_GROUP;
    let open_passes = min(wf_control.passes, resolved + wf_control.ring);
    let queued = (open_passes - next_pass) * tiles - position;
    let waits = resolved < next_pass && queued < most;
    let next = select(min(queued, most), 0u, waits);
    let groups = min(next, wf_control.pool_blocks);
    wf_control.resolved = resolved;
    wf_control.next_pass = next_pass;
    wf_control.next_position = position;
    wf_control.new_blocks = next;
    wf_control.live_blocks = groups;
    wf_write_arguments(WF_BANK_ARGUMENTS + WF_STAGE_ARGUMENTS, groups);
    wf_write_arguments(WF_RESOLVE_ARGUMENTS, resolve_tiles);
}
