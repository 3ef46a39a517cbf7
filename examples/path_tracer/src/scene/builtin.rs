//! Scenes that need no file.
//!
//! Key decision: made by functions at run time; they are the first picture of a new user and the fixed ground of the tests.

mod corridor;
mod glass;
mod material_trees;

use glam::{Mat4, Vec3, Vec4};

use super::model::{Camera, Material, Projection, Scene};
use super::shapes;

/// Name and description of every built-in scene.
pub const BUILTIN: &[(&str, &str)] = &[
    ("cornell-box", "the Cornell box: two blocks in a room with a red and a green wall, one area light"),
    ("mirror-corridor", "a closed corridor between two mirrors: very long paths, lit by a strip on the ceiling"),
    ("corridor", "a hall with columns, an aisle and side rooms, lit through deep windows: long diffuse paths"),
    ("glass", "35 groups of solid glass bodies under a large lamp: long specular paths"),
    ("material-trees", "seven spheres whose materials are trees of others: lacquer, velvet, worn gilding, glazes and glass"),
];

/// The built-in scene of that name.
pub fn builtin(name: &str) -> Option<Scene> {
    match name {
        "cornell-box" => Some(cornell_box()),
        "mirror-corridor" => Some(mirror_corridor()),
        "corridor" => Some(corridor::corridor()),
        "glass" => Some(glass::glass()),
        "material-trees" => Some(material_trees::material_trees()),
        _ => None,
    }
}

fn matte(name: &str, r: f32, g: f32, b: f32) -> Material {
    Material { name: String::from(name), base_color: Vec4::new(r, g, b, 1.0), double_sided: true, ..Material::default() }
}

fn lamp(radiance: Vec3) -> Material {
    Material { emissive: radiance, double_sided: false, ..matte("lamp", 0.78, 0.78, 0.78) }
}

/// **Source:** dimensions of the measured box at Cornell, `graphics.cornell.edu/online/box/data.html`, here in metres and with
/// rectangular blocks; colours and light in linear Rec. 709.
fn cornell_box() -> Scene {
    let mut scene = Scene {
        name: String::from("cornell-box"),
        materials: vec![
            matte("white", 0.73, 0.73, 0.73),
            matte("red", 0.63, 0.065, 0.05),
            matte("green", 0.14, 0.45, 0.091),
            lamp(Vec3::new(17.0, 12.0, 4.0)),
        ],
        ..Scene::default()
    };
    let (white, red, green, light) = (0, 1, 2, 3);
    let size = Vec3::new(0.5528, 0.5488, 0.5592);
    // The camera looks along +Z, so +X is on its left. The wall behind it does not exist.
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    for (name, corner, u, v, material) in [
        ("floor", Vec3::ZERO, z, x, white),
        ("ceiling", y, x, z, white),
        ("back wall", z, y, x, white),
        ("red wall", x, z, y, red),
        ("green wall", Vec3::ZERO, y, z, green),
    ] {
        shapes::quad(&mut scene, corner, u, v, material);
        scene.name_object(name);
    }
    // Just below the ceiling, so that the two never compete for a ray.
    let corner = Vec3::new(0.213, size.y - 0.0005, 0.227);
    shapes::quad(&mut scene, corner, Vec3::X * 0.130, Vec3::Z * 0.105, light);
    scene.name_object("lamp");
    let (short, tall) = (Vec3::new(0.0825, 0.0825, 0.0825), Vec3::new(0.0825, 0.165, 0.0825));
    shapes::cuboid(&mut scene, Vec3::new(0.1855, short.y, 0.169), short, 0.29, white);
    scene.name_object("short block");
    shapes::cuboid(&mut scene, Vec3::new(0.3685, tall.y, 0.351), tall, -0.30, white);
    scene.name_object("tall block");
    scene.cameras.push(Camera {
        name: String::from("front"),
        world_from_camera: look_at(Vec3::new(0.278, 0.273, -0.8), Vec3::new(0.278, 0.273, 0.0)),
        projection: Projection::Perspective { vertical_fov: 39.3f32.to_radians() },
    });
    scene
}

