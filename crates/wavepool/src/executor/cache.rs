//! Compiled kernels, kept for the next scheduler that needs the same.
//!
//! Key decision: the key is the whole text of the module (features, constants and policies are in it), the entry point, the layout of the
//! bindings and the device. Nothing can be served that another choice would have made different.

use std::{
    collections::HashMap,
    fmt,
    sync::{Arc, Mutex},
};

use xxhash_rust::xxh3::xxh3_128;

/// A shared store of compiled kernels; clones share it. Dropping the last clone drops the kernels, and with them the hold on their devices.
#[derive(Clone, Default)]
pub struct KernelCache(Arc<Mutex<Store>>);

#[derive(Default)]
struct Store {
    pipelines: HashMap<Key, wgpu::ComputePipeline>,
    modules: HashMap<(wgpu::Device, u128), wgpu::ShaderModule>,
    served: u64,
}

/// What tells one kernel from another.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key {
    pub(super) device: wgpu::Device,
    /// Of the text of the whole module.
    pub(super) text: u128,
    pub(super) entry_point: String,
    /// Of the layout of all bindings.
    pub(super) layout: u128,
}

/// Distinguishes texts; two of 128 bits do not collide by accident.
pub(super) fn fingerprint(text: &str) -> u128 {
    xxh3_128(text.as_bytes())
}

impl KernelCache {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// Kernels in it.
    pub fn len(&self) -> usize {
        self.0.lock().map_or(0, |store| store.pipelines.len())
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How often a kernel was found here and not compiled.
    pub fn served(&self) -> u64 {
        self.0.lock().map_or(0, |store| store.served)
    }

    pub(super) fn pipeline(&self, key: &Key) -> Option<wgpu::ComputePipeline> {
        let mut store = self.0.lock().ok()?;
        let found = store.pipelines.get(key).cloned();
        store.served += u64::from(found.is_some());
        found
    }

    pub(super) fn keep_pipeline(&self, key: Key, pipeline: &wgpu::ComputePipeline) {
        if let Ok(mut store) = self.0.lock() {
            store.pipelines.insert(key, pipeline.clone());
        }
    }

    pub(super) fn module(&self, device: &wgpu::Device, text: u128) -> Option<wgpu::ShaderModule> {
        self.0.lock().ok()?.modules.get(&(device.clone(), text)).cloned()
    }

    pub(super) fn keep_module(&self, device: &wgpu::Device, text: u128, module: &wgpu::ShaderModule) {
        if let Ok(mut store) = self.0.lock() {
            store.modules.insert((device.clone(), text), module.clone());
        }
    }
}

impl fmt::Debug for KernelCache {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("KernelCache").field("kernels", &self.len()).field("served", &self.served()).finish()
    }
}
