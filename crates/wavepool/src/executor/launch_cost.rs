//! What a launch costs on this device, work apart.
//!
//! wgpu checks indirect arguments by a launch of its own unless the instance was made without that check, and a borrowed device does not
//! tell. So it is measured: an indirect launch of no groups beside a direct one of one group.

use std::time::{Duration, Instant};

use super::{kernels::scoped, readback::read_words};
use crate::Result;

const LAUNCHES: u32 = 256;
const ROUNDS: usize = 5;
const KERNEL: &str = "@group(0) @binding(0) var<storage, read_write> word: u32;
@compute @workgroup_size(1) fn touch() { word += 1u; }";

/// Nanoseconds of an indirect launch without groups, and of a direct one with one group; medians of a few rounds.
pub(super) fn measure(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Option<[u64; 2]>> {
    let (buffer, arguments, pipeline, group) = scoped(device, "measuring the cost of a launch", || {
        let buffer = |usage| {
            let usage = usage | wgpu::BufferUsages::COPY_SRC;
            device.create_buffer(&wgpu::BufferDescriptor { label: Some("launch cost"), size: 16, usage, mapped_at_creation: false })
        };
        let (word, arguments) = (buffer(wgpu::BufferUsages::STORAGE), buffer(wgpu::BufferUsages::INDIRECT));
        let source = wgpu::ShaderSource::Wgsl(KERNEL.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("launch cost"), source });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("launch cost"),
            layout: None,
            module: &module,
            entry_point: Some("touch"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let entries = [wgpu::BindGroupEntry { binding: 0, resource: word.as_entire_binding() }];
        let layout = pipeline.get_bind_group_layout(0);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries });
        (word, arguments, pipeline, group)
    })?;
    let run = |launch: &dyn Fn(&mut wgpu::ComputePass<'_>)| -> Result<Duration> {
        let begun = Instant::now();
        scoped(device, "measuring the cost of a launch", || {
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_pipeline(&pipeline);
                pass.set_bind_group(0, &group, &[]);
                (0..LAUNCHES).for_each(|_| launch(&mut pass));
            }
            queue.submit([encoder.finish()]);
        })?;
        read_words(device, queue, &buffer, 0, 1, "measuring the cost of a launch")?;
        Ok(begun.elapsed())
    };
    let median = |launch: &dyn Fn(&mut wgpu::ComputePass<'_>)| -> Result<Duration> {
        let mut times = (0..ROUNDS).map(|_| run(launch)).collect::<Result<Vec<_>>>()?;
        times.sort_unstable();
        Ok(times[ROUNDS / 2])
    };
    // The first run compiles.
    run(&|pass| pass.dispatch_workgroups(1, 1, 1))?;
    let nothing = median(&|_| {})?;
    let indirect = median(&|pass| pass.dispatch_workgroups_indirect(&arguments, 0))?;
    let direct = median(&|pass| pass.dispatch_workgroups(1, 1, 1))?;
    Ok(Some([indirect, direct].map(|time| time.saturating_sub(nothing).as_nanos() as u64 / u64::from(LAUNCHES))))
}
