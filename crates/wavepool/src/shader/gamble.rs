//! How roulette enters the wrappers: a draw per lane at the end of a step, or a draw per block or group of lanes between two steps.
//!
//! Key decision: a block's chance is condensed by one integer atomic per lane, without a barrier; the tick draws, and the first kernel of
//! the next step kills or reweights. Where the state is in registers the same is done in lock-step, the only walk with barriers: the
//! work-group is the block. Both take every decision from integers, so that they agree bit for bit.
//!
//! Groups of lanes need no tick: each lane draws what its whole group draws. A group has three words, by the age of the tile: a step reads
//! the chances that the one before announced, clears those for the one after the next, and announces for the next. So one kernel can do
//! all three without a barrier, and no kernel reads a word that another lane of the same kernel writes.

use std::fmt::Write as _;

use super::{
    Summary,
    generate::{Glue, WALK_HEAD, call_stages, settle_born},
    items,
    storage::settle,
};
use crate::{
    layout::BLOCK,
    policy::{Execution, Grain, RouletteScope, Statistic},
};

/// One word from four counters, apart from every stream of the program: pcg4d of Jarzynski and Olano, JCGT 9(3), 2020.
const DRAW: &str = "fn wf_draw(counters: vec4u) -> u32 {
    var v = counters * 1664525u + 1013904223u;
    v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
    v = v ^ (v >> vec4u(16u));
    v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
    return v.x;
}
";

/// The draws of a lane and of a block, and how a block's chance is read from what its lanes have announced.
pub(super) fn draws(glue: &Glue, out: &mut String) {
    let Some(scope) = glue.scope() else { return };
    out.push_str(DRAW);
    match scope {
        RouletteScope::Lane => out.push_str(
            "fn wf_roulette_draw(item: Item, step: u32) -> u32 {\n    \
             return wf_draw(vec4u(item.pixel, item.sample, step, wf_control.seed ^ 0x9e3779b9u));\n}\n",
        ),
        RouletteScope::Group(lanes) => {
            let groups = BLOCK / lanes;
            let _ = write!(
                out,
                "fn wf_group_inverse(word: u32, tile: u32, lane: u32, sample_index: u32, step: u32) -> f32 {{\n    \
                 let draw = wf_draw(vec4u(tile * {groups}u + lane / {lanes}u, sample_index, step, wf_control.seed ^ 0x3c6ef372u));\n    \
                 return wf_inverse_survival(bitcast<f32>(word), draw);\n}}\n"
            );
            if glue.execution == Execution::Wavefront {
                let ordered = format!("{}u * wf_control.tiles", glue.order.rule().words_per_tile());
                let _ = write!(
                    out,
                    "fn wf_group_chance(block: u32, lane: u32, age: u32) -> u32 {{\n    \
                     return wf_estimate({ordered}) + (3u * block + age % 3u) * {groups}u + lane / {lanes}u;\n}}\n"
                );
            }
        }
        RouletteScope::Block(statistic) => {
            out.push_str(
                "fn wf_block_draw(tile: u32, sample_index: u32, step: u32) -> u32 {\n    \
                 return wf_draw(vec4u(tile, sample_index, step, wf_control.seed ^ 0x7f4a7c15u));\n}\n",
            );
            out.push_str(match statistic {
                Statistic::Max => "fn wf_block_chance(word: u32, lanes: u32) -> f32 { return bitcast<f32>(word); }\n",
                Statistic::Mean => "fn wf_block_chance(word: u32, lanes: u32) -> f32 { return f32(word / lanes) * 1.52587890625e-5; }\n",
            });
        }
    }
}

/// What the tick needs.
pub(super) fn tick(glue: &Glue, shader: impl Fn(&str) -> &'static str) -> String {
    match glue.roulette {
        _ if !glue.execution.is_wavefront() => String::new(),
        Some(roulette) if glue.is_by_block() => {
            let mut text = roulette.wgsl();
            draws(glue, &mut text);
            text + shader("scheduler::roulette_block")
        }
        _ => shader("scheduler::roulette_lane").into(),
    }
}

/// The draw at the end of a step: sets `wf_verdict` and counts, or reweights.
pub(super) fn draw_lane(glue: &Glue, count: &str, indent: &str, out: &mut String) {
    let names = glue.names;
    let _ = writeln!(out, "{indent}let wf_chance = wf_pin_f32({}(&wf_state));", names.survival);
    settle_after(glue, &glue.interface.survival, indent, out);
    let _ = write!(
        out,
        "{indent}let wf_inverse = wf_pin_f32(wf_inverse_survival(wf_chance, wf_roulette_draw(wf_item, wf_step)));\n\
         {indent}if (wf_inverse == 0.0) {{\n\
         {indent}    wf_verdict = FINISH;\n\
         {indent}    {count}\n\
         {indent}}} else if (wf_inverse != 1.0) {{\n\
         {indent}    {}(&wf_state, wf_inverse);\n",
        names.reweight
    );
    settle_after(glue, &glue.interface.reweight, &format!("{indent}    "), out);
    let _ = write!(out, "{indent}}}\n{indent}wf_pin(&wf_state);\n");
}

