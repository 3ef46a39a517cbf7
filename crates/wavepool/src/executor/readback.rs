//! Brings words back from the device, with time limits.

use std::{
    panic::AssertUnwindSafe,
    sync::mpsc,
    time::{Duration, Instant},
};

use super::{kernels::scoped, times::Clock};
use crate::{
    Error, Result,
    control::{Control, counters, tables},
};

/// A device that says nothing for this long is given up. Software drivers may need minutes for one submission of a large scene.
const PATIENCE: Duration = Duration::from_secs(600);
/// Some drivers hang on infinite waits: ask again and again instead.
const SLICE: Duration = Duration::from_secs(2);

/// Bytes that are read back at once, at most.
const MOST_AT_ONCE: u64 = 16 << 20;

const HEAD: u64 = size_of::<Control>() as u64;
const TABLES: u64 = tables::BLOCKS as u64 * 4;
const COUNTERS: u64 = counters::BLOCKS as u64 * 4;
/// Where the record begins, and behind it the timestamps.
const RECORD: u64 = (HEAD + TABLES + COUNTERS).next_multiple_of(16);

/// A mappable buffer for the head of control, the global counters, and what instruments add.
#[derive(Debug)]
pub(super) struct Staging {
    buffer: wgpu::Buffer,
    record_bytes: u64,
    is_timed: bool,
}

/// What the device has counted.
#[derive(Clone, Debug)]
pub(super) struct Snapshot {
    pub(super) control: Control,
    tables: Vec<u32>,
    pub(super) counters: [u32; counters::BLOCKS as usize],
    /// The record; empty without.
    pub(super) record: Vec<u32>,
    /// Timestamps; empty without.
    pub(super) marks: Vec<u64>,
}

impl Snapshot {
    /// What a counter has counted since the run began.
    pub(super) fn total(&self, slot: u32) -> u64 {
        let place = (tables::TOTALS + 2 * slot) as usize;
        let words = self.tables.get(place..place + 2).map_or([0; 2], |words| [words[0], words[1]]);
        crate::control::counter_64(words) + u64::from(self.counters[slot as usize])
    }
}

/// A snapshot under way.
#[derive(Debug)]
pub(super) struct Pending {
    pub(super) slot: usize,
    pub(super) submission: wgpu::SubmissionIndex,
    pub(super) mapped: mpsc::Receiver<std::result::Result<(), wgpu::BufferAsyncError>>,
    /// Launches whose times are on their way, as indices into the expanded plan.
    pub(super) launches: Vec<super::run::Launched>,
}

fn mappable(device: &wgpu::Device, bytes: u64) -> Result<wgpu::Buffer> {
    scoped(device, &format!("allocating {bytes} bytes for reading back"), || {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    })
}

impl Staging {
    pub(super) fn new(device: &wgpu::Device, record_bytes: u64, clock: Option<&Clock>) -> Result<Self> {
        let marks = clock.map_or(0, |_| Clock::bytes());
        let buffer = mappable(device, RECORD + record_bytes.next_multiple_of(8) + marks)?;
        Ok(Staging { buffer, record_bytes, is_timed: clock.is_some() })
    }

    fn marks(&self) -> u64 {
        RECORD + self.record_bytes.next_multiple_of(8)
    }

    pub(super) fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        control: &wgpu::Buffer,
        counters: &wgpu::Buffer,
        record: &wgpu::Buffer,
        timed: Option<(&Clock, u32)>,
    ) {
        encoder.copy_buffer_to_buffer(control, 0, &self.buffer, 0, HEAD + TABLES);
        encoder.copy_buffer_to_buffer(counters, 0, &self.buffer, HEAD + TABLES, COUNTERS);
        if self.record_bytes > 0 {
            encoder.copy_buffer_to_buffer(record, 0, &self.buffer, RECORD, self.record_bytes);
        }
        if let Some((clock, launches)) = timed.filter(|(_, launches)| *launches > 0) {
            clock.collect(encoder, launches, &self.buffer, self.marks());
        }
    }

    pub(super) fn request(&self) -> mpsc::Receiver<std::result::Result<(), wgpu::BufferAsyncError>> {
        request(&self.buffer)
    }

    pub(super) fn read(&self) -> Result<Snapshot> {
        let view = self.buffer.get_mapped_range(..).map_err(|error| Error::DeviceLost(error.to_string()))?;
        let bytes = |from: u64, length: u64| &view[from as usize..(from + length) as usize];
        let control = bytemuck::pod_read_unaligned(bytes(0, HEAD));
        let tables = bytemuck::pod_collect_to_vec(bytes(HEAD, TABLES));
        let counters = bytemuck::pod_read_unaligned(bytes(HEAD + TABLES, COUNTERS));
        let record = bytemuck::pod_collect_to_vec(bytes(RECORD, self.record_bytes));
        let marks = if self.is_timed { bytemuck::pod_collect_to_vec(bytes(self.marks(), Clock::bytes())) } else { Vec::new() };
        drop(view);
        self.buffer.unmap();
        Ok(Snapshot { control, tables, counters, record, marks })
    }
}

