//! Device time of every launch, by timestamps.
//!
//! Key decision: a timestamp before the first launch of a submission and one behind each. Where timestamps inside of a pass are not to be
//! had, every launch gets a pass of its own, which says when it begins and ends.

use super::kernels::scoped;
use crate::Result;

/// Timestamps that one submission may take.
pub(super) const MOST: u32 = wgpu::QUERY_SET_MAX_QUERIES;
/// Bytes of a timestamp.
const BYTES: u64 = 8;

/// Where timestamps go.
#[derive(Debug)]
pub(super) struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    /// Nanoseconds per tick.
    pub(super) period: f32,
    pub(super) is_inside_passes: bool,
}

/// A launch that was timed: which kernel, and when, in nanoseconds of the device's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Timed {
    pub(super) launch: usize,
    pub(super) begin: u64,
    pub(super) end: u64,
}

impl Clock {
    /// `None` where the device has no timestamps.
    pub(super) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Option<Self>> {
        let features = device.features();
        if !features.contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Ok(None);
        }
        let (queries, resolved) = scoped(device, "making a set of timestamps", || {
            let queries =
                device.create_query_set(&wgpu::QuerySetDescriptor { label: Some("launches"), ty: wgpu::QueryType::Timestamp, count: MOST });
            let resolved = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: Self::bytes(),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            (queries, resolved)
        })?;
        let is_inside_passes = features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES);
        Ok(Some(Clock { queries, resolved, period: queue.get_timestamp_period(), is_inside_passes }))
    }

    pub(super) fn bytes() -> u64 {
        u64::from(MOST) * BYTES
    }

    /// Launches that one submission can time.
    pub(super) fn most_launches(&self) -> u32 {
        if self.is_inside_passes { MOST - 1 } else { MOST / 2 }
    }

    /// Marks the beginning (`0`) or the end of launch number `index - 1`, inside of a pass.
    pub(super) fn mark(&self, pass: &mut wgpu::ComputePass<'_>, index: u32) {
        pass.write_timestamp(&self.queries, index);
    }

    /// For a pass that is one launch.
    pub(super) fn around(&self, launch: u32) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * launch),
            end_of_pass_write_index: Some(2 * launch + 1),
        }
    }

    /// Copies what `launches` launches have marked.
    pub(super) fn collect(&self, encoder: &mut wgpu::CommandEncoder, launches: u32, target: &wgpu::Buffer, offset: u64) {
        let marks = if self.is_inside_passes { launches + 1 } else { 2 * launches };
        encoder.resolve_query_set(&self.queries, 0..marks, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, target, offset, u64::from(marks) * BYTES);
    }

    /// Turns marks into times of launches.
    pub(super) fn read(&self, marks: &[u64], launches: usize) -> Vec<Timed> {
        let time = |mark: u64| (mark as f64 * f64::from(self.period)) as u64;
        (0..launches)
            .map(|launch| {
                let (begin, end) = if self.is_inside_passes { (launch, launch + 1) } else { (2 * launch, 2 * launch + 1) };
                let begin = time(marks[begin]);
                Timed { launch, begin, end: time(marks[end]).max(begin) }
            })
            .collect()
    }
}
