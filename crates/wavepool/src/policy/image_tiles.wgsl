// Device face of ImageTiles: wf_control.work holds width, height and tiles per row.

fn wf_tile_pixel(tile: u32, index: u32) -> u32 {
    let work = wf_control.work;
    let x = tile % work.z * 16u + index % 16u;
    let y = tile / work.z * 16u + index / 16u;
    return select(WF_NONE, y * work.x + x, x < work.x && y < work.y);
}

fn wf_tile_items(tile: u32) -> u32 {
    let work = wf_control.work;
    return min(16u, work.x - tile % work.z * 16u) * min(16u, work.y - tile / work.z * 16u);
}

fn item_coordinates(item: Item) -> vec2u {
    return vec2u(item.pixel % wf_control.work.x, item.pixel / wf_control.work.x);
}
