// Stages are launched over the lists of packed lanes.

// Work-groups of a stage for the list of a bank.
fn wf_launched_of_bank(bank: u32) -> u32 {
    return (wf_bank_listed(bank) + 255u) / 256u;
}
