//! Wraps the stages into kernels.
//!
//! Key decision: a wrapper is straight-line glue around one call of the user's function; all control flow that is the scheduler's
//! stands here once and the same sequence (stage, pin, verdict, roulette, pin) is emitted for every execution. That, and the pins, is
//! why every execution gives the same bits.
//!
//! **Invariant:** the user's stages are called, never copied. **Invariant:** no work-group barrier in the wrapper of a stage, unless the
//! schedule packs its lanes.

use std::fmt::Write as _;

use super::{
    Interface, LeafSet, arrays, gamble, items,
    persistent::PERSISTENT,
    regenerating::megakernel_regen,
    storage::{load, pin, poison_planes, poison_state, settle, settle_stage, store, to_word},
};
use crate::{
    Instruments, control,
    layout::{BLOCK, Layout, Scalar},
    policy::{Execution, Grain, LaneCompaction, LaunchScope, OrderRule, Regeneration, Roulette, RouletteScope, TileOrder, WorkSource},
    program::Gauge,
};

/// Everything the generator needs to know about a run.
pub(crate) struct Glue<'a> {
    pub(crate) interface: &'a Interface,
    pub(crate) layout: &'a Layout,
    pub(crate) names: &'a crate::program::Names,
    pub(crate) source: &'a dyn WorkSource,
    pub(crate) order: &'a dyn TileOrder,
    pub(crate) regeneration: &'a dyn Regeneration,
    pub(crate) roulette: Option<&'a dyn Roulette>,
    pub(crate) execution: Execution,
    pub(crate) launch: LaunchScope,
    pub(crate) local: &'a LaneCompaction,
    pub(crate) pins: bool,
    pub(crate) poison: Option<u32>,
    pub(crate) instruments: &'a Instruments,
    /// Invocations of the tick.
    pub(crate) tick_lanes: u32,
}

impl Glue<'_> {
    /// Who shares a draw of roulette; `None` without roulette.
    pub(super) fn scope(&self) -> Option<RouletteScope> {
        self.roulette.map(Roulette::scope)
    }

    /// In which portions a pool receives work.
    pub(super) fn grain(&self) -> Grain {
        if self.execution.is_wavefront() { self.regeneration.grain() } else { Grain::Tiles }
    }

    pub(super) fn is_by_block(&self) -> bool {
        matches!(self.scope(), Some(RouletteScope::Block(_)))
    }

    /// True when lanes share a draw.
    pub(super) fn is_shared(&self) -> bool {
        self.scope().is_some_and(RouletteScope::is_shared)
    }
}

/// Group 0 as stages see it, what the work source provides, and the program's named counters; enough to inspect a program.
pub(crate) fn header(source: &dyn WorkSource, gauges: &[Gauge], assertions: bool) -> String {
    let gauges: String = gauges.iter().enumerate().map(|(index, gauge)| gauge.wgsl(index as u32, assertions)).collect();
    format!(
        "{}@group(0) @binding(0) var<storage, read> wf_control: WfControl;\n\
         @group(0) @binding(1) var<storage, read_write> wf_counters: array<atomic<u32>>;\n\
         @group(0) @binding(2) var<storage, read_write> wf_results: array<u32>;\n\
         @group(0) @binding(3) var<storage, read_write> wf_bank: array<u32>;\n\
         // Number of the bank, and its first block.\n\
         @group(0) @binding(4) var<uniform> wf_bank_of: vec4u;\n{}{gauges}",
        control::declarations(),
        source.wgsl()
    )
}

