//! Layers against closed forms, and against the schedule: what is seen beside the colour is known for every pixel of these scenes.
//!
//! **Invariant:** scenes stand far from their origin, so that a place in normalised space is never mistaken for one in metres.

use std::ops::ControlFlow;

use glam::{Vec3, Vec4};
use path_tracer::{
    LayerRequest, Renderer, Rendering, Settings,
    layers::Values,
    scene::{Environment, Material, Scene, builtin, shapes},
    wavepool::Schedule,
};

use crate::{assert_mean, lambert, metal, parallel_camera};

/// Where the middle of each scene is.
const MIDDLE: Vec3 = Vec3::new(10.0, 20.0, -3.0);
const SIDE: u32 = 16;

pub(crate) fn render(scene: &Scene, settings: &Settings) -> Option<Rendering> {
    let gpu = wavepool_tests::device::gpu()?;
    let mut scene = scene.clone();
    scene.validate().expect("a valid scene");
    let mut renderer = Renderer::new(gpu, &scene, settings).expect("the scene compiles");
    let rendering = renderer.render(|_| ControlFlow::Continue(())).expect("the scene renders");
    assert_eq!(rendering.report.not_finite, 0);
    Some(rendering)
}

fn of_scene(scene: &Scene, samples: u32, layers: LayerRequest) -> Settings {
    Settings { depth: 8, layers, camera: scene.cameras.first().cloned(), ..Settings::new(SIDE, SIDE, samples) }
}

/// The values of a channel by its name in a file.
fn channel(rendering: &Rendering, name: &str) -> Values {
    let layers = rendering.layers();
    let mut channels = layers.iter().flat_map(|layer| layer.channels.iter().map(move |channel| (layer.full_name(channel), channel)));
    let found = channels.find(|(full_name, _)| full_name == name);
    found.unwrap_or_else(|| panic!("there is no channel {name}")).1.values.clone()
}

fn quantities(rendering: &Rendering, name: &str) -> Vec<f64> {
    match channel(rendering, name) {
        Values::F32(values) => values.into_iter().map(f64::from).collect(),
        Values::U32(_) => panic!("{name} holds numbers of things"),
    }
}

fn numbers(rendering: &Rendering, name: &str) -> Vec<u32> {
    match channel(rendering, name) {
        Values::U32(values) => values,
        Values::F32(_) => panic!("{name} holds quantities"),
    }
}

fn colored(r: f32, g: f32, b: f32) -> Material {
    Material { base_color: Vec4::new(r, g, b, 1.0), ..lambert(1.0, 0.0) }
}

/// A matte wall that ends in the middle of the image, two metres and a half in front of a parallel camera.
fn half_a_wall() -> Scene {
    let environment = Environment::constant([0.25, 0.5, 3.0]);
    let materials = vec![lambert(0.0, 0.0), colored(0.8, 0.5, 0.3)];
    let mut scene = Scene { materials, environment: Some(environment), ..Scene::default() };
    // Behind the camera; its material and object come first.
    shapes::quad(&mut scene, MIDDLE + Vec3::Z * 5.0, Vec3::X * 0.1, Vec3::Y * 0.1, 0);
    scene.name_object("behind");
    shapes::quad(&mut scene, MIDDLE + Vec3::new(-2.0, -2.0, 0.0), Vec3::X * 2.0, Vec3::Y * 4.0, 1);
    scene.name_object("wall");
    scene.cameras.push(parallel_camera(MIDDLE + Vec3::Z * 2.5, MIDDLE, 1.0));
    scene
}

