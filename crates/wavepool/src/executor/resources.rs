//! The program's own bindings, given by the name of the WGSL variable.

use std::collections::BTreeMap;

use wgpu::util::DeviceExt as _;

use super::kernels::scoped;
use crate::{
    Error, Result,
    shader::{Resource, ResourceKind},
};

/// Buffers, texture views and samplers by the name of the WGSL variable they are bound to. Names that the program does not use are
/// ignored, so that one set serves several programs.
#[derive(Clone, Debug, Default)]
pub struct Resources(BTreeMap<String, Bound>);

#[derive(Clone, Debug)]
enum Bound {
    Buffer(wgpu::Buffer),
    Texture(wgpu::TextureView),
    Sampler(wgpu::Sampler),
}

impl Resources {
    /// None.
    pub fn new() -> Self {
        Self::default()
    }

    /// Binds a whole buffer.
    pub fn buffer(mut self, name: &str, buffer: &wgpu::Buffer) -> Self {
        self.0.insert(name.to_owned(), Bound::Buffer(buffer.clone()));
        self
    }

    /// Binds a texture.
    pub fn texture(mut self, name: &str, view: &wgpu::TextureView) -> Self {
        self.0.insert(name.to_owned(), Bound::Texture(view.clone()));
        self
    }

    /// Binds a sampler.
    pub fn sampler(mut self, name: &str, sampler: &wgpu::Sampler) -> Self {
        self.0.insert(name.to_owned(), Bound::Sampler(sampler.clone()));
        self
    }

    /// The binding for a variable, checked against what the WGSL wants.
    pub(super) fn binding(&self, wanted: &Resource) -> Result<wgpu::BindingResource<'_>> {
        let problem = |problem: &str| Error::Resource { name: wanted.name.clone(), problem: problem.to_owned() };
        match (self.0.get(&wanted.name), &wanted.kind) {
            (Some(Bound::Buffer(buffer)), ResourceKind::Uniform | ResourceKind::Storage { .. }) => Ok(buffer.as_entire_binding()),
            (Some(Bound::Texture(view)), ResourceKind::Texture { .. }) => Ok(wgpu::BindingResource::TextureView(view)),
            (Some(Bound::Sampler(sampler)), ResourceKind::Sampler) => Ok(wgpu::BindingResource::Sampler(sampler)),
            (Some(_), _) => Err(problem("is declared in WGSL as another kind of resource")),
            (None, _) => Err(problem("is used by the program but was not provided")),
        }
    }
}

/// A buffer with the given contents; for programs that upload their own data.
///
/// # Errors
/// [`Error::Gpu`] when the device has no memory for it.
pub fn upload(device: &wgpu::Device, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
    scoped(device, &format!("uploading {} bytes of {label}", contents.len()), || {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
    })
}

/// How a variable is declared in a bind group layout.
pub(super) fn binding_type(kind: &ResourceKind) -> wgpu::BindingType {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    match kind {
        ResourceKind::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        ResourceKind::Storage { writable } => buffer(wgpu::BufferBindingType::Storage { read_only: !writable }),
        ResourceKind::Texture { dimension, sample_type } => {
            wgpu::BindingType::Texture { sample_type: *sample_type, view_dimension: *dimension, multisampled: false }
        }
        ResourceKind::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering),
    }
}
