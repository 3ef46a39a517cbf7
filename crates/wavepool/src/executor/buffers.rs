//! The scheduler's own buffers, and the bind groups over them.

use super::{
    kernels::{Class, Kernels, scoped},
    readback::{Staging, reader},
    sizes::Sizes,
    times::Clock,
};
use crate::{
    Instruments, Result,
    control::{self, Control},
};

#[derive(Debug)]
pub(super) struct Buffers {
    pub(super) sizes: Sizes,
    pub(super) control: wgpu::Buffer,
    pub(super) counters: wgpu::Buffer,
    pub(super) arguments: wgpu::Buffer,
    pub(super) results: wgpu::Buffer,
    pub(super) record: wgpu::Buffer,
    pub(super) banks: Vec<wgpu::Buffer>,
    pub(super) film: wgpu::Buffer,
    /// One per bank.
    stage_groups: Vec<wgpu::BindGroup>,
    tick_group: wgpu::BindGroup,
    resolve_group: wgpu::BindGroup,
    pub(super) staging: Vec<Staging>,
    /// For the film and all else that is read at the end.
    pub(super) reader: wgpu::Buffer,
    pub(super) clock: Option<Clock>,
}

/// Submissions whose counters may be on their way back.
const STAGING: usize = 3;
/// Offsets of uniforms are multiples of this on every device.
const UNIFORM_STRIDE: u64 = 256;

impl Buffers {
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        kernels: &Kernels,
        sizes: Sizes,
        instruments: &Instruments,
    ) -> Result<Self> {
        let with_usage = |label: &str, words: u64, usage: wgpu::BufferUsages| {
            scoped(device, &format!("allocating {} bytes of {label}", words * 4), || {
                device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size: words.max(4) * 4,
                    usage: usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                })
            })
        };
        let buffer = |label: &str, words: u64| with_usage(label, words, wgpu::BufferUsages::STORAGE);
        let control = buffer("control", Control::words(sizes.pool_blocks, sizes.ordered_tiles))?;
        let counters = buffer("counters", control::counter_words(sizes.pool_blocks, sizes.ordered_tiles))?;
        let words = u64::from(control::arguments::words(sizes.banks));
        let arguments = with_usage("arguments", words, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT)?;
        let results = buffer("results", sizes.result_words())?;
        let film = buffer("film", u64::from(sizes.film_planes) * sizes.places())?;
        let record = buffer("record", sizes.record_words())?;
        let bank_words = |bank: u32| u64::from(sizes.stride) * u64::from(sizes.blocks_of(bank));
        let banks = (0..sizes.banks).map(|bank| buffer("bank", bank_words(bank))).collect::<Result<Vec<_>>>()?;

        // Which bank a launch sees, for each of them.
        let numbers = with_usage("bank numbers", u64::from(sizes.banks) * UNIFORM_STRIDE / 4, wgpu::BufferUsages::UNIFORM)?;
        let mut words = vec![0_u32; numbers.size() as usize / 4];
        for (bank, entry) in (0..sizes.banks).zip(words.chunks_mut(UNIFORM_STRIDE as usize / 4)) {
            entry[..2].copy_from_slice(&[bank, bank * sizes.bank_blocks]);
        }
        queue.write_buffer(&numbers, 0, bytemuck::cast_slice(&words));

        let group = |label: &str, layout: &wgpu::BindGroupLayout, resources: &[wgpu::BindingResource<'_>]| {
            let entries: Vec<_> = resources
                .iter()
                .enumerate()
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding: binding as u32, resource: resource.clone() })
                .collect();
            scoped(device, &format!("binding {label}"), || {
                device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
            })
        };
        let whole = wgpu::Buffer::as_entire_binding;
        let stage_groups = banks
            .iter()
            .zip(0..)
            .map(|(bank, number)| {
                let number = number_binding(&numbers, number);
                let resources = [whole(&control), whole(&counters), whole(&results), whole(bank), number];
                group("stage buffers", &kernels.stage_layout, &resources)
            })
            .collect::<Result<Vec<_>>>()?;
        let tick_group = group("tick buffers", &kernels.tick_layout, &[&control, &counters, &arguments, &record].map(whole))?;
        let resolve_group = group("resolve buffers", &kernels.resolve_layout, &[&control, &counters, &results, &film].map(whole))?;
        let record_bytes = if sizes.record_steps > 0 { record.size() } else { 0 };
        let clock = if instruments.times { Clock::new(device, queue)? } else { None };
        let staging = (0..STAGING).map(|_| Staging::new(device, record_bytes, clock.as_ref())).collect::<Result<_>>()?;
        let reader = reader(device, film.size().max(results.size()))?;
        Ok(Buffers {
            sizes,
            control,
            counters,
            arguments,
            results,
            record,
            banks,
            film,
            stage_groups,
            tick_group,
            resolve_group,
            staging,
            reader,
            clock,
        })
    }

    pub(super) fn group(&self, class: Class, bank: u32) -> &wgpu::BindGroup {
        match class {
            Class::Stage => &self.stage_groups[bank as usize],
            Class::Tick => &self.tick_group,
            Class::Resolve => &self.resolve_group,
        }
    }

    /// Bytes of everything, by name.
    pub(super) fn memory(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("state", self.banks.iter().map(wgpu::Buffer::size).sum()),
            ("results", self.results.size()),
            ("film", self.film.size()),
            ("control", self.control.size() + self.counters.size() + self.arguments.size()),
            ("record", self.record.size()),
        ]
    }

    /// Brings everything to the state before the first tick.
    pub(super) fn reset(&self, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, head: &Control) {
        for buffer in [&self.counters, &self.arguments, &self.results, &self.film, &self.record].into_iter().chain(&self.banks) {
            encoder.clear_buffer(buffer, 0, None);
        }
        let mut words: Vec<u32> = bytemuck::cast_slice(bytemuck::bytes_of(head)).to_vec();
        // Every ring slot waits for all tiles of its first pass; nothing is counted; no block has a tile.
        words.resize(words.len() + control::MAX_RING as usize, self.sizes.tiles);
        words.resize(Control::block_table() as usize / 4, 0);
        words.resize(words.len() + self.sizes.pool_blocks as usize, control::NONE);
        queue.write_buffer(&self.control, 0, bytemuck::cast_slice(&words));
        // The first pass of a measured order follows the numbers of the tiles.
        let first: Vec<u32> = (0..self.sizes.ordered_tiles).collect();
        let place = Control::words(self.sizes.pool_blocks, 0) * 4;
        queue.write_buffer(&self.control, place, bytemuck::cast_slice(&first));
    }
}

fn number_binding(numbers: &wgpu::Buffer, bank: u64) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
        buffer: numbers,
        offset: bank * UNIFORM_STRIDE,
        size: std::num::NonZeroU64::new(16),
    })
}
