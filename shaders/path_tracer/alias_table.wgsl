// Picks an entry with exactly its stored probability from two random words.
// Source: Walker, 1974; integer thresholds, two independent words, and a power of two of columns: row L5 of our numerics.

import package::path_tracer::scene_access::table_row;

// `base` is the first row; a row holds two entries (threshold, other, threshold, other); `log2_count` is at least 1.
fn pick_alias(base: u32, log2_count: u32, column_word: u32, threshold_word: u32) -> u32 {
    let column = column_word >> (32u - log2_count);
    let row = table_row(base + (column >> 1u));
    let entry = select(row.xy, row.zw, (column & 1u) == 1u);
    return select(entry.y, column, threshold_word < entry.x);
}
