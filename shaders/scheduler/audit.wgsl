// Checked mode: counts again, from the lanes and the results themselves, what the counters claim. Runs between the stages of a step and
// the tick; the host compares.

var<workgroup> wf_flags: atomic<u32>;

// One work-group per block of the bank: its live lanes against the block's counter.
@compute @workgroup_size(256)
fn wf_audit_lanes(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = group.x + group.y * WF_MAX_GROUPS;
    let block = wf_bank_of.y + slot;
    let is_block = slot < wf_control.bank_blocks && block < wf_control.pool_blocks;
    if (lane == 0u) {
        atomicStore(&wf_flags, 0u);
    }
    workgroupBarrier();
    if (is_block && wf_bank[slot * WF_STRIDE + lane] != 0u) {
        atomicAdd(&wf_flags, 1u);
    }
    workgroupBarrier();
    if (lane == 0u && is_block) {
        let alive = atomicLoad(&wf_flags);
        atomicAdd(&wf_counters[WF_AUDIT_ALIVE], alive);
        let counted = atomicLoad(&wf_counters[wf_live_counter(block)]);
        if (WF_BY_LANE) {
            atomicAdd(&wf_counters[WF_AUDIT_MISMATCH], select(0u, 1u, alive != counted));
            return;
        }
        if (wf_block_tile(block) == WF_NONE) {
            atomicAdd(&wf_counters[WF_AUDIT_MISMATCH], alive);
            return;
        }
        if (alive + WF_ALL_DEAD != counted) {
            atomicAdd(&wf_counters[WF_AUDIT_MISMATCH], 1u);
        }
        atomicAdd(&wf_counters[WF_AUDIT_KILLED], atomicLoad(&wf_counters[wf_killed_counter(block)]));
    }
}

// One work-group per tile: its results of passes that have not been resolved.
@compute @workgroup_size(256)
fn wf_audit_results(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let tile = group.x + group.y * WF_MAX_GROUPS;
    if (tile >= wf_control.tiles || wf_tile_pixel(tile, lane) == WF_NONE) {
        return;
    }
    let plane = wf_control.tiles * 256u;
    let end = min(wf_control.passes, wf_control.resolved + wf_control.ring);
    var done = 0u;
    for (var pass_index = wf_control.resolved; pass_index < end; pass_index++) {
        let place = (pass_index % wf_control.ring) * WF_RESULT_PLANES * plane + tile * 256u + lane;
        done += select(0u, 1u, wf_results[place] == pass_index + 1u);
    }
    if (done > 0u) {
        atomicAdd(&wf_counters[WF_AUDIT_DONE], done);
    }
}
