// Where lanes receive items.

// The item at a place of the queue, counted from the first that is given away in this step.
fn wf_given_item(rank: u32) -> vec3u {
    let place = wf_control.given_position + rank;
    let queued = place / 256u;
    let pass_index = wf_control.given_pass + queued / wf_control.tiles;
    return vec3u(wf_tile_at(pass_index, queued % wf_control.tiles), place % 256u, pass_index);
}
