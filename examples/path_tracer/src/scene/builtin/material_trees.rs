//! Spheres whose materials are put together from others: one for each kind of node.
//!
//! Key decision: every leaf appears in several trees, so that what differs between two spheres is how they are put together. The room is that of a
//! photographer: grey, with one large lamp above and a striped wall that the smooth ones show.

use glam::{Vec2, Vec3};

use super::{Camera, Material, Projection, Scene, lamp, look_at, matte, shapes};
use crate::scene::{Curve, Image, MaterialTree, TextureUse, Weight, Wrap};

const FLOOR: u32 = 0;
const WALL: u32 = 1;
const STRIPE: u32 = 2;
const LAMP: u32 = 3;
/// Leaves.
const LACQUER: u32 = 4;
const PAINT: u32 = 5;
const FLAKES: u32 = 6;
const GOLD: u32 = 7;
const PLASTER: u32 = 8;
const FLUFF: u32 = 9;
const GLASS: u32 = 10;
/// The first material that is a tree.
const FIRST_TREE: u32 = 11;
/// Texels along a side of the mask.
const MASK: u32 = 64;

pub(super) fn material_trees() -> Scene {
    let bare = |name: &str, r, g, b| Material { ior: 1.0, ..matte(name, r, g, b) };
    let metal = |name: &str, r, g, b, roughness| Material { metallic: 1.0, roughness, ..matte(name, r, g, b) };
    let mut scene = Scene {
        name: String::from("material-trees"),
        materials: vec![
            matte("floor", 0.32, 0.31, 0.30),
            matte("wall", 0.55, 0.55, 0.55),
            matte("stripe", 0.75, 0.42, 0.12),
            lamp(Vec3::new(6.0, 5.8, 5.4)),
            metal("lacquer", 1.0, 1.0, 1.0, 0.0),
            bare("paint", 0.05, 0.12, 0.45),
            metal("flakes", 0.55, 0.70, 0.90, 0.35),
            metal("gold", 1.00, 0.72, 0.32, 0.25),
            bare("plaster", 0.30, 0.06, 0.05),
            bare("fluff", 0.75, 0.68, 0.62),
            Material { transmission: 1.0, roughness: 0.0, solid: true, ..matte("glass", 0.85, 0.97, 0.90) },
        ],
        images: vec![mask()],
        ..Scene::default()
    };
    for (name, tree, solid) in trees() {
        scene.materials.push(Material { tree: Some(tree), solid, ..matte(name, 1.0, 1.0, 1.0) });
    }
    shapes::room(&mut scene, Vec3::new(-2.2, 0.0, -1.2), Vec3::new(2.2, 2.6, 3.2), [WALL, WALL, FLOOR, WALL, WALL, WALL]);
    scene.name_object("walls");
    for stripe in 0..6 {
        let corner = Vec3::new(-1.9 + 0.7 * stripe as f32, 0.0, -1.199);
        shapes::quad(&mut scene, corner, Vec3::X * 0.3, Vec3::Y * 2.6, STRIPE);
    }
    scene.name_object("stripes");
    shapes::quad(&mut scene, Vec3::new(-1.1, 2.595, -0.6), Vec3::X * 2.2, Vec3::Z * 1.8, LAMP);
    scene.name_object("lamp");
    for (number, (name, ..)) in (0..).zip(trees()) {
        let (row, column) = if number < 4 { (0, number) } else { (1, number - 4) };
        let place = Vec3::new(-1.05 + 0.7 * column as f32 + 0.35 * row as f32, 0.31, -0.35 + 0.75 * row as f32);
        shapes::uv_sphere(&mut scene, place, 0.3, 32, 64, FIRST_TREE + number);
        scene.name_object(name);
    }
    scene.cameras.push(Camera {
        name: String::from("front"),
        world_from_camera: look_at(Vec3::new(0.0, 1.35, 2.9), Vec3::new(0.0, 0.28, 0.0)),
        projection: Projection::Perspective { vertical_fov: 36f32.to_radians() },
    });
    scene
}

