//! The smallest wavefront program: how many steps does Collatz's rule take from each number down to 1?
//!
//! Try `cargo run -p collatz -- never`, `block` (the default) or `megakernel`.

use wavepool::{GpuContext, LinearRange, Program, Schedule, Scheduler};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let program = Program::builder("collatz").source("collatz.wgsl", include_str!("collatz.wgsl")).stage("step").build()?;

    let schedule: Schedule = std::env::args().nth(1).as_deref().unwrap_or("block").parse()?;
    let gpu = GpuContext::headless()?;
    let mut scheduler = Scheduler::new(&gpu.device, &gpu.queue, &program, LinearRange { count: 65_536 }, &schedule)?;
    let (film, report) = scheduler.run(1)?;

    let longest = (0..film.pixels()).max_by_key(|&pixel| film.sum(pixel, 0) as u64).unwrap_or(0);
    println!("{} takes {} steps, more than any other number up to {}", longest + 1, film.sum(longest, 0), film.pixels());
    println!("{}: {} launches, {} regenerations, on {}", report.schedule, report.launches, report.regenerations, gpu.facts);
    Ok(())
}
