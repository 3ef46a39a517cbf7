//! An interior lit through its windows: a hall with a colonnade, an aisle and two side rooms.
//!
//! Key decision: light enters through deep openings on one side only, and the plaster is bright, so that most of it has been reflected
//! many times before it arrives: long diffuse paths of very unequal length. Everything is boxes and prisms; the emitters are panels of sky
//! outside of the windows.

use glam::Vec3;

use super::{Camera, Material, Projection, Scene, lamp, look_at, matte, shapes};

/// Depth of the hall, along -Z.
const LENGTH: f32 = 15.0;
const HEIGHT: f32 = 3.4;
/// Inner faces of the window wall, of the row of columns and of the aisle's wall.
const WINDOWS: f32 = -1.6;
const COLUMNS: f32 = 1.5;
const AISLE: f32 = 3.2;
/// Bays of the hall, each with a window and a column.
const BAYS: u32 = 5;
/// Thickness of the walls.
const WALL: f32 = 0.35;

/// Materials by place in the scene's list.
const PLASTER: u32 = 0;
const STONE: u32 = 1;
const TILE: u32 = 2;
const WOOD: u32 = 3;
const BRONZE: u32 = 4;
const CARPET: u32 = 5;
const SKY: u32 = 6;

pub(super) fn corridor() -> Scene {
    let metal = Material { metallic: 1.0, roughness: 0.35, ..matte("bronze", 0.80, 0.52, 0.28) };
    let polished = Material { roughness: 0.25, ..matte("tile", 0.20, 0.21, 0.24) };
    let mut scene = Scene {
        name: String::from("corridor"),
        materials: vec![
            matte("plaster", 0.86, 0.84, 0.80),
            matte("stone", 0.62, 0.56, 0.47),
            polished,
            matte("wood", 0.33, 0.19, 0.10),
            metal,
            matte("carpet", 0.42, 0.04, 0.05),
            Material { name: String::from("sky"), ..lamp(Vec3::new(6.5, 7.2, 8.2)) },
        ],
        ..Scene::default()
    };
    shell(&mut scene);
    scene.name_object("shell");
    window_wall(&mut scene);
    scene.name_object("window wall");
    aisle_wall(&mut scene);
    scene.name_object("aisle wall and rooms");
    for bay in 0..BAYS {
        column(&mut scene, Vec3::new(COLUMNS, 0.0, middle_of(bay) - 0.5 * LENGTH / BAYS as f32));
        // Beams from wall to wall, over the columns.
        let z = middle_of(bay) - 0.5 * LENGTH / BAYS as f32;
        block(&mut scene, Vec3::new(WINDOWS, HEIGHT - 0.3, z - 0.15), Vec3::new(AISLE, HEIGHT, z + 0.15), PLASTER);
        scene.name_object(&format!("column {bay}"));
    }
    furniture(&mut scene);
    scene.name_object("furniture");
    scene.cameras.push(Camera {
        name: String::from("entrance"),
        world_from_camera: look_at(Vec3::new(0.35, 1.6, -0.5), Vec3::new(0.1, 1.35, -9.0)),
        projection: Projection::Perspective { vertical_fov: 62f32.to_radians() },
    });
    scene
}

/// Where a bay has its middle, along Z.
fn middle_of(bay: u32) -> f32 {
    -LENGTH / BAYS as f32 * (bay as f32 + 0.5)
}

/// A box between two corners.
fn block(scene: &mut Scene, min: Vec3, max: Vec3, material: u32) {
    shapes::cuboid(scene, (min + max) * 0.5, (max - min) * 0.5, 0.0, material);
}

/// Floor in two kinds of stone, ceiling, and the walls at both ends.
fn shell(scene: &mut Scene) {
    let (left, right) = (WINDOWS - WALL, AISLE + WALL);
    block(scene, Vec3::new(left, -0.2, -LENGTH - WALL), Vec3::new(right, 0.0, WALL), STONE);
    for bay in 0..2 * BAYS {
        let z = -LENGTH / (2 * BAYS) as f32 * (bay as f32 + 0.5);
        block(scene, Vec3::new(WINDOWS + 0.25, 0.0, z - 0.55), Vec3::new(COLUMNS - 0.35, 0.004, z + 0.55), TILE);
    }
    block(scene, Vec3::new(left, HEIGHT, -LENGTH - WALL), Vec3::new(right, HEIGHT + 0.2, WALL), PLASTER);
    block(scene, Vec3::new(left, 0.0, -LENGTH - WALL), Vec3::new(right, HEIGHT, -LENGTH), PLASTER);
    block(scene, Vec3::new(left, 0.0, 0.0), Vec3::new(right, HEIGHT, WALL), PLASTER);
}

/// A wall along Z between `x` and `x + thickness`, pierced in every bay by an opening from `sill` to `lintel`, `width` wide; `has_opening`
/// says in which.
fn pierced(scene: &mut Scene, x: f32, thickness: f32, [width, sill, lintel]: [f32; 3], has_opening: impl Fn(u32) -> bool) {
    let mut solid_from = 0.0;
    for bay in (0..BAYS).filter(|bay| has_opening(*bay)) {
        let (near, far) = (middle_of(bay) + 0.5 * width, middle_of(bay) - 0.5 * width);
        block(scene, Vec3::new(x, 0.0, near), Vec3::new(x + thickness, HEIGHT, solid_from), PLASTER);
        block(scene, Vec3::new(x, lintel, far), Vec3::new(x + thickness, HEIGHT, near), PLASTER);
        if sill > 0.0 {
            block(scene, Vec3::new(x, 0.0, far), Vec3::new(x + thickness, sill, near), PLASTER);
        }
        solid_from = far;
    }
    block(scene, Vec3::new(x, 0.0, -LENGTH), Vec3::new(x + thickness, HEIGHT, solid_from), PLASTER);
}

