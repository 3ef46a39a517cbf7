//! `path-tracer info`: what is in a scene, and what it takes on a device, without one.

use path_tracer::{
    gpu_scene::{GpuScene, PackOptions},
    scene::{Animation, Camera, HeightMap, LightKind, Material, Projection, Scene, framing::frame},
};
use serde_json::{Value, json};

use super::{Failure, say, scene::SceneArguments};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// As one JSON object.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut scene = arguments.scene.load()?;
    let camera = scene.cameras.first().cloned().unwrap_or_else(|| frame(scene.bounds(), 1.0));
    let options = PackOptions { binding_limit: u64::from(u32::MAX), ..PackOptions::default() };
    let packed = GpuScene::pack(&scene, &camera, &options).map_err(path_tracer::Error::from)?;
    scene.warnings.extend(packed.facts.warnings.iter().cloned());
    let parts = [
        ("hierarchy", packed.bvh.len()),
        ("triangles and vertices", packed.triangles.len()),
        ("materials and lights", packed.tables.len()),
        ("texels", packed.texels.len()),
    ];
    if arguments.json {
        say(object(&scene, &parts))
    } else {
        tell(&scene, &parts)
    }
    Ok(())
}

/// For people.
fn tell(scene: &Scene, parts: &[(&str, usize)]) {
    say(format_args!("scene:       {}", scene.name));
    say(format_args!("triangles:   {}, {} vertices", scene.triangles.len(), scene.vertices.len()));
    if let Some(bounds) = scene.bounds() {
        let [min, max] = [bounds.min, bounds.max].map(|p| format!("({}, {}, {})", p.x, p.y, p.z));
        say(format_args!("bounds:      {min} to {max} metres"));
    }
    list("cameras", scene.cameras.iter().map(|camera| format!("'{}', {}", camera.name, lens(camera))));
    let leaves = |material: &Material| material.tree.as_ref().map(|tree| format!(", a tree of {} leaves", tree.leaves().len()));
    let entry = |material: &Material| format!("'{}'{}", material.name, leaves(material).unwrap_or_default());
    list("materials", scene.materials.iter().map(entry));
    let images = scene.images.iter().map(|image| format!("'{}', {}x{}", image.name, image.width, image.height));
    list("images", images);
    list("lights", lights(scene).into_iter().map(|(kind, count)| format!("{count} {kind}")));
    list("animations", scene.animations.iter().map(|animation| format!("'{}'{}", animation.name, span(animation))));
    if !scene.profiles.is_empty() {
        list("IES profiles", profiles(scene).into_iter().map(|(name, n)| format!("'{name}', {n} lights")));
    }
    let heights = heights(scene);
    if !heights.is_empty() {
        let entry = |(material, map): (&str, &HeightMap)| {
            let scale = map.scale.map(|scale| format!(", scale {scale}")).unwrap_or_default();
            format!("'{material}': '{}'{scale}", map.name)
        };
        list("height maps", heights.into_iter().map(entry));
    }
    match &scene.environment {
        Some(environment) => say(format_args!("environment: '{}', {}x{}", environment.name, environment.width, environment.height)),
        None => say("environment: none"),
    }
    let total: usize = parts.iter().map(|(_, bytes)| bytes).sum();
    let each: Vec<String> = parts.iter().map(|(part, bytes)| format!("{part} {}", size(*bytes))).collect();
    say(format_args!("memory:      {} on the device for the scene: {}", size(total), each.join(", ")));
    list("warnings", scene.warnings.iter().cloned());
}

/// At most so many lines of a list; the rest is counted.
const LINES: usize = 32;

fn list(title: &str, entries: impl ExactSizeIterator<Item = String>) {
    let n = entries.len();
    say(format_args!("{:12} {n}", format!("{title}:")));
    entries.take(LINES).for_each(|entry| say(format_args!("  {entry}")));
    if n > LINES {
        say(format_args!("  and {} more (--json lists all)", n - LINES));
    }
}

