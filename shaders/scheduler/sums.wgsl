// Prefix sums over the invocations of the tick, two at a time.

// What each invocation brings to a scan, then sums within segments of 16, and what each segment adds up to.
const WF_SEGMENTS: u32 = WF_TICK_LANES / 16u;
var<workgroup> wf_scan: array<vec2u, WF_TICK_LANES>;
var<workgroup> wf_segments: array<vec2u, WF_SEGMENTS>;

// Sums over the invocations before this one. Two levels of 16 need three barriers, and barriers are what a tick costs.
fn wf_sums_before(lane: u32, value: vec2u) -> vec2u {
    wf_scan[lane] = value;
    workgroupBarrier();
    if (lane < WF_SEGMENTS) {
        var sum = vec2u(0u);
        for (var i = 16u * lane; i < 16u * lane + 16u; i++) {
            let next = sum + wf_scan[i];
            wf_scan[i] = sum;
            sum = next;
        }
        wf_segments[lane] = sum;
    }
    workgroupBarrier();
    return wf_scan[lane] + wf_segments_before(lane / 16u);
}

fn wf_segments_before(count: u32) -> vec2u {
    var sum = vec2u(0u);
    for (var segment = 0u; segment < count; segment++) {
        sum += wf_segments[segment];
    }
    return sum;
}
