//! The statistics of a run: one JSON document with a version, and a printed summary.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::{Observed, Times};
use crate::{
    Report,
    layout::{BLOCK, Layout},
    replay::{Occupancy, WIDTHS},
};

/// Name and version of the document; the number grows when a reader of an older one could misunderstand it.
pub const SCHEMA: &str = "wavepool.statistics/1";

/// What a stage moves per lane.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageBytes {
    /// Its name.
    pub stage: String,
    /// Bytes loaded and stored by a lane that continues.
    pub read: usize,
    /// The same, stored.
    pub written: usize,
}

/// Everything about one run.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Statistics {
    /// Name of the program.
    pub program: String,
    /// The schedule, printed.
    pub schedule: String,
    /// The device, in words.
    pub device: String,
    /// What was run, in words; empty when nobody said.
    pub command: String,
    /// The counters.
    pub report: Report,
    /// Bytes of state per lane.
    pub bytes_per_lane: u32,
    /// What each stage moves.
    pub stages: Vec<StageBytes>,
    /// Useful and launched lane-steps, when the lengths of the walks are known.
    pub occupancy: Option<Occupancy>,
    /// Nanoseconds of an indirect launch without groups, and of a direct one with one group of the tick; measured with times.
    pub launch_ns: Option<[u64; 2]>,
    /// What instruments have seen.
    pub observed: Observed,
}

impl Statistics {
    pub(crate) fn new(program: &str, device: String, layout: &Layout, report: &Report, launch_ns: Option<[u64; 2]>) -> Self {
        let stages = layout.kernels.iter().map(|kernel| {
            let (read, written) = kernel.bytes();
            StageBytes { stage: kernel.stage.clone(), read, written }
        });
        let occupancy = report.observed.steps.as_ref().zip(report.observed.lengths.as_ref()).map(|(steps, lengths)| {
            let mut occupancy = Occupancy::default();
            let mut left = [0; BLOCK as usize];
            for assignment in &steps.assignments {
                crate::replay::WalkLengths::of_tile(lengths, assignment.pass_index, assignment.tile, &mut left);
                while occupancy.launch(&left) > 0 {
                    left.iter_mut().for_each(|left| *left = left.saturating_sub(1));
                }
            }
            occupancy
        });
        Statistics {
            program: program.to_owned(),
            schedule: report.schedule.clone(),
            device,
            command: String::new(),
            report: report.clone(),
            bytes_per_lane: layout.bytes_per_lane(),
            stages: stages.collect(),
            occupancy,
            launch_ns,
            observed: report.observed.clone(),
        }
    }

    /// Bytes of state that the stages moved, as far as lanes continued: lane-steps times bytes of a step.
    pub fn state_traffic(&self) -> u64 {
        self.report.lane_steps * self.stages.iter().map(|stage| (stage.read + stage.written) as u64).sum::<u64>()
    }

    /// The document.
    pub fn to_json(&self) -> Value {
        let report = &self.report;
        let named =
            |list: &[(String, u64)]| list.iter().map(|(name, count)| (name.clone(), json!(count))).collect::<serde_json::Map<_, _>>();
        let mut document = json!({
            "schema": SCHEMA,
            "program": self.program,
            "device": self.device,
            "command": self.command,
            "schedule": self.schedule,
            "notes": report.notes,
            "pool": { "blocks": report.pool_blocks, "banks": report.banks, "ring": report.ring },
            "passes": report.passes,
            "items": { "started": report.items_started, "killed": report.items_killed },
            "ledger": { "not_finite": report.not_finite, "storage_clamped": report.storage_clamped },
            "counters": named(&report.counters),
            "failed_assertions": named(&report.assertions),
            "launches": report.launches,
            "steps": report.steps,
            "regenerations": report.regenerations,
            "block_steps": report.block_steps,
            "group_steps": report.group_steps,
            "lane_steps": report.lane_steps,
            "submissions": report.submissions,
            "seconds": report.elapsed.as_secs_f64(),
            "bytes": {
                "per_lane": self.bytes_per_lane,
                "per_stage": self.stages.iter().map(|stage| json!({ "stage": stage.stage, "read": stage.read, "written": stage.written }))
                    .collect::<Vec<_>>(),
                "state_traffic": self.state_traffic(),
                "memory": report.memory.iter().map(|(name, bytes)| ((*name).to_owned(), json!(bytes))).collect::<serde_json::Map<_, _>>(),
            },
        });
        if let Some(steps) = &self.observed.steps {
            document["per_step"] = json!({
                "live_blocks": steps.steps.iter().map(|step| step.live_blocks).collect::<Vec<_>>(),
                "live_lanes": steps.steps.iter().map(|step| step.live_lanes).collect::<Vec<_>>(),
                "new_blocks": steps.steps.iter().map(|step| step.new_blocks).collect::<Vec<_>>(),
                "launched_blocks": steps.steps.iter().map(|step| step.launched_blocks).collect::<Vec<_>>(),
                "resolved_after": steps.resolved_after,
            });
        }
        if let Some(lengths) = &self.observed.lengths {
            document["walk_lengths"] = json!(lengths.histogram());
        }
        if let Some(occupancy) = &self.occupancy {
            document["lane_steps_at_widths"] = json!({
                "useful": occupancy.useful,
                "launched": WIDTHS.iter().zip(occupancy.launched).map(|(width, launched)| (width.to_string(), json!(launched)))
                    .collect::<serde_json::Map<_, _>>(),
            });
        }
        if let Some(times) = &self.observed.times {
            document["times"] = json!({
                "kernels": times.kernels.iter()
                    .map(|kernel| json!({ "kernel": kernel.kernel, "launches": kernel.launches, "ns": kernel.nanoseconds }))
                    .collect::<Vec<_>>(),
                "busy_ns": times.busy_ns(),
                "span_ns": times.span_ns,
                "idle_ns": times.idle_ns,
                "scheduling_share": times.scheduling_share(),
            });
        }
        if let Some([indirect, direct]) = self.launch_ns {
            document["launch_ns"] = json!({ "indirect_without_groups": indirect, "direct_with_one_group": direct });
        }
        document
    }

