//! What the literature claims about schedules, as numbers of a run.
//!
//! Key decision: a claim becomes a quotient of two rivals of the same cell, and a row says the least, the median and the greatest of them over the
//! cells that the claim is about. No row is a verdict: whether 0.97 is a gain is for people, who see the intervals beside it.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016.

use std::fmt::Write as _;

use super::{
    Cell, Rival,
    ablation::{Row, Variant},
    markdown::cell,
};
use crate::interval::median;

/// What the claims are about in a program.
#[derive(Clone, Copy, Debug)]
pub struct Terms<'a> {
    /// Stages whose device time counts as tracing.
    pub tracing: &'a [&'a str],
    /// From here on a cell is deep; the least place of all cells is the shallow one.
    pub deep: u32,
    /// The work of a run: processor time on a software driver, seconds elsewhere.
    pub work: fn(&Rival) -> Option<f64>,
}

type Quantity<'a> = &'a dyn Fn(&Rival) -> Option<f64>;

/// Head of the table.
const HEAD: &str = "| quantity | cells | least | median | greatest |\n| --- | --- | ---: | ---: | ---: |\n";
/// Each over the other one: work from `deep` on.
const DEEP: [[&str; 2]; 11] = [
    ["block", "never-full"],
    ["per-lane", "never-full"],
    ["compaction", "never-full"],
    ["block", "never"],
    ["per-lane", "block"],
    ["compaction", "block"],
    ["keyed", "compaction"],
    ["megakernel", "block"],
    ["megakernel-regen", "megakernel"],
    ["persistent", "megakernel"],
    ["auto", "megakernel-regen"],
];
/// The same at the shallow end.
const SHALLOW: [[&str; 2]; 3] = [["per-lane", "block"], ["compaction", "block"], ["megakernel-regen", "megakernel"]];
/// What regenerates, over the baseline, from place to place.
const REGENERATING: [&str; 4] = ["block", "per-lane", "compaction", "keyed"];
const BASELINE: &str = "never-full";
/// One of each kind that differs in which lanes meet.
const PACKINGS: [&str; 4] = ["block", "per-lane", "compaction", "keyed"];

/// The numbers as a Markdown table. A row without a cell is left out.
pub fn claims(cells: &[Cell], ablations: &[(String, u32, Vec<Row>)], terms: &Terms) -> String {
    let mut out = String::from(HEAD);
    let deep: Vec<&Cell> = cells.iter().filter(|cell| cell.at >= terms.deep).collect();
    let from = format!("from {} on", terms.deep);
    for name in PACKINGS {
        for (width, index) in [(8, 0), (32, 1), (64, 2)] {
            let share = |cell: &&Cell| Some(named(cell, name)?.occupancy?.efficiency()[index]);
            row(&mut out, &format!("`{name}`: useful of launched lane-steps, subgroups of {width}"), &from, deep.iter().filter_map(share));
        }
    }
    for pair in DEEP {
        row(&mut out, &over("work", pair), &from, deep.iter().filter_map(|cell| quotient(cell, pair, terms.work)));
    }
    if let Some(least) = cells.iter().map(|cell| cell.at).min() {
        let shallow: Vec<&Cell> = cells.iter().filter(|cell| cell.at == least).collect();
        for pair in SHALLOW {
            row(&mut out, &over("work", pair), &format!("at {least}"), shallow.iter().filter_map(|cell| quotient(cell, pair, terms.work)));
        }
    }
    let mut places: Vec<u32> = cells.iter().map(|cell| cell.at).collect();
    places.sort_unstable();
    places.dedup();
    for name in REGENERATING {
        for &place in &places {
            let here = cells.iter().filter(|cell| cell.at == place);
            let pair = [name, BASELINE];
            row(&mut out, &over("work", pair), &format!("at {place}"), here.filter_map(|cell| quotient(cell, pair, terms.work)));
        }
    }
    let lists = "`compaction`: time of tick and generate beyond that of `block`, over its own tracing";
    row(&mut out, lists, &from, deep.iter().filter_map(|cell| cost_of_lists(cell, terms)));
    let bytes = |rival: &Rival| rival.state_bytes_moved.map(|bytes| bytes as f64);
    let pair = ["compaction", "block"];
    row(&mut out, &over("state moved", pair), &from, deep.iter().filter_map(|cell| quotient(cell, pair, bytes)));
    ideas(&mut out, ablations, terms);
    out
}

