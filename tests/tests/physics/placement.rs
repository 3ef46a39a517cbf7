//! Where the rows of a scene lie, and whether there is a hierarchy over them, makes no difference to what is seen.

use std::ops::ControlFlow;

use glam::Vec3;
use path_tracer::{
    Renderer, Settings,
    gpu_scene::exhaustive::EXHAUSTIVE_TRIANGLES,
    scene::{self, Triangle},
};
use wavepool::{GpuContext, GpuOptions};
use wavepool_tests::{device::gpu, kernels::everything};

use crate::lambert;

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
        assert_eq!((uniform, never), (gpu.facts.is_llvmpipe() && has_int64, false), "{}", scene.name);
        assert!((0..seen.pixels()).any(|pixel| seen.sum(pixel, 0) > 0.0), "{}: a black picture proves nothing", scene.name);
        assert_eq!(seen.hash(), expected.hash(), "{}", scene.name);
    }
}

/// Kills: a triangle that is asked by nobody, another one of those at the same distance than the hierarchy finds,
/// a small scene with a hierarchy where it is faster without.
#[test]
fn small_scenes_without_a_hierarchy_give_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let scene = scene::builtin("cornell-box").expect("it is in the list");
    let outcome = |copies: u32| {
        let mut scene = scene.clone();
        // Black ones in the very places of the first triangles that do not glow; whoever comes first in the scene is seen.
        let black = scene.materials.len() as u32;
        scene.materials.push(lambert(0.0, 0.0));
        let dark = scene.triangles.iter().filter(|triangle| scene.materials[triangle.material as usize].emissive == Vec3::ZERO);
        let copied: Vec<_> = dark.take(copies as usize).map(|&triangle| Triangle { material: black, ..triangle }).collect();
        scene.triangles.extend(copied);
        let mut renderer = Renderer::new(gpu, &scene, &Settings::new(32, 32, 4)).expect("the scene compiles");
        let is_exhaustive = renderer.scheduler().wgsl().contains("fn meet_all_triangles");
        (scene.triangles.len() as u32, is_exhaustive, renderer.render(|_| ControlFlow::Continue(())).expect("the scene renders").film)
    };
    let (_, _, expected) = outcome(0);
    assert!((0..expected.pixels()).any(|pixel| expected.sum(pixel, 0) > 0.0), "a black picture proves nothing");
    for copies in [0, 10, 30] {
        let (triangles, is_exhaustive, seen) = outcome(copies);
        assert_eq!(is_exhaustive, gpu.facts.is_llvmpipe() && triangles <= EXHAUSTIVE_TRIANGLES, "{triangles} triangles");
        assert_eq!(seen.hash(), expected.hash(), "{copies} copies");
    }
}
