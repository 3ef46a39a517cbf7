//! A run as a trace for Perfetto and `chrome://tracing`.
//!
//! **Source:** *Trace Event Format*, Google, 2016: complete events (`X`), counters (`C`) and metadata (`M`); times are in microseconds.

use serde_json::{Value, json};

use super::Statistics;

/// Tracks of the trace.
const DEVICE: u32 = 1;

impl Statistics {
    /// The trace as JSON: a track with every timed launch, and tracks of live blocks and lanes. Without times, steps stand at a distance
    /// of a microsecond each.
    pub fn trace(&self) -> Value {
        let mut events = vec![
            json!({ "ph": "M", "pid": 1, "tid": DEVICE, "name": "process_name", "args": { "name": format!("wavepool: {}", self.program) } }),
            json!({ "ph": "M", "pid": 1, "tid": DEVICE, "name": "thread_name", "args": { "name": self.schedule } }),
        ];
        let mut begins: Vec<f64> = Vec::new();
        if let Some(times) = &self.observed.times {
            for event in &times.events {
                let begin = event.begin_ns as f64 / 1e3;
                if begins.len() as u64 <= event.step {
                    begins.resize(event.step as usize + 1, begin);
                }
                events.push(json!({
                    "ph": "X", "pid": 1, "tid": DEVICE, "ts": begin, "dur": event.duration_ns as f64 / 1e3,
                    "name": event.kernel, "cat": "launch", "args": { "step": event.step },
                }));
            }
        }
        if let Some(steps) = &self.observed.steps {
            for (step, record) in (1..).zip(&steps.steps) {
                let at = begins.get(step).copied().unwrap_or(step as f64);
                events.push(json!({ "ph": "C", "pid": 1, "ts": at, "name": "live blocks", "args": { "blocks": record.live_blocks } }));
                events.push(json!({ "ph": "C", "pid": 1, "ts": at, "name": "live lanes", "args": { "lanes": record.live_lanes } }));
            }
        }
        json!({ "displayTimeUnit": "ns", "traceEvents": events })
    }
}