/// Five windows with stone sills, each with a panel of sky before it.
fn window_wall(scene: &mut Scene) {
    pierced(scene, WINDOWS - WALL, WALL, [1.0, 0.9, 2.7], |_| true);
    for bay in 0..BAYS {
        let z = middle_of(bay);
        block(scene, Vec3::new(WINDOWS - WALL, 0.86, z - 0.55), Vec3::new(WINDOWS + 0.12, 0.9, z + 0.55), STONE);
        // A cross of wood in the opening.
        let x = WINDOWS - 0.6 * WALL;
        block(scene, Vec3::new(x, 0.9, z - 0.025), Vec3::new(x + 0.05, 2.7, z + 0.025), WOOD);
        block(scene, Vec3::new(x, 1.95, z - 0.5), Vec3::new(x + 0.05, 2.0, z + 0.5), WOOD);
        shapes::quad(scene, Vec3::new(WINDOWS - WALL - 0.5, 0.7, z - 0.7), Vec3::Y * 2.2, Vec3::Z * 1.4, SKY);
    }
}

/// The aisle's wall, with doorways to two rooms that get what light passes the columns.
fn aisle_wall(scene: &mut Scene) {
    pierced(scene, AISLE, WALL, [1.1, 0.0, 2.2], |bay| bay % 2 == 1);
    for bay in (0..BAYS).filter(|bay| bay % 2 == 1) {
        let (inner, z) = (AISLE + WALL, middle_of(bay));
        let (min, max) = (Vec3::new(inner, 0.0, z - 1.2), Vec3::new(inner + 2.0, 2.6, z + 1.2));
        for (from, to) in [
            (Vec3::new(min.x, -0.1, min.z), Vec3::new(max.x, 0.0, max.z)),
            (Vec3::new(min.x, max.y, min.z), Vec3::new(max.x, max.y + 0.1, max.z)),
            (Vec3::new(max.x, min.y, min.z), Vec3::new(max.x + 0.1, max.y, max.z)),
            (Vec3::new(min.x, min.y, min.z - 0.1), Vec3::new(max.x, max.y, min.z)),
            (Vec3::new(min.x, min.y, max.z), Vec3::new(max.x, max.y, max.z + 0.1)),
        ] {
            block(scene, from, to, PLASTER);
        }
        // A door that stands open into the room.
        shapes::cuboid(scene, Vec3::new(inner + 0.5, 1.08, z - 0.62), Vec3::new(0.5, 1.08, 0.03), 0.35, WOOD);
    }
}

/// A round column with plinth and capital, its foot at `foot`.
fn column(scene: &mut Scene, foot: Vec3) {
    let (plinth, capital) = (0.25, 0.22);
    shapes::cuboid(scene, foot + Vec3::Y * 0.5 * plinth, Vec3::new(0.28, 0.5 * plinth, 0.28), 0.0, STONE);
    let shaft = HEIGHT - 0.3 - plinth - capital;
    shapes::cylinder(scene, foot + Vec3::Y * plinth, 0.19, shaft, 20, STONE);
    let top = foot + Vec3::Y * (plinth + shaft + 0.5 * capital);
    shapes::cuboid(scene, top, Vec3::new(0.27, 0.5 * capital, 0.27), 0.0, STONE);
}

fn furniture(scene: &mut Scene) {
    block(scene, Vec3::new(-0.55, 0.004, -LENGTH + 1.0), Vec3::new(0.55, 0.018, -1.0), CARPET);
    // Doors at the far end, with handles.
    block(scene, Vec3::new(-0.95, 0.0, -LENGTH), Vec3::new(0.95, 2.35, -LENGTH + 0.06), WOOD);
    for x in [-0.08, 0.08] {
        shapes::icosphere(scene, Vec3::new(x, 1.05, -LENGTH + 0.1), 0.04, 2, BRONZE);
    }
    // Benches under the windows, and a sphere of bronze in the aisle.
    for bay in [0, 2, 4] {
        let z = middle_of(bay);
        block(scene, Vec3::new(WINDOWS + 0.05, 0.42, z - 0.7), Vec3::new(WINDOWS + 0.5, 0.48, z + 0.7), WOOD);
        for leg in [-0.6, 0.6] {
            block(scene, Vec3::new(WINDOWS + 0.1, 0.0, z + leg - 0.04), Vec3::new(WINDOWS + 0.45, 0.42, z + leg + 0.04), WOOD);
        }
    }
    shapes::cuboid(scene, Vec3::new(2.35, 0.45, middle_of(1) + 1.4), Vec3::new(0.22, 0.45, 0.22), 0.3, STONE);
    shapes::icosphere(scene, Vec3::new(2.35, 1.16, middle_of(1) + 1.4), 0.26, 3, BRONZE);
}
