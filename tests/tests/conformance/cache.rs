//! Kernels are compiled once per text and device, and a kept kernel is the right one.

use wavepool::{GpuContext, LinearRange, Program, Schedule, Scheduler};
use wavepool_tests::device::gpu;

const STEP: &str = "struct Walk { n: u32 }
    fn generate(w: ptr<function, Walk>, item: Item) { (*w).n = item.pixel; }
    fn stop(w: ptr<function, Walk>) -> u32 {
        @if(doubled) { (*w).n *= 2u; }
        (*w).n += EXTRA;
        return FINISH;
    }
    fn finish(w: ptr<function, Walk>) -> u32 { return (*w).n; }";

/// Kills: a kernel served to another text, feature or constant, or to another device; a kernel compiled again although it is there.
#[test]
fn a_kernel_is_compiled_once_per_text_and_device() {
    let Some(gpu) = gpu() else { return };
    let context = GpuContext::borrow(&gpu.device, &gpu.queue);
    let run = |gpu: &GpuContext, doubled: bool, extra: u32| {
        let builder = Program::builder("cached").source("cached.wgsl", STEP).stage("stop");
        let program = builder.feature("doubled", doubled).constant("EXTRA", extra).build().expect("a program");
        let builder = Scheduler::builder(&program, LinearRange { count: 300 }).schedule(&Schedule::block());
        let (film, _) = builder.build_on(gpu).expect("kernels").run(1).expect("a run");
        assert_eq!(film.sum(299, 0), f64::from(299 * (1 + u32::from(doubled)) + extra), "doubled {doubled}, extra {extra}");
        gpu.kernels().0
    };
    // Generate, the stage, tick and resolve.
    assert_eq!(run(&context, false, 1), 4);
    assert_eq!((run(&context, false, 1), context.kernels().1), (4, 4));
    // Another text has another generate and stage, and the same tick and resolve.
    assert_eq!(run(&context, true, 1), 6);
    assert_eq!(run(&context, true, 5), 8);
    let other = GpuContext::headless().expect("there is an adapter");
    assert_eq!(run(&other, true, 5), 4);
}