/// Each variant of the ablation over its baseline.
fn ideas(out: &mut String, ablations: &[(String, u32, Vec<Row>)], terms: &Terms) {
    let mut places: Vec<u32> = ablations.iter().map(|(_, at, _)| *at).collect();
    places.sort_unstable();
    places.dedup();
    let ran = |rows: &'_ [Row], name: &str| {
        rows.iter().find(|(variant, _)| variant.name() == name).and_then(|(_, rival)| rival.as_ref().ok().cloned())
    };
    let launches = |rival: &Rival| Some(rival.report.launches as f64);
    let tracing = |rival: &Rival| device_time(rival, terms.tracing);
    let useful = |rival: &Rival| rival.occupancy.map(|occupancy| occupancy.efficiency()[1]);
    let quantities: [(&str, Quantity); 4] =
        [("launches", &launches), ("work", &terms.work), ("device time of tracing", &tracing), ("useful share, subgroups of 32", &useful)];
    for &place in &places {
        for variant in Variant::all().filter(|variant| *variant != Variant::Baseline) {
            for (what, of) in quantities {
                let here = ablations.iter().filter(|(_, at, _)| *at == place);
                let values = here.filter_map(|(_, _, rows)| {
                    let baseline = ran(rows, &Variant::Baseline.name())?;
                    divided(of(&ran(rows, &variant.name())?)?, of(&baseline)?)
                });
                row(out, &format!("{}: {what} over the baseline's", variant.name()), &format!("at {place}"), values);
            }
        }
    }
}

fn over(what: &str, [one, other]: [&str; 2]) -> String {
    format!("{what}: `{one}` over `{other}`")
}

fn row(out: &mut String, quantity: &str, cells: &str, values: impl Iterator<Item = f64>) {
    let values: Vec<f64> = values.collect();
    if values.is_empty() {
        return;
    }
    let (least, greatest) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &value| (least.min(value), most.max(value)));
    let middle = median(&values);
    let _ = writeln!(out, "| {} | {}: {} | {least:.2} | {middle:.2} | {greatest:.2} |", cell(quantity), cell(cells), values.len());
}

fn named<'a>(cell: &'a Cell, name: &str) -> Option<&'a Rival> {
    cell.rivals.iter().find(|rival| rival.name == name)
}

fn quotient(cell: &Cell, [one, other]: [&str; 2], of: impl Fn(&Rival) -> Option<f64>) -> Option<f64> {
    divided(of(named(cell, one)?)?, of(named(cell, other)?)?)
}

fn divided(value: f64, by: f64) -> Option<f64> {
    (by > 0.0).then(|| value / by)
}

/// Nanoseconds of these kernels together; `None` when the device told none of them.
fn device_time(rival: &Rival, kernels: &[&str]) -> Option<f64> {
    let of_them = rival.times.as_ref()?.kernels.iter().filter(|entry| kernels.contains(&entry.kernel.as_str()));
    let sum: u64 = of_them.map(|entry| entry.nanoseconds).sum();
    (sum > 0).then_some(sum as f64)
}

/// The lists are made by the tick, and what they cost shows in `generate` too, whose lanes look themselves up.
fn cost_of_lists(cell: &Cell, terms: &Terms) -> Option<f64> {
    let (lists, plain) = (named(cell, "compaction")?, named(cell, "block")?);
    let making = |rival| device_time(rival, &["tick", "generate"]);
    divided(making(lists)? - making(plain)?, device_time(lists, terms.tracing)?)
}

