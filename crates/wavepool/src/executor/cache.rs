//! Compiled kernels, kept for the next scheduler that needs the same.
//!
//! Key decision: the key is the whole text of the module (features, constants and policies are in it), the entry point and the layout of
//! the bindings. Nothing can be served that another choice would have made different. A cache belongs to one device for good: wgpu tells
//! devices of one instance apart, but not those of two.

use std::{
    collections::HashMap,
    fmt,
    sync::{Arc, Mutex},
};

use xxhash_rust::xxh3::xxh3_128;

/// The compiled kernels of one device; clones share them.
#[derive(Clone, Default)]
pub(crate) struct KernelCache(Arc<Mutex<Store>>);

#[derive(Default)]
struct Store {
    pipelines: HashMap<Key, wgpu::ComputePipeline>,
    modules: HashMap<u128, wgpu::ShaderModule>,
    served: u64,
}

/// What tells one kernel from another.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key {
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
    /// Kernels in it.
    pub(crate) fn len(&self) -> usize {
        self.0.lock().map_or(0, |store| store.pipelines.len())
    }

    /// How often a kernel was found here and not compiled.
    pub(crate) fn served(&self) -> u64 {
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

    pub(super) fn module(&self, text: u128) -> Option<wgpu::ShaderModule> {
        self.0.lock().ok()?.modules.get(&text).cloned()
    }

    pub(super) fn keep_module(&self, text: u128, module: &wgpu::ShaderModule) {
        if let Ok(mut store) = self.0.lock() {
            store.modules.insert(text, module.clone());
        }
    }
}

impl fmt::Debug for KernelCache {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("KernelCache").field("kernels", &self.len()).field("served", &self.served()).finish()
    }
}
