//! Joins a program and a schedule into complete modules, and checks them before any device sees them.

use super::{Composition, GENERATED, Glue, kernels, tick_module};
use crate::{
    Error, Program, Result, Schedule,
    layout::Layout,
    policy::{Execution, OrderRule, WorkSource},
};

/// The WGSL of a program under a schedule.
#[derive(Clone, Debug)]
pub(crate) struct Linked {
    /// The user's modules with the kernels around their stages.
    pub(crate) stages: Composition,
    pub(crate) tick: String,
    pub(crate) resolve: String,
    pub(crate) layout: Layout,
}

/// Generates the kernels of `program` and validates those that contain the user's text.
pub(crate) fn link(program: &Program, source: &dyn WorkSource, schedule: &Schedule) -> Result<Linked> {
    if schedule.execution == Execution::Megakernel && matches!(schedule.order.rule(), OrderRule::Measured(_)) {
        let name = schedule.order.name();
        return Err(Error::Schedule(format!("order `{name}` measures the steps of tiles; the megakernel has none that could be measured")));
    }
    // A program that does not say how likely a walk survives has no roulette, whatever the schedule offers.
    let roulette = schedule.roulette.as_deref().filter(|_| program.has_roulette());
    let layout = program.layout(roulette.map(|roulette| roulette.scope()));
    let glue = Glue {
        interface: program.interface(),
        layout: &layout,
        names: program.names(),
        source,
        order: schedule.order.as_ref(),
        regeneration: schedule.regeneration.as_ref(),
        roulette,
        execution: schedule.execution,
        pins: schedule.pins,
        poison: schedule.poison,
    };
    let mut stages = program.compose(source)?;
    let generated = kernels(&glue);
    stages.push(GENERATED, &generated, &generated);
    stages.parse().map_err(|diagnostic| Error::Shader(vec![diagnostic]))?;
    let (tick, resolve) = tick_module(&glue);
    Ok(Linked { stages, tick, resolve, layout })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::policy::LinearRange;

    /// Kills: an order that is silently ignored where it means nothing.
    #[test]
    fn a_megakernel_refuses_a_measured_order() {
        let text = "struct S { a: u32 }\nfn generate(s: ptr<function, S>, item: Item) {}\n\
                    fn end(s: ptr<function, S>) -> u32 { return FINISH; }\nfn finish(s: ptr<function, S>) -> u32 { return (*s).a; }";
        let program = Program::builder("p").source("p.wgsl", text).stage("end").build().expect("a program");
        let schedule: Schedule = "megakernel,order=depth-max".parse().expect("a schedule");
        let message = link(&program, &LinearRange { count: 1 }, &schedule).expect_err("refused").to_string();
        assert!(message.contains("depth-max") && message.contains("megakernel"), "{message}");
    }
}
