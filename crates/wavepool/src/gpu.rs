//! A device for programs that have none of their own.
//!
//! Key decision: the scheduler borrows any `wgpu::Device`; this context is an offer. It switches the validation of indirect calls off
//! (wgpu runs an extra dispatch for each, even in release): the tick's arguments are in bounds by construction.

use std::sync::{Arc, Mutex};

use crate::{Error, Result, executor::KernelCache};

/// A device, its queue and what is known about them.
#[derive(Clone, Debug)]
pub struct GpuContext {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Which adapter it came from.
    pub facts: AdapterFacts,
    /// Those compiled for this device.
    pub(crate) kernels: KernelCache,
    lost: Arc<Mutex<Option<String>>>,
}

/// How to choose an adapter.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Part of the adapter's or driver's name, any case; also taken from `WAVEPOOL_ADAPTER`.
    pub adapter: Option<String>,
    /// Ask for nothing that WebGPU does not have: no timestamps inside passes, no numbers of 64 bits. To see what these are worth.
    pub webgpu_only: bool,
}

/// What an adapter says about itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterFacts {
    /// Its name.
    pub name: String,
    /// The API, as wgpu calls it.
    pub backend: String,
    /// Driver name and version.
    pub driver: String,
    /// `DiscreteGpu`, `IntegratedGpu`, `VirtualGpu`, `Cpu` or `Other`.
    pub device_type: String,
}

impl AdapterFacts {
    fn of(adapter: &wgpu::Adapter) -> Self {
        Self::from_info(adapter.get_info())
    }

    fn from_info(info: wgpu::AdapterInfo) -> Self {
        AdapterFacts {
            name: info.name,
            backend: info.backend.to_string(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            device_type: format!("{:?}", info.device_type),
        }
    }

    /// True for drivers that run on the CPU.
    pub fn is_software(&self) -> bool {
        self.device_type == "Cpu"
    }

    /// True for Mesa's software driver of Vulkan, which is the only one whose way to read memory is known here.
    pub fn is_llvmpipe(&self) -> bool {
        self.is_software() && self.name.starts_with("llvmpipe")
    }

    fn rank(&self) -> u32 {
        ["DiscreteGpu", "IntegratedGpu", "VirtualGpu", "Other", "Cpu"].iter().position(|kind| *kind == self.device_type).unwrap_or(5) as u32
    }
}

impl std::fmt::Display for AdapterFacts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({}, {})", self.name, self.backend, self.driver)
    }
}

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.flags = wgpu::InstanceFlags::empty();
    wgpu::Instance::new(descriptor)
}

fn usable(instance: &wgpu::Instance) -> Vec<(AdapterFacts, wgpu::Adapter)> {
    let mut found: Vec<_> = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY))
        .into_iter()
        .filter(|adapter| adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS))
        .map(|adapter| (AdapterFacts::of(&adapter), adapter))
        .collect();
    found.sort_by_key(|(facts, _)| facts.rank());
    found
}

/// The adapters that can run wavepool, best first.
pub fn adapters() -> Vec<AdapterFacts> {
    usable(&instance()).into_iter().map(|(facts, _)| facts).collect()
}

impl GpuContext {
    /// A device on the best adapter, or on the one that the environment variable `WAVEPOOL_ADAPTER` names.
    ///
    /// # Errors
    /// [`Error::NoAdapter`], [`Error::NoDevice`].
    pub fn headless() -> Result<Self> {
        Self::new(&GpuOptions::default())
    }

    /// A device as `options` ask.
    ///
    /// # Errors
    /// [`Error::NoAdapter`], [`Error::NoDevice`].
    pub fn new(options: &GpuOptions) -> Result<Self> {
        let wanted = options.adapter.clone().or_else(|| std::env::var("WAVEPOOL_ADAPTER").ok()).filter(|name| !name.is_empty());
        let mut found = usable(&instance());
        if let Some(wanted) = &wanted {
            let needle = wanted.to_lowercase();
            let names: Vec<String> = found.iter().map(|(facts, _)| facts.name.clone()).collect();
            found.retain(|(facts, _)| facts.to_string().to_lowercase().contains(&needle));
            if found.is_empty() && !names.is_empty() {
                return Err(Error::NoAdapter(format!(" of the name `{wanted}`; there are: {}", names.join(", "))));
            }
        }
        let Some((facts, adapter)) = found.into_iter().next() else { return Err(Error::NoAdapter(String::new())) };
        let offered = adapter.limits();
        let mut limits = wgpu::Limits::default();
        limits.max_storage_buffer_binding_size = limits.max_storage_buffer_binding_size.max(offered.max_storage_buffer_binding_size);
        limits.max_buffer_size = limits.max_buffer_size.max(offered.max_buffer_size);
        let native = wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES | wgpu::Features::SHADER_INT64;
        let wished = wgpu::Features::TIMESTAMP_QUERY | if options.webgpu_only { wgpu::Features::empty() } else { native };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("wavepool"),
            required_limits: limits,
            required_features: adapter.features() & wished,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|source| Error::NoDevice { adapter: facts.name.clone(), source })?;
        let lost = Arc::new(Mutex::new(None));
        let report = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, message| {
            if let Ok(mut slot) = report.lock() {
                *slot = Some(format!("{reason:?}: {message}"));
            }
        });
        Ok(GpuContext { device, queue, facts, kernels: KernelCache::default(), lost })
    }

    /// A context around a device that somebody else has made. What happens to the device is theirs to watch: [`lost`](Self::lost) says
    /// nothing, and the validation of indirect calls is as they have left it; [`Scheduler::statistics`](crate::Scheduler::statistics)
    /// measures what it costs.
    pub fn borrow(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        GpuContext {
            facts: AdapterFacts::from_info(device.adapter_info()),
            device: device.clone(),
            queue: queue.clone(),
            kernels: KernelCache::default(),
            lost: Arc::default(),
        }
    }

    /// Kernels compiled for this context, and how often one was found compiled already.
    pub fn kernels(&self) -> (usize, u64) {
        (self.kernels.len(), self.kernels.served())
    }

    /// Why the device went away, when it has.
    pub fn lost(&self) -> Option<String> {
        self.lost.lock().ok().and_then(|slot| slot.clone())
    }
}
