//! Coverage against closed forms: how much of a pixel something covers, and that only the direct sight of the environment is gone.
//!
//! **Invariant:** the environment is never black, so that whatever is left of it where it should not be seen shows.

use glam::{Vec3, Vec4};
use path_tracer::{
    LayerRequest, Rendering, Settings,
    scene::{AlphaMode, Environment, Material, Scene, shapes},
    wavepool::Schedule,
};

use crate::{assert_mean, lambert, layers::render, metal, parallel_camera};

const SIDE: u32 = 16;
const LIGHT: [f32; 3] = [0.25, 0.5, 3.0];

/// Seen by a parallel camera from +Z that shows 2 x 2 metres around the origin.
fn scene_of(material: Material) -> Scene {
    let mut scene = Scene { materials: vec![material], environment: Some(Environment::constant(LIGHT)), ..Scene::default() };
    scene.cameras.push(parallel_camera(Vec3::Z * 2.5, Vec3::ZERO, 1.0));
    scene
}

/// Its middle is the origin.
fn quad(scene: &mut Scene, u: Vec3, v: Vec3) {
    shapes::quad(scene, -0.5 * (u + v), u, v, 0);
}

fn seen(scene: &Scene, samples: u32, depth: u32, transparent: bool) -> Option<Rendering> {
    render(scene, &Settings { depth, transparent, ..Settings::new(SIDE, SIDE, samples) })
}

fn alpha(rendering: &Rendering) -> Vec<f64> {
    rendering.alpha().expect("it was asked for").into_iter().map(f64::from).collect()
}

/// A square of half of the picture's area, turned by 30 degrees, so that its edges cross pixels everywhere.
fn half_of_the_picture(material: Material) -> Scene {
    let mut scene = scene_of(material);
    let (sin, cos) = 30.0_f32.to_radians().sin_cos();
    let side = 2.0_f32.sqrt();
    quad(&mut scene, Vec3::new(cos, sin, 0.0) * side, Vec3::new(-sin, cos, 0.0) * side);
    scene
}

/// Kills: an alpha that counts pixels instead of samples, one that counts the first sample alone, hits that are misses, a transparent
/// background that still shows the environment, an alpha where nobody has asked for it.
#[test]
fn half_of_the_picture_is_covered() {
    let scene = half_of_the_picture(lambert(0.5, 0.0));
    let samples = 256;
    let Some(rendering) = seen(&scene, samples, 1, true) else { return };
    let alpha = alpha(&rendering);
    // Every pixel is a number of coins of its own.
    let n = alpha.len() as f64;
    let mean = alpha.iter().sum::<f64>() / n;
    let variance = alpha.iter().map(|alpha| alpha * (1.0 - alpha) / f64::from(samples - 1)).sum::<f64>() / (n * n);
    let error = variance.sqrt();
    println!("coverage: {mean:.6} against 0.5, standard error {error:.2e}");
    assert!((mean - 0.5).abs() < 4.9 * error, "{mean} against 0.5, standard error {error}");
    assert!(4.9 * error < 0.005, "an error of 1 % of the coverage would not be seen: {error}");
    let n_partly = alpha.iter().filter(|alpha| **alpha > 0.0 && **alpha < 1.0).count();
    assert!((30..90).contains(&n_partly), "the edges cross {n_partly} pixels");
    for (pixel, (alpha, color)) in alpha.iter().zip(rendering.pixels()).enumerate() {
        assert_eq!((alpha * f64::from(samples)).fract(), 0.0, "pixel {pixel}: no whole number of samples");
        assert_eq!(*alpha == 0.0, color == [0.0; 3], "pixel {pixel}: {alpha} {color:?}");
    }
    let Some(opaque) = seen(&scene, 1, 1, false) else { return };
    assert_eq!(opaque.alpha(), None);
}

/// Kills: an environment that is gone as a light too, found or picked; a colour that is not multiplied by the alpha, or twice.
#[test]
fn only_the_direct_sight_of_the_environment_is_gone() {
    let scene = half_of_the_picture(lambert(0.5, 0.0));
    let (Some(empty), Some(full)) = (seen(&scene, 256, 1, true), seen(&scene, 256, 1, false)) else { return };
    let alpha = alpha(&empty);
    for (pixel, alpha) in alpha.iter().enumerate() {
        for (channel, light) in LIGHT.iter().enumerate() {
            let behind = (1.0 - alpha) * f64::from(*light);
            let (found, expected) = (empty.film.mean(pixel, channel) + behind, full.film.mean(pixel, channel));
            assert!((found - expected).abs() < 1e-5, "pixel {pixel}: {found} against {expected}");
        }
    }
    // Under an even sky a matte surface sends on its albedo of the sky's light.
    let covered = alpha.iter().enumerate().filter(|(_, alpha)| **alpha > 0.0);
    let straight: Vec<f64> = covered.map(|(pixel, alpha)| empty.film.mean(pixel, 1) / alpha).collect();
    assert_mean("light on the square", &straight, 0.5 * f64::from(LIGHT[1]), 0.03);
}