/// The scheduler's own kernels: tick or advance, and resolve, each with its bindings.
pub(crate) fn tick_module(glue: &Glue) -> (String, String) {
    let shader = scheduler_module;
    let order = match glue.order.rule() {
        _ if !glue.execution.is_wavefront() => String::new(),
        OrderRule::Formula(formula) => format!("{}{}", formula.wgsl(), shader("scheduler::order_formula")),
        OrderRule::Measured(measure) => {
            let reads = measure.reads_lane_steps();
            let kernels = ["scheduler::order_measured", "scheduler::order_sort"].map(shader).concat();
            format!("const WF_READS_LANE_STEPS: bool = {reads};\n{}{kernels}", measure.wgsl())
        }
        OrderRule::Estimated(_) => ["scheduler::order_estimated", "scheduler::order_sort"].map(shader).concat(),
    };
    let packs = glue.grain().is_packed();
    let tick = format!(
        "const WF_TICK_LANES: u32 = {}u;\nconst WF_PACKS: bool = {packs};\n{}@group(0) @binding(0) var<storage, read_write> wf_control: WfControl;\n\
         @group(0) @binding(1) var<storage, read_write> wf_counters: array<atomic<u32>>;\n\
         @group(0) @binding(2) var<storage, read_write> wf_arguments: array<u32>;\n\
         @group(0) @binding(3) var<storage, read_write> wf_record: array<u32>;\n{}{}{}{}{}{}{}",
        glue.tick_lanes,
        control::declarations(),
        glue.source.wgsl(),
        order,
        glue.regeneration.wgsl(),
        gamble::tick(glue, shader),
        items::counters(glue),
        shader("scheduler::arguments"),
        match glue.execution.is_wavefront() {
            true => {
                let launch = if packs { shader("scheduler::launch_packed") } else { shader("scheduler::launch_blocks") };
                let tick = if glue.grain().is_by_lane() { shader("scheduler::tick_lanes") } else { shader("scheduler::tick") };
                let common = ["scheduler::sums", "scheduler::passes", "scheduler::banks"].map(shader).concat();
                format!("{}{common}{launch}{tick}", glue.launch.tick_wgsl())
            }
            false => format!("const WF_TILES_PER_GROUP: u32 = {}u;\n{}", glue.execution.tiles_per_group(), shader("scheduler::advance")),
        },
    );
    (tick, resolve_module(glue))
}

/// Resolve, with its bindings.
fn resolve_module(glue: &Glue) -> String {
    let shader = scheduler_module;
    let (mut leaves, mut floats) = (String::new(), Vec::new());
    let mut film = 1;
    for (index, leaf) in glue.interface.result.iter().enumerate() {
        let result = format!("result + {}u * plane", index + 1);
        let place = format!("place + {film}u * plane");
        match leaf.scalar {
            Scalar::F32 => {
                let _ = writeln!(leaves, "    let leaf_{index} = wf_sum_f32({result}, {place}, plane, samples);");
                floats.push(format!("leaf_{index}"));
                film += 3;
            }
            _ => {
                let _ = writeln!(leaves, "    wf_sum_u32({result}, {place}, plane);");
                film += 2;
            }
        }
    }
    let looks = match glue.order.rule() {
        OrderRule::Estimated(estimate) if glue.execution.is_wavefront() => {
            let keeps = glue.instruments.lengths;
            format!("const WF_KEEPS_KEYS: bool = {keeps};\n{}{}", estimate.wgsl(), shader("scheduler::resolve_estimates"))
        }
        _ => {
            floats.clear();
            shader("scheduler::resolve_only").into()
        }
    };
    let sum = if floats.is_empty() { "0.0".into() } else { floats.join(" + ") };
    format!(
        "{}const WF_RESULT_PLANES: u32 = {}u;\n\
         @group(0) @binding(0) var<storage, read> wf_control: WfControl;\n\
         @group(0) @binding(1) var<storage, read_write> wf_counters: array<atomic<u32>>;\n\
         @group(0) @binding(2) var<storage, read_write> wf_results: array<u32>;\n\
         @group(0) @binding(3) var<storage, read_write> wf_film: array<u32>;\n{}{looks}{}\n\
         fn wf_resolve_leaves(result: u32, place: u32, plane: u32, samples: u32) -> f32 {{\n{leaves}    return {sum};\n}}\n",
        control::declarations(),
        glue.interface.result.len() + 1,
        glue.source.wgsl(),
        shader("scheduler::resolve"),
    )
}

/// The kernels around the user's functions, to be appended to the composed program.
pub(crate) fn kernels(glue: &Glue) -> String {
    let mut out = String::new();
    if let Some(roulette) = glue.roulette {
        out.push_str(&roulette.wgsl());
    }
    pin(glue, &mut out);
    arrays::accessors(glue, &mut out);
    complete(glue, &mut out);
    out.push_str(&items::counters(glue));
    match glue.execution {
        Execution::Wavefront => {
            out.push_str(&items::helpers(glue, scheduler_module));
            generate_kernel(glue, &mut out);
            (0..glue.interface.stages.len()).for_each(|index| stage_kernel(glue, index, &mut out));
        }
        whole_walks => {
            out.push_str(&items::formula(glue));
            match whole_walks {
                Execution::MegakernelRegen => megakernel_regen(glue, &mut out),
                Execution::Persistent => {
                    walk(glue, &mut out);
                    out.push_str(PERSISTENT);
                }
                _ => {
                    walk(glue, &mut out);
                    out.push_str(MEGAKERNEL);
                }
            }
        }
    }
    if glue.instruments.checked {
        let _ = writeln!(out, "const WF_BY_LANE: bool = {};", glue.grain().is_by_lane());
        let _ = writeln!(out, "const WF_STRIDE: u32 = {}u;", glue.layout.stride());
        let _ = writeln!(out, "const WF_RESULT_PLANES: u32 = {}u;", glue.interface.result.len() + 1);
        out.push_str(scheduler_module("scheduler::audit"));
    }
    out
}

