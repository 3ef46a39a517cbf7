// Advances the megakernel: accounts for the tiles just launched, lets a finished pass be resolved, prepares the next launch.

@compute @workgroup_size(WF_TICK_LANES)
fn wf_advance(@builtin(local_invocation_index) lane: u32) {
    wf_drain_counters(lane);
    if (lane > 0u) {
        return;
    }
    let launched = wf_control.new_blocks;
    var pass_index = wf_control.next_pass;
    var position = wf_control.next_position + launched;
    var resolve_tiles = 0u;
    if (launched > 0u) {
        wf_control.block_steps = wf_add_64(wf_control.block_steps, launched);
        wf_control.group_steps = wf_add_64(wf_control.group_steps, launched);
        wf_control.step += 1u;
        if (position == wf_control.tiles) {
            resolve_tiles = wf_control.tiles;
            wf_control.resolve_pass = pass_index;
            pass_index += 1u;
            position = 0u;
            wf_control.resolved = pass_index;
        }
    }
    let left = select(0u, wf_control.tiles - position, pass_index < wf_control.passes);
    let next = min(left, wf_control.pool_blocks);
    wf_control.next_pass = pass_index;
    wf_control.next_position = position;
    wf_control.new_blocks = next;
    wf_control.live_blocks = next;
    wf_write_arguments(WF_BANK_ARGUMENTS + WF_STAGE_ARGUMENTS, next);
    wf_write_arguments(WF_RESOLVE_ARGUMENTS, resolve_tiles);
}
