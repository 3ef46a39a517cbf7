//! What is observed while a program runs, apart from the schedule.
//!
//! Key decision: everything here is off by default and then costs nothing: no code in a kernel, no buffer, no query.
//!
//! **Invariant:** no instrument changes a result, a decision of the scheduler or an order.

/// What to observe.
///
/// # Example
/// ```
/// use wavepool::Instruments;
/// let instruments = Instruments { lengths: true, ..Instruments::default() };
/// assert!(!instruments.checked);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Instruments {
    /// After every step, count lanes and results again and compare with the counters; switches [`assertions`](Self::assertions) on.
    ///
    /// **Cost:** the host waits twice per step.
    pub checked: bool,
    /// Evaluate the assertions of the program; else they have no code.
    pub assertions: bool,
    /// Write down what every tick decides: live blocks and lanes, blocks that start a tile, which tile goes where.
    pub steps: bool,
    /// Keep the number of steps of every walk; what [`replay`](crate::replay) needs.
    ///
    /// **Cost:** one word per item of the run.
    pub lengths: bool,
    /// Device time of every launch, where the device has timestamps.
    pub times: bool,
    /// Debug groups such as `step 12 / trace`, for RenderDoc, Nsight and the like.
    pub markers: bool,
    /// Submit so many steps before the first look at a counter; 0 looks after every submission.
    pub look_after: u32,
}

impl Instruments {
    /// Everything that explains a run: steps, lengths and times.
    pub fn statistics() -> Self {
        Instruments { steps: true, lengths: true, times: true, ..Instruments::default() }
    }

    /// Checked mode.
    pub fn checked() -> Self {
        Instruments { checked: true, ..Instruments::default() }
    }

    /// True when assertions have code.
    pub(crate) fn has_assertions(&self) -> bool {
        self.checked || self.assertions
    }
}
