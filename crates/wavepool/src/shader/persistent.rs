//! Work-groups that stay: each walks one tile after the other of those that a launch was given.
//!
//! Key decision: the advance kernel gives a launch a bounded run of the tile queue, and an atomic counter hands it out. Which group walks a
//! tile is decided by the hardware, what comes of it is not: random numbers and results belong to items. Groups wait for nobody; what a
//! launch was given is done when it ends, so that passes are accounted for between launches. What is given up: nobody sees the order.
//!
//! **Invariant:** a tile is taken by its whole work-group, so that lanes can share a draw of roulette.

/// The kernel around `wf_walk`. The number of the tile reaches all lanes through a uniform load, as barriers behind it need.
pub(super) const PERSISTENT: &str = "var<workgroup> wf_taken: u32;
@compute @workgroup_size(256)
fn wf_persistent(@builtin(local_invocation_index) wf_lane: u32) {
    loop {
        if (wf_lane == 0u) { wf_taken = atomicAdd(&wf_counters[WF_TAKEN], 1u); }
        let wf_slot = workgroupUniformLoad(&wf_taken);
        if (wf_slot >= wf_control.new_blocks) { break; }
        let wf_place = wf_control.next_position + wf_slot;
        let wf_pass_index = wf_control.next_pass + wf_place / wf_control.tiles;
        wf_walk(wf_tile_at(wf_pass_index, wf_place % wf_control.tiles), wf_pass_index, wf_lane);
    }
}
";
