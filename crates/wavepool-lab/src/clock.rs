//! The clock that a software driver runs by.
//!
//! Key decision: such a driver computes on threads of this process, so the processor time of the process is what its work has cost. Other
//! work on the same machine makes it wait, which the clock on the wall counts and this one does not.

use std::time::Duration;

/// Processor time that all threads of this process have used; `None` where the system does not tell.
pub fn process_time() -> Option<Duration> {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Some(Duration::new(time.tv_sec.try_into().ok()?, time.tv_nsec.try_into().ok()?))
    }
    #[cfg(not(unix))]
    None
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// Kills: a clock of the calling thread alone, and one that stands still.
    #[test]
    fn work_of_every_thread_counts() {
        let spent = || process_time().expect("unix tells");
        let before = spent();
        let work = std::thread::spawn(move || while spent() - before < Duration::from_millis(50) {});
        work.join().expect("no panic");
        assert!(spent() - before >= Duration::from_millis(50));
    }
}
