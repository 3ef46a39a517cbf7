// Tile orders that follow from pass and position alone: nothing is measured, nothing sorted.

fn wf_tile_ended(block: u32) {
}

fn wf_tile_goes_on(block: u32, lanes: u32) {
}

fn wf_tile_begins(block: u32, lanes: u32) {
}

fn wf_order_passes(lane: u32) {
}

// The tile at a place of the queue, counted from the first tile of the pass that was being handed out when the tick began.
fn wf_queued_tile(place: u32) -> u32 {
    return wf_tile_at(wf_assignment.y + place / wf_control.tiles, place % wf_control.tiles);
}
