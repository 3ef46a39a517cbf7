//! The hierarchy's forms: nodes on a grid, and nodes as they are where the grid would be too coarse; what is still to visit in registers, and in
//! an array where the hierarchy is deep.
//!
//! **Invariant:** every pixel of the mosaic looks at one tile of it and at nothing else.

use glam::Vec3;
use path_tracer::{
    gpu_scene::{GpuScene, PackOptions, hierarchy::SHORT_STACK},
    scene::{Scene, shapes},
};

use crate::{lambert, parallel_camera, pixels};

/// Metres.
const TILE: f32 = 0.025;

/// Tiles that glow, `side` across and down, each with a strength of its own, in the plane z = 0; from the middle of the first one on to the right
/// and up.
fn mosaic(side: u32) -> Scene {
    let mut scene = Scene::default();
    for tile in 0..side * side {
        scene.materials.push(lambert(0.0, tile as f32 + 1.0));
        let corner = Vec3::new((tile % side) as f32, (tile / side) as f32, 0.0) * TILE;
        shapes::quad(&mut scene, corner, Vec3::X * TILE, Vec3::Y * TILE, tile);
    }
    scene
}

/// Triangles one behind the other, which all let the same rays pass through the empty half of their boxes, and a wall that glows behind them.
fn pile(layers: u32) -> Scene {
    let mut scene = Scene { materials: vec![lambert(0.0, 1.0), lambert(0.0, 7.0)], ..Scene::default() };
    for layer in 0..layers {
        let depth = Vec3::NEG_Z * layer as f32 / layers as f32;
        shapes::quad(&mut scene, depth, Vec3::X, Vec3::Y, 0);
        // The half that the rays go through.
        scene.triangles.pop();
        let half = scene.triangles.last_mut().expect("a quad is two triangles");
        let first = scene.vertices.len() as u32 - 4;
        half.vertices = [first, first + 1, first + 3];
    }
    shapes::quad(&mut scene, Vec3::NEG_Z, Vec3::X, Vec3::Y, 1);
    scene
}

/// Kills: a stack in registers that loses the node which has waited longest, or one of eight; an array that is a place too small.
#[test]
fn what_waits_on_the_stack_is_not_lost() {
    let camera = parallel_camera(Vec3::new(0.75, 0.75, 1.0), Vec3::new(0.75, 0.75, 0.0), 0.15);
    let depth_of = |scene: &Scene| GpuScene::pack(scene, &camera, &PackOptions::default()).expect("the scene packs").facts.bvh_depth;
    for depth in [SHORT_STACK, SHORT_STACK + 1] {
        let scene = (8..4096).step_by(8).map(pile).find(|scene| depth_of(scene) == depth).expect("a pile of this depth");
        let Some(seen) = pixels(&scene, camera.clone(), 4, 1, 2, "block,roulette=none") else { return };
        assert_eq!(seen, vec![7.0; 16], "{} triangles, {depth} deep", scene.triangles.len());
    }
}

/// Kills: corners of one child read for the other's, near and far planes exchanged, a pad or margin on the wrong side, rows of one form read as the
/// other's; nodes that come back from the stack in another order.
#[test]
fn every_tile_of_a_mosaic_is_found_in_all_forms() {
    // Two walls, behind the camera and behind the mosaic, so far apart that its tiles are 8 cells of the grid.
    let mut far = mosaic(8);
    far.materials.push(lambert(0.5, 0.0));
    for z in [-100.0, 100.0] {
        shapes::quad(&mut far, Vec3::new(-100.0, -100.0, z), Vec3::X * 200.0, Vec3::Y * 200.0, 64);
    }
    for (scene, side, is_compact, is_deep) in [(mosaic(8), 8, true, false), (mosaic(32), 32, true, true), (far, 8, false, false)] {
        let middle = Vec3::new(1.0, 1.0, 0.0) * TILE * side as f32 / 2.0;
        let camera = parallel_camera(middle + Vec3::Z, middle, TILE * side as f32 / 2.0);
        let packed = GpuScene::pack(&scene, &camera, &PackOptions::default()).expect("the scene packs");
        assert_eq!((packed.facts.compact_nodes, packed.facts.bvh_depth > SHORT_STACK), (is_compact, is_deep), "{}", packed.facts.bvh_depth);
        let Some(seen) = pixels(&scene, camera, side, 1, 2, "block,roulette=none") else { return };
        for (pixel, value) in (0u32..).zip(seen) {
            // Row 0 is at the top.
            let tile = pixel % side + (side - 1 - pixel / side) * side;
            assert_eq!(value, f64::from(tile + 1), "pixel {pixel} of {side}x{side}, compact: {is_compact}");
        }
    }
}
