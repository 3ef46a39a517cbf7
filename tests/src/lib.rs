//! What the tests of this package share: the trap functions, the devices, small programs.
//!
//! **Invariant:** a test that cannot run says so on one line, or fails when `WAVEPOOL_NO_SKIP=1`.

pub mod arrays;
pub mod border;
pub mod covering;
pub mod device;
pub mod kernels;
pub mod memory;
pub mod moments;
pub mod programs;
pub mod traps;
pub mod workloads;
