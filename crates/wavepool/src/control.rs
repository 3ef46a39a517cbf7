//! Facts that the host shares with the scheduler's kernels, declared once and emitted to WGSL.
//!
//! **Invariant:** the WGSL declaration and the Rust struct come from the same list; naga's offsets are compared in a test.

use crate::layout::BLOCK;

/// Passes that may be in flight at once, at most: the size of the tick's table.
pub(crate) const MAX_RING: u32 = 64;
/// Banks that a pool may have, at most: 8 GiB of state at 128 MiB each.
pub(crate) const MAX_BANKS: u32 = 64;
/// Invocations of the tick: at least [`MAX_RING`] and [`counters::BLOCKS`], a divisor of the keys of a measured order.
pub(crate) const TICK_LANES: u32 = 256;
/// Work-groups per dimension that every device accepts.
pub(crate) const MAX_GROUPS: u32 = 65_535;
/// What a stage returns to end its walk.
pub(crate) const FINISH: u32 = 1;
/// "No tile", "no pixel".
pub(crate) const NONE: u32 = u32::MAX;

/// What the control buffer keeps per block: its tile, the pass of that, the step it began in, an entry of the list of live blocks, one of
/// the list of blocks that start a tile, the lane-steps of the tile so far, the key that a measured order remembered of it when it began,
/// and what block roulette has drawn (bits of a float: 0 kills). Where lanes receive items: how many lanes of the pool live before the
/// block's first one, and how many are dead.
const BLOCK_SECTIONS: [&str; 10] = [
    "block_tile",
    "block_pass",
    "block_birth",
    "live_block",
    "new_block",
    "block_lane_steps",
    "block_remembered",
    "block_inverse",
    "live_before",
    "dead_before",
];
/// Places in that list.
pub(crate) const BLOCK_TILE: u32 = 0;
pub(crate) const BLOCK_PASS: u32 = 1;
pub(crate) const BLOCK_BIRTH: u32 = 2;
/// Tile orders that sort keep keys of so many bits, packed with the pass they stem from.
pub(crate) const KEY_BITS: u32 = 10;

/// Where the arguments of each indirect launch lie, in words.
pub(crate) mod arguments {
    pub(crate) const RESOLVE: u32 = 0;
    /// Of the first bank; the others follow.
    pub(crate) const BANKS: u32 = 4;
    pub(crate) const PER_BANK: u32 = 12;
    /// Within a bank.
    pub(crate) const GENERATE: u32 = 0;
    /// Within a bank.
    pub(crate) const STAGE: u32 = 4;
    /// Within a bank: one work-group when the bank has lanes.
    pub(crate) const QUEUES: u32 = 8;

    pub(crate) fn words(banks: u32) -> u32 {
        BANKS + PER_BANK * banks
    }
}

/// Where the counters lie, in words. The tick empties them into totals of 64 bits, except those of the audit.
pub(crate) mod counters {
    pub(crate) const NOT_FINITE: u32 = 0;
    pub(crate) const MISSING: u32 = 1;
    /// Items ended by roulette in the megakernel; wavefronts count per block.
    pub(crate) const KILLED: u32 = 2;
    /// Items ended by the program; counted in checked mode alone.
    pub(crate) const FINISHED: u32 = 3;
    /// What the audit finds: lanes alive, blocks whose counter disagrees with their lanes, results of unresolved passes, items killed in
    /// blocks that still run.
    pub(crate) const AUDIT_ALIVE: u32 = 4;
    pub(crate) const AUDIT_MISMATCH: u32 = 5;
    pub(crate) const AUDIT_DONE: u32 = 6;
    pub(crate) const AUDIT_KILLED: u32 = 7;
    pub(crate) const AFTER_AUDIT: u32 = 8;
    pub(crate) const STORAGE_CLAMPED: u32 = 8;
    pub(crate) const OUT_OF_RANGE: u32 = 9;
    /// Tiles or items of a launch that have been asked for; where work-groups stay.
    pub(crate) const TAKEN: u32 = 10;
    /// The program's named counters and assertions.
    pub(crate) const NAMED: u32 = 16;
    /// Named counters and assertions that a program may have.
    pub(crate) const MOST_NAMED: u32 = BLOCKS - NAMED;
    /// Per block: live lanes, lanes killed by roulette, their chances condensed for block roulette.
    pub(crate) const BLOCKS: u32 = 64;
    /// What the first of these says of a block without a tile, and of one whose lanes are all dead; each live lane adds one.
    pub(crate) const NO_TILE: u32 = 0;
    pub(crate) const ALL_DEAD: u32 = 1;
    /// Words per block.
    pub(crate) const PER_BLOCK: u32 = 3;
}