/// A kernel of the library, as text.
fn scheduler_module(path: &str) -> &'static str {
    wavepool_shaders::SCHEDULER.iter().find(|module| module.path == path).map_or("", |module| module.text)
}

/// Puts the result of a walk into the item's own slot, last of all the mark that it is there.
fn complete(glue: &Glue, out: &mut String) {
    let _ = write!(
        out,
        "fn wf_complete(wf_state: ptr<function, {}>, wf_tile: u32, wf_pass_index: u32, wf_lane: u32, wf_length: u32) {{\n    \
         let result = {}(wf_state);\n    \
         let plane = wf_control.tiles * {BLOCK}u;\n    \
         let place = (wf_pass_index % wf_control.ring) * {}u * plane + wf_tile * {BLOCK}u + wf_lane;\n",
        glue.interface.state,
        glue.names.finish,
        glue.interface.result.len() + 1
    );
    for (index, leaf) in glue.interface.result.iter().enumerate() {
        let _ =
            writeln!(out, "    wf_results[place + {}u * plane] = {};", index + 1, to_word(leaf.scalar, &format!("result{}", leaf.path)));
    }
    if glue.instruments.lengths {
        let ring = format!("wf_control.ring * {}u", glue.interface.result.len() + 1);
        let _ = writeln!(out, "    wf_results[({ring} + wf_pass_index) * plane + wf_tile * {BLOCK}u + wf_lane] = wf_length;");
    }
    out.push_str("    wf_results[place] = wf_pass_index + 1u;\n}\n");
    out.push_str(
        "fn wf_item_of(wf_tile: u32, wf_pass_index: u32, wf_lane: u32) -> Item {\n    \
         return Item(wf_tile, wf_lane, wf_tile_pixel(wf_tile, wf_lane), wf_control.first_sample + wf_pass_index);\n}\n",
    );
    gamble::draws(glue, out);
}

fn generate_kernel(glue: &Glue, out: &mut String) {
    let _ = write!(
        out,
        "@compute @workgroup_size({BLOCK})\n\
         fn wf_generate(@builtin(workgroup_id) wf_group: vec3u, @builtin(local_invocation_index) wf_lane: u32) {{\n    \
         {}{}{}{}var wf_state = {}();\n    \
         {}(&wf_state, wf_item);\n",
        items::enter_generate(glue),
        arrays::enter(glue),
        arrays::clear(glue),
        gamble::clear_first(glue),
        glue.interface.state,
        glue.names.generate
    );
    settle_born(glue, "    ", out);
    store(glue, &glue.layout.generate, out);
    poison_planes(glue, out);
    out.push_str("}\n");
}

/// After `generate`: formats and pins.
pub(super) fn settle_born(glue: &Glue, indent: &str, out: &mut String) {
    settle(glue, &glue.interface.generate.on_return().may, indent, out);
    let _ = writeln!(out, "{indent}wf_pin(&wf_state);");
}

/// Calls stage `index`; `verdict` tells afterwards whether the walk goes on.
fn call_stage(glue: &Glue, index: usize, indent: &str, out: &mut String) {
    let stage = &glue.interface.stages[index];
    if stage.decides {
        let _ = writeln!(out, "{indent}wf_verdict = {}(&wf_state);", stage.name);
    } else {
        let _ = writeln!(out, "{indent}{}(&wf_state);", stage.name);
    }
    if stage.decides && glue.instruments.checked {
        let _ = writeln!(out, "{indent}if (wf_verdict == FINISH) {{ atomicAdd(&wf_counters[WF_FINISHED], 1u); }}");
    }
    settle_stage(glue, &stage.summary, indent, out);
    let _ = writeln!(out, "{indent}wf_pin(&wf_state);");
}

/// Calls all stages of a step inside a loop, which the verdict of any of them leaves.
pub(super) fn call_stages(glue: &Glue, indent: &str, out: &mut String) {
    for index in 0..glue.interface.stages.len() {
        call_stage(glue, index, indent, out);
        if glue.interface.stages[index].decides {
            let _ = writeln!(out, "{indent}if (wf_verdict == FINISH) {{ break; }}");
        }
    }
}

