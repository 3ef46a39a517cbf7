// Roulette that is no business of the tick.

fn wf_gamble(block: u32, lanes: u32) {
}

fn wf_gamble_begins(block: u32) {
}
