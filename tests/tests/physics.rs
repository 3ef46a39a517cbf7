//! The path tracer against closed forms.
//!
//! Every scene here has a known answer, so no picture is stored. Means are compared by two bounds: they must lie within 4.9 standard
//! errors of the truth (family error below 1e-6 per test), and the standard error must be small enough to have seen the planted fault;
//! both come from the pixels themselves, which are independent samples of the same number.

#[path = "physics/alpha.rs"]
mod alpha;
#[path = "physics/hierarchy.rs"]
mod hierarchy;
#[path = "physics/layers.rs"]
mod layers;
#[path = "physics/placement.rs"]
mod placement;
#[path = "physics/trees.rs"]
mod trees;
#[path = "physics/volume.rs"]
mod volume;

use std::{f64::consts::PI, ops::ControlFlow};

use glam::{Mat4, Vec3, Vec4};
use path_tracer::{
    Renderer, Settings,
    gpu_scene::LightStrategy,
    scene::{Camera, Environment, Material, Projection, Scene, Vertex, shapes},
    wavepool::Schedule,
};

/// Looks from `eye` towards `target`, parallel, `half_height` metres of it.
fn parallel_camera(eye: Vec3, target: Vec3, half_height: f32) -> Camera {
    let back = (eye - target).normalize();
    let up = if back.y.abs() > 0.9 { Vec3::Z } else { Vec3::Y };
    let right = up.cross(back).normalize();
    Camera {
        name: "test".into(),
        world_from_camera: Mat4::from_cols(right.extend(0.0), back.cross(right).extend(0.0), back.extend(0.0), eye.extend(1.0)),
        projection: Projection::Orthographic { half_height },
    }
}

/// A material without a coat: all the energy is in the diffuse base.
fn lambert(albedo: f32, emission: f32) -> Material {
    Material { base_color: Vec4::new(albedo, albedo, albedo, 1.0), ior: 1.0, emissive: Vec3::splat(emission), ..Material::default() }
}

fn metal(reflectance: f32, roughness: f32, emission: f32) -> Material {
    let base_color = Vec4::new(reflectance, reflectance, reflectance, 1.0);
    Material { base_color, metallic: 1.0, roughness, emissive: Vec3::splat(emission), ..Material::default() }
}

/// A sphere whose normals are those of its facets: interpolated normals and flat facets disagree, which costs light.
fn faceted_sphere(scene: &mut Scene) {
    shapes::icosphere(scene, Vec3::ZERO, 1.0, 3, 0);
    let vertices = std::mem::take(&mut scene.vertices);
    for triangle in &mut scene.triangles {
        let corners = triangle.vertices.map(|index| vertices[index as usize]);
        let normal = (corners[1].position - corners[0].position).cross(corners[2].position - corners[0].position).normalize();
        triangle.vertices = [0, 1, 2].map(|corner| scene.vertices.len() as u32 + corner);
        scene.vertices.extend(corners.map(|vertex| Vertex { normal, ..vertex }));
    }
}

/// The green channel of every pixel of a small image.
fn pixels(scene: &Scene, camera: Camera, side: u32, samples: u32, depth: u32, schedule: &str) -> Option<Vec<f64>> {
    let schedule = schedule.parse::<Schedule>().expect("a valid schedule");
    render(scene, Settings { depth, schedule, camera: Some(camera), ..Settings::new(side, side, samples) })
}

fn render(scene: &Scene, mut settings: Settings) -> Option<Vec<f64>> {
    let gpu = wavepool_tests::device::gpu()?;
    settings.schedule.pool_blocks = Some(16);
    let mut scene = scene.clone();
    scene.validate().expect("a valid scene");
    let mut renderer = Renderer::new(gpu, &scene, &settings).expect("the scene compiles");
    let rendering = renderer.render(|_| ControlFlow::Continue(())).expect("the scene renders");
    assert_eq!(rendering.report.not_finite, 0);
    Some((0..rendering.film.pixels()).map(|pixel| rendering.film.mean(pixel, 1)).collect())
}

/// The mean lies within 4.9 standard errors of `truth`, and the test would have seen a relative error of `resolution`.
fn assert_mean(what: &str, pixels: &[f64], truth: f64, resolution: f64) {
    let n = pixels.len() as f64;
    let mean = pixels.iter().sum::<f64>() / n;
    let variance = pixels.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let error = (variance / n).sqrt();
    println!("{what}: {mean:.6} against {truth:.6}, standard error {error:.2e}");
    // Roundings of a few hundred operations on the way are no bias.
    assert!((mean - truth).abs() <= 4.9 * error + 2e-6 * truth, "{what}: {mean} against {truth} +- {error}");
    // 4.9 + 3.1 standard errors: a bias of this size is missed once in a thousand times.
    assert!(8.0 * error <= resolution * truth, "{what}: a standard error of {error} cannot resolve {resolution}");
}

