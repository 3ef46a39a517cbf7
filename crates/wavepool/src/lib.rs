//! wavepool schedules wavefront programs on the GPU: very many independent walks (light paths, particles, rays, random walks), each
//! with an unknown number of steps.
//!
//! You write the walk as plain WGSL functions; wavepool keeps the state of a pool of lanes, refills lanes whose walk has ended, ends
//! hopeless walks, orders the work and launches the stages. The schedule is one value, swapped without touching the stages:
//!
//! ```ignore
#![doc = include_str!("../../../examples/collatz/src/main.rs")]
//! ```
//!
//! The WGSL of that program:
//!
//! ```wgsl
#![doc = include_str!("../../../examples/collatz/src/collatz.wgsl")]
//! ```
//!
//! What a program declares, with `walk: ptr<function, STATE>` before all:
//!
//! | function | called |
//! | --- | --- |
//! | `generate(walk, item: Item)` | once per item, on a state of zeros; `Item` is `{ tile, index, pixel, sample }` |
//! | stages `(walk)` or `(walk) -> u32` | in each step, in their order; `FINISH` ends the walk, `CONTINUE` does not |
//! | `finish(walk) -> RESULT` | once per item; f32 and u32, vectors or a struct of them, summed per pixel into the film |
//! | `survival(walk) -> f32` and `reweight(walk, inverse_p: f32)` | optional, for roulette: the chance to go on, and what survivors do about it |
//! | `queue_key(walk) -> u32` | optional, for keyed queues: which kind of work the walk asks for after the first stage, modulo 64; writes nothing |
//!
//! Key decisions: the device decides, the host records; random numbers and results belong to items, never to lanes; so on one device
//! and driver every schedule gives the same bits, as long as the roulette is the same and the pins are on. What is given up: stages are
//! pure in their lane, they cannot talk to each other.
//!
//! **Invariant:** `program`, `layout`, `policy` and `plan` never see a device; `executor` alone encodes wgpu commands.

mod control;
mod error;
mod executor;
mod film;
mod gpu;
mod instruments;
pub mod layout;
pub mod plan;
pub mod policy;
pub mod profile;
mod program;
pub mod replay;
mod schedule;
pub mod shader;

pub use error::{Error, Result};
pub use executor::{
    Decision, LaneState, PoolSnapshot, Progress, Report, Resources, Run, Scheduler, SchedulerBuilder, SchedulingCost, Took, Value, upload,
};
pub use film::Film;
pub use gpu::{AdapterFacts, GpuContext, GpuOptions, adapters};
pub use instruments::Instruments;
pub use policy::{ImageTiles, LinearRange};
pub use program::{Program, ProgramBuilder};
pub use schedule::{SCHEDULE_KEYS, SCHEDULES, Schedule};
pub use shader::Constant;

pub use {bytemuck, naga, wgpu};
