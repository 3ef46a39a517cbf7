//! Brings words back from the device, with time limits.

use std::{
    panic::AssertUnwindSafe,
    sync::mpsc,
    time::{Duration, Instant},
};

use super::kernels::scoped;
use crate::{
    Error, Result,
    control::{Control, counters},
};

/// A device that says nothing for this long is given up. Software drivers may need minutes for one submission of a large scene.
const PATIENCE: Duration = Duration::from_secs(600);
/// Some drivers hang on infinite waits: ask again and again instead.
const SLICE: Duration = Duration::from_secs(2);

const HEAD: u64 = size_of::<Control>() as u64;
const COUNTERS: u64 = counters::BLOCKS as u64 * 4;

/// A small mappable buffer for the control head and the global counters.
#[derive(Debug)]
pub(super) struct Staging(wgpu::Buffer);

/// What the device has counted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Snapshot {
    pub(super) control: Control,
    pub(super) counters: [u32; counters::BLOCKS as usize],
}

/// A snapshot under way.
#[derive(Debug)]
pub(super) struct Pending {
    pub(super) slot: usize,
    pub(super) submission: wgpu::SubmissionIndex,
    pub(super) mapped: mpsc::Receiver<std::result::Result<(), wgpu::BufferAsyncError>>,
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
    pub(super) fn new(device: &wgpu::Device) -> Result<Self> {
        mappable(device, HEAD + COUNTERS).map(Staging)
    }

    pub(super) fn record(&self, encoder: &mut wgpu::CommandEncoder, control: &wgpu::Buffer, counters: &wgpu::Buffer) {
        encoder.copy_buffer_to_buffer(control, 0, &self.0, 0, HEAD);
        encoder.copy_buffer_to_buffer(counters, 0, &self.0, HEAD, COUNTERS);
    }

    pub(super) fn request(&self) -> mpsc::Receiver<std::result::Result<(), wgpu::BufferAsyncError>> {
        request(&self.0)
    }

    pub(super) fn read(&self) -> Result<Snapshot> {
        let view = self.0.get_mapped_range(..).map_err(|error| Error::DeviceLost(error.to_string()))?;
        let control = bytemuck::pod_read_unaligned(&view[..HEAD as usize]);
        let counters = bytemuck::pod_read_unaligned(&view[HEAD as usize..(HEAD + COUNTERS) as usize]);
        drop(view);
        self.0.unmap();
        Ok(Snapshot { control, counters })
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

/// A whole buffer as words.
pub(super) fn read_words(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer, doing: &str) -> Result<Vec<u32>> {
    let staging = mappable(device, buffer.size())?;
    let (submission, mapped) = scoped(device, doing, || {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(doing) });
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        (queue.submit([encoder.finish()]), request(&staging))
    })?;
    wait(device, &submission, &mapped, doing)?;
    let view = staging.get_mapped_range(..).map_err(|error| Error::DeviceLost(error.to_string()))?;
    Ok(bytemuck::pod_collect_to_vec(&view))
}