/// For programs.
fn object(scene: &Scene, parts: &[(&str, usize)]) -> Value {
    let total: usize = parts.iter().map(|(_, bytes)| bytes).sum();
    let cameras = scene.cameras.iter().map(|camera| {
        let position = camera.world_from_camera.w_axis;
        let mut object = json!({ "name": camera.name, "position": [position.x, position.y, position.z] });
        match camera.projection {
            Projection::Perspective { vertical_fov } => object["vertical_fov_degrees"] = vertical_fov.to_degrees().into(),
            Projection::Orthographic { half_height } => object["half_height"] = half_height.into(),
        }
        object
    });
    let images = scene.images.iter().map(|image| json!({ "name": image.name, "width": image.width, "height": image.height }));
    let environment = scene.environment.as_ref();
    json!({
        "name": scene.name,
        "triangles": scene.triangles.len(),
        "vertices": scene.vertices.len(),
        "bounds": scene.bounds().map(|bounds| json!({ "min": bounds.min.to_array(), "max": bounds.max.to_array() })),
        "cameras": cameras.collect::<Vec<_>>(),
        "materials": scene.materials.iter().map(|material| material.name.as_str()).collect::<Vec<_>>(),
        "images": images.collect::<Vec<_>>(),
        "lights": lights(scene).into_iter().map(|(kind, count)| (kind.to_owned(), count.into())).collect::<serde_json::Map<_, _>>(),
        "animations": scene.animations.iter().map(|animation| json!({ "name": animation.name, "seconds": animation.seconds })).collect::<Vec<_>>(),
        "ies_profiles": profiles(scene).into_iter().map(|(name, n)| json!({ "file": name, "lights": n })).collect::<Vec<_>>(),
        "height_maps": heights(scene)
            .into_iter()
            .map(|(material, map)| json!({ "material": material, "file": map.name, "scale": map.scale }))
            .collect::<Vec<_>>(),
        "environment": environment.map(|map| json!({ "name": map.name, "width": map.width, "height": map.height })),
        "device_bytes": total,
        "warnings": scene.warnings,
    })
}

fn lens(camera: &Camera) -> String {
    match camera.projection {
        Projection::Perspective { vertical_fov } => format!("{:.2} degrees high", vertical_fov.to_degrees()),
        Projection::Orthographic { half_height } => format!("parallel, {} metres high", 2.0 * half_height),
    }
}

fn span(animation: &Animation) -> String {
    animation.seconds.map_or_else(String::new, |[first, last]| format!(", seconds {first} to {last}"))
}

/// How many there are of each kind.
fn lights(scene: &Scene) -> Vec<(&'static str, usize)> {
    let count = |is: fn(&LightKind) -> bool| scene.lights.iter().filter(|light| is(&light.kind)).count();
    let emits = scene.emitting_materials();
    let glowing = scene.triangles.iter().filter(|triangle| emits.get(triangle.material as usize) == Some(&true)).count();
    let kinds = [
        ("point", count(|kind| matches!(kind, LightKind::Point))),
        ("spot", count(|kind| matches!(kind, LightKind::Spot { .. }))),
        ("directional", count(|kind| matches!(kind, LightKind::Directional))),
        ("emissive triangles", glowing),
    ];
    kinds.into_iter().filter(|(_, n)| *n > 0).collect()
}

/// Names of files, and how many lights ask for each.
fn profiles(scene: &Scene) -> Vec<(&str, usize)> {
    let count = |index: usize| scene.lights.iter().filter(|light| light.profile.is_some_and(|profile| profile as usize == index)).count();
    scene.profiles.iter().enumerate().map(|(index, profile)| (profile.name.as_str(), count(index))).collect()
}

/// Names of materials, and what they ask for.
fn heights(scene: &Scene) -> Vec<(&str, &HeightMap)> {
    scene.materials.iter().filter_map(|material| Some((material.name.as_str(), material.extensions.height_map.as_ref()?))).collect()
}

fn size(bytes: usize) -> String {
    match bytes {
        0..10_240 => format!("{bytes} bytes"),
        10_240..10_485_760 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        _ => format!("{:.1} MiB", bytes as f64 / 1_048_576.0),
    }
}
