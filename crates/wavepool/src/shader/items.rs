//! Which lanes a kernel visits, and which items these lanes walk.
//!
//! Key decision: where whole tiles are handed out, a lane's place in its block says which item it has, and nothing is kept for that. Where
//! single items are handed out, the lane keeps the place of its item and its pass as two words of state, and its flag is the step in which
//! it was born. Packed lanes are visited through a list of the bank, which lies in a plane of the bank's own blocks: entry `i` at place
//! `i % 256` of block `i / 256`, whatever lives there. The wrappers ask this module for expressions and know none of it.
//!
//! **Invariant:** an item's numbers are the same, and end in the same result slot, wherever its lane lies.

use super::generate::Glue;
use crate::{
    control::queues,
    layout::BLOCK,
    policy::{Grain, RouletteScope},
};

/// Expressions for the item of the lane at hand.
pub(super) struct Item {
    pub(super) tile: String,
    pub(super) pass_index: String,
    /// Place in the tile.
    pub(super) index: String,
    /// Steps that the walk had done before this one.
    pub(super) age: String,
}

/// How the lane at hand knows its item.
pub(super) fn item(glue: &Glue) -> Item {
    let item = |tile: String, pass_index: String, index: String, age: &str| Item { tile, pass_index, index, age: age.into() };
    match planes(glue) {
        None => item(
            "wf_block_tile(wf_block)".into(),
            "wf_block_pass(wf_block)".into(),
            "wf_lane".into(),
            "wf_control.step - wf_block_birth(wf_block)",
        ),
        Some([place, pass, ..]) => item(
            format!("wf_bank[wf_base + {place}u] / {BLOCK}u"),
            format!("wf_bank[wf_base + {pass}u]"),
            format!("wf_bank[wf_base + {place}u] % {BLOCK}u"),
            "wf_control.step - wf_flag",
        ),
    }
}

/// Where the words of an item begin within a block: its place, its pass, the list, the seat in which the lane announced its chance or the key
/// of its queue, the list by key.
fn planes(glue: &Glue) -> Option<[u32; 5]> {
    let first = glue.layout.item_plane?;
    Some([0, 1, 2, 3, 4].map(|plane| (first + plane) * BLOCK))
}

/// Names the lane of an invocation of a stage, or leaves: `wf_block`, `wf_lane`, `wf_base`.
pub(super) fn enter_stage(glue: &Glue, stage: &str) -> String {
    let stride = glue.layout.stride();
    let (leave, leave_flagged) = ("if (wf_bank[wf_base] == 0u) { return; }\n    ", "if (wf_flag == 0u) { return; }\n    ");
    // All lanes of a work-group come here, or none.
    let (lane, leave, leave_flagged) = match glue.local.packs(stage) {
        true => {
            let flag = format!("wf_bank[(wf_block - wf_bank_of.y) * {stride}u + wf_place]");
            let lane = format!("wf_packed_lane(wf_place, {flag} != 0u);\n    if (wf_lane == WF_NONE) {{ return; }}");
            (lane, "", "")
        }
        false => ("wf_place;".to_owned(), leave, leave_flagged),
    };
    match (glue.grain(), planes(glue)) {
        (Grain::PackedLanes | Grain::KeyedLanes, Some([_, _, list, _, by_key])) => {
            let is_first = glue.interface.stages.first().is_some_and(|first| first.name == stage);
            let is_keyed = glue.grain() == Grain::KeyedLanes && !is_first;
            let (list, seats) = match is_keyed {
                true => (by_key, "atomicLoad(&wf_counters[wf_queues(wf_bank_of.x) + 2u * WF_QUEUE_KEYS])"),
                false => (list, "wf_bank_listed(wf_bank_of.x)"),
            };
            format!(
                "let wf_seat = (wf_group.x + wf_group.y * WF_MAX_GROUPS) * {BLOCK}u + wf_place;\n    \
             if (wf_seat >= {seats}) {{ return; }}\n    \
             let wf_entry = wf_bank[wf_seat / {BLOCK}u * {stride}u + {list}u + wf_seat % {BLOCK}u];\n    \
             let wf_block = wf_bank_of.y + wf_entry / {BLOCK}u;\n    \
             let wf_lane = wf_entry % {BLOCK}u;\n    \
             let wf_base = wf_entry / {BLOCK}u * {stride}u + wf_lane;\n    \
             let wf_flag = wf_bank[wf_base];\n    \
             if (wf_flag == 0u) {{ return; }}\n    "
            )
        }
        (Grain::Lanes, _) => format!(
            "{}let wf_lane = {lane}\n    \
             let wf_base = (wf_block - wf_bank_of.y) * {stride}u + wf_lane;\n    \
             let wf_flag = wf_bank[wf_base];\n    \
             {leave_flagged}",
            glue.launch.stage_wgsl()
        ),
        _ => format!(
            "{}let wf_lane = {lane}\n    \
             let wf_base = (wf_block - wf_bank_of.y) * {stride}u + wf_lane;\n    \
             {leave}",
            glue.launch.stage_wgsl()
        ),
    }
}

