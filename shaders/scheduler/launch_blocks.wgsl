// Stages are launched over blocks.

// Work-groups of a stage for the blocks of a bank.
fn wf_launched_of_bank(bank: u32) -> u32 {
    let live = wf_bank_starts[bank + 1u].x - wf_bank_starts[bank].x;
    let first = bank * wf_control.bank_blocks;
    return wf_launched(live, min(max(wf_filled, first) - first, wf_control.bank_blocks));
}