/// Kills: an albedo that is lit, a normal in another space, a depth along the ray from the image plane's corner, places left normalised,
/// means that count samples which meet nothing, the environment without its colour, an object's number that is its material's.
#[test]
fn a_matte_wall_and_the_sky_beside_it() {
    let Some(seen) = render(&half_a_wall(), &of_scene(&half_a_wall(), 16, LayerRequest::ALL)) else { return };
    let of = |name: &str| quantities(&seen, name);
    let albedo = ["albedo.R", "albedo.G", "albedo.B"].map(of);
    let normal = ["normal.X", "normal.Y", "normal.Z"].map(of);
    let position = ["position.X", "position.Y", "position.Z"].map(of);
    let (depth, object, material) = (of("Z"), numbers(&seen, "object"), numbers(&seen, "material"));
    assert_eq!(numbers(&seen, "samples"), [16; (SIDE * SIDE) as usize]);
    for pixel in 0..(SIDE * SIDE) as usize {
        let (x, y) = (pixel % SIDE as usize, pixel / SIDE as usize);
        let at = |layer: &[Vec<f64>; 3]| [0, 1, 2].map(|axis| layer[axis][pixel]);
        let near = |found: [f64; 3], expected: [f64; 3], bound: f64| {
            let error = (0..3).map(|axis| (found[axis] - expected[axis]).abs()).fold(0.0, f64::max);
            assert!(error <= bound, "pixel {x}, {y}: {found:?} against {expected:?}");
        };
        if x < SIDE as usize / 2 {
            near(at(&albedo), [0.8, 0.5, 0.3], 1e-6);
            assert_eq!(at(&normal), [0.0, 0.0, 1.0], "pixel {x}, {y}");
            assert!((depth[pixel] - 2.5).abs() < 2e-6, "pixel {x}, {y}: {}", depth[pixel]);
            let size = 2.0 / f64::from(SIDE);
            let middle = [10.0 - 1.0 + (x as f64 + 0.5) * size, 20.0 + 1.0 - (y as f64 + 0.5) * size, -3.0];
            near(at(&position), middle, size / 2.0);
            assert!((position[2][pixel] + 3.0).abs() < 2e-6, "pixel {x}, {y}: {}", position[2][pixel]);
            assert_eq!((object[pixel], material[pixel]), (1, 1), "pixel {x}, {y}");
        } else {
            near(at(&albedo), [0.25, 0.5, 1.0], 1e-6);
            assert_eq!((at(&normal), at(&position)), ([0.0; 3], [0.0; 3]), "pixel {x}, {y}");
            assert_eq!((depth[pixel], object[pixel], material[pixel]), (f64::INFINITY, LayerRequest::NOTHING, LayerRequest::NOTHING));
        }
    }
}

/// Kills: a radial depth, which grows towards the edges of the image, and a normal of the plane where a slanted one is interpolated.
#[test]
fn depth_is_planar_and_normals_are_those_of_shading() {
    let mut scene = Scene { materials: vec![lambert(0.5, 0.0)], ..Scene::default() };
    shapes::quad(&mut scene, MIDDLE - Vec3::new(9.0, 9.0, 0.0), Vec3::X * 18.0, Vec3::Y * 18.0, 0);
    let slanted = Vec3::new(0.6, 0.0, 0.8);
    scene.vertices.iter_mut().for_each(|vertex| vertex.normal = slanted);
    let mut camera = parallel_camera(MIDDLE + Vec3::Z * 4.0, MIDDLE, 1.0);
    camera.projection = path_tracer::scene::Projection::Perspective { vertical_fov: 1.5 };
    scene.cameras.push(camera);
    let layers = LayerRequest { depth: true, normal: true, ..LayerRequest::NONE };
    let Some(seen) = render(&scene, &of_scene(&scene, 4, layers)) else { return };
    let depth = quantities(&seen, "Z");
    assert!(depth.iter().all(|depth| (depth - 4.0).abs() < 2e-6), "{depth:?}");
    for (name, expected) in [("normal.X", 0.6), ("normal.Y", 0.0), ("normal.Z", 0.8)] {
        assert!(quantities(&seen, name).iter().all(|found| (found - expected).abs() < 1e-6), "{name}");
    }
}

/// A surface at 45 degrees in the line of sight, a wall where its reflection is seen and another one behind it.
fn surface_before_walls(surface: Material) -> Scene {
    let materials = vec![surface, colored(0.7, 0.2, 0.4), colored(0.1, 0.9, 0.6)];
    let mut scene = Scene { materials, environment: Some(Environment::constant([0.5; 3])), ..Scene::default() };
    // Its normal is (1, 0, 1): the camera, which looks along -Z, sees in it what is towards +X.
    shapes::quad(&mut scene, MIDDLE + Vec3::new(-2.0, -2.0, 2.0), Vec3::new(4.0, 0.0, -4.0), Vec3::Y * 4.0, 0);
    scene.name_object("surface");
    shapes::quad(&mut scene, MIDDLE + Vec3::new(3.0, -5.0, -5.0), Vec3::Z * 10.0, Vec3::Y * 10.0, 1);
    scene.name_object("reflected");
    shapes::quad(&mut scene, MIDDLE + Vec3::new(-5.0, -5.0, -4.0), Vec3::X * 10.0, Vec3::Y * 10.0, 2);
    scene.name_object("behind");
    scene.cameras.push(parallel_camera(MIDDLE + Vec3::Z * 6.0, MIDDLE, 0.25));
    scene
}

