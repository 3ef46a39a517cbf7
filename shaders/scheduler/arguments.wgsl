// Indirect arguments (work-groups of a launch, folded into two dimensions beyond the limit of one) and counters of 64 bits.

fn wf_write_arguments(offset: u32, groups: u32) {
    wf_arguments[offset] = min(groups, WF_MAX_GROUPS);
    wf_arguments[offset + 1u] = (groups + WF_MAX_GROUPS - 1u) / WF_MAX_GROUPS;
    wf_arguments[offset + 2u] = 1u;
}

// 64-bit counters as (low, high).
fn wf_add_64(counter: vec2u, amount: u32) -> vec2u {
    let low = counter.x + amount;
    return vec2u(low, counter.y + select(0u, 1u, low < amount));
}

// Empties the counters into their totals, one per invocation, so that 32 bits suffice between two ticks. The audit's own are left.
fn wf_drain_counters(lane: u32) {
    if (lane >= WF_BLOCK_COUNTERS || (lane >= WF_AUDIT_ALIVE && lane < WF_AFTER_AUDIT)) {
        return;
    }
    let amount = atomicExchange(&wf_counters[lane], 0u);
    if (amount > 0u) {
        let place = WF_TOTALS + 2u * lane;
        let total = wf_add_64(vec2u(wf_control.words[place], wf_control.words[place + 1u]), amount);
        wf_control.words[place] = total.x;
        wf_control.words[place + 1u] = total.y;
    }
}
