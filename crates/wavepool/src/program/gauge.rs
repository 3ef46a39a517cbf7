//! Counters and assertions that stages call by name.
//!
//! Key decision: a gauge is a WGSL function generated for the program (`count_rays(1u)`, `assert_finite(ok)`), so that naga checks the call
//! and a gauge nobody calls has no code. Counts are integers added atomically; they decide nothing.

use crate::{
    control::counters,
    shader::{Diagnostic, is_identifier},
};

/// A counter or an assertion of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Gauge {
    pub(crate) name: String,
    pub(crate) is_assertion: bool,
}

impl Gauge {
    /// What stages call.
    pub(crate) fn function(&self) -> String {
        format!("{}_{}", if self.is_assertion { "assert" } else { "count" }, self.name)
    }

    /// Declares the function of gauge number `index`; assertions have no body unless they are wanted.
    pub(crate) fn wgsl(&self, index: u32, assertions: bool) -> String {
        let slot = counters::NAMED + index;
        let function = self.function();
        match (self.is_assertion, assertions) {
            (false, _) => format!("fn {function}(amount: u32) {{ atomicAdd(&wf_counters[{slot}u], amount); }}\n"),
            (true, true) => {
                format!("fn {function}(holds: bool) {{ if (!holds) {{ atomicAdd(&wf_counters[{slot}u], 1u); }} }}\n")
            }
            (true, false) => format!("fn {function}(holds: bool) {{ }}\n"),
        }
    }
}

/// What is wrong with the names of a program's gauges.
pub(crate) fn check(gauges: &[Gauge]) -> Result<(), Diagnostic> {
    let wrong = |message: String| Err(Diagnostic::nowhere(message));
    for (index, gauge) in gauges.iter().enumerate() {
        let (name, kind) = (&gauge.name, if gauge.is_assertion { "assertion" } else { "counter" });
        if !is_identifier(name) {
            return wrong(format!("{kind} `{name}`: letters, digits and underscores, the first one a letter"));
        }
        if gauges[..index].contains(gauge) {
            return wrong(format!("{kind} `{name}` is declared twice"));
        }
    }
    let most = counters::MOST_NAMED as usize;
    if gauges.len() > most {
        return wrong(format!("the program has {} counters and assertions, the limit is {most}", gauges.len()));
    }
    Ok(())
}
