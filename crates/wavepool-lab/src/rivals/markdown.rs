//! Rivals as tables for people.

use std::fmt::Write as _;

use super::{Cell, Rival, csv::by_kernel};

/// Head of [`table`].
pub const TABLE_HEAD: &str = "| cell | schedule | pool | launches | steps | groups | useful of groups, % | useful at widths 8, 32, 64, % | state moved, MB | Mwalks/s | time over the first | processor, ms | tick, % |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
";

/// Head of [`stages`].
pub const STAGES_HEAD: &str = "| cell | schedule | device time of a run, ms |
| --- | --- | --- |
";

/// Instead of what is not known.
const UNKNOWN: &str = "-";

fn known<T>(value: Option<T>, write: impl Fn(T) -> String) -> String {
    value.map_or_else(|| UNKNOWN.into(), write)
}

/// Text that stays in its cell of a table.
pub(super) fn cell(words: &str) -> String {
    words.replace('|', "\\|").replace(['\n', '\r'], " ")
}

/// The rivals as rows of a Markdown table, with `label` before each; the head is [`TABLE_HEAD`].
pub fn table(label: &str, rivals: &[Rival]) -> String {
    let mut rows = String::new();
    for rival in rivals {
        let useful = known(rival.occupancy, |lanes| lanes.efficiency().map(|share| format!("{:.1}", share * 100.0)).join(", "));
        let (rate, time) = (rival.walks_per_second, rival.time_ratio);
        let _ = writeln!(
            rows,
            "| {} | `{}` | {} | {} | {} | {} | {} | {useful} | {} | {:.3} [{:.3}, {:.3}] | {:.3} [{:.3}, {:.3}] | {} | {} |",
            cell(label),
            cell(&rival.schedule),
            rival.report.pool_blocks,
            rival.report.launches,
            rival.report.steps,
            known(rival.group_steps, |groups| groups.to_string()),
            known(rival.group_efficiency(), |share| format!("{:.1}", share * 100.0)),
            known(rival.state_bytes_moved, |bytes| format!("{:.1}", bytes as f64 / 1e6)),
            rate.value / 1e6,
            rate.low / 1e6,
            rate.high / 1e6,
            time.value,
            time.low,
            time.high,
            known(rival.processor_seconds(), |seconds| format!("{:.0}", seconds * 1e3)),
            known(rival.times.as_ref(), |times| format!("{:.2}", times.scheduling_share() * 100.0)),
        );
    }
    rows
}

/// Device time by kernel as rows of a Markdown table, those of rivals that were timed by the device; the head is [`STAGES_HEAD`].
pub fn stages(label: &str, rivals: &[Rival]) -> String {
    let timed = rivals.iter().filter_map(|rival| Some((rival, by_kernel(rival, ' ', ", ")?)));
    timed.map(|(rival, times)| format!("| {} | `{}` | {} |\n", cell(label), cell(&rival.schedule), cell(&times))).collect()
}

/// Speeds at a glance: a row for each cell, a column for each name, Mwalks/s, the fastest of a row in bold.
pub fn glance(axis: &str, names: &[String], cells: &[Cell]) -> String {
    let heads: Vec<String> = names.iter().map(|name| format!(" {} |", cell(name))).collect();
    let mut out = format!("| {} |{}\n| ---: |{}\n", cell(axis), heads.concat(), " ---: |".repeat(names.len()));
    for row in cells {
        let rates: Vec<Option<f64>> = names
            .iter()
            .map(|name| row.rivals.iter().find(|rival| rival.name == *name).map(|rival| rival.walks_per_second.value / 1e6))
            .collect();
        let most = rates.iter().flatten().copied().fold(0.0, f64::max);
        let write = |rate: &Option<f64>| match rate {
            Some(rate) if *rate == most => format!(" **{rate:.3}** |"),
            rate => format!(" {} |", known(*rate, |rate| format!("{rate:.3}"))),
        };
        let _ = writeln!(out, "| {} |{}", row.at, rates.iter().map(write).collect::<String>());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{super::samples, *};

    /// Kills: a speed in another's column, the slowest in bold, a name that did not run shown as zero.
    #[test]
    fn the_fastest_of_a_row_is_bold() {
        let cell = |at, factor: f64| Cell {
            workload: "glass".into(),
            at,
            rivals: vec![samples::rival("block", 2e6 * factor), samples::rival("never", 3e6)],
        };
        let names = ["never", "block", "keyed"].map(String::from);
        let text = glance("depth", &names, &[cell(2, 1.0), cell(64, 2.0)]);
        let expected = "| depth | never | block | keyed |\n| ---: | ---: | ---: | ---: |\n\
                        | 2 | **3.000** | 2.000 | - |\n| 64 | 3.000 | **4.000** | - |\n";
        assert_eq!(text, expected);
    }

    /// Kills: a row with another number of cells than its head, a label that opens one, a number where nothing is known.
    #[test]
    fn rows_have_the_cells_of_their_head() {
        let mut unknown = samples::rival("megakernel", 3e6);
        (unknown.occupancy, unknown.group_steps, unknown.times) = (None, None, None);
        let rivals = [samples::rival("block", 2e6), unknown];
        let bars = |line: &str| line.replace("\\|", "").matches('|').count();
        let all = table("a|b", &rivals);
        assert_eq!(all.lines().count(), 2);
        assert!(all.lines().all(|line| bars(line) == bars(TABLE_HEAD.lines().next().unwrap_or_default())), "{all}");
        assert!(all.contains("2.000 [1.900, 2.200]") && all.contains("| 90.0, 75.0, 50.0 |") && all.contains("| 10.00 |"), "{all}");
        assert!(all.lines().last().is_some_and(|line| line.contains("| - | - | - |") && line.ends_with("| - |")), "{all}");
        let timed = stages("a|b", &rivals);
        assert_eq!(timed, "| a\\|b | `block,threshold=0.5,check_every=2,order=scanline,roulette=lane` | trace 9.000, tick 1.000 |\n");
        assert_eq!(bars(&timed), bars(STAGES_HEAD.lines().next().unwrap_or_default()));
    }
}
