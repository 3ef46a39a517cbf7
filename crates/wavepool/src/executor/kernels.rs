//! Pipelines and bind group layouts of a program under a schedule.

use super::resources::{Resources, binding_type};
use crate::{
    Error, Program, Result,
    plan::{self, Launch, Plan},
};

/// Which buffers a kernel sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    Stage,
    Tick,
    Resolve,
}

/// One compiled kernel.
#[derive(Debug)]
pub(super) struct Kernel {
    kernel: plan::Kernel,
    pub(super) class: Class,
    pub(super) pipeline: wgpu::ComputePipeline,
}

/// Everything compiled once per scheduler.
#[derive(Debug)]
pub(super) struct Kernels {
    kernels: Vec<Kernel>,
    pub(super) stage_layout: wgpu::BindGroupLayout,
    pub(super) tick_layout: wgpu::BindGroupLayout,
    /// Groups of the program, by index.
    pub(super) program_groups: Vec<(u32, wgpu::BindGroup)>,
}

/// Runs `make` inside error scopes; wgpu would panic without.
pub(super) fn scoped<T>(device: &wgpu::Device, doing: &str, make: impl FnOnce() -> T) -> Result<T> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let made = make();
    let errors = [pollster::block_on(internal.pop()), pollster::block_on(validation.pop()), pollster::block_on(memory.pop())];
    match errors.into_iter().flatten().next() {
        Some(source) => Err(Error::Gpu { doing: doing.to_owned(), source }),
        None => Ok(made),
    }
}

fn storage_layout(device: &wgpu::Device, label: &str, writable: &[bool]) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = writable
        .iter()
        .enumerate()
        .map(|(binding, writable)| wgpu::BindGroupLayoutEntry {
            binding: binding as u32,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: !writable },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

impl Kernels {
    pub(super) fn new(
        device: &wgpu::Device,
        program: &Program,
        plan: &Plan,
        stages: &str,
        tick: &str,
        resolve: &str,
        resources: &Resources,
    ) -> Result<Self> {
        let name = program.name();
        let stage_layout =
            scoped(device, "creating the layout of stages", || storage_layout(device, "wavepool stage", &[false, true, true, true]))?;
        let tick_layout =
            scoped(device, "creating the layout of the tick", || storage_layout(device, "wavepool tick", &[true, true, true]))?;
        let (group_layouts, program_groups) = program_groups(device, program, resources)?;
        let module = |label: &str, text: &str| {
            scoped(device, &format!("compiling {name}: {label}"), || {
                device.create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: Some(label),
                    source: wgpu::ShaderSource::Wgsl(text.into()),
                })
            })
        };
        let stage_module = module("stages", stages)?;
        let tick_module = module("tick", tick)?;
        let resolve_module = module("resolve", resolve)?;

        let mut layouts = vec![Some(&stage_layout)];
        layouts.extend(group_layouts.iter().map(Option::as_ref));
        let pipeline_layout = |label: &str, groups: &[Option<&wgpu::BindGroupLayout>]| {
            scoped(device, "creating a pipeline layout", || {
                device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some(label),
                    bind_group_layouts: groups,
                    immediate_size: 0,
                })
            })
        };
        let stage_pipeline_layout = pipeline_layout("stages", &layouts)?;
        let tick_pipeline_layout = pipeline_layout("tick", &[Some(&tick_layout)])?;
        let resolve_pipeline_layout = pipeline_layout("resolve", &[Some(&stage_layout)])?;

        let mut kernels: Vec<Kernel> = Vec::new();
        for Launch { kernel, .. } in plan.opening.iter().chain(&plan.step) {
            if kernels.iter().any(|known| known.kernel == *kernel) {
                continue;
            }
            let (class, module, layout) = match kernel {
                plan::Kernel::Tick | plan::Kernel::Advance => (Class::Tick, &tick_module, &tick_pipeline_layout),
                plan::Kernel::Resolve => (Class::Resolve, &resolve_module, &resolve_pipeline_layout),
                _ => (Class::Stage, &stage_module, &stage_pipeline_layout),
            };
            let (entry, label) = (kernel.entry_point(), kernel.to_string());
            let pipeline = scoped(device, &format!("compiling {name}: {kernel}"), || {
                device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(&label),
                    layout: Some(layout),
                    module,
                    entry_point: Some(&entry),
                    compilation_options: wgpu::PipelineCompilationOptions { zero_initialize_workgroup_memory: false, ..Default::default() },
                    cache: None,
                })
            })?;
            kernels.push(Kernel { kernel: kernel.clone(), class, pipeline });
        }
        Ok(Kernels { kernels, stage_layout, tick_layout, program_groups })
    }

    /// The kernel of a launch; every launch of the plan has one.
    pub(super) fn get(&self, wanted: &plan::Kernel) -> Option<&Kernel> {
        self.kernels.iter().find(|kernel| kernel.kernel == *wanted)
    }
}

type Groups = (Vec<Option<wgpu::BindGroupLayout>>, Vec<(u32, wgpu::BindGroup)>);

/// Layouts and bind groups of groups 1 and up.
fn program_groups(device: &wgpu::Device, program: &Program, resources: &Resources) -> Result<Groups> {
    let wanted = &program.interface().resources;
    let last = wanted.iter().map(|resource| resource.group).max().unwrap_or(0);
    let most = device.limits().max_bind_groups;
    if last >= most {
        let what = format!("program `{}`", program.name());
        return Err(Error::Limit {
            what,
            need: u64::from(last) + 1,
            limit: u64::from(most),
            unit: "bind groups",
            advice: "use lower group numbers".into(),
        });
    }
    let mut layouts = Vec::new();
    let mut groups = Vec::new();
    for group in 1..=last {
        let members: Vec<_> = wanted.iter().filter(|resource| resource.group == group).collect();
        let entries: Vec<_> = members
            .iter()
            .map(|resource| wgpu::BindGroupLayoutEntry {
                binding: resource.binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: binding_type(&resource.kind),
                count: None,
            })
            .collect();
        let label = format!("{} group {group}", program.name());
        let layout = scoped(device, &format!("creating the layout of group {group}"), || {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(&label), entries: &entries })
        })?;
        let bound = members
            .iter()
            .map(|resource| Ok(wgpu::BindGroupEntry { binding: resource.binding, resource: resources.binding(resource)? }))
            .collect::<Result<Vec<_>>>()?;
        let bind_group = scoped(device, &format!("binding group {group}"), || {
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(&label), layout: &layout, entries: &bound })
        })?;
        groups.push((group, bind_group));
        layouts.push(Some(layout));
    }
    Ok((layouts, groups))
}
