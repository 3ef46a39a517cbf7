// Queues by key: after the first stage of a step, the lanes of a bank that go on are listed once more, those of a key side by side.
// Source: Laine, Karras and Aila, Megakernels considered harmful: wavefront path tracing on GPUs, 2013.

var<workgroup> wf_of_keys: array<u32, WF_QUEUE_KEYS>;

// One work-group: where the lanes of each key go, and how many there are. The counts start again from zero.
@compute @workgroup_size(WF_QUEUE_KEYS)
fn wf_queues_of_bank(@builtin(local_invocation_index) key: u32) {
    let queues = wf_queues(wf_bank_of.x);
    wf_of_keys[key] = atomicExchange(&wf_counters[queues + key], 0u);
    workgroupBarrier();
    var begin = 0u;
    for (var before = 0u; before < key; before++) {
        begin += wf_of_keys[before];
    }
    atomicStore(&wf_counters[queues + WF_QUEUE_KEYS + key], begin);
    if (key == WF_QUEUE_KEYS - 1u) {
        atomicStore(&wf_counters[queues + 2u * WF_QUEUE_KEYS], begin + wf_of_keys[key]);
    }
}

// Every lane that goes on takes the next place of its key.
@compute @workgroup_size(256)
fn wf_enqueue(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) place: u32) {
    let seat = (group.x + group.y * WF_MAX_GROUPS) * 256u + place;
    if (seat >= wf_bank_listed(wf_bank_of.x)) {
        return;
    }
    let entry = wf_bank[seat / 256u * WF_QUEUE_STRIDE + WF_LIST + seat % 256u];
    let base = entry / 256u * WF_QUEUE_STRIDE + entry % 256u;
    if (wf_bank[base] == 0u) {
        return;
    }
    let kind = wf_bank[base + WF_KEY];
    let queued = atomicAdd(&wf_counters[wf_queues(wf_bank_of.x) + WF_QUEUE_KEYS + kind], 1u);
    wf_bank[queued / 256u * WF_QUEUE_STRIDE + WF_LIST_BY_KEY + queued % 256u] = entry;
}
