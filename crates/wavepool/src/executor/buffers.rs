//! The scheduler's own buffers, and the bind groups over them.

use super::{
    kernels::{Class, Kernels, scoped},
    readback::Staging,
    sizes::Sizes,
};
use crate::{
    Result,
    control::{self, Control},
};

#[derive(Debug)]
pub(super) struct Buffers {
    pub(super) sizes: Sizes,
    pub(super) control: wgpu::Buffer,
    pub(super) counters: wgpu::Buffer,
    pub(super) arguments: wgpu::Buffer,
    results: wgpu::Buffer,
    bank: wgpu::Buffer,
    pub(super) film: wgpu::Buffer,
    stage_group: wgpu::BindGroup,
    tick_group: wgpu::BindGroup,
    resolve_group: wgpu::BindGroup,
    pub(super) staging: Vec<Staging>,
}

/// Submissions whose counters may be on their way back.
const STAGING: usize = 3;

impl Buffers {
    pub(super) fn new(device: &wgpu::Device, kernels: &Kernels, sizes: Sizes) -> Result<Self> {
        let buffer = |label: &str, words: u64, extra: wgpu::BufferUsages| {
            scoped(device, &format!("allocating {} bytes of {label}", words * 4), || {
                device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size: words.max(4) * 4,
                    usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC | extra,
                    mapped_at_creation: false,
                })
            })
        };
        let none = wgpu::BufferUsages::empty();
        let control = buffer("control", Control::words(sizes.pool_blocks, sizes.ordered_tiles), none)?;
        let counters = buffer("counters", control::counter_words(sizes.pool_blocks, sizes.ordered_tiles), none)?;
        let arguments = buffer("arguments", u64::from(control::arguments::WORDS), wgpu::BufferUsages::INDIRECT)?;
        let results = buffer("results", u64::from(sizes.ring) * u64::from(sizes.result_planes) * sizes.places(), none)?;
        let film = buffer("film", u64::from(sizes.film_planes) * sizes.places(), none)?;
        let bank = buffer("bank", sizes.bank_words, none)?;
        let group = |label: &str, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]| {
            let entries: Vec<_> = buffers
                .iter()
                .enumerate()
                .map(|(binding, buffer)| wgpu::BindGroupEntry { binding: binding as u32, resource: buffer.as_entire_binding() })
                .collect();
            scoped(device, &format!("binding {label}"), || {
                device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
            })
        };
        let stage_group = group("stage buffers", &kernels.stage_layout, &[&control, &counters, &results, &bank])?;
        let tick_group = group("tick buffers", &kernels.tick_layout, &[&control, &counters, &arguments])?;
        let resolve_group = group("resolve buffers", &kernels.stage_layout, &[&control, &counters, &results, &film])?;
        let staging = (0..STAGING).map(|_| Staging::new(device)).collect::<Result<_>>()?;
        Ok(Buffers { sizes, control, counters, arguments, results, bank, film, stage_group, tick_group, resolve_group, staging })
    }

    pub(super) fn group(&self, class: Class) -> &wgpu::BindGroup {
        match class {
            Class::Stage => &self.stage_group,
            Class::Tick => &self.tick_group,
            Class::Resolve => &self.resolve_group,
        }
    }

    /// Brings everything to the state before the first tick.
    pub(super) fn reset(&self, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, head: &Control) {
        for buffer in [&self.counters, &self.arguments, &self.results, &self.film, &self.bank] {
            encoder.clear_buffer(buffer, 0, None);
        }
        let mut words: Vec<u32> = bytemuck::cast_slice(bytemuck::bytes_of(head)).to_vec();
        // Every ring slot waits for all tiles of its first pass; no block has a tile.
        words.resize(words.len() + control::MAX_RING as usize, self.sizes.tiles);
        words.resize(words.len() + self.sizes.pool_blocks as usize, control::NONE);
        queue.write_buffer(&self.control, 0, bytemuck::cast_slice(&words));
        // The first pass of a measured order follows the numbers of the tiles.
        let first: Vec<u32> = (0..self.sizes.ordered_tiles).collect();
        let place = Control::words(self.sizes.pool_blocks, 0) * 4;
        queue.write_buffer(&self.control, place, bytemuck::cast_slice(&first));
    }
}
