// Marked lanes of a work-group, as one bit each. All lanes of a work-group call these together.

var<workgroup> wf_marks: array<atomic<u32>, 8>;

// How many lanes before this one are marked.
fn wf_marked_before(lane: u32, is_marked: bool) -> u32 {
    if (lane < 8u) {
        atomicStore(&wf_marks[lane], 0u);
    }
    workgroupBarrier();
    if (is_marked) {
        atomicOr(&wf_marks[lane / 32u], 1u << (lane % 32u));
    }
    workgroupBarrier();
    var before = countOneBits(atomicLoad(&wf_marks[lane / 32u]) & ((1u << (lane % 32u)) - 1u));
    for (var word = 0u; word < lane / 32u; word++) {
        before += countOneBits(atomicLoad(&wf_marks[word]));
    }
    return before;
}
