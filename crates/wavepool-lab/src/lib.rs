//! Measuring for programs on wavepool.
//!
//! Key decision: two things are compared in one process, in turns, and told apart by the ratio of their times with an interval; a time alone
//! says more about the machine than about the program. Numbers that do not depend on a device come from the scheduler's own counters.
//!
//! **Invariant:** nothing here knows about light; whatever runs on wavepool can be measured.

pub mod clock;
pub mod conformance;
pub mod drawing;
pub mod interval;
pub mod pairs;
pub mod rivals;

pub use interval::{Interval, median};
pub use pairs::{Pair, compare};
pub use rivals::{Cell, Rival, Rounds, bench_schedules, compare_schedules};