/// Kills: mirrors and glass that show nothing of an environment that is hidden from the camera alone, or that are transparent themselves;
/// an emitter or a path that may not scatter taken for a miss.
#[test]
fn what_is_met_counts_and_shows_the_environment() {
    let glass = Material { transmission: 1.0, roughness: 0.0, ..Material::default() };
    let cases = [("mirror", metal(1.0, 0.0, 0.0), 1.0), ("glass", glass, 1.0), ("lamp", lambert(0.0, 2.0), 2.0 / f64::from(LIGHT[1]))];
    for (name, material, expected) in cases {
        let mut scene = scene_of(material);
        quad(&mut scene, Vec3::X * 4.0, Vec3::Y * 4.0);
        let Some(rendering) = seen(&scene, 8, 8, true) else { return };
        assert!(alpha(&rendering).iter().all(|alpha| *alpha == 1.0), "{name}");
        for pixel in 0..rendering.film.pixels() {
            let found = rendering.film.mean(pixel, 1) / f64::from(LIGHT[1]);
            assert!((found - expected).abs() < 1e-4, "{name}, pixel {pixel}: {found}");
        }
        let Some(rendering) = seen(&scene, 8, 0, true) else { return };
        assert!(alpha(&rendering).iter().all(|alpha| *alpha == 1.0), "{name} that may not scatter");
    }
}

/// Kills: a surface that is there for the alpha and not for the colour, or the other way round; veils that are counted once.
#[test]
fn veils_cover_as_often_as_they_are_there() {
    let veil = |alpha: f32, mode| Material { base_color: Vec4::new(1.0, 1.0, 1.0, alpha), alpha: mode, ..lambert(0.0, 1.0) };
    let mut scene = scene_of(veil(0.25, AlphaMode::Blend));
    quad(&mut scene, Vec3::X * 4.0, Vec3::Y * 4.0);
    shapes::quad(&mut scene, Vec3::new(-2.0, -2.0, -1.0), Vec3::X * 4.0, Vec3::Y * 4.0, 0);
    let Some(rendering) = seen(&scene, 512, 0, true) else { return };
    let found = alpha(&rendering);
    assert_mean("two veils", &found, 1.0 - 0.75 * 0.75, 0.03);
    for (pixel, alpha) in found.iter().enumerate() {
        // Where a veil is, it shines with a radiance of 1.
        assert!((rendering.film.mean(pixel, 1) - alpha).abs() < 1e-6, "pixel {pixel}");
    }
    for (alpha_of_veil, expected) in [(0.25, 0.0), (0.75, 1.0)] {
        scene.materials[0] = veil(alpha_of_veil, AlphaMode::Mask { cutoff: 0.5 });
        let Some(rendering) = seen(&scene, 4, 0, true) else { return };
        assert!(alpha(&rendering).iter().all(|alpha| *alpha == expected), "{alpha_of_veil}");
    }
}

/// Kills: an alpha whose bits depend on who traces when; layers that change it, or an albedo of a sky that is not seen.
#[test]
fn no_schedule_changes_a_bit_of_the_alpha() {
    let glass = Material { transmission: 1.0, roughness: 0.0, solid: true, ..Material::default() };
    let mut scene = scene_of(glass);
    scene.materials.extend([lambert(0.5, 0.0), Material { alpha: AlphaMode::Blend, ..lambert(0.5, 0.0) }]);
    scene.materials[2].base_color.w = 0.5;
    shapes::icosphere(&mut scene, Vec3::Y * 0.3, 0.4, 2, 0);
    shapes::quad(&mut scene, Vec3::new(-0.4, -0.6, -0.2), Vec3::new(0.9, 0.1, 0.0), Vec3::new(-0.1, 0.7, 0.0), 1);
    shapes::quad(&mut scene, Vec3::new(-0.3, -0.9, 0.5), Vec3::new(0.7, 0.0, 0.0), Vec3::new(0.0, 0.8, 0.0), 2);
    let settings = |schedule: &str, layers| {
        let mut schedule: Schedule = schedule.parse().expect("a schedule");
        schedule.pool_blocks = Some(4);
        Settings { width: 24, height: 40, depth: 12, samples: 3, schedule, layers, transparent: true, ..Settings::default() }
    };
    let Some(reference) = render(&scene, &settings("block", LayerRequest::NONE)) else { return };
    let found = alpha(&reference);
    assert!(found.contains(&0.0) && found.contains(&1.0) && found.iter().any(|alpha| alpha.fract() > 0.0), "{found:?}");
    let mut launches = vec![reference.report.launches];
    for schedule in ["never", "megakernel", "compaction", "keyed", "persistent", "per-lane"] {
        let Some(rendering) = render(&scene, &settings(schedule, LayerRequest::NONE)) else { return };
        assert_eq!(rendering.film.hash(), reference.film.hash(), "{schedule}");
        assert_eq!(rendering.alpha(), reference.alpha(), "{schedule}");
        launches.push(rendering.report.launches);
    }
    launches.sort_unstable();
    launches.dedup();
    assert!(launches.len() >= 4, "the schedules did the same: {launches:?}");
    let Some(layered) = render(&scene, &settings("block", LayerRequest::ALL)) else { return };
    assert_eq!(layered.alpha(), reference.alpha());
    assert_eq!(layered.pixels(), reference.pixels());
    let layers = layered.layers();
    let albedo = layers.iter().find(|layer| layer.name == "albedo").expect("it was asked for");
    for (pixel, alpha) in found.iter().enumerate() {
        let is_black = albedo.channels.iter().all(|channel| match &channel.values {
            path_tracer::layers::Values::F32(values) => values[pixel] == 0.0,
            path_tracer::layers::Values::U32(_) => false,
        });
        assert!(*alpha > 0.0 || is_black, "pixel {pixel}: albedo of nothing");
    }
}