fn stage_kernel(glue: &Glue, index: usize, out: &mut String) {
    let stage = &glue.interface.stages[index];
    let traffic = &glue.layout.kernels[index];
    let last = index + 1 == glue.interface.stages.len();
    let lane_gambles = last && glue.scope() == Some(RouletteScope::Lane);
    let _ = write!(
        out,
        "@compute @workgroup_size({BLOCK})\n\
         fn wf_stage_{}(@builtin(workgroup_id) wf_group: vec3u, @builtin(local_invocation_index) wf_place: u32) {{\n    \
         {}{}var wf_state = {}();\n",
        stage.name,
        items::enter_stage(glue, &stage.name),
        arrays::enter(glue),
        glue.interface.state
    );
    poison_state(glue, &traffic.load, out);
    load(glue, &traffic.load, "    ", out);
    if index == 0 && glue.is_shared() {
        gamble::obey(glue, out, |out| finish_lane(glue, &traffic.load_killed, "        ", out));
    }
    if stage.decides || lane_gambles {
        out.push_str("    var wf_verdict = CONTINUE;\n");
    }
    call_stage(glue, index, "    ", out);
    if lane_gambles {
        let going_on = if stage.decides { "if (wf_verdict != FINISH) " } else { "" };
        let _ = writeln!(out, "    {going_on}{{");
        let items::Item { tile, pass_index, index, age } = items::item(glue);
        let _ = write!(
            out,
            "        let wf_item = wf_item_of({tile}, {pass_index}, {index});\n        \
             let wf_step = {age};\n"
        );
        gamble::draw_lane(glue, &format!("atomicAdd(&wf_counters[{}], 1u);", items::killed_counter(glue)), "        ", out);
        out.push_str("    }\n");
    }
    if stage.decides || lane_gambles {
        out.push_str("    if (wf_verdict == FINISH) {\n");
        finish_lane(glue, &traffic.load_late, "        ", out);
        out.push_str("    }\n");
    }
    out.push_str(&items::choose_queue(glue, index));
    if last && glue.is_shared() {
        gamble::announce_chance(glue, &gamble::place_of_chance(glue), "    ", out);
        if matches!(glue.scope(), Some(RouletteScope::Group(_))) {
            out.push_str(&items::remember_seat(glue));
        }
    }
    store(glue, &traffic.store, out);
    out.push_str("}\n");
}

/// Ends the walk of this lane and leaves the kernel; `late` is what `finish` reads and nobody has loaded.
fn finish_lane(glue: &Glue, late: &LeafSet, indent: &str, out: &mut String) {
    load(glue, late, indent, out);
    let items::Item { tile, pass_index, index, age } = items::item(glue);
    let _ = write!(
        out,
        "{indent}let wf_pass_index = {pass_index};\n\
         {indent}wf_complete(&wf_state, {tile}, wf_pass_index, {index}, {age} + 1u);\n\
         {}{indent}return;\n",
        items::leave(glue, "wf_pass_index", indent)
    );
}

/// A tile per work-group.
const MEGAKERNEL: &str = "@compute @workgroup_size(256)
fn wf_megakernel(@builtin(workgroup_id) wf_group: vec3u, @builtin(local_invocation_index) wf_lane: u32) {
    let wf_slot = wf_group.x + wf_group.y * WF_MAX_GROUPS;
    if (wf_slot >= wf_control.new_blocks) { return; }
    let wf_pass_index = wf_control.next_pass;
    wf_walk(wf_tile_at(wf_pass_index, wf_control.next_position + wf_slot), wf_pass_index, wf_lane);
}
";

/// Which item a lane of a tile walks.
pub(super) const WALK_HEAD: &str = "fn wf_walk(wf_tile: u32, wf_pass_index: u32, wf_lane: u32) {
    let wf_item = wf_item_of(wf_tile, wf_pass_index, wf_lane);
    ";

/// `wf_walk`, which takes one lane of a tile from birth to its result.
fn walk(glue: &Glue, out: &mut String) {
    if glue.is_shared() {
        return gamble::lockstep_walk(glue, out);
    }
    let _ = write!(
        out,
        "{WALK_HEAD}\
         if (wf_item.pixel == WF_NONE) {{ return; }}\n    \
         var wf_state = {}();\n    \
         {}(&wf_state, wf_item);\n",
        glue.interface.state, glue.names.generate
    );
    settle_born(glue, "    ", out);
    out.push_str("    var wf_verdict = CONTINUE;\n    var wf_step = 0u;\n    loop {\n");
    call_stages(glue, "        ", out);
    if glue.roulette.is_some() {
        gamble::draw_lane(glue, "atomicAdd(&wf_counters[WF_KILLED], 1u);", "        ", out);
        out.push_str("        if (wf_verdict == FINISH) { break; }\n");
    }
    out.push_str("        wf_step += 1u;\n    }\n");
    out.push_str("    wf_complete(&wf_state, wf_tile, wf_pass_index, wf_lane, wf_step + 1u);\n}\n");
}
