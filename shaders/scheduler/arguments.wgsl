// Indirect arguments: work-groups of a launch, folded into two dimensions beyond the limit of one.

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