fn mirror_corridor() -> Scene {
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..matte("mirror", 0.9, 0.9, 0.9) };
    let mut scene = Scene {
        name: String::from("mirror-corridor"),
        materials: vec![
            mirror,
            matte("floor", 0.35, 0.30, 0.25),
            matte("ceiling", 0.70, 0.70, 0.70),
            matte("end", 0.30, 0.40, 0.60),
            lamp(Vec3::new(8.0, 7.6, 7.0)),
            matte("red", 0.70, 0.08, 0.06),
            matte("green", 0.10, 0.50, 0.12),
            matte("yellow", 0.80, 0.60, 0.08),
            matte("blue", 0.07, 0.15, 0.60),
        ],
        ..Scene::default()
    };
    let (mirror, floor, ceiling, end, light, first_color) = (0, 1, 2, 3, 4, 5);
    shapes::room(&mut scene, Vec3::new(-1.2, 0.0, -4.0), Vec3::new(1.2, 2.6, 4.0), [mirror, mirror, floor, ceiling, end, end]);
    scene.name_object("walls");
    // One strip along the whole corridor, just below the ceiling.
    shapes::quad(&mut scene, Vec3::new(-0.1, 2.595, -3.6), Vec3::X * 0.2, Vec3::Z * 7.2, light);
    scene.name_object("lamp");
    // Pillars and boxes on both sides in turn, so that every reflection shows another row of them.
    for index in 0..6u32 {
        let side = if index % 2 == 0 { -1.0 } else { 1.0 };
        let z = 1.6 - 0.95 * index as f32;
        let half = if index % 3 == 0 { Vec3::new(0.12, 1.0, 0.12) } else { Vec3::new(0.18, 0.25, 0.18) };
        let center = Vec3::new(side * 0.65, half.y, z);
        shapes::cuboid(&mut scene, center, half, 0.4 * index as f32, first_color + index % 4);
        scene.name_object(&format!("block {index}"));
    }
    scene.cameras.push(Camera {
        name: String::from("inside"),
        world_from_camera: look_at(Vec3::new(-0.7, 1.5, 3.6), Vec3::new(0.9, 1.0, -0.4)),
        projection: Projection::Perspective { vertical_fov: 60f32.to_radians() },
    });
    scene
}

/// Right, up and back of a camera at `eye` that looks at `target`, horizon level.
fn look_at(eye: Vec3, target: Vec3) -> Mat4 {
    let back = (eye - target).normalize();
    let right = Vec3::Y.cross(back).normalize();
    Mat4::from_cols(right.extend(0.0), back.cross(right).extend(0.0), back.extend(0.0), eye.extend(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a name in the list without a scene, degenerate triangles, and materials out of range.
    #[test]
    fn every_listed_scene_is_valid_and_has_light_and_camera() {
        for (name, _) in BUILTIN {
            let mut scene = builtin(name).unwrap();
            scene.validate().unwrap();
            assert_eq!(scene.name, *name);
            assert!(scene.warnings.is_empty() && scene.cameras.len() == 1);
            let lit = |t: &&super::super::Triangle| scene.materials[t.material as usize].emissive != Vec3::ZERO;
            let panels = if *name == "corridor" { 5 } else { 1 };
            assert_eq!(scene.triangles.iter().filter(lit).count(), 2 * panels, "{name}");
        }
        assert!(builtin("nothing").is_none());
    }

    // Kills: walls or lamps that show their back to the room: every front faces the middle of the room.
    #[test]
    fn fronts_face_the_inside() {
        for (name, n_blocks) in [("cornell-box", 24), ("mirror-corridor", 72)] {
            let scene = builtin(name).unwrap();
            let bounds = scene.bounds().unwrap();
            let middle = (bounds.min + bounds.max) * 0.5;
            // The blocks come last.
            for triangle in &scene.triangles[..scene.triangles.len() - n_blocks] {
                let vertex = scene.vertices[triangle.vertices[0] as usize];
                assert!(vertex.normal.dot(middle - vertex.position) > 0.0, "{name}: {vertex:?}");
            }
        }
    }

    // Kills: a box seen mirrored: the red wall is on the left.
    #[test]
    fn the_red_wall_is_on_the_left() {
        let scene = builtin("cornell-box").unwrap();
        let red = scene.triangles.iter().find(|t| t.material == 1).unwrap();
        let seen = scene.cameras[0].world_from_camera.inverse().transform_point3(scene.vertices[red.vertices[0] as usize].position);
        assert!(seen.x < 0.0 && seen.z < 0.0, "{seen}");
    }
}