/// Kills: a mirror that has its own albedo and normal, what it shows without its reflectance, a depth or an object of what is shown in it.
#[test]
fn a_mirror_is_followed_and_is_the_first_hit() {
    let scene = surface_before_walls(metal(0.9, 0.0, 0.0));
    let Some(seen) = render(&scene, &of_scene(&scene, 8, LayerRequest::ALL)) else { return };
    // Schlick's reflectance at 45 degrees.
    let reflectance = 0.9 + 0.1 * (1.0 - 0.5_f64.sqrt()).powi(5);
    for (name, color) in [("albedo.R", 0.7), ("albedo.G", 0.2), ("albedo.B", 0.4)] {
        let found = quantities(&seen, name);
        assert!(found.iter().all(|found| (found - reflectance * color).abs() < 1e-6), "{name}: {found:?}");
    }
    for (name, expected) in [("normal.X", -1.0), ("normal.Y", 0.0), ("normal.Z", 0.0)] {
        assert!(quantities(&seen, name).iter().all(|found| (found - expected).abs() < 1e-6), "{name}");
    }
    let (depth, side) = (quantities(&seen, "Z"), SIDE as usize);
    for (pixel, depth) in depth.iter().enumerate() {
        // The surface comes nearer towards the left by as much as it goes there.
        let x = 0.5 * ((pixel % side) as f64 + 0.5) / side as f64 - 0.25;
        assert!((depth - (6.0 + x)).abs() < 0.25 / side as f64 + 1e-6, "pixel {pixel}: {depth}");
    }
    assert!(numbers(&seen, "object").iter().chain(&numbers(&seen, "material")).all(|number| *number == 0));
}

/// Kills: glass taken as a surface of its own tint, a blend that is not Fresnel's, a rough surface that is looked through.
#[test]
fn glass_is_the_blend_of_what_it_shows() {
    let glass = Material { transmission: 1.0, roughness: 0.0, ..Material::default() };
    let scene = surface_before_walls(glass.clone());
    let Some(seen) = render(&scene, &of_scene(&scene, 256, LayerRequest { albedo: true, ..LayerRequest::NONE })) else { return };
    // Fresnel at 45 degrees and an index of 1.5, once and back and forth between two faces.
    let (cosine, inner) = (0.5_f64.sqrt(), (1.0 - 0.5 / 2.25_f64).sqrt());
    let amplitudes = [(1.5 * cosine - inner) / (1.5 * cosine + inner), (cosine - 1.5 * inner) / (cosine + 1.5 * inner)];
    let once = 0.5 * (amplitudes[0].powi(2) + amplitudes[1].powi(2));
    let sheet = 2.0 * once / (1.0 + once);
    for (name, reflected, behind) in [("albedo.R", 0.7, 0.1), ("albedo.G", 0.2, 0.9), ("albedo.B", 0.4, 0.6)] {
        assert_mean(name, &quantities(&seen, name), sheet * reflected + (1.0 - sheet) * behind, 0.05);
    }
    let frosted = Material { transmission: 0.5, base_color: Vec4::new(0.3, 0.3, 0.3, 1.0), ..glass };
    let scene = surface_before_walls(frosted);
    let Some(seen) = render(&scene, &of_scene(&scene, 4, LayerRequest { albedo: true, ..LayerRequest::NONE })) else { return };
    assert!(quantities(&seen, "albedo.R").iter().all(|found| (found - 0.3).abs() < 1e-6));
}

/// A camera looks at the edge of the wall: some samples see it, some do not.
fn edge_of_a_wall() -> Scene {
    let mut scene = half_a_wall();
    scene.materials[1] = lambert(0.0, 0.0);
    scene.environment = Some(Environment::constant([1.0; 3]));
    scene.cameras = vec![parallel_camera(MIDDLE + Vec3::Z * 2.5, MIDDLE, 0.5 / SIDE as f32)];
    // Moved by half a pixel, so that the edge stands in the middle of a column of pixels.
    scene.cameras[0].world_from_camera.w_axis.x += 0.5 / (SIDE * SIDE) as f32;
    scene
}

