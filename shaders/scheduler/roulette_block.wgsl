// Roulette by block: the tick draws once for all live lanes of a block; the next step's first kernel kills or reweights them.

fn wf_gamble(block: u32, lanes: u32) {
    let chance = wf_block_chance(atomicExchange(&wf_counters[wf_chance_counter(block)], 0u), lanes);
    let step = wf_control.step - wf_block_birth(block);
    let draw = wf_block_draw(wf_block_tile(block), wf_control.first_sample + wf_block_pass(block), step);
    wf_control.words[wf_block_inverse_word(block)] = bitcast<u32>(wf_inverse_survival(chance, draw));
}

fn wf_gamble_begins(block: u32) {
    // The bits of 1. naga 30 makes 1u of `bitcast<u32>(1.0)`.
    wf_control.words[wf_block_inverse_word(block)] = 0x3f800000u;
    atomicStore(&wf_counters[wf_chance_counter(block)], 0u);
}
