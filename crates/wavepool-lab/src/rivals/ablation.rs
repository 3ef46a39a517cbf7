//! The ideas of block-in-place regeneration, each left out of the full scheme and each alone on the baseline.
//!
//! Key decision: a scheme is a set of ideas, and its schedule is written from that set, so that no two rows differ by more than they say.
//! An idea that this library cannot leave out, that does nothing by itself, or that it does not have yet keeps its row, with the reason.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, whose six ideas are never taken apart there; the live list is a
//! seventh.

use wavepool::Schedule;

use super::{
    Rival,
    csv::{field, fields, head},
    markdown::cell,
    table,
};

/// One of the ideas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Idea {
    /// Work is handed out in tiles of 256 items.
    Tiles,
    /// A block whose lanes are all dead takes the next tile, in place.
    Regeneration,
    /// Lanes of a work-group share a draw of roulette, by the largest of their chances.
    GroupRoulette,
    /// Tiles that took longest in the pass before begin first.
    DepthSort,
    /// Blocks wait until enough of them wish to regenerate.
    Threshold,
    /// Live lanes of a work-group are packed to its front while it traces rays.
    LocalCompaction,
    /// Live blocks alone are launched.
    LiveList,
}

/// All of them: the six of the paper in its order, and the live list.
pub const IDEAS: [Idea; 7] =
    [Idea::Tiles, Idea::Regeneration, Idea::GroupRoulette, Idea::DepthSort, Idea::Threshold, Idea::LocalCompaction, Idea::LiveList];

impl Idea {
    /// A word or two.
    pub fn name(self) -> &'static str {
        match self {
            Idea::Tiles => "tiles",
            Idea::Regeneration => "regeneration in place",
            Idea::GroupRoulette => "work-group roulette",
            Idea::DepthSort => "depth-sorted tiles",
            Idea::Threshold => "threshold",
            Idea::LocalCompaction => "local compaction",
            Idea::LiveList => "live list",
        }
    }
}

/// Which scheme a row is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Variant {
    /// Every idea that the library has.
    Full,
    /// All but one.
    Without(Idea),
    /// None but tiles: no regeneration, every block launched, roulette by lane.
    Baseline,
    /// The baseline and one.
    Alone(Idea),
}

impl Variant {
    /// Every row, in the order of the table.
    pub fn all() -> impl Iterator<Item = Variant> {
        let full = std::iter::once(Variant::Full).chain(IDEAS.map(Variant::Without));
        full.chain(std::iter::once(Variant::Baseline)).chain(IDEAS.map(Variant::Alone))
    }

    /// In words.
    pub fn name(self) -> String {
        match self {
            Variant::Full => "full scheme".into(),
            Variant::Without(idea) => format!("without {}", idea.name()),
            Variant::Baseline => "baseline".into(),
            Variant::Alone(idea) => format!("{} alone", idea.name()),
        }
    }

    /// The schedule as text, with local compaction where the library `has_local` compaction, or why there is none.
    fn text(self, has_local: bool) -> Result<String, &'static str> {
        let has = |idea| match self {
            Variant::Full => true,
            Variant::Without(other) => idea != other,
            Variant::Baseline => false,
            Variant::Alone(other) => idea == other,
        };
        match self {
            Variant::Without(Idea::Tiles) | Variant::Alone(Idea::Tiles) => {
                return Err("tiles are always there: the pool is made of blocks that hold one each");
            }
            Variant::Alone(Idea::Threshold) => return Err("without regeneration nobody waits for it"),
            Variant::Without(Idea::LocalCompaction) | Variant::Alone(Idea::LocalCompaction) if !has_local => {
                return Err("this library does not have it yet: no schedule understands `local=all`");
            }
            _ => {}
        }
        let regeneration = match (has(Idea::Regeneration), has(Idea::Threshold)) {
            (true, true) => "block,threshold=0.5,check_every=2",
            (true, false) => "block,threshold=0,check_every=1",
            (false, _) => "never",
        };
        let mut text = regeneration.to_owned();
        for (idea, with, without) in [
            (Idea::LiveList, "launch=live", "launch=full"),
            (Idea::DepthSort, "order=depth-max", "order=scanline"),
            (Idea::GroupRoulette, "roulette=block-max", "roulette=lane"),
        ] {
            text = format!("{text},{}", if has(idea) { with } else { without });
        }
        if has_local && has(Idea::LocalCompaction) {
            text += ",local=all";
        }
        Ok(text)
    }

    /// The schedule.
    ///
    /// # Errors
    /// Why there is none, in words.
    pub fn schedule(self) -> Result<Schedule, String> {
        let has_local = "block,local=all".parse::<Schedule>().is_ok();
        self.text(has_local)?.parse().map_err(|error: wavepool::Error| error.to_string())
    }
}

