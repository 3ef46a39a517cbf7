// Device face of the curves over the grid of tiles. A square as large as a power of two is cut in four, again and again; a quarter that the
// grid only touches has as many places on the curve as it has tiles. `wf_quarter` of a turn and a number says where the quarter of that
// number lies (x, y) and how the curve is turned within it.

fn wf_tiles_in_square(corner: vec2u, side: u32, columns: u32) -> u32 {
    let rows = wf_control.tiles / columns;
    let full = select(0u, min(side, rows - corner.y), corner.y < rows);
    let wide = select(0u, min(side, columns - corner.x), corner.x < columns);
    // The last row may be shorter than the others.
    let rest = wf_control.tiles % columns;
    let has_rest = corner.y <= rows && rows - corner.y < side && corner.x < rest;
    return wide * full + select(0u, min(side, rest - corner.x), has_rest);
}

fn wf_tile_at(pass_index: u32, position: u32) -> u32 {
    let columns = clamp(wf_control.work.z, 1u, wf_control.tiles);
    let extent = max(columns, (wf_control.tiles + columns - 1u) / columns);
    var side = 1u;
    while (side < extent) {
        side *= 2u;
    }
    var corner = vec2u(0u);
    var turn = 0u;
    var left = position;
    while (side > 1u) {
        side /= 2u;
        for (var quarter = 0u; quarter < 4u; quarter++) {
            let place = wf_quarter(turn, quarter);
            let at = corner + place.xy * side;
            let tiles = wf_tiles_in_square(at, side, columns);
            if (left < tiles) {
                corner = at;
                turn = place.z;
                break;
            }
            left -= tiles;
        }
    }
    return corner.y * columns + corner.x;
}
