//! Rivals as a chart: how fast they are, and how much of what they launch is of use.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, figures 2 to 5, samples per second against the maximum depth.

use super::Cell;
use crate::{
    Interval,
    drawing::{Axis, AxisScale, Line, LinePanel, lines},
};

/// Speeds that differ by more than this are drawn by their ratios.
const WIDE: f64 = 5.0;

/// A chart of the cells of one workload: walks per second over `axis` with their intervals, and useful lane-steps at subgroups of 32 beside
/// it. `names` are all rivals of a series of charts, so that each keeps its colour; rivals of other names are left out.
pub fn chart(title: &str, axis: &str, names: &[String], cells: &[Cell]) -> String {
    let line = |series: usize, value: &dyn Fn(&super::Rival) -> Option<Interval>| {
        let of_cell = |cell: &Cell| {
            let rival = cell.rivals.iter().find(|rival| rival.name == names[series])?;
            Some((f64::from(cell.at), value(rival)?))
        };
        Line { series, points: cells.iter().filter_map(of_cell).collect() }
    };
    let millions = |rate: Interval| Interval { value: rate.value / 1e6, low: rate.low / 1e6, high: rate.high / 1e6 };
    let speeds: Vec<Line> = (0..names.len()).map(|series| line(series, &|rival| Some(millions(rival.walks_per_second)))).collect();
    let useful = |rival: &super::Rival| {
        let share = rival.occupancy?.efficiency()[1] * 100.0;
        Some(Interval { value: share, low: share, high: share })
    };
    let useful: Vec<Line> = (0..names.len()).map(|series| line(series, &useful)).collect();
    let ends = || speeds.iter().flat_map(|line| &line.points).flat_map(|(_, rate)| [rate.low, rate.high]);
    let (least, most) = ends().fold((f64::MAX, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    let scale = if most > WIDE * least { AxisScale::Log } else { AxisScale::Linear };
    let across = || Axis::covering(axis, AxisScale::Log2, cells.iter().map(|cell| f64::from(cell.at)));
    let panels = [
        LinePanel {
            title: "walks per second, 95 % intervals".into(),
            x: across(),
            y: Axis::covering("Mwalks/s", scale, ends()),
            lines: speeds,
        },
        LinePanel {
            title: "useful lane-steps in subgroups of 32 lanes".into(),
            x: across(),
            y: Axis::covering("useful, %", AxisScale::Linear, [100.0]),
            lines: useful,
        },
    ];
    lines(title, names, &panels)
}

#[cfg(test)]
mod tests {
    use super::{super::samples, *};

    /// Kills: a line of another rival or another cell, a share drawn where none is known, speeds that differ a hundredfold on a linear axis.
    #[test]
    fn each_rival_has_its_line() {
        let names = ["block", "never", "persistent"].map(String::from);
        let cell = |at: u32, factor: f64| {
            let mut unknown = samples::rival("persistent", 3e6 * factor);
            unknown.occupancy = None;
            let rivals = vec![samples::rival("block", 2e6 * factor), samples::rival("never", 1e6 * factor), unknown];
            Cell { workload: "glass".into(), at, rivals }
        };
        let text = chart("glass", "maximum depth", &names, &[cell(2, 1.0), cell(64, 0.01)]);
        // A line in the first panel, one in the second where the share is known, one in the legend.
        assert_eq!([0, 1, 2].map(|series| text.matches(&format!("class=\"s{series} line\"")).count()), [3, 3, 2]);
        assert_eq!(text.matches(" bar\"").count(), 6);
        assert!(text.contains(">0.01<") && text.contains(">5<") && text.contains(">100<"), "{text}");
        let near = chart("glass", "maximum depth", &names, &[cell(2, 1.0), cell(64, 0.9)]);
        assert!(near.contains(">0<") && near.contains(">4<") && !near.contains("NaN"));
        assert!(!chart("", "", &names, &[]).contains("NaN"));
    }
}
