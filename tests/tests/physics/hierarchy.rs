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

/// Kills: corners of one child read for the other's, near and far planes exchanged, a pad or margin on the wrong side, rows of one form read as the
/// other's; nodes that come back from the stack in another order, the last of eight lost.
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