/// Formats after `survival` or `reweight`, where they are called.
fn settle_after(glue: &Glue, function: &Option<Summary>, indent: &str, out: &mut String) {
    if let Some(summary) = function {
        settle(glue, &summary.on_return().may, indent, out);
    }
}

/// Adds this lane's chance to what the block draws with. Integers throughout: bits of a float between 0 and 1 order like the float, and
/// sums of 65536ths do not depend on their order. What is not a number counts as certain survival.
pub(super) fn announce_chance(glue: &Glue, place: &str, indent: &str, out: &mut String) {
    let _ = writeln!(out, "{indent}let wf_chance = bitcast<u32>(wf_pin_f32({}(&wf_state)));", glue.names.survival);
    settle_after(glue, &glue.interface.survival, indent, out);
    let _ = write!(
        out,
        "{indent}wf_pin(&wf_state);\n\
         {indent}let wf_certain = min(select(wf_chance, 0u, (wf_chance & 0x80000000u) != 0u), 0x3f800000u);\n"
    );
    let _ = match glue.scope() {
        Some(RouletteScope::Block(Statistic::Mean)) => {
            writeln!(out, "{indent}atomicAdd({place}, u32(bitcast<f32>(wf_certain) * 65536.0));")
        }
        _ => writeln!(out, "{indent}atomicMax({place}, wf_certain);"),
    };
}

/// Where a lane of a wavefront announces its chance.
pub(super) fn place_of_chance(glue: &Glue) -> String {
    match glue.scope() {
        Some(RouletteScope::Group(_)) => format!("&wf_counters[{}]", items::chance_word(glue, "1u")),
        _ => "&wf_counters[wf_chance_counter(wf_block)]".into(),
    }
}

/// At birth: clears what the first step announces into.
pub(super) fn clear_first(glue: &Glue) -> String {
    match glue.scope() {
        // Packed lanes have done so when they took their seats.
        Some(RouletteScope::Group(_)) if !glue.grain().is_packed() => {
            format!("atomicStore(&wf_counters[{}], 0u);\n    ", items::chance_word(glue, "1u"))
        }
        _ => String::new(),
    }
}

/// What the group has drawn. Where lanes of several items share a group, the draw is keyed by the place of the group and the step of the run.
fn group_inverse(glue: &Glue) -> String {
    if glue.grain() == Grain::Tiles {
        return "        let wf_word = atomicLoad(&wf_counters[wf_group_chance(wf_block, wf_lane, wf_age)]);\n        \
                let wf_sample = wf_control.first_sample + wf_block_pass(wf_block);\n        \
                wf_inverse = wf_pin_f32(wf_group_inverse(wf_word, wf_block_tile(wf_block), wf_lane, wf_sample, wf_age - 1u));\n"
            .into();
    }
    format!(
        "{}        let wf_word = atomicLoad(&wf_counters[wf_group_chance(wf_announced_block, wf_announced_lane, wf_control.step)]);\n        \
         let wf_drawn_in = wf_control.step - 1u;\n        \
         wf_inverse = wf_pin_f32(wf_group_inverse(wf_word, wf_announced_block, wf_announced_lane, wf_control.first_sample, wf_drawn_in));\n",
        items::announced_seat(glue)
    )
}

/// Carries out what has been drawn for the block or the group; `finish` ends the walk of the lane.
pub(super) fn obey(glue: &Glue, out: &mut String, finish: impl Fn(&mut String)) {
    match glue.scope() {
        Some(RouletteScope::Group(_)) => {
            let _ = write!(
                out,
                "    let wf_age = {};\n    \
                 atomicStore(&wf_counters[{}], 0u);\n    \
                 var wf_inverse = 1.0;\n    \
                 if (wf_age > 0u) {{\n{}    }}\n",
                items::item(glue).age,
                items::chance_word(glue, "2u"),
                group_inverse(glue)
            );
        }
        _ => out.push_str("    let wf_inverse = bitcast<f32>(wf_block_inverse(wf_block));\n"),
    }
    let _ = write!(out, "    if (wf_inverse == 0.0) {{\n        atomicAdd(&wf_counters[{}], 1u);\n", items::killed_counter(glue));
    finish(out);
    let _ = writeln!(out, "    }}\n    if (wf_inverse != 1.0) {{\n        {}(&wf_state, wf_inverse);", glue.names.reweight);
    settle_after(glue, &glue.interface.reweight, "        ", out);
    out.push_str("        wf_pin(&wf_state);\n    }\n");
}

