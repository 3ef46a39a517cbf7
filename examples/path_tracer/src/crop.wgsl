// Device face of CropTiles: wf_control.work holds left and upper edge, width and height (each pair in one word), tiles per row, and the width
// of the whole picture.

fn wf_tile_pixel(tile: u32, index: u32) -> u32 {
    let work = wf_control.work;
    let x = tile % work.z * 16u + index % 16u;
    let y = tile / work.z * 16u + index / 16u;
    let pixel = ((work.x >> 16u) + y) * work.w + (work.x & 0xffffu) + x;
    return select(WF_NONE, pixel, x < (work.y & 0xffffu) && y < (work.y >> 16u));
}

fn wf_tile_items(tile: u32) -> u32 {
    let work = wf_control.work;
    return min(16u, (work.y & 0xffffu) - tile % work.z * 16u) * min(16u, (work.y >> 16u) - tile / work.z * 16u);
}

fn item_coordinates(item: Item) -> vec2u {
    return vec2u(item.pixel % wf_control.work.w, item.pixel / wf_control.work.w);
}
