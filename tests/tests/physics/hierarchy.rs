//! The hierarchy's two forms: nodes on a grid, and nodes as they are where the grid would be too coarse.
//!
//! **Invariant:** every pixel of the mosaic looks at one tile of it and at nothing else.

use glam::Vec3;
use path_tracer::{
    gpu_scene::{GpuScene, PackOptions},
    scene::{Scene, shapes},
};

use crate::{lambert, parallel_camera, pixels};

/// Tiles across and down.
const SIDE: u32 = 8;
/// Metres.
const TILE: f32 = 0.025;

/// Tiles that glow, each with a strength of its own, in the plane z = 0; from the middle of the first one on to the right and up.
fn mosaic() -> Scene {
    let mut scene = Scene::default();
    for tile in 0..SIDE * SIDE {
        scene.materials.push(lambert(0.0, tile as f32 + 1.0));
        let corner = Vec3::new((tile % SIDE) as f32, (tile / SIDE) as f32, 0.0) * TILE;
        shapes::quad(&mut scene, corner, Vec3::X * TILE, Vec3::Y * TILE, tile);
    }
    scene
}

/// Kills: corners of one child read for the other's, a pad or margin on the wrong side, rows of one form read as the other's.
#[test]
fn every_tile_of_a_mosaic_is_found_in_both_forms() {
    let near = mosaic();
    // Two walls, behind the camera and behind the mosaic, so far apart that its tiles are 8 cells of the grid.
    let mut far = mosaic();
    far.materials.push(lambert(0.5, 0.0));
    for z in [-100.0, 100.0] {
        shapes::quad(&mut far, Vec3::new(-100.0, -100.0, z), Vec3::X * 200.0, Vec3::Y * 200.0, SIDE * SIDE);
    }
    for (scene, is_compact) in [(near, true), (far, false)] {
        let middle = Vec3::new(1.0, 1.0, 0.0) * TILE * SIDE as f32 / 2.0;
        let camera = parallel_camera(middle + Vec3::Z, middle, TILE * SIDE as f32 / 2.0);
        let packed = GpuScene::pack(&scene, &camera, &PackOptions::default()).expect("the scene packs");
        assert_eq!(packed.facts.compact_nodes, is_compact);
        let Some(seen) = pixels(&scene, camera, SIDE, 1, 2, "block,roulette=none") else { return };
        for (pixel, value) in (0u32..).zip(seen) {
            // Row 0 is at the top.
            let tile = pixel % SIDE + (SIDE - 1 - pixel / SIDE) * SIDE;
            assert_eq!(value, f64::from(tile + 1), "pixel {pixel}, compact: {is_compact}");
        }
    }
}
