//! Many bodies of glass on a table: paths that are refracted again and again before they meet anything that scatters.
//!
//! Key decision: solid dielectrics alone, no rough ones, in several sizes and tints, close enough together that a path out of one usually
//! enters another. The light is large, so that paths that find it by chance are no rarity: a path that has been refracted last can find it in
//! no other way.

use glam::{Vec3, Vec4};

use super::{Camera, Material, Projection, Scene, lamp, look_at, matte, shapes};

const TABLE: u32 = 0;
const WALL: u32 = 1;
const WARM: u32 = 2;
const COOL: u32 = 3;
const LIGHT: u32 = 4;
const FIRST_GLASS: u32 = 5;
/// Tints of the glass.
const TINTS: [[f32; 3]; 4] = [[1.0, 1.0, 1.0], [0.85, 0.97, 0.92], [0.99, 0.86, 0.74], [0.80, 0.90, 0.99]];

pub(super) fn glass() -> Scene {
    let body = |[r, g, b]: [f32; 3]| Material {
        name: String::from("glass"),
        base_color: Vec4::new(r, g, b, 1.0),
        roughness: 0.0,
        transmission: 1.0,
        ior: 1.52,
        solid: true,
        ..Material::default()
    };
    let mut scene = Scene {
        name: String::from("glass"),
        materials: vec![
            matte("table", 0.48, 0.42, 0.36),
            matte("wall", 0.72, 0.72, 0.70),
            matte("warm", 0.70, 0.32, 0.12),
            matte("cool", 0.12, 0.30, 0.55),
            lamp(Vec3::new(3.2, 3.1, 2.9)),
        ],
        ..Scene::default()
    };
    scene.materials.extend(TINTS.map(body));
    shapes::room(&mut scene, Vec3::new(-1.6, 0.0, -1.4), Vec3::new(1.6, 2.0, 2.2), [WARM, COOL, TABLE, WALL, WALL, WALL]);
    scene.name_object("walls");
    shapes::quad(&mut scene, Vec3::new(-0.8, 1.995, -0.9), Vec3::X * 1.6, Vec3::Z * 1.6, LIGHT);
    scene.name_object("lamp");
    // Rows of bodies, every second row shifted; none touches another or the table.
    for row in 0..5u32 {
        for column in 0..7u32 {
            let number = row * 7 + column;
            let shift = if row % 2 == 0 { 0.0 } else { 0.15 };
            let place = Vec3::new(-1.02 + 0.32 * column as f32 + shift, 0.0, 0.75 - 0.34 * row as f32);
            let material = FIRST_GLASS + number * 5 % TINTS.len() as u32;
            let grown = 0.7 + 0.3 * ((number * 37 % 10) as f32 / 10.0);
            match number % 3 {
                0 => shapes::icosphere(&mut scene, place + Vec3::Y * (0.15 * grown + 0.004), 0.15 * grown, 3, material),
                1 => {
                    let half = Vec3::new(0.085, 0.17, 0.085) * grown;
                    shapes::cuboid(&mut scene, place + Vec3::Y * (half.y + 0.004), half, 0.5 + 0.7 * number as f32, material);
                }
                _ => {
                    let height = 0.42 * grown;
                    shapes::cylinder(&mut scene, place + Vec3::Y * 0.004, 0.1 * grown, height, 32, material);
                    shapes::icosphere(&mut scene, place + Vec3::Y * (height + 0.09), 0.08, 3, FIRST_GLASS);
                }
            }
            scene.name_object(&format!("group {number}"));
        }
    }
    scene.cameras.push(Camera {
        name: String::from("table"),
        world_from_camera: look_at(Vec3::new(0.15, 0.75, 2.0), Vec3::new(0.0, 0.2, 0.0)),
        projection: Projection::Perspective { vertical_fov: 50f32.to_radians() },
    });
    scene
}