/// Kills: an environment light sampled without the cosine, a BSDF density left out of the weights, radiance lost at the coat of ior 1.
#[test]
fn white_furnace() {
    let mut scene = Scene { materials: vec![lambert(1.0, 0.0)], environment: Some(Environment::constant([1.0; 3])), ..Scene::default() };
    faceted_sphere(&mut scene);
    let Some(seen) = pixels(&scene, parallel_camera(Vec3::Z * 3.0, Vec3::ZERO, 0.6), 32, 128, 4, "block,roulette=none") else { return };
    assert_mean("Lambert sphere of albedo 1 under radiance 1", &seen, 1.0, 0.02);
}

/// Kills: radiance scaled by the squared index on entering but not on leaving, rays lost at total reflection, a Fresnel term of 1.
#[test]
fn glass_sphere_in_a_furnace_is_invisible() {
    let glass = Material { transmission: 1.0, solid: true, roughness: 0.0, ..Material::default() };
    let mut scene = Scene { materials: vec![glass], environment: Some(Environment::constant([1.0; 3])), ..Scene::default() };
    shapes::icosphere(&mut scene, Vec3::ZERO, 1.0, 3, 0);
    let camera = parallel_camera(Vec3::Z * 3.0, Vec3::ZERO, 1.2);
    let Some(seen) = pixels(&scene, camera, 32, 16, 64, "block,roulette=none") else { return };
    // Every path carries the radiance it meets, except that reflecting or not is drawn in 65536ths: 2^-17 of the whole against a
    // reflectance of at least 0.04, a few times per path.
    for (pixel, value) in seen.iter().enumerate() {
        assert!((value - 1.0).abs() < 1e-3, "pixel {pixel}: {value}");
    }
    assert_mean("glass sphere under radiance 1", &seen, 1.0, 1e-4);
}