fn request(buffer: &wgpu::Buffer) -> mpsc::Receiver<std::result::Result<(), wgpu::BufferAsyncError>> {
    let (sender, receiver) = mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |outcome| {
        // The receiver is gone only when the run has failed already.
        let _ = sender.send(outcome);
    });
    receiver
}

/// Waits until the mapping that `mapped` announces is there.
pub(super) fn wait(
    device: &wgpu::Device,
    submission: &wgpu::SubmissionIndex,
    mapped: &mpsc::Receiver<std::result::Result<(), wgpu::BufferAsyncError>>,
    doing: &str,
) -> Result<()> {
    let begun = Instant::now();
    loop {
        match mapped.try_recv() {
            Ok(Ok(())) => return Ok(()),
            Ok(Err(error)) => return Err(Error::DeviceLost(format!("{doing}: {error}"))),
            Err(mpsc::TryRecvError::Disconnected) => return Err(Error::DeviceLost(format!("{doing}: the mapping was dropped"))),
            Err(mpsc::TryRecvError::Empty) => {}
        }
        // wgpu 30 panics when it polls a device that is gone.
        let wait = wgpu::PollType::Wait { submission_index: Some(submission.clone()), timeout: Some(SLICE) };
        match std::panic::catch_unwind(AssertUnwindSafe(|| device.poll(wait))) {
            Ok(Ok(_) | Err(wgpu::PollError::Timeout)) => {}
            Ok(Err(error)) => return Err(Error::DeviceLost(format!("{doing}: {error}"))),
            Err(_) => return Err(Error::DeviceLost(format!("{doing}: the driver gave it up"))),
        }
        if begun.elapsed() > PATIENCE {
            return Err(Error::Timeout { doing: doing.to_owned(), seconds: PATIENCE.as_secs() });
        }
    }
}

/// A buffer to read others through, piece by piece; reserved before a run, because at its end there may be no memory for another.
pub(super) fn reader(device: &wgpu::Device, bytes: u64) -> Result<wgpu::Buffer> {
    mappable(device, bytes.clamp(16, MOST_AT_ONCE))
}

/// Words `from..from + count` of a buffer, read through a [`reader`].
pub(super) fn read_through(
    reader: &wgpu::Buffer,
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    buffer: &wgpu::Buffer,
    from: u64,
    count: u64,
    doing: &str,
) -> Result<Vec<u32>> {
    let mut words: Vec<u32> = Vec::with_capacity(count as usize);
    while (words.len() as u64) < count {
        let place = from + words.len() as u64;
        let bytes = 4 * (count - words.len() as u64).min(reader.size() / 4);
        let (submission, mapped) = scoped(device, doing, || {
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(doing) });
            encoder.copy_buffer_to_buffer(buffer, place * 4, reader, 0, bytes);
            (queue.submit([encoder.finish()]), request(reader))
        })?;
        wait(device, &submission, &mapped, doing)?;
        let view = reader.get_mapped_range(..bytes).map_err(|error| Error::DeviceLost(error.to_string()))?;
        words.extend(bytemuck::pod_collect_to_vec::<u8, u32>(&view));
        drop(view);
        reader.unmap();
    }
    Ok(words)
}

/// The same without a reserved buffer.
pub(super) fn read_words(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    buffer: &wgpu::Buffer,
    from: u64,
    count: u64,
    doing: &str,
) -> Result<Vec<u32>> {
    read_through(&reader(device, count * 4)?, device, queue, buffer, from, count, doing)
}