    /// The same for people: a few lines.
    pub fn summary(&self) -> String {
        let report = &self.report;
        let mut text = format!("statistics of {} on {}\n  schedule     {}\n", self.program, self.device, self.schedule);
        let mut line = |name: &str, value: String| {
            let _ = writeln!(text, "  {name:<12} {value}");
        };
        let lanes = u64::from(report.pool_blocks) * u64::from(BLOCK);
        let state = megabytes(report.state_bytes);
        let (blocks, banks, ring) = (report.pool_blocks, report.banks, report.ring);
        line("pool", format!("{blocks} blocks ({lanes} lanes) in {banks} bank(s), {state} of state; results of {ring} passes at once"));
        line("work", format!("{} launches, {} steps, {} regenerations", report.launches, report.steps, report.regenerations));
        let alive = report.lane_steps as f64 / (report.block_steps * u64::from(BLOCK)).max(1) as f64;
        line("lane-steps", format!("{} of {} in live blocks ({:.1} %)", report.lane_steps, report.block_steps * 256, alive * 100.0));
        if let Some(occupancy) = &self.occupancy {
            let shares: Vec<String> = WIDTHS
                .iter()
                .zip(occupancy.efficiency())
                .map(|(width, share)| format!("{:.1} % at width {width}", share * 100.0))
                .collect();
            line("useful", shares.join(", "));
        }
        let stages: Vec<String> = self.stages.iter().map(|stage| format!("{} {}/{}", stage.stage, stage.read, stage.written)).collect();
        line("bytes", format!("{} per lane; read/written: {}", self.bytes_per_lane, stages.join(", ")));
        let memory: Vec<String> = report.memory.iter().map(|(name, bytes)| format!("{name} {}", megabytes(*bytes))).collect();
        line("memory", memory.join(", "));
        if let Some(times) = &self.observed.times {
            line("device time", device_time(times));
            for kernel in &times.kernels {
                let share = kernel.nanoseconds as f64 / times.busy_ns().max(1) as f64 * 100.0;
                let each = kernel.nanoseconds as f64 / kernel.launches.max(1) as f64 / 1e3;
                line("", format!("{:<16} {share:5.1} %  {} launches of {each:.1} us", kernel.kernel, kernel.launches));
            }
        }
        if let Some([indirect, direct]) = self.launch_ns {
            let (indirect, direct) = (indirect as f64 / 1e3, direct as f64 / 1e3);
            line("a launch", format!("{indirect:.1} us indirect without groups, {direct:.1} us direct with one group"));
        }
        for (name, count) in &report.counters {
            line("counter", format!("{name}: {count}"));
        }
        for (name, count) in report.assertions.iter().filter(|(_, count)| *count > 0) {
            line("assertion", format!("{name} did not hold {count} times"));
        }
        for note in &report.notes {
            line("note", note.clone());
        }
        text
    }
}

fn device_time(times: &Times) -> String {
    let (busy, span) = (times.busy_ns() as f64 / 1e6, times.span_ns as f64 / 1e6);
    let idle = times.idle_ns as f64 / times.span_ns.max(1) as f64 * 100.0;
    let share = times.scheduling_share() * 100.0;
    format!("{busy:.1} ms of {span:.1} ms; between submissions {idle:.1} %; tick {share:.2} %")
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}
