//! Rivals as a table for programs: one row each, every column explained at the head.
//!
//! Key decision: a column is its name, its meaning and its value in one place, so that the explanation cannot drift from the numbers.
//! Lines of explanation begin with `#`; readers that know comments skip them, others find the header behind them.
//!
//! **Invariant:** what is not known is an empty field, never a zero.

use super::{Cell, Rival};

/// One column of [`csv()`].
#[derive(Debug)]
pub struct Column {
    /// As in the header.
    pub name: &'static str,
    /// What stands in it.
    pub about: &'static str,
    /// A rival's value; empty when it is not known.
    pub value: fn(&Rival) -> String,
}

fn known<T: ToString>(value: Option<T>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

macro_rules! columns {
    ($($name:literal, $about:literal, $value:expr;)*) => {
        &[$(Column { name: $name, about: $about, value: $value }),*]
    };
}

/// The columns of a rival, behind those that say where it ran.
pub const COLUMNS: &[Column] = columns![
    "rival", "short name of the schedule", |rival| field(&rival.name);
    "schedule", "the schedule with all its settings", |rival| field(&rival.schedule);
    "pool_blocks", "blocks of 256 lanes in the pool; of a megakernel: tiles per launch", |rival| rival.report.pool_blocks.to_string();
    "passes", "passes over all items", |rival| rival.report.passes.to_string();
    "film", "hash of the film; equal hashes, equal bits", |rival| format!("{:016x}", rival.film);
    "walks_per_second", "walks per second, by the median of the runs", |rival| rival.walks_per_second.value.to_string();
    "walks_per_second_low", "lower end of its 95 % interval, by resampling the runs", |rival| rival.walks_per_second.low.to_string();
    "walks_per_second_high", "upper end of it", |rival| rival.walks_per_second.high.to_string();
    "time_ratio", "time over that of the first rival of the cell, ratio of medians", |rival| rival.time_ratio.value.to_string();
    "time_ratio_low", "lower end of its 95 % interval, by resampling pairs of the same round", |rival| rival.time_ratio.low.to_string();
    "time_ratio_high", "upper end of it", |rival| rival.time_ratio.high.to_string();
    "seconds", "median seconds of a run", |rival| rival.seconds().to_string();
    "processor_seconds", "median processor seconds of the process in a run; on a software driver they are the work itself",
        |rival| known(rival.processor_seconds());
    "runs", "runs that were timed", |rival| rival.runs.len().to_string();
    "launches", "dispatches with at least one group", |rival| rival.report.launches.to_string();
    "steps", "steps in which somebody was alive; of a megakernel: launches of tiles", |rival| rival.report.steps.to_string();
    "regenerations", "ticks that handed out work", |rival| rival.report.regenerations.to_string();
    "group_steps", "work-groups of each stage, summed over the steps, dead ones that were launched included", |rival| known(rival.group_steps);
    "useful_lane_steps", "lanes alive, summed over the steps", |rival| known(rival.occupancy.map(|lanes| lanes.useful));
    "launched_lane_steps_8", "lanes of subgroups of 8 with a live lane, summed over the steps",
        |rival| known(rival.occupancy.map(|lanes| lanes.launched[0]));
    "launched_lane_steps_32", "the same for subgroups of 32", |rival| known(rival.occupancy.map(|lanes| lanes.launched[1]));
    "launched_lane_steps_64", "the same for subgroups of 64", |rival| known(rival.occupancy.map(|lanes| lanes.launched[2]));
    "useful_share_8", "useful over launched lane-steps, subgroups of 8", |rival| known(rival.occupancy.map(|lanes| lanes.efficiency()[0]));
    "useful_share_32", "the same for subgroups of 32", |rival| known(rival.occupancy.map(|lanes| lanes.efficiency()[1]));
    "useful_share_64", "the same for subgroups of 64", |rival| known(rival.occupancy.map(|lanes| lanes.efficiency()[2]));
    "useful_share_groups", "useful over the lane-steps of group_steps whole groups", |rival| known(rival.group_efficiency());
    "state_bytes_moved", "bytes of state that stages read and write, if every lane-step goes on", |rival| known(rival.state_bytes_moved);
    "items_killed", "walks ended by roulette", |rival| rival.report.items_killed.to_string();
    "device_ms", "milliseconds of all launches by the device's timestamps, in a run of its own",
        |rival| known(rival.times.as_ref().map(|times| times.busy_ns() as f64 / 1e6));
    "scheduling_share", "part of these that the tick took", |rival| known(rival.times.as_ref().map(wavepool::profile::Times::scheduling_share));
    "device_ms_by_kernel", "the same by kernel, `kernel:milliseconds` with spaces between",
        |rival| field(&by_kernel(rival, ':', " ").unwrap_or_default());
    "seconds_of_runs", "seconds of every run in the order of the rounds, with spaces between",
        |rival| rival.runs.iter().map(|run| run.seconds.to_string()).collect::<Vec<_>>().join(" ");
];

/// Milliseconds of each kernel; `None` without times.
pub(super) fn by_kernel(rival: &Rival, is: char, between: &str) -> Option<String> {
    let times = rival.times.as_ref()?;
    let kernels = times.kernels.iter().map(|kernel| format!("{}{is}{:.3}", kernel.kernel, kernel.nanoseconds as f64 / 1e6));
    Some(kernels.collect::<Vec<_>>().join(between))
}

/// A field, quoted where it must be. **Source:** RFC 4180, section 2.
pub fn field(words: &str) -> String {
    match words.contains(['"', ',', '\n', '\r', '#']) {
        true => format!("\"{}\"", words.replace('"', "\"\"")),
        false => words.to_owned(),
    }
}

/// Lines of explanation and the header, with columns of the caller before those of [`COLUMNS`].
pub(super) fn head(leading: &[(&str, &str)]) -> String {
    let columns: Vec<(&str, &str)> = leading.iter().copied().chain(COLUMNS.iter().map(|column| (column.name, column.about))).collect();
    let mut out: String = columns.iter().map(|(name, about)| format!("# {name}: {about}\n")).collect();
    out += &columns.iter().map(|(name, _)| field(name)).collect::<Vec<_>>().join(",");
    out + "\n"
}

/// The fields of a rival, or as many empty ones.
pub(super) fn fields(rival: Option<&Rival>) -> String {
    COLUMNS.iter().map(|column| rival.map_or_else(String::new, column.value)).collect::<Vec<_>>().join(",")
}

/// All cells as CSV: one row per cell and rival. `columns` names what a cell's workload and its place are.
pub fn csv([workload, at]: [&str; 2], cells: &[Cell]) -> String {
    let mut out = head(&[(workload, "what was walked"), (at, "what varies from cell to cell")]);
    for cell in cells {
        for rival in &cell.rivals {
            out += &format!("{},{},{}\n", field(&cell.workload), cell.at, fields(Some(rival)));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{super::samples, *};

    /// Fields of a line; quotes are taken off.
    fn split(line: &str) -> Vec<String> {
        let (mut out, mut is_quoted) = (vec![String::new()], false);
        for c in line.chars() {
            match c {
                '"' => is_quoted = !is_quoted,
                ',' if !is_quoted => out.push(String::new()),
                c => out.last_mut().expect("one at least").push(c),
            }
        }
        out
    }

    /// Kills: a value under another column's name, a schedule whose commas become columns, a column without explanation, a zero where
    /// nothing is known.
    #[test]
    fn every_value_stands_under_its_name() {
        let mut unknown = samples::rival("persistent", 3e6);
        (unknown.occupancy, unknown.group_steps, unknown.state_bytes_moved, unknown.times) = (None, None, None, None);
        let cells = [Cell { workload: "a, b".into(), at: 16, rivals: vec![samples::rival("block", 2e6), unknown] }];
        let text = csv(["scene", "depth"], &cells);
        let comments = text.lines().take_while(|line| line.starts_with("# ")).count();
        let lines: Vec<Vec<String>> = text.lines().skip(comments).map(split).collect();
        assert_eq!((lines.len(), comments), (3, lines[0].len()));
        assert!(lines.iter().all(|line| line.len() == COLUMNS.len() + 2), "{lines:?}");
        let of = |row: usize, name: &str| lines[row][lines[0].iter().position(|column| column == name).expect(name)].as_str();
        assert_eq!((of(1, "scene"), of(1, "depth"), of(1, "rival"), of(2, "rival")), ("a, b", "16", "block", "persistent"));
        assert_eq!(of(1, "schedule"), "block,threshold=0.5,check_every=2,order=scanline,roulette=lane");
        assert_eq!((of(1, "walks_per_second"), of(1, "walks_per_second_low")), ("2000000", "1900000"));
        assert_eq!((of(1, "launches"), of(1, "steps"), of(1, "runs")), ("700", "70", "3"));
        assert_eq!((of(1, "useful_share_8"), of(1, "useful_share_32"), of(1, "useful_share_64")), ("0.9", "0.75", "0.5"));
        assert_eq!((of(1, "device_ms"), of(1, "scheduling_share")), ("10", "0.1"));
        assert_eq!(of(1, "device_ms_by_kernel"), "trace:9.000 tick:1.000");
        assert_eq!((of(1, "seconds"), of(1, "processor_seconds"), of(1, "seconds_of_runs")), ("0.5", "0.75", "0.25 0.5 1"));
        for name in ["useful_lane_steps", "useful_share_64", "group_steps", "state_bytes_moved", "device_ms", "device_ms_by_kernel"] {
            assert_eq!(of(2, name), "", "{name}");
        }
        assert_eq!(field("a \"b\""), "\"a \"\"b\"\"\"");
    }
}
