//! How well a schedule does that chooses: against the best fixed one of each cell, and against the best that could be fixed for all.
//!
//! Key decision: who is best is decided on the rounds of even number and judged on those of odd number. Whoever is called best because it was
//! lucky is lucky no longer, so a chooser is not held to a speed that nobody has.
//!
//! **Invariant:** both sides of a ratio stood in the same round.

use std::fmt::Write as _;

use super::{Cell, Rival, Run};
use crate::{
    interval::{Interval, median},
    pairs::{Pair, ratio},
};

/// What a chooser took in a cell, over what the fixed one took.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The cell's workload.
    pub workload: String,
    /// The cell's place.
    pub at: u32,
    /// Whom it is compared with.
    pub fixed: String,
    /// Time over time, in the rounds of odd number.
    pub ratio: Interval,
}

impl Verdict {
    /// True when the chooser is certainly slower by more than a part, say 0.03: the whole interval lies beyond.
    pub fn is_beyond(&self, part: f64) -> bool {
        self.ratio.low > 1.0 + part
    }
}

fn seconds(runs: &[Run], is_even: bool) -> Vec<f64> {
    runs.iter().enumerate().filter(|(round, _)| round.is_multiple_of(2) == is_even).map(|(_, run)| run.seconds).collect()
}

/// Compares `chooser` in each cell with the fixed rival of least median time in the rounds of even number. Cells without one of both, or with
/// less than two rounds, are left out.
pub fn judge(cells: &[Cell], chooser: &str, is_fixed: impl Fn(&Rival) -> bool) -> Vec<Verdict> {
    let verdict = |cell: &Cell| {
        let mine = cell.rivals.iter().find(|rival| rival.name == chooser && rival.runs.len() > 1)?;
        let early = |rival: &Rival| median(&seconds(&rival.runs, true));
        let fixed = cell.rivals.iter().filter(|rival| rival.name != chooser && is_fixed(rival));
        let best = fixed.min_by(|a, b| early(a).total_cmp(&early(b)))?;
        let pairs: Vec<Pair> =
            seconds(&mine.runs, false).into_iter().zip(seconds(&best.runs, false)).map(|(first, second)| Pair { first, second }).collect();
        Some(Verdict { workload: cell.workload.clone(), at: cell.at, fixed: best.name.clone(), ratio: ratio(&pairs) })
    };
    cells.iter().filter_map(verdict).collect()
}

/// The fixed rival that is the best choice for all cells: the least geometric mean of its time over the least of the cell, in the rounds of
/// even number. Only rivals that took part in every cell.
pub fn best_constant(cells: &[Cell], is_fixed: impl Fn(&Rival) -> bool) -> Option<String> {
    let names: Vec<&str> = cells.first()?.rivals.iter().filter(|rival| is_fixed(rival)).map(|rival| rival.name.as_str()).collect();
    let cost = |name: &str| {
        let logs: Option<Vec<f64>> = cells
            .iter()
            .map(|cell| {
                let early = |rival: &Rival| median(&seconds(&rival.runs, true)).max(f64::MIN_POSITIVE);
                let mine = cell.rivals.iter().find(|rival| rival.name == name).map(early)?;
                let least = cell.rivals.iter().filter(|rival| is_fixed(rival)).map(early).fold(f64::INFINITY, f64::min);
                Some((mine / least).ln())
            })
            .collect();
        logs.map(|logs| logs.iter().sum::<f64>())
    };
    let costs = names.into_iter().filter_map(|name| Some((cost(name)?, name)));
    costs.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name.to_owned())
}

/// Head of [`markdown`].
pub const HEAD: &str = "| cell | against | time over it | beyond 3 % | beyond 10 % |\n| --- | --- | ---: | --- | --- |\n";

/// A row per verdict, and a line that counts them.
pub fn markdown(verdicts: &[Verdict]) -> String {
    let mut text = String::from(HEAD);
    let mark = |is_beyond: bool| if is_beyond { "yes" } else { "" };
    for verdict in verdicts {
        let Interval { value, low, high } = verdict.ratio;
        let _ = writeln!(
            text,
            "| `{}`, {} | `{}` | {value:.3} [{low:.3}, {high:.3}] | {} | {} |",
            verdict.workload,
            verdict.at,
            verdict.fixed,
            mark(verdict.is_beyond(0.03)),
            mark(verdict.is_beyond(0.1))
        );
    }
    let beyond = |part: f64| verdicts.iter().filter(|verdict| verdict.is_beyond(part)).count();
    let _ = writeln!(text, "\n{} of {} cells lie beyond 3 %, {} beyond 10 %.", beyond(0.03), verdicts.len(), beyond(0.1));
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rivals::samples::rival;

    fn timed(name: &str, seconds: &[f64]) -> Rival {
        let mut rival = rival(name, 1.0);
        rival.runs = seconds.iter().map(|seconds| Run { seconds: *seconds, processor: None }).collect();
        rival
    }

    fn cell(at: u32, rivals: Vec<Rival>) -> Cell {
        Cell { workload: "made up".into(), at, rivals }
    }

    /// Kills: a rival called best by the rounds that it is judged by; the chooser compared with itself; rounds of two rivals mixed up.
    #[test]
    fn the_best_is_chosen_on_one_half_and_judged_on_the_other() {
        // `never` is faster in even rounds, `block` in odd ones.
        let never = timed("never", &[1.0, 8.0, 1.0, 8.0]);
        let block = timed("block", &[2.0, 1.0, 2.0, 1.0]);
        let auto = timed("auto", &[0.5, 4.0, 0.5, 4.0]);
        let cells = [cell(4, vec![auto, never, block])];
        let verdicts = judge(&cells, "auto", |_| true);
        assert_eq!((verdicts[0].fixed.as_str(), verdicts[0].ratio.value), ("never", 0.5));
        let only_block = judge(&cells, "auto", |rival| rival.name == "block");
        assert_eq!((only_block[0].fixed.as_str(), only_block[0].ratio.value), ("block", 4.0));
        assert!(only_block[0].is_beyond(0.1) && !verdicts[0].is_beyond(0.03));
        assert!(markdown(&only_block).contains("1 of 1 cells lie beyond 3 %, 1 beyond 10 %"));
        assert!(judge(&cells, "keyed", |_| true).is_empty());
    }

    /// Kills: a constant choice that is best in one cell and hopeless in another; one that did not run everywhere.
    #[test]
    fn a_constant_choice_is_good_everywhere() {
        let cells = [
            cell(1, vec![timed("never", &[1.0, 1.0]), timed("block", &[1.2, 1.2]), timed("keyed", &[0.1, 0.1])]),
            cell(2, vec![timed("never", &[9.0, 9.0]), timed("block", &[1.0, 1.0])]),
        ];
        assert_eq!(best_constant(&cells, |_| true).as_deref(), Some("block"));
        assert_eq!(best_constant(&cells, |rival| rival.name == "never").as_deref(), Some("never"));
        assert_eq!(best_constant(&[], |_| true), None);
    }
}