/// `generate` up to the birth of `wf_item`, or leaves: lanes without an item have a flag of zero.
pub(super) fn enter_generate(glue: &Glue) -> String {
    let stride = glue.layout.stride();
    let block = format!(
        "let wf_slot = wf_bank_new(wf_bank_of.x) + wf_group.x + wf_group.y * WF_MAX_GROUPS;\n    \
         if (wf_slot >= wf_bank_new(wf_bank_of.x + 1u)) {{ return; }}\n    \
         let wf_block = wf_new_block(wf_slot);\n    \
         let wf_base = (wf_block - wf_bank_of.y) * {stride}u + wf_lane;\n    "
    );
    let Some([place, pass, list, ..]) = planes(glue) else {
        return format!(
            "{block}let wf_tile = wf_block_tile(wf_block);\n    \
             let wf_item = wf_item_of(wf_tile, wf_block_pass(wf_block), wf_lane);\n    \
             if (wf_item.pixel == WF_NONE) {{ wf_bank[wf_base] = 0u; return; }}\n    \
             wf_bank[wf_base] = 1u;\n    "
        );
    };
    let (mut live, mut receiving) = (String::new(), String::new());
    if glue.grain().is_packed() {
        let enter = |seat: &str| {
            format!(
                "let wf_seat = {seat};\n        \
                 wf_bank[wf_seat / {BLOCK}u * {stride}u + {list}u + wf_seat % {BLOCK}u] = wf_block_in_bank * {BLOCK}u + wf_lane;\n        \
                 {}",
                match glue.scope() {
                    // Nobody has announced for the next step yet.
                    Some(RouletteScope::Group(_)) => format!("atomicStore(&wf_counters[{}], 0u);\n        ", chance_word(glue, "1u")),
                    _ => String::new(),
                }
            )
        };
        live = enter("wf_live_before(wf_block) - wf_live_before(wf_bank_of.y) + wf_lane - wf_dead_before_lane");
        receiving = enter("wf_bank_front(wf_bank_of.x) + wf_rank - wf_dead_before(wf_bank_of.y)");
    }
    // Blocks of its own, because both name their seat.
    let in_braces = |text: &str| if text.is_empty() { String::new() } else { format!("{{\n        {}\n    }}\n    ", text.trim_end()) };
    format!(
        "{block}let wf_block_in_bank = wf_block - wf_bank_of.y;\n    \
         let wf_is_dead = wf_bank[wf_base] == 0u;\n    \
         let wf_dead_before_lane = wf_marked_before(wf_lane, wf_is_dead);\n    \
         if (!wf_is_dead) {{\n        {live}return;\n    }}\n    \
         let wf_rank = wf_dead_before(wf_block) + wf_dead_before_lane;\n    \
         if (wf_rank >= wf_control.given) {{ return; }}\n    \
         {}let wf_given = wf_given_item(wf_rank);\n    \
         let wf_item = wf_item_of(wf_given.x, wf_given.z, wf_given.y);\n    \
         if (wf_item.pixel == WF_NONE) {{ return; }}\n    \
         wf_bank[wf_base] = wf_control.step;\n    \
         wf_bank[wf_base + {place}u] = wf_given.x * {BLOCK}u + wf_given.y;\n    \
         wf_bank[wf_base + {pass}u] = wf_given.z;\n    \
         atomicAdd(&wf_counters[wf_live_counter(wf_block)], 1u);\n    ",
        in_braces(&receiving)
    )
}

/// Counts the end of the walk of the lane at hand; `item` are the numbers of its item.
pub(super) fn leave(glue: &Glue, pass_index: &str, indent: &str) -> String {
    let done = match glue.grain().is_by_lane() {
        true => format!("{indent}atomicAdd(&wf_counters[wf_done_counter(wf_block, {pass_index} % wf_control.ring)], 1u);\n"),
        false => String::new(),
    };
    format!(
        "{indent}wf_bank[wf_base] = 0u;\n\
         {indent}atomicSub(&wf_counters[wf_live_counter(wf_block)], 1u);\n\
         {done}"
    )
}

/// Where a lane killed by roulette is counted.
pub(super) fn killed_counter(glue: &Glue) -> &'static str {
    if glue.grain().is_by_lane() { "WF_KILLED" } else { "wf_killed_counter(wf_block)" }
}

