//! Pipelines and bind group layouts of a program under a schedule.

use super::{
    cache::{KernelCache, Key, fingerprint},
    resources::{Resources, binding_type},
};
use crate::{
    Error, Program, Result,
    plan::{self, Launch, Plan},
    shader::Linked,
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
    pub(super) resolve_layout: wgpu::BindGroupLayout,
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

/// What a binding of group 0 is.
#[derive(Clone, Copy, Debug)]
enum Own {
    Read,
    Write,
    Uniform,
}

const STAGE_BINDINGS: [Own; 5] = [Own::Read, Own::Write, Own::Write, Own::Write, Own::Uniform];
const TICK_BINDINGS: [Own; 4] = [Own::Write; 4];
const RESOLVE_BINDINGS: [Own; 4] = [Own::Read, Own::Write, Own::Write, Own::Write];

fn own_layout(device: &wgpu::Device, label: &str, bindings: &[Own]) -> Result<wgpu::BindGroupLayout> {
    let buffer = |own: &Own| match own {
        Own::Read => wgpu::BufferBindingType::Storage { read_only: true },
        Own::Write => wgpu::BufferBindingType::Storage { read_only: false },
        Own::Uniform => wgpu::BufferBindingType::Uniform,
    };
    let entries: Vec<_> = bindings
        .iter()
        .enumerate()
        .map(|(binding, own)| wgpu::BindGroupLayoutEntry {
            binding: binding as u32,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty: buffer(own), has_dynamic_offset: false, min_binding_size: None },
            count: None,
        })
        .collect();
    scoped(device, &format!("creating the layout of {label}"), || {
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
    })
}

impl Kernels {
    pub(super) fn new(
        device: &wgpu::Device,
        program: &Program,
        plan: &Plan,
        linked: &Linked,
        resources: &Resources,
        cache: &KernelCache,
    ) -> Result<Self> {
        let name = program.name();
        let stage_layout = own_layout(device, "wavepool stages", &STAGE_BINDINGS)?;
        let tick_layout = own_layout(device, "wavepool tick", &TICK_BINDINGS)?;
        let resolve_layout = own_layout(device, "wavepool resolve", &RESOLVE_BINDINGS)?;
        let (group_layouts, program_groups) = program_groups(device, program, resources)?;
        let mut layouts = vec![Some(&stage_layout)];
        layouts.extend(group_layouts.iter().map(Option::as_ref));
        let stage_layouts = fingerprint(&format!("{STAGE_BINDINGS:?} {:?}", program.interface().resources));
        let (tick_layouts, resolve_layouts) = ([Some(&tick_layout)], [Some(&resolve_layout)]);
        let part = |class| match class {
            Class::Stage => (&linked.stages.text, layouts.as_slice(), stage_layouts),
            Class::Tick => (&linked.tick, tick_layouts.as_slice(), 0),
            Class::Resolve => (&linked.resolve, resolve_layouts.as_slice(), 0),
        };

        let mut kernels: Vec<Kernel> = Vec::new();
        for Launch { kernel, .. } in plan.opening.iter().chain(&plan.step).chain(&plan.audit) {
            if kernels.iter().any(|known| known.kernel == *kernel) {
                continue;
            }
            let class = match kernel {
                plan::Kernel::Tick | plan::Kernel::Advance => Class::Tick,
                plan::Kernel::Resolve => Class::Resolve,
                _ => Class::Stage,
            };
            let (text, groups, layout) = part(class);
            let key = Key { text: fingerprint(text), entry_point: kernel.entry_point(), layout };
            let pipeline = match cache.pipeline(&key) {
                Some(pipeline) => pipeline,
                None => {
                    let pipeline = compile(device, &format!("{name}: {kernel}"), text, &key, groups, cache)?;
                    cache.keep_pipeline(key, &pipeline);
                    pipeline
                }
            };
            kernels.push(Kernel { kernel: kernel.clone(), class, pipeline });
        }
        Ok(Kernels { kernels, stage_layout, tick_layout, resolve_layout, program_groups })
    }

    /// The kernel of a launch; every launch of the plan has one.
    pub(super) fn get(&self, wanted: &plan::Kernel) -> Option<&Kernel> {
        self.kernels.iter().find(|kernel| kernel.kernel == *wanted)
    }
}

fn compile(
    device: &wgpu::Device,
    label: &str,
    text: &str,
    key: &Key,
    groups: &[Option<&wgpu::BindGroupLayout>],
    cache: &KernelCache,
) -> Result<wgpu::ComputePipeline> {
    let module = match cache.module(key.text) {
        Some(module) => module,
        None => {
            let source = wgpu::ShaderSource::Wgsl(text.into());
            let module = scoped(device, &format!("compiling {label}"), || {
                device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
            })?;
            cache.keep_module(key.text, &module);
            module
        }
    };
    scoped(device, &format!("compiling {label}"), || {
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: groups,
            immediate_size: 0,
        });
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(&key.entry_point),
            compilation_options: wgpu::PipelineCompilationOptions { zero_initialize_workgroup_memory: false, ..Default::default() },
            cache: None,
        })
    })
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