/// Kills: sums of numbers over the samples, numbers of another sample than the first, means over samples that meet nothing.
#[test]
fn numbers_are_those_of_the_first_sample() {
    let scene = edge_of_a_wall();
    let layers = LayerRequest { object: true, material: true, depth: true, ..LayerRequest::NONE };
    let mut kinds = Vec::new();
    for first_sample in [0, 5] {
        let settings = |samples| Settings { first_sample, ..of_scene(&scene, samples, layers) };
        let (Some(one), Some(many)) = (render(&scene, &settings(1)), render(&scene, &settings(32))) else { return };
        for name in ["object", "material"] {
            assert_eq!(numbers(&one, name), numbers(&many, name), "{name} from sample {first_sample}");
        }
        let mixed: Vec<u32> = numbers(&many, "object").into_iter().skip(SIDE as usize / 2 - 1).step_by(SIDE as usize).collect();
        assert!(mixed.contains(&1) && mixed.contains(&LayerRequest::NOTHING), "no edge: {mixed:?}");
        kinds.push(mixed);
        let depth = quantities(&many, "Z");
        let hits = depth.iter().filter(|depth| depth.is_finite());
        assert!(hits.clone().count() > SIDE as usize && hits.clone().all(|depth| (depth - 2.5).abs() < 2e-6), "{depth:?}");
    }
    assert_ne!(kinds[0], kinds[1], "both runs begin with the same sample");
}

/// Kills: the variance of a sample instead of the mean's, a biased divisor, noise where there is none, certainty after one sample.
#[test]
fn variance_of_coin_flips() {
    let scene = edge_of_a_wall();
    let layers = LayerRequest { variance: true, ..LayerRequest::NONE };
    let samples = 50;
    let Some(seen) = render(&scene, &of_scene(&scene, samples, layers)) else { return };
    let mut n_mixed = 0;
    for (pixel, found) in quantities(&seen, "variance.G").into_iter().enumerate() {
        let mean = seen.film.mean(pixel, 1);
        let truth = mean * (1.0 - mean) / f64::from(samples - 1);
        n_mixed += usize::from(truth > 0.0);
        assert!((found - truth).abs() < 1e-9, "pixel {pixel}: {found} against {truth}");
    }
    assert!(n_mixed >= SIDE as usize, "the edge is in {n_mixed} pixels");
    let Some(seen) = render(&scene, &of_scene(&scene, 1, layers)) else { return };
    assert!(quantities(&seen, "variance.R").iter().all(|variance| *variance == f64::INFINITY));
    // A level that no binary fraction meets, in every sample.
    let mut even = scene.clone();
    even.environment = Some(Environment::constant([0.7; 3]));
    even.cameras[0].world_from_camera.w_axis.x += 10.0;
    let Some(seen) = render(&even, &of_scene(&even, 300, layers)) else { return };
    assert!(quantities(&seen, "variance.R").iter().all(|variance| *variance <= 0.49 / 299.0 / f64::from(1 << 15)));
}

/// Kills: a layer whose bits depend on who traces when; a colour that changes because somebody looks at something else besides.
#[test]
fn no_schedule_and_no_request_changes_a_bit() {
    for name in ["cornell-box", "mirror-corridor", "glass"] {
        let mut scene = builtin(name).expect("it is in the list");
        scene.reframe(24.0 / 40.0);
        let settings = |schedule: &str, layers| {
            let mut schedule: Schedule = schedule.parse().expect("a schedule");
            schedule.pool_blocks = Some(4);
            Settings { width: 24, height: 40, depth: 12, first_sample: 3, samples: 3, schedule, layers, ..Settings::default() }
        };
        let Some(plain) = render(&scene, &settings("block", LayerRequest::NONE)) else { return };
        let Some(reference) = render(&scene, &settings("block", LayerRequest::ALL)) else { return };
        let colour = |seen: &Rendering| -> Vec<u64> {
            (0..seen.film.pixels()).flat_map(|pixel| [0, 1, 2].map(|leaf| seen.film.sum(pixel, leaf).to_bits())).collect()
        };
        assert_eq!(colour(&plain), colour(&reference), "{name}: layers change the colour");
        let mut launches = vec![reference.report.launches];
        for schedule in ["never", "megakernel", "compaction", "keyed", "persistent"] {
            let Some(seen) = render(&scene, &settings(schedule, LayerRequest::ALL)) else { return };
            assert_eq!(seen.film.hash(), reference.film.hash(), "{name} under {schedule}");
            assert_eq!(seen.layers(), reference.layers(), "{name} under {schedule}");
            launches.push(seen.report.launches);
        }
        launches.sort_unstable();
        launches.dedup();
        assert!(launches.len() >= 4, "{name}: the schedules did the same: {launches:?}");
        for layer in reference.layers() {
            let is_flat = layer.channels.iter().all(|channel| match &channel.values {
                Values::F32(values) => values.iter().all(|value| value.to_bits() == values[0].to_bits()),
                Values::U32(values) => values.iter().all(|value| *value == values[0]),
            });
            assert_eq!(is_flat, layer.name == "samples", "{name}: {}", layer.name);
        }
    }
}
