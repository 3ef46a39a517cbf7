//! Where the rows of a scene lie makes no difference to what is seen.

use std::ops::ControlFlow;

use path_tracer::{Renderer, Settings, scene};
use wavepool::{GpuContext, GpuOptions};
use wavepool_tests::{device::gpu, kernels::everything};

/// Kills: the halves of a number of 64 bits exchanged, a word of the next row, a table that is cut off, a small scene in storage memory where uniform
/// memory is the faster one, numbers of 64 bits on a device that has none.
#[test]
fn rows_in_uniform_memory_give_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let plain = GpuContext::new(&GpuOptions { webgpu_only: true, ..GpuOptions::default() }).expect("the same adapter");
    let has_int64 = gpu.device.features().contains(wavepool::wgpu::Features::SHADER_INT64);
    for scene in [everything(), scene::builtin("cornell-box").expect("it is in the list")] {
        let outcome = |gpu: &GpuContext| {
            let mut renderer = Renderer::new(gpu, &scene, &Settings::new(32, 32, 2)).expect("the scene compiles");
            let is_uniform = renderer.scheduler().wgsl().contains("var<uniform> triangles");
            (is_uniform, renderer.render(|_| ControlFlow::Continue(())).expect("the scene renders").film)
        };
        let ((uniform, seen), (never, expected)) = (outcome(gpu), outcome(&plain));
        assert_eq!((uniform, never), (gpu.facts.name.starts_with("llvmpipe") && has_int64, false), "{}", scene.name);
        assert!((0..seen.pixels()).any(|pixel| seen.sum(pixel, 0) > 0.0), "{}: a black picture proves nothing", scene.name);
        assert_eq!(seen.hash(), expected.hash(), "{}", scene.name);
    }
}
