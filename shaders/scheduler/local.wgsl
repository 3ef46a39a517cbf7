// Stages that pack the live lanes of their work-group to its front.
// Source: Wald, Active thread compaction for GPU path tracing, 2011.

var<workgroup> wf_packed: array<u32, 256>;

// The lane that an invocation takes: the live ones in their order, WF_NONE behind them.
fn wf_packed_lane(place: u32, is_alive: bool) -> u32 {
    wf_packed[place] = WF_NONE;
    let before = wf_marked_before(place, is_alive);
    if (is_alive) {
        wf_packed[before] = place;
    }
    workgroupBarrier();
    return wf_packed[place];
}