/// The word in which a group gathers its chances for the step so many after this one (of a tile: after its age).
pub(super) fn chance_word(glue: &Glue, ahead: &str) -> String {
    match glue.grain() {
        Grain::Tiles => format!("wf_group_chance(wf_block, wf_lane, {} + {ahead})", item(glue).age),
        Grain::Lanes => format!("wf_group_chance(wf_block, wf_lane, wf_control.step + {ahead})"),
        Grain::PackedLanes | Grain::KeyedLanes => {
            format!("wf_group_chance(wf_bank_of.y + wf_seat / {BLOCK}u, wf_seat % {BLOCK}u, wf_control.step + {ahead})")
        }
    }
}

/// Remembers in which group the lane has announced its chance: packed anew, it sits elsewhere.
pub(super) fn remember_seat(glue: &Glue) -> String {
    match (glue.grain(), planes(glue)) {
        (Grain::PackedLanes, Some([_, _, _, seat, _])) => format!("    wf_bank[wf_base + {seat}u] = wf_seat;\n"),
        _ => String::new(),
    }
}

/// Declares `wf_announced_block` and `wf_announced_lane`: the place that stood for the lane when it announced its chance.
pub(super) fn announced_seat(glue: &Glue) -> String {
    match (glue.grain(), planes(glue)) {
        (Grain::PackedLanes, Some([_, _, _, seat, _])) => format!(
            "        let wf_announced_seat = wf_bank[wf_base + {seat}u];\n        \
             let wf_announced_block = wf_bank_of.y + wf_announced_seat / {BLOCK}u;\n        \
             let wf_announced_lane = wf_announced_seat % {BLOCK}u;\n"
        ),
        _ => "        let wf_announced_block = wf_block;\n        let wf_announced_lane = wf_lane;\n".into(),
    }
}

/// Words of counters per block besides those that every block has: chances by group, then items done per slot of the result ring.
pub(crate) fn extra_counters(grain: Grain, scope: Option<RouletteScope>, ring: u32) -> u32 {
    scope.map_or(0, RouletteScope::words_per_block) + if grain.is_by_lane() { ring } else { 0 }
}

/// Where the counters of the finer grains lie; for kernels of the program and for the tick.
pub(super) fn counters(glue: &Glue) -> String {
    if !glue.grain().is_by_lane() {
        return String::new();
    }
    let groups = glue.scope().map_or(0, RouletteScope::words_per_block);
    format!(
        "fn wf_done_counter(block: u32, slot: u32) -> u32 {{\n    \
         return wf_estimate(0u) + {groups}u * wf_control.pool_blocks + block * wf_control.ring + slot;\n}}\n\
         const WF_QUEUE_KEYS: u32 = {}u;\n\
         fn wf_queues(bank: u32) -> u32 {{ return wf_done_counter(wf_control.pool_blocks, 0u) + bank * {}u; }}\n",
        queues::KEYS,
        queues::PER_BANK
    )
}

/// What `generate` and the stages need besides.
pub(super) fn helpers(glue: &Glue, shader: impl Fn(&str) -> &'static str) -> String {
    let (by_lane, packs) = (glue.grain().is_by_lane(), glue.interface.stages.iter().any(|stage| glue.local.packs(&stage.name)));
    let lanes = if by_lane { format!("{}{}", formula(glue), shader("scheduler::lanes")) } else { String::new() };
    let marks = if by_lane || packs { shader("scheduler::marks") } else { "" };
    let local = if packs { shader("scheduler::local") } else { "" };
    format!("{lanes}{marks}{local}{}", if glue.grain() == Grain::KeyedLanes { enqueue(glue, shader) } else { String::new() })
}

/// The kernels between the first stage and the others, where queues have keys.
fn enqueue(glue: &Glue, shader: impl Fn(&str) -> &'static str) -> String {
    let Some([_, _, list, key, by_key]) = planes(glue) else { return String::new() };
    format!(
        "const WF_QUEUE_STRIDE: u32 = {}u;\n\
         const WF_LIST: u32 = {list}u;\n\
         const WF_KEY: u32 = {key}u;\n\
         const WF_LIST_BY_KEY: u32 = {by_key}u;\n{}",
        glue.layout.stride(),
        shader("scheduler::queues")
    )
}

/// Behind the first stage: the lane that goes on says what kind of work it asks for.
pub(super) fn choose_queue(glue: &Glue, index: usize) -> String {
    match (glue.grain(), planes(glue)) {
        (Grain::KeyedLanes, Some([_, _, _, key, _])) if index == 0 => format!(
            "    let wf_kind = {}(&wf_state) % WF_QUEUE_KEYS;\n    \
             wf_bank[wf_base + {key}u] = wf_kind;\n    \
             atomicAdd(&wf_counters[wf_queues(wf_bank_of.x) + wf_kind], 1u);\n",
            glue.names.queue_key
        ),
        _ => String::new(),
    }
}

/// The order of the tiles as a formula; empty for orders that sort.
pub(super) fn formula(glue: &Glue) -> String {
    match glue.order.rule() {
        crate::policy::OrderRule::Formula(formula) => formula.wgsl(),
        _ => String::new(),
    }
}