/// Kills: a depth limit off by one, a product of throughputs kept in half precision, an offset that leaves the axis.
#[test]
fn mirror_corridor_to_depth_1000() {
    for (reflectance, depth) in [(0.5, 1000), (0.9, 1000), (0.99, 1000), (0.999, 1000), (0.999, 3)] {
        let mut scene = Scene { materials: vec![metal(reflectance, 0.0, 1.0)], ..Scene::default() };
        shapes::quad(&mut scene, Vec3::new(-1.0, -1.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0);
        shapes::quad(&mut scene, Vec3::new(-1.0, -1.0, 1.0), Vec3::Y * 2.0, Vec3::X * 2.0, 0);
        let camera = parallel_camera(Vec3::ZERO, Vec3::NEG_Z, 0.3);
        let Some(seen) = pixels(&scene, camera, 8, 1, depth, "block,roulette=none") else { return };
        // At a right angle the reflectance is the base colour itself, whatever the model of its rise towards grazing angles.
        let rho = f64::from(reflectance);
        let truth = (1.0 - rho.powi(depth as i32 + 1)) / (1.0 - rho);
        // One rounding of the product and one of the sum per bounce.
        let bound = f64::from(depth + 1) * 2.0 * 2.0_f64.powi(-24);
        for (pixel, value) in seen.iter().enumerate() {
            let error = (value / truth - 1.0).abs();
            assert!(error <= bound, "rho {rho}, depth {depth}, pixel {pixel}: {value} against {truth}, relative error {error:.1e}");
        }
    }
}

/// Kills: roulette without 1/p, straggling paths dropped, a cosine lost between walls, emission counted twice by the two strategies.
#[test]
fn closed_room_of_uniform_walls() {
    for (schedule, depth) in [("block,roulette=lane", 1000), ("never,roulette=none", 5)] {
        let (albedo, emission) = (0.5_f32, 0.7_f32);
        let mut scene = Scene { materials: vec![lambert(albedo, emission)], ..Scene::default() };
        shapes::room(&mut scene, Vec3::new(-1.0, -1.5, -2.0), Vec3::new(1.0, 1.5, 2.0), [0; 6]);
        let camera = parallel_camera(Vec3::new(0.1, 0.2, 1.0), Vec3::new(0.3, -0.1, -2.0), 0.7);
        let Some(seen) = pixels(&scene, camera, 48, 64, depth, schedule) else { return };
        let rho = f64::from(albedo);
        let truth = f64::from(emission) * (1.0 - rho.powi(depth.min(900) as i32 + 1)) / (1.0 - rho);
        assert_mean(&format!("Le/(1-rho) under {schedule}"), &seen, truth, 0.01);
    }
}

/// Kills: the cosine at the light left out, the area density not turned into one of solid angle, light leaving the back.
#[test]
fn rectangle_light_over_its_corner() {
    let (albedo, radiance) = (0.8_f32, 3.0_f32);
    let light = Material { double_sided: false, ..lambert(0.0, radiance) };
    let mut scene = Scene { materials: vec![lambert(albedo, 0.0), light], ..Scene::default() };
    shapes::quad(&mut scene, Vec3::new(-0.5, 0.0, -0.5), Vec3::Z, Vec3::X, 0);
    shapes::quad(&mut scene, Vec3::new(0.0, 1.0, 0.0), Vec3::X * 0.8, Vec3::Z * 1.5, 1);
    let camera = parallel_camera(Vec3::new(-1.0, 1.5, -1.0), Vec3::ZERO, 2e-4);
    let Some(seen) = pixels(&scene, camera, 16, 256, 1, "block,roulette=none") else { return };
    // numerics S10: the irradiance below the corner of a rectangle 0.8 x 1.5 at height 1 is 0.443663 times its radiance.
    let truth = f64::from(albedo) / PI * f64::from(radiance) * 0.443_663;
    assert_mean("rectangle light", &seen, truth, 0.02);
}

/// Kills: a panorama shifted by half a texel, turned or upside down, for sampling or for rays that leave; the solid angle of a texel
/// taken at its middle.
#[test]
fn one_texel_of_a_panorama() {
    let (width, height, row, column) = (16_u32, 8_u32, 2_u32, 13_u32);
    let (albedo, radiance) = (0.6_f32, 1e4_f32);
    let mut texels = vec![[0.0; 3]; (width * height) as usize];
    texels[(row * width + column) as usize] = [radiance; 3];
    let environment = Environment { name: "one texel".into(), width, height, texels };
    // The range of the texel: from the pole, and from +X, which lies at three quarters of the width.
    let polar = |row: u32| f64::from(row) * PI / f64::from(height);
    let azimuth = |column: u32| (f64::from(column) / f64::from(width) - 0.75) * 2.0 * PI;
    // numerics S13: the integral of the cosine to the normal over the texel, for a floor (normal at the pole) and for a wall towards +X.
    let floor = (azimuth(column + 1) - azimuth(column)) * (polar(row + 1).sin().powi(2) - polar(row).sin().powi(2)) / 2.0;
    let meridian = |angle: f64| angle / 2.0 - (2.0 * angle).sin() / 4.0;
    let wall = (azimuth(column + 1).sin() - azimuth(column).sin()) * (meridian(polar(row + 1)) - meridian(polar(row)));
    for (normal, integral) in [(Vec3::Y, floor), (Vec3::X, wall), (Vec3::NEG_X, 0.0)] {
        let mut scene = Scene { materials: vec![lambert(albedo, 0.0)], environment: Some(environment.clone()), ..Scene::default() };
        let u = if normal == Vec3::Y { Vec3::Z } else { Vec3::Y };
        let v = normal.cross(u);
        shapes::quad(&mut scene, -u - v, u * 2.0, v * 2.0, 0);
        let truth = f64::from(albedo) / PI * f64::from(radiance) * integral;
        for (strategy, samples) in [(LightStrategy::Mis, 64), (LightStrategy::Lights, 64), (LightStrategy::Bsdf, 1024)] {
            let camera = Some(parallel_camera(normal, Vec3::ZERO, 0.3));
            let schedule = Schedule::block().with_roulette(None);
            let settings = Settings { depth: 1, schedule, camera, light_strategy: strategy, ..Settings::new(32, 32, samples) };
            let Some(seen) = render(&scene, settings) else { return };
            if integral > 0.0 {
                assert_mean(&format!("one texel, normal {normal}, {strategy:?}"), &seen, truth, 0.06);
            } else {
                assert!(seen.iter().all(|value| *value == 0.0), "light through the back of a wall, {strategy:?}");
            }
        }
    }
}

/// Kills: a distribution of normals that loses its tail, masking on one side only, sampling weights that are not value over density.
#[test]
fn single_scattering_of_rough_metal() {
    // numerics S17: directional albedo at normal incidence for alpha = roughness squared, Fresnel 1.
    for (alpha, truth) in [(1.0_f32, 1.0 - 2.0_f64.ln()), (0.5, 0.687_849), (0.1, 0.988_304)] {
        let mut scene = Scene {
            materials: vec![metal(1.0, alpha.sqrt(), 0.0)],
            environment: Some(Environment::constant([1.0; 3])),
            ..Scene::default()
        };
        shapes::quad(&mut scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 0);
        let camera = parallel_camera(Vec3::Y, Vec3::ZERO, 0.3);
        let Some(seen) = pixels(&scene, camera, 48, 256, 1, "block,roulette=none") else { return };
        assert_mean(&format!("rough metal, alpha {alpha}"), &seen, truth, 0.02);
    }
}