/// Names, trees, and whether the sphere is solid: the first four stand behind.
fn trees() -> [(&'static str, MaterialTree, bool); 7] {
    let leaf = MaterialTree::Leaf;
    let all = Weight::constant(1.0);
    let mix = |parts: &[(f32, u32)]| MaterialTree::Mix(parts.iter().map(|(part, of)| (Weight::constant(*part), leaf(*of))).collect());
    let fresnel = |ior| Curve::Fresnel { ior };
    let worn = Weight { factor: 1.0, texture: Some(mask_use()) };
    [
        ("car paint", MaterialTree::layer(all, fresnel(1.5), leaf(LACQUER), mix(&[(0.7, PAINT), (0.3, FLAKES)])), false),
        (
            "velvet",
            MaterialTree::layer(all, Curve::Custom { normal: 0.02, grazing: 0.9, exponent: 3.0 }, leaf(FLUFF), leaf(PLASTER)),
            false,
        ),
        ("worn gilding", MaterialTree::layer(worn, Curve::Constant, leaf(GOLD), leaf(PLASTER)), false),
        (
            "glazed gilding",
            {
                let worn = MaterialTree::layer(worn, Curve::Constant, leaf(GOLD), leaf(PLASTER));
                MaterialTree::layer(all, fresnel(1.8), leaf(LACQUER), worn)
            },
            false,
        ),
        ("half a mirror", mix(&[(0.5, LACQUER), (0.5, PAINT)]), false),
        ("painted glass", MaterialTree::layer(worn, Curve::Constant, leaf(GLASS), leaf(PAINT)), true),
        ("glazed glass", MaterialTree::layer(Weight::constant(0.6), fresnel(2.4), leaf(GOLD), leaf(GLASS)), true),
    ]
}

fn mask_use() -> TextureUse {
    TextureUse { image: 0, uv_set: 0, wrap: [Wrap::Repeat, Wrap::Clamp], linear: true, transform: [Vec3::X * 2.0, Vec3::Y] }
}

/// Blotches: a sum of waves in several directions, steepened.
fn mask() -> Image {
    let texel = |index: u32| {
        let at = Vec2::new((index % MASK) as f32, (index / MASK) as f32) * (std::f32::consts::TAU / MASK as f32);
        let waves = [(1.0, 2.0, 0.3), (3.0, -1.0, 1.7), (-2.0, 3.0, 2.9), (5.0, 4.0, 0.9), (-6.0, 5.0, 4.1)];
        let sum: f32 = waves.iter().map(|(x, y, phase)| (at.dot(Vec2::new(*x, *y)) + phase).sin()).sum();
        let level = (0.5 + 0.8 * sum).clamp(0.0, 1.0);
        let byte = (level * 255.0) as u8;
        [byte, byte, byte, 255]
    };
    Image { name: String::from("mask"), width: MASK, height: MASK, texels: (0..MASK * MASK).map(texel).collect() }
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    // Kills: a kind of node that no sphere shows, a leaf that no tree has, a sphere of another's material.
    #[test]
    fn every_kind_of_node_and_every_leaf_is_shown() {
        let scene = material_trees();
        let trees: Vec<&MaterialTree> = scene.materials.iter().filter_map(|material| material.tree.as_ref()).collect();
        assert_eq!(trees.len(), 7);
        let leaves: std::collections::BTreeSet<u32> = trees.iter().flat_map(|tree| tree.leaves()).collect();
        assert_eq!(leaves, (LACQUER..=GLASS).collect());
        let has = |curve: fn(&Curve) -> bool| trees.iter().any(|tree| matches!(tree, MaterialTree::Layer(layer) if curve(&layer.curve)));
        assert!(has(|curve| matches!(curve, Curve::Constant)) && has(|curve| matches!(curve, Curve::Fresnel { .. })));
        assert!(has(|curve| matches!(curve, Curve::Custom { .. })) && trees.iter().any(|tree| matches!(tree, MaterialTree::Mix(_))));
        let shown: std::collections::BTreeSet<u32> = scene.triangles.iter().map(|triangle| triangle.material).collect();
        assert!(
            (FIRST_TREE..FIRST_TREE + 7).all(|tree| shown.contains(&tree)) && Vec4::ONE == scene.materials[FIRST_TREE as usize].base_color
        );
    }
}
