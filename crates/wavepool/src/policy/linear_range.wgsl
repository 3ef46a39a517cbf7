// Device face of LinearRange: wf_control.work holds the count.

fn wf_tile_pixel(tile: u32, index: u32) -> u32 {
    let pixel = tile * 256u + index;
    return select(WF_NONE, pixel, pixel < wf_control.work.x);
}

fn wf_tile_items(tile: u32) -> u32 {
    return min(256u, wf_control.work.x - tile * 256u);
}

fn item_coordinates(item: Item) -> vec2u {
    return vec2u(item.pixel, 0u);
}
