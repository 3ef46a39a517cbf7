//! Absorption inside solids against closed forms: what a slab of a known thickness lets through and sends back.
//!
//! **Invariant:** slabs are measured in metres far from one, so that a length of normalised space is never mistaken for one.

use glam::Vec3;
use path_tracer::scene::{Environment, Material, Scene, shapes};

use crate::{assert_mean, parallel_camera, pixels};

/// Metres.
const THICKNESS: f32 = 6.0;

/// A slab across the line of sight under radiance 1; its inside leaves `left` of the light after a metre and a half.
fn slab(ior: f32, left: f32) -> Scene {
    let glass = Material {
        transmission: 1.0,
        roughness: 0.0,
        solid: true,
        ior,
        attenuation_color: Vec3::new(1.0, left, 0.0),
        attenuation_distance: 1.5,
        ..Material::default()
    };
    let mut scene = Scene { materials: vec![glass], environment: Some(Environment::constant([1.0; 3])), ..Scene::default() };
    shapes::cuboid(&mut scene, Vec3::new(5.0, -7.0, 1.0), Vec3::new(20.0, 20.0, THICKNESS / 2.0), 0.0, 0);
    scene
}

/// Kills: a length of normalised space taken for metres, absorption outside or on both sides, a colour taken at the wrong distance.
#[test]
fn a_slab_without_an_interface_follows_beer_and_lambert() {
    let left = 0.8_f32;
    for (tilt, stretch) in [(0.0, 1.0), (0.75, 1.25)] {
        // Seen at a slant whose cosine is 0.8 the way through is longer by a quarter.
        let eye = Vec3::new(5.0 + 20.0 * tilt, -7.0, 21.0);
        let camera = parallel_camera(eye, Vec3::new(5.0, -7.0, 1.0), 1.0);
        let Some(seen) = pixels(&slab(1.0, left), camera, 8, 2, 16, "block,roulette=none") else { return };
        let truth = f64::from(left).powf(f64::from(THICKNESS) / 1.5 * stretch);
        // Rays begin a few roundings off the face, of 20 metres; the exponential has its own.
        for (pixel, value) in seen.iter().enumerate() {
            assert!((value / truth - 1.0).abs() < 1e-5, "stretch {stretch}, pixel {pixel}: {value} against {truth}");
        }
    }
}

/// Kills: absorption once per path instead of once per crossing, or also on the reflected way outside.
#[test]
fn light_goes_back_and_forth_in_a_slab_and_is_absorbed_each_time() {
    let left = 0.9_f32;
    let camera = parallel_camera(Vec3::new(5.0, -7.0, 21.0), Vec3::new(5.0, -7.0, 1.0), 1.0);
    let Some(seen) = pixels(&slab(1.5, left), camera, 32, 256, 64, "block,roulette=none") else { return };
    // At a right angle: reflectance 0.04 at each face, `once` of the light left at each crossing; the series of all crossings.
    let (reflectance, once) = (0.04_f64, f64::from(left).powf(f64::from(THICKNESS) / 1.5));
    let series = (1.0 - reflectance).powi(2) * once / (1.0 - (reflectance * once).powi(2));
    let truth = reflectance + series * (1.0 + reflectance * once);
    assert_mean("slab of absorbing glass", &seen, truth, 0.005);
}

/// Kills: a path that begins inside of a solid and is taken to be outside until it has entered one.
#[test]
fn a_camera_inside_of_a_solid_sees_through_it() {
    let left = 0.7_f32;
    let camera = parallel_camera(Vec3::new(5.0, -7.0, 2.0), Vec3::new(5.0, -7.0, -1.0), 0.5);
    let Some(seen) = pixels(&slab(1.0, left), camera, 8, 1, 16, "block,roulette=none") else { return };
    // From z = 2 to the face at z = -2.
    let truth = f64::from(left).powf(4.0 / 1.5);
    assert!(seen.iter().all(|value| (value / truth - 1.0).abs() < 1e-5), "{seen:?} against {truth}");
}