/// Queues by key, per bank: lanes of each key, where the key's part of the list begins, and the length of the list.
pub(crate) mod queues {
    /// Keys that have a queue of their own; larger ones share these, modulo.
    pub(crate) const KEYS: u32 = 64;
    /// Words of counters.
    pub(crate) const PER_BANK: u32 = 2 * KEYS + 1;
}

/// What the control buffer keeps between its head and the table of blocks, in words from the end of the head.
pub(crate) mod tables {
    use super::{MAX_BANKS, MAX_RING, counters};

    /// Tiles of the pass in each slot of the result ring that have not been retired; where lanes receive items, items without a result.
    pub(crate) const RING: u32 = 0;
    /// Where each bank's blocks begin in the list of live blocks, and where the last one's end.
    pub(crate) const BANK_LIVE: u32 = RING + MAX_RING;
    /// The same for the list of blocks that start a tile.
    pub(crate) const BANK_NEW: u32 = BANK_LIVE + MAX_BANKS + 1;
    /// Where lanes are packed: entries of each bank's list, and how many of them, at its front, lived when it was made.
    pub(crate) const BANK_LISTED: u32 = BANK_NEW + MAX_BANKS + 1;
    pub(crate) const BANK_FRONT: u32 = BANK_LISTED + MAX_BANKS;
    /// The counters' totals, as (low, high).
    pub(crate) const TOTALS: u32 = BANK_FRONT + MAX_BANKS;
    pub(crate) const BLOCKS: u32 = (TOTALS + 2 * counters::BLOCKS).next_multiple_of(4);
}

/// What the tick writes down about a step and about a tile handed out, when asked, in words.
pub(crate) mod record {
    /// Live blocks, live lanes, blocks that start a tile, the pass handed to resolve plus one (0: none), work-groups per stage.
    pub(crate) const PER_STEP: u32 = 5;
    /// Step, block, pass, tile.
    pub(crate) const PER_ASSIGNMENT: u32 = 4;
}

