//! Steps that are announced, timed and summed up in a table.

use std::time::{Duration, Instant};

use crate::process::Failure;

/// How a step that did not fail went.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It did what it is for.
    Passed,
    /// It could not be done here, for this reason.
    Skipped(String),
}

/// The steps so far.
#[derive(Debug, Default)]
pub(crate) struct Steps {
    rows: Vec<Row>,
}

#[derive(Debug)]
struct Row {
    name: String,
    took: Duration,
    verdict: String,
}

impl Steps {
    /// Announces a step, does it, and notes how long it took. A failure ends the table: the caller hands it on.
    ///
    /// # Errors
    /// Whatever the work reports, with the step's name in front.
    pub(crate) fn run(&mut self, name: &str, work: impl FnOnce() -> Result<Outcome, Failure>) -> Result<(), Failure> {
        println!("\n==> {name}");
        let start = Instant::now();
        let result = work();
        let took = start.elapsed();
        let verdict = match &result {
            Ok(Outcome::Passed) => "ok".to_owned(),
            Ok(Outcome::Skipped(why)) => format!("skipped: {why}"),
            Err(_) => "FAILED".to_owned(),
        };
        println!("<== {name}: {verdict} ({:.1} s)", took.as_secs_f64());
        self.rows.push(Row { name: name.to_owned(), took, verdict });
        match result {
            Ok(_) => Ok(()),
            Err(Failure::Step(why) | Failure::Usage(why)) => Err(Failure::step(format!("step `{name}`: {why}"))),
        }
    }

    /// One line per step, the total last.
    pub(crate) fn summary(&self) -> String {
        let width = self.rows.iter().map(|row| row.name.len()).max().unwrap_or(0).max("total".len());
        let line = |name: &str, took: Duration, verdict: &str| format!("  {name:width$}  {:7.1} s  {verdict}\n", took.as_secs_f64());
        let mut text = String::from("summary\n");
        for row in &self.rows {
            text += &line(&row.name, row.took, &row.verdict);
        }
        let total = self.rows.iter().map(|row| row.took).sum();
        text += &line("total", total, "");
        text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a failure that is swallowed, and a failed or skipped step that the table shows as passed.
    #[test]
    fn the_table_tells_each_verdict() {
        let mut steps = Steps::default();
        assert_eq!(steps.run("one", || Ok(Outcome::Passed)), Ok(()));
        assert_eq!(steps.run("two", || Ok(Outcome::Skipped("no driver".into()))), Ok(()));
        let failed = steps.run("three", || Err(Failure::step("it broke")));
        assert_eq!(failed, Err(Failure::step("step `three`: it broke")));
        let table = steps.summary();
        let rows: Vec<&str> = table.lines().collect();
        assert_eq!(rows.len(), 5, "{table}");
        assert!(rows[1].contains("one") && rows[1].ends_with("ok"), "{table}");
        assert!(rows[2].ends_with("skipped: no driver"), "{table}");
        assert!(rows[3].ends_with("FAILED"), "{table}");
        assert!(rows[4].contains("total"), "{table}");
    }
}
