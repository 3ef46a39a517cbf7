//! A megakernel whose lanes regenerate: a lane whose walk has ended takes the next item in the same loop over steps.
//!
//! Key decision: one loop, not a loop within a loop, so that a lane with a new walk shares the stages with neighbours that are in the middle
//! of theirs. Items come from an atomic counter over the tiles that the launch was given, at most a few per work-group; who gets which is
//! decided by the hardware and shows nowhere, since random numbers and results belong to items. What is given up: lanes of a tile part
//! ways, so nothing can be shared among them. Source: Davidovic, Krivanek, Hasan and Slusallek, *Progressive light transport simulation on
//! the GPU*, 2014.

use std::fmt::Write as _;

use super::{
    gamble,
    generate::{Glue, call_stages, settle_born},
};
use crate::layout::BLOCK;

pub(super) fn megakernel_regen(glue: &Glue, out: &mut String) {
    let state = &glue.interface.state;
    let _ = write!(
        out,
        "@compute @workgroup_size({BLOCK})\n\
         fn wf_megakernel_regen() {{\n    \
         var wf_state = {state}();\n    \
         var wf_item = Item();\n    \
         var wf_pass_index = 0u;\n    \
         var wf_step = 0u;\n    \
         var wf_walks = false;\n    \
         loop {{\n        \
         if (!wf_walks) {{\n            \
         let wf_taken = atomicAdd(&wf_counters[WF_TAKEN], 1u);\n            \
         if (wf_taken >= wf_control.new_blocks * {BLOCK}u) {{ break; }}\n            \
         let wf_place = wf_control.next_position + wf_taken / {BLOCK}u;\n            \
         wf_pass_index = wf_control.next_pass + wf_place / wf_control.tiles;\n            \
         wf_item = wf_item_of(wf_tile_at(wf_pass_index, wf_place % wf_control.tiles), wf_pass_index, wf_taken % {BLOCK}u);\n            \
         if (wf_item.pixel == WF_NONE) {{ continue; }}\n            \
         wf_state = {state}();\n            \
         {}(&wf_state, wf_item);\n",
        glue.names.generate
    );
    settle_born(glue, "            ", out);
    out.push_str(
        "            wf_step = 0u;\n            \
         wf_walks = true;\n        \
         }\n        \
         var wf_verdict = CONTINUE;\n        \
         loop {\n",
    );
    call_stages(glue, "            ", out);
    if glue.roulette.is_some() {
        gamble::draw_lane(glue, "atomicAdd(&wf_counters[WF_KILLED], 1u);", "            ", out);
    }
    out.push_str(
        "            break;\n        \
         }\n        \
         wf_step += 1u;\n        \
         if (wf_verdict == FINISH) {\n            \
         wf_complete(&wf_state, wf_item.tile, wf_pass_index, wf_item.index, wf_step);\n            \
         wf_walks = false;\n        \
         }\n    \
         }\n}\n",
    );
}