/// Walks a tile whose lanes wait for each other after every step, because they share a draw.
pub(super) fn lockstep_walk(glue: &Glue, out: &mut String) {
    let group = match glue.scope() {
        Some(RouletteScope::Group(lanes)) => lanes,
        _ => BLOCK,
    };
    let groups = BLOCK / group;
    let _ = write!(
        out,
        "var<workgroup> wf_group_chances: array<atomic<u32>, {groups}>;\n\
         var<workgroup> wf_group_live: atomic<u32>;\n\
         var<workgroup> wf_group_verdict: vec2u;\n\
         {WALK_HEAD}\
         var wf_state = {}();\n    \
         var wf_alive = wf_item.pixel != WF_NONE;\n    \
         if (wf_alive) {{\n        \
         {}(&wf_state, wf_item);\n",
        glue.interface.state, glue.names.generate
    );
    settle_born(glue, "        ", out);
    let _ = write!(
        out,
        "    }}\n    \
         for (var wf_step = 0u; ; wf_step++) {{\n        \
         if (wf_lane < {groups}u) {{ atomicStore(&wf_group_chances[wf_lane], 0u); }}\n        \
         if (wf_lane == 0u) {{ atomicStore(&wf_group_live, 0u); }}\n        \
         workgroupBarrier();\n        \
         if (wf_alive) {{\n            \
         var wf_verdict = CONTINUE;\n            \
         loop {{\n"
    );
    call_stages(glue, "                ", out);
    announce_chance(glue, &format!("&wf_group_chances[wf_lane / {group}u]"), "                ", out);
    out.push_str(
        "                atomicAdd(&wf_group_live, 1u);\n                \
         break;\n            \
         }\n            \
         if (wf_verdict == FINISH) {\n                \
         wf_complete(&wf_state, wf_tile, wf_pass_index, wf_lane, wf_step + 1u);\n                \
         wf_alive = false;\n            \
         }\n        \
         }\n        \
         workgroupBarrier();\n",
    );
    let draw = match glue.scope() {
        Some(RouletteScope::Group(_)) => format!(
            "        let wf_word = atomicLoad(&wf_group_chances[wf_lane / {group}u]);\n        \
             let wf_own = wf_pin_f32(wf_group_inverse(wf_word, wf_tile, wf_lane, wf_item_sample(wf_pass_index), wf_step));\n        \
             if (wf_lane == 0u) {{ wf_group_verdict = vec2u(atomicLoad(&wf_group_live), 0u); }}\n        \
             // Every lane has read its group's word when this is known.\n        \
             let wf_decided = workgroupUniformLoad(&wf_group_verdict);\n        \
             let wf_inverse = wf_own;\n"
        ),
        _ => "        // Live lanes, and the bits of what the block's draw gave.\n        \
             if (wf_lane == 0u) {\n            \
             let wf_live = atomicLoad(&wf_group_live);\n            \
             var wf_bits = 0u;\n            \
             if (wf_live > 0u) {\n                \
             let wf_chance = wf_block_chance(atomicLoad(&wf_group_chances[0]), wf_live);\n                \
             wf_bits = bitcast<u32>(wf_inverse_survival(wf_chance, wf_block_draw(wf_tile, wf_item_sample(wf_pass_index), wf_step)));\n            \
             }\n            \
             wf_group_verdict = vec2u(wf_live, wf_bits);\n        \
             }\n        \
             let wf_decided = workgroupUniformLoad(&wf_group_verdict);\n        \
             let wf_inverse = bitcast<f32>(wf_decided.y);\n"
            .to_owned(),
    };
    out.push_str(&draw);
    let _ = writeln!(
        out,
        "        if (wf_decided.x == 0u) {{ break; }}\n        \
         if (wf_alive && wf_inverse == 0.0) {{\n            \
         atomicAdd(&wf_counters[WF_KILLED], 1u);\n            \
         // A wavefront obeys the draw in the first kernel of the next step.\n            \
         wf_complete(&wf_state, wf_tile, wf_pass_index, wf_lane, wf_step + 2u);\n            \
         wf_alive = false;\n        \
         }}\n        \
         if (wf_alive && wf_inverse != 1.0) {{\n            \
         {}(&wf_state, wf_inverse);",
        glue.names.reweight
    );
    settle_after(glue, &glue.interface.reweight, "            ", out);
    out.push_str("            wf_pin(&wf_state);\n        }\n    }\n}\n");
    out.push_str("fn wf_item_sample(pass_index: u32) -> u32 { return wf_control.first_sample + pass_index; }\n");
}