/// One row: what ran, or why nothing did.
pub type Row = (Variant, Result<Rival, String>);

/// Head of [`markdown`].
pub const HEAD: &str = super::TABLE_HEAD;

/// Rows of a Markdown table with `label` and the variant before each, and a line for each that did not run.
pub fn markdown(label: &str, rows: &[Row]) -> String {
    let write = |(variant, outcome): &Row| {
        let label = format!("{label}, {}", variant.name());
        match outcome {
            Ok(rival) => table(&label, std::slice::from_ref(rival)),
            Err(why) => format!("| {} | left out: {} |{}\n", cell(&label), cell(why), " |".repeat(11)),
        }
    };
    rows.iter().map(write).collect()
}

/// All cells (workload, place, rows) as CSV, one line per row, those that did not run included.
pub fn csv([workload, at]: [&str; 2], cells: &[(String, u32, Vec<Row>)]) -> String {
    let mut out = head(&[
        (workload, "what was walked"),
        (at, "what varies from cell to cell"),
        ("variant", "which ideas: all, all but one, none but tiles, or one more"),
        ("left_out", "why it did not run; empty where it did"),
    ]);
    for (name, at, rows) in cells {
        for (variant, outcome) in rows {
            let why = outcome.as_ref().err().map_or("", String::as_str);
            out += &format!("{},{at},{},{},{}\n", field(name), field(&variant.name()), field(why), fields(outcome.as_ref().ok()));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{super::samples, *};

    /// How many of the parts of two schedules differ, with threshold and interval as one part and the name as another.
    fn differences(one: Variant, other: Variant) -> usize {
        let parts = |variant: Variant| {
            let text = variant.text(true).expect("a schedule");
            let threshold = if text.contains("threshold=0,") { "at once" } else { "waits" };
            let part = |key: &str| text.split(',').find(|part| part.starts_with(key)).unwrap_or_default().to_owned();
            [part("block"), part("launch"), part("order"), part("roulette"), part("local"), threshold.to_owned()]
        };
        parts(one).iter().zip(&parts(other)).filter(|(one, other)| one != other).count()
    }

    /// Kills: a row that differs from its scheme by two ideas or by none, an idea without a row, a schedule that cannot be read.
    #[test]
    fn rows_differ_by_what_they_say() {
        assert_eq!(Variant::all().count(), 2 * (1 + IDEAS.len()));
        for idea in IDEAS.into_iter().filter(|idea| *idea != Idea::Tiles) {
            assert_eq!(differences(Variant::Full, Variant::Without(idea)), 1, "without {idea:?}");
        }
        for idea in [Idea::GroupRoulette, Idea::DepthSort, Idea::LocalCompaction, Idea::LiveList] {
            assert_eq!(differences(Variant::Baseline, Variant::Alone(idea)), 1, "{idea:?} alone");
        }
        // Regeneration alone acts at once: the threshold is an idea of its own.
        assert_eq!(
            Variant::Alone(Idea::Regeneration).text(false),
            Ok("block,threshold=0,check_every=1,launch=full,order=scanline,roulette=lane".into())
        );
        assert_eq!(Variant::Full.text(true).map(|text| text.ends_with(",local=all")), Ok(true));
        for variant in Variant::all() {
            match variant.schedule() {
                Ok(schedule) => assert_eq!(
                    schedule.to_string().contains("launch=full"),
                    variant.text(true).is_ok_and(|text| text.contains("launch=full"))
                ),
                Err(why) => {
                    assert!(why.contains("tiles are") || why.contains("nobody waits") || why.contains("local=all"), "{variant:?}: {why}")
                }
            }
        }
    }

    /// Kills: a row that did not run lost from a table, or filled with another's numbers.
    #[test]
    fn what_did_not_run_keeps_its_row() {
        let rows =
            vec![(Variant::Full, Ok(samples::rival("block", 2e6))), (Variant::Alone(Idea::Tiles), Err("always, there | here".into()))];
        let text = markdown("glass", &rows);
        let bars = |line: &str| line.replace("\\|", "").matches('|').count();
        assert!(
            text.lines().count() == 2 && text.lines().all(|line| bars(line) == bars(HEAD.lines().next().unwrap_or_default())),
            "{text}"
        );
        assert!(text.contains("| glass, tiles alone | left out: always, there \\| here |"), "{text}");
        let csv = csv(["scene", "depth"], &[("glass".into(), 16, rows)]);
        let last = csv.lines().last().expect("a row");
        assert!(last.starts_with("glass,16,tiles alone,\"always, there | here\",,,") && last.ends_with(",,"), "{last}");
        assert_eq!(csv.lines().filter(|line| line.starts_with("glass,16,")).count(), 2);
    }
}