#[cfg(test)]
mod tests {
    use super::{
        super::{ablation::Idea, samples},
        *,
    };

    const TERMS: Terms = Terms { tracing: &["trace"], deep: 16, work: Rival::processor_seconds };

    /// Under that name, `slower` times the work and the tick of the sample.
    fn rival(name: &str, slower: u32) -> Rival {
        let mut rival = samples::rival(name, 1e6);
        for run in &mut rival.runs {
            run.processor = run.processor.map(|seconds| seconds * f64::from(slower));
        }
        let tick = rival.times.as_mut().expect("timed").kernels.iter_mut().find(|entry| entry.kernel == "tick").expect("a tick");
        tick.nanoseconds *= u64::from(slower);
        rival.report.launches *= u64::from(slower);
        rival
    }

    fn cell(at: u32, rivals: &[(&str, u32)]) -> Cell {
        Cell { workload: "w".into(), at, rivals: rivals.iter().map(|(name, slower)| rival(name, *slower)).collect() }
    }

    /// Kills: the quotient upside down, shallow cells among the deep ones, a median that is a mean, a rival that did not run counted as one.
    #[test]
    fn quotients_are_taken_over_the_cells_that_they_are_about() {
        let cells = [
            cell(2, &[("block", 1), ("compaction", 9), ("per-lane", 1)]),
            cell(16, &[("block", 2), ("compaction", 4)]),
            cell(32, &[("block", 1), ("compaction", 3)]),
            cell(64, &[("block", 1), ("compaction", 7)]),
            cell(128, &[("block", 1)]),
        ];
        let text = claims(&cells, &[], &TERMS);
        assert!(text.contains("| work: `compaction` over `block` | from 16 on: 3 | 2.00 | 3.00 | 7.00 |"), "{text}");
        assert!(text.contains("| work: `compaction` over `block` | at 2: 1 | 9.00 | 9.00 | 9.00 |"), "{text}");
        assert!(text.contains("| work: `per-lane` over `block` | at 2: 1 | 1.00 | 1.00 | 1.00 |"), "{text}");
        assert!(!text.contains("keyed") && !text.contains("megakernel"), "{text}");
        // A tick of 1 ms beside 9 ms of tracing: (4 - 2) / 9, (3 - 1) / 9, (7 - 1) / 9.
        assert!(text.contains("over its own tracing | from 16 on: 3 | 0.22 | 0.22 | 0.67 |"), "{text}");
        assert!(
            text.contains("| `block`: useful of launched lane-steps, subgroups of 32 | from 16 on: 4 | 0.75 | 0.75 | 0.75 |"),
            "{text}"
        );
        let is_table = |line: &str| line.split('|').count() == 7;
        assert!(text.lines().all(is_table), "{text}");
    }

    /// Kills: another baseline, a variant that did not run, places mixed.
    #[test]
    fn ideas_are_compared_with_the_baseline_of_their_cell() {
        let rows = |alone: u32, baseline: u32| {
            let idea = Variant::Alone(Idea::Regeneration);
            vec![
                (idea, Ok(rival("block", alone))),
                (Variant::Baseline, Ok(rival("never", baseline))),
                (Variant::Full, Err(String::from("did not run"))),
            ]
        };
        let cells = [("a".into(), 16, rows(1, 2)), ("b".into(), 16, rows(3, 2)), ("a".into(), 64, rows(4, 1))];
        let text = claims(&[], &cells, &TERMS);
        let name = Variant::Alone(Idea::Regeneration).name();
        assert!(text.contains(&format!("| {name}: launches over the baseline's | at 16: 2 | 0.50 | 1.00 | 1.50 |")), "{text}");
        assert!(text.contains(&format!("| {name}: work over the baseline's | at 64: 1 | 4.00 | 4.00 | 4.00 |")), "{text}");
        assert!(!text.contains("full scheme"), "{text}");
    }
}