macro_rules! control_record {
    ($($(#[$doc:meta])* $name:ident: $ty:ty = $wgsl:literal,)*) => {
        /// The head of the control buffer; the block table follows.
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
        pub(crate) struct Control {
            $($(#[$doc])* pub(crate) $name: $ty,)*
        }

        impl Control {
            fn members() -> String {
                [$(concat!("    ", stringify!($name), ": ", $wgsl, ",\n")),*].concat()
            }
        }

        #[cfg(test)]
        const OFFSETS: &[(&str, usize)] = &[$((stringify!($name), std::mem::offset_of!(Control, $name))),*];
    };
}

control_record! {
    /// The work source's four parameters.
    work: [u32; 4] = "vec4u",
    /// 64-bit counters as (low, high).
    items_started: [u32; 2] = "vec2u",
    /// Items ended by roulette, counted when their block is retired.
    items_killed: [u32; 2] = "vec2u",
    /// Sum of live blocks over steps.
    block_steps: [u32; 2] = "vec2u",
    /// Sum over steps of the lanes alive when the step began.
    lane_steps: [u32; 2] = "vec2u",
    /// Always zero; kernels cannot know it.
    opaque_zero: u32 = "u32",
    /// Tiles per pass.
    tiles: u32 = "u32",
    /// Passes to do.
    passes: u32 = "u32",
    /// Sample number of pass 0.
    first_sample: u32 = "u32",
    /// Blocks of the pool; without one: work-groups per launch.
    pool_blocks: u32 = "u32",
    /// Passes whose results can be kept at once.
    ring: u32 = "u32",
    /// Steps in which a block was live.
    step: u32 = "u32",
    /// Length of the list of live blocks; without a pool: work-groups of the launch.
    live_blocks: u32 = "u32",
    /// Length of the list of blocks that start a tile in this step; without a pool: tiles of the launch.
    new_blocks: u32 = "u32",
    /// Head of the queue; without a pool the first tile of the launch.
    next_pass: u32 = "u32",
    /// Head of the queue within the pass: in tiles, or in places of tiles where lanes receive items.
    next_position: u32 = "u32",
    /// Passes that have been handed to the resolve kernel.
    resolved: u32 = "u32",
    /// The pass that the next resolve launch adds.
    resolve_pass: u32 = "u32",
    /// Ticks that handed out tiles.
    regenerations: u32 = "u32",
    /// Keys the draws of roulette together with pixel, sample and step.
    seed: u32 = "u32",
    /// Which of the two stored orders the queue follows.
    order_slot: u32 = "u32",
    /// Banks of the pool.
    banks: u32 = "u32",
    /// Blocks per bank; the last one may have fewer.
    bank_blocks: u32 = "u32",
    /// Steps that the record has room for; 0 when nothing is written down.
    record: u32 = "u32",
    /// Steps written down since the host emptied the record.
    record_steps: u32 = "u32",
    /// Tiles written down since.
    record_assignments: u32 = "u32",
    /// Sum over the steps of banks with a live block: that often each stage was launched.
    bank_steps: u32 = "u32",
    /// Sum over the regenerations of banks with a block that starts a tile.
    bank_regenerations: u32 = "u32",
    /// Blocks of the current fill: from the first to the last that has held a tile since the pool was empty.
    filled_blocks: u32 = "u32",
    /// Sum over the steps of the work-groups that each stage was launched with.
    group_steps: [u32; 2] = "vec2u",
    /// Items of a pass.
    pass_items: u32 = "u32",
    /// Where lanes receive items: dead lanes that do in this step, and the head of the queue before.
    given: u32 = "u32",
    /// The pass of that head.
    given_pass: u32 = "u32",
    /// Its position within the pass.
    given_position: u32 = "u32",
    /// Where lanes are packed: entries of all lists.
    listed: u32 = "u32",
    /// Rounds the head to whole rows.
    padding: u32 = "u32",
}

impl Control {
    /// Words of the whole control buffer for a pool; where tiles are sorted, two orders of them are kept.
    pub(crate) fn words(pool_blocks: u32, ordered_tiles: u32) -> u64 {
        size_of::<Control>() as u64 / 4
            + u64::from(tables::BLOCKS)
            + BLOCK_SECTIONS.len() as u64 * u64::from(pool_blocks)
            + 2 * u64::from(ordered_tiles)
    }

    /// Where the table of blocks begins, in bytes.
    pub(crate) fn block_table() -> u64 {
        size_of::<Control>() as u64 + 4 * u64::from(tables::BLOCKS)
    }
}

/// A 64-bit counter as the kernels keep it.
pub(crate) fn counter_64(words: [u32; 2]) -> u64 {
    u64::from(words[0]) | u64::from(words[1]) << 32
}

/// Declarations that every kernel and every program sees.
pub(crate) fn declarations() -> String {
    let members = Control::members();
    let constants = [
        ("WF_NONE", NONE),
        ("WF_MAX_GROUPS", MAX_GROUPS),
        ("WF_MAX_RING", MAX_RING),
        ("WF_MAX_BANKS", MAX_BANKS),
        ("WF_RING", tables::RING),
        ("WF_BANK_LIVE", tables::BANK_LIVE),
        ("WF_BANK_NEW", tables::BANK_NEW),
        ("WF_BANK_LISTED", tables::BANK_LISTED),
        ("WF_BANK_FRONT", tables::BANK_FRONT),
        ("WF_TOTALS", tables::TOTALS),
        ("WF_BLOCK_TABLE", tables::BLOCKS),
        ("WF_RECORD_PER_STEP", record::PER_STEP),
        ("WF_RECORD_PER_ASSIGNMENT", record::PER_ASSIGNMENT),
        ("WF_KEY_BITS", KEY_BITS),
        ("WF_KEYS", 1 << KEY_BITS),
        ("WF_RESOLVE_ARGUMENTS", arguments::RESOLVE),
        ("WF_BANK_ARGUMENTS", arguments::BANKS),
        ("WF_ARGUMENTS_PER_BANK", arguments::PER_BANK),
        ("WF_GENERATE_ARGUMENTS", arguments::GENERATE),
        ("WF_STAGE_ARGUMENTS", arguments::STAGE),
        ("WF_QUEUE_ARGUMENTS", arguments::QUEUES),
        ("WF_NOT_FINITE", counters::NOT_FINITE),
        ("WF_MISSING", counters::MISSING),
        ("WF_KILLED", counters::KILLED),
        ("WF_FINISHED", counters::FINISHED),
        ("WF_AUDIT_ALIVE", counters::AUDIT_ALIVE),
        ("WF_AUDIT_MISMATCH", counters::AUDIT_MISMATCH),
        ("WF_AUDIT_DONE", counters::AUDIT_DONE),
        ("WF_AUDIT_KILLED", counters::AUDIT_KILLED),
        ("WF_AFTER_AUDIT", counters::AFTER_AUDIT),
        ("WF_STORAGE_CLAMPED", counters::STORAGE_CLAMPED),
        ("WF_OUT_OF_RANGE", counters::OUT_OF_RANGE),
        ("WF_TAKEN", counters::TAKEN),
        ("WF_BLOCK_COUNTERS", counters::BLOCKS),
        ("WF_COUNTERS_PER_BLOCK", counters::PER_BLOCK),
        ("WF_NO_TILE", counters::NO_TILE),
        ("WF_ALL_DEAD", counters::ALL_DEAD),
    ];
    let constants: String = constants.iter().map(|(name, value)| format!("const {name}: u32 = {value:#x}u;\n")).collect();
    let mut sections = String::new();
    for (section, name) in BLOCK_SECTIONS.iter().enumerate() {
        let place = format!("WF_BLOCK_TABLE + {section}u * wf_control.pool_blocks");
        sections += &format!("fn wf_{name}_word(index: u32) -> u32 {{ return {place} + index; }}\n");
        sections += &format!("fn wf_{name}(index: u32) -> u32 {{ return wf_control.words[{place} + index]; }}\n");
    }
    format!(
        "struct Item {{ tile: u32, index: u32, pixel: u32, sample: u32 }}\n\
         const CONTINUE: u32 = 0u;\n\
         const FINISH: u32 = {FINISH}u;\n\
         {constants}\
         struct WfControl {{\n{members}    words: array<u32>,\n}}\n\
         fn wf_bank_live(bank: u32) -> u32 {{ return wf_control.words[WF_BANK_LIVE + bank]; }}\n\
         fn wf_bank_new(bank: u32) -> u32 {{ return wf_control.words[WF_BANK_NEW + bank]; }}\n\
         fn wf_bank_listed(bank: u32) -> u32 {{ return wf_control.words[WF_BANK_LISTED + bank]; }}\n\
         fn wf_bank_front(bank: u32) -> u32 {{ return wf_control.words[WF_BANK_FRONT + bank]; }}\n\
         fn wf_live_counter(block: u32) -> u32 {{ return WF_BLOCK_COUNTERS + WF_COUNTERS_PER_BLOCK * block; }}\n\
         fn wf_killed_counter(block: u32) -> u32 {{ return wf_live_counter(block) + 1u; }}\n\
         fn wf_chance_counter(block: u32) -> u32 {{ return wf_live_counter(block) + 2u; }}\n\
         fn wf_estimate(tile: u32) -> u32 {{ return wf_live_counter(wf_control.pool_blocks) + tile; }}\n\
         fn wf_sort_key(tile: u32) -> u32 {{ return wf_estimate(wf_control.tiles + tile); }}\n\
         fn wf_tile_memory(tile: u32) -> u32 {{ return wf_estimate(2u * (wf_control.tiles + tile)); }}\n\
         {sections}\
         fn wf_order_word(slot: u32) -> u32 {{ return wf_{}_word({}u * wf_control.pool_blocks) + slot * wf_control.tiles; }}\n",
        BLOCK_SECTIONS[0],
        BLOCK_SECTIONS.len(),
    )
}

/// Words of the counters buffer for a pool; orders that sort keep `order_words` in all, roulette by group and finer portions than tiles
/// `extra_words` per block; queues by key have `queue_words` in all.
pub(crate) fn counter_words(pool_blocks: u32, order_words: u64, extra_words: u32, queue_words: u32) -> u64 {
    let per_block = u64::from(counters::PER_BLOCK + extra_words);
    u64::from(counters::BLOCKS) + per_block * u64::from(pool_blocks) + order_words + u64::from(queue_words)
}

const _: () = assert!(size_of::<Control>().is_multiple_of(16) && BLOCK == 256);

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: two members swapped in the Rust struct alone.
    #[test]
    fn offsets_agree_with_naga() {
        let text = format!("{}\n@group(0) @binding(0) var<storage, read> wf_control: WfControl;", declarations());
        let module = naga::front::wgsl::parse_str(&text).expect("the declarations parse");
        let (_, ty) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some("WfControl")).expect("the struct is there");
        let naga::TypeInner::Struct { members, .. } = &ty.inner else { panic!("not a struct") };
        for ((name, offset), member) in OFFSETS.iter().zip(members) {
            assert_eq!(member.name.as_deref(), Some(*name));
            assert_eq!(member.offset as usize, *offset, "{name}");
        }
        assert_eq!(members.last().map(|member| member.offset as usize), Some(size_of::<Control>()));
    }
}
