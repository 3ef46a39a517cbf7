// The tick's lists cut into banks, each of which is launched by itself.

// Where each bank's blocks begin in the lists of live (x) and of new (y) blocks; the entry after the last bank is the end.
var<workgroup> wf_bank_starts: array<vec2u, WF_MAX_BANKS + 1u>;

// The place of the first of `count` entries that is not before `block`, in a list in block order that begins at a word of the control.
fn wf_first_of_list(list: u32, count: u32, block: u32) -> u32 {
    var low = 0u;
    var high = select(count, 0u, block == 0u);
    while (low < high) {
        let middle = (low + high) / 2u;
        if (wf_control.words[list + middle] < block) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

// Where the lists of live and of new blocks reach the blocks of a bank.
fn wf_bank_start(bank: u32) -> vec2u {
    let first = bank * wf_control.bank_blocks;
    return vec2u(
        wf_first_of_list(wf_live_block_word(0u), wf_control.live_blocks, first),
        wf_first_of_list(wf_new_block_word(0u), wf_control.new_blocks, first),
    );
}

// Says where the blocks of a bank stand in the two lists, and how many work-groups they are.
fn wf_launch_bank(bank: u32) {
    let start = wf_bank_starts[bank];
    wf_control.words[WF_BANK_LIVE + bank] = start.x;
    wf_control.words[WF_BANK_NEW + bank] = start.y;
    if (bank < wf_control.banks) {
        let end = wf_bank_starts[bank + 1u];
        let arguments = WF_BANK_ARGUMENTS + WF_ARGUMENTS_PER_BANK * bank;
        wf_write_arguments(arguments + WF_GENERATE_ARGUMENTS, end.y - start.y);
        wf_write_arguments(arguments + WF_STAGE_ARGUMENTS, wf_launched_of_bank(bank));
        if (WF_PACKS) {
            wf_write_arguments(arguments + WF_QUEUE_ARGUMENTS, min(wf_launched_of_bank(bank), 1u));
        }
    }
}

// Counts what a step launches, and returns the work-groups of each stage. Launches of a bank without blocks have no groups and do not count.
fn wf_count_bank_launches() -> u32 {
    var groups = 0u;
    for (var bank = 0u; bank < wf_control.banks; bank++) {
        let launched = wf_launched_of_bank(bank);
        groups += launched;
        wf_control.bank_steps += min(launched, 1u);
        wf_control.bank_regenerations += min(wf_bank_starts[bank + 1u].y - wf_bank_starts[bank].y, 1u);
    }
    wf_control.group_steps = wf_add_64(wf_control.group_steps, groups);
    return groups;
}
