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
    numbers: wgpu::Buffer,
    /// One per bank for the stages, that of the tick, that of resolve.
    groups: Vec<wgpu::BindGroup>,
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
        let counters =
            buffer("counters", control::counter_words(sizes.pool_blocks, sizes.order_words, sizes.extra_words, sizes.queue_words))?;
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

        let record_bytes = if sizes.record_steps > 0 { record.size() } else { 0 };
        let clock = if instruments.times { Clock::new(device, queue)? } else { None };
        let staging = (0..STAGING).map(|_| Staging::new(device, record_bytes, clock.as_ref())).collect::<Result<_>>()?;
        let tick_group = bind(device, "tick buffers", &kernels.tick_layout, &[&control, &counters, &arguments, &record].map(whole))?;
        let reader = reader(device, film.size().max(results.size()))?;
        let groups = Vec::new();
        let mut buffers =
            Buffers { sizes, control, counters, arguments, results, record, banks, numbers, film, groups, staging, reader, clock };
        let control = buffers.control.clone();
        let stages = (0..sizes.banks).map(|bank| buffers.stage_group(device, kernels, whole(&control), bank));
        let mut groups = stages.collect::<Result<Vec<_>>>()?;
        groups.push(tick_group);
        groups.push(buffers.resolve_group(device, kernels, whole(&control))?);
        buffers.groups = groups;
        Ok(buffers)
    }

    /// What a stage sees of a bank, with `control` for the tables.
    pub(super) fn stage_group(
        &self,
        device: &wgpu::Device,
        kernels: &Kernels,
        control: wgpu::BindingResource<'_>,
        bank: u32,
    ) -> Result<wgpu::BindGroup> {
        let number = number_binding(&self.numbers, u64::from(bank));
        let resources = [control, whole(&self.counters), whole(&self.results), whole(&self.banks[bank as usize]), number];
        bind(device, "stage buffers", &kernels.stage_layout, &resources)
    }

    /// What resolve sees, with `control` for the tables.
    pub(super) fn resolve_group(
        &self,
        device: &wgpu::Device,
        kernels: &Kernels,
        control: wgpu::BindingResource<'_>,
    ) -> Result<wgpu::BindGroup> {
        let resources = [control, whole(&self.counters), whole(&self.results), whole(&self.film)];
        bind(device, "resolve buffers", &kernels.resolve_layout, &resources)
    }

    pub(super) fn group(&self, class: Class, bank: u32) -> &wgpu::BindGroup {
        &self.groups[match class {
            Class::Stage => bank as usize,
            Class::Tick => self.banks.len(),
            Class::Resolve => self.banks.len() + 1,
        }]
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

    /// Bytes of everything, what is read back through included.
    pub(super) fn bytes(&self) -> u64 {
        self.memory().iter().map(|(_, bytes)| bytes).sum::<u64>() + self.reader.size()
    }

    /// Brings everything to the state before the first tick; the film to that of `film`, or to nothing.
    pub(super) fn reset(&self, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, head: &Control, film: Option<&wgpu::Buffer>) {
        match film {
            Some(film) if *film == self.film => {}
            Some(film) => encoder.copy_buffer_to_buffer(film, 0, &self.film, 0, self.film.size()),
            None => encoder.clear_buffer(&self.film, 0, None),
        }
        for buffer in [&self.counters, &self.arguments, &self.results, &self.record].into_iter().chain(&self.banks) {
            encoder.clear_buffer(buffer, 0, None);
        }
        let mut words: Vec<u32> = bytemuck::cast_slice(bytemuck::bytes_of(head)).to_vec();
        // Every ring slot waits for all of its first pass; nothing is counted; no block has a tile.
        words.resize(words.len() + control::MAX_RING as usize, self.sizes.outstanding);
        words.resize(Control::block_table() as usize / 4, 0);
        words.resize(words.len() + self.sizes.pool_blocks as usize, control::NONE);
        queue.write_buffer(&self.control, 0, bytemuck::cast_slice(&words));
        // The first pass of an order that sorts follows the numbers of the tiles.
        let first: Vec<u32> = (0..self.sizes.ordered_tiles).collect();
        let place = Control::words(self.sizes.pool_blocks, 0) * 4;
        queue.write_buffer(&self.control, place, bytemuck::cast_slice(&first));
    }
}

fn whole(buffer: &wgpu::Buffer) -> wgpu::BindingResource<'_> {
    buffer.as_entire_binding()
}

fn bind(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> Result<wgpu::BindGroup> {
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() }).collect();
    scoped(device, &format!("binding {label}"), || {
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
    })
}

fn number_binding(numbers: &wgpu::Buffer, bank: u64) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
        buffer: numbers,
        offset: bank * UNIFORM_STRIDE,
        size: std::num::NonZeroU64::new(16),
    })
}
