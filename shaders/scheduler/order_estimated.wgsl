// Tile orders by what results say: the keys are written where passes are resolved, and nothing is measured in the tick.

fn wf_tile_ended(block: u32) {
}

fn wf_tile_goes_on(block: u32, lanes: u32) {
}

fn wf_tile_begins(block: u32, lanes: u32) {
}

fn wf_raise_keys(lane: u32) {
}
