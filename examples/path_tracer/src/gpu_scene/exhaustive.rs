//! Scenes of so few triangles that every ray is tested against all of them.
//!
//! Key decision: the kernel names each triangle, one call after the other, without a loop. Mesa's software driver reads a buffer lane by lane, or
//! gathers, unless it can tell while it compiles that all lanes read the same; a constant index is the one case where it can, and then a
//! word is one load for all lanes. Nor do lanes wait for each other: all do the same. A hierarchy saves tests that are cheaper than
//! what it takes to skip them. The price is compilation, which grows with the triangles; SwiftShader compiles for minutes and is never asked.
//!
//! **Invariant:** bits do not depend on it. Slots are those of the hierarchy, and triangles are asked in the order of the scene, so that the first of
//! those at the same distance wins.
//! Scenes with alpha are left out: each call would hold a copy of all that alpha reads.

use std::fmt::Write as _;

use super::records::TriangleRecord;

/// Triangles up to which llvmpipe does without a hierarchy. On llvmpipe 36 of them are 1.5 times as fast this way, 86 are 1.1 times as fast
/// and take seconds more to compile; the book has the numbers.
pub const EXHAUSTIVE_TRIANGLES: u32 = 48;

/// Slots by the number that their triangle has in the scene.
pub(crate) fn slots_in_scene_order(triangles: &[TriangleRecord]) -> Vec<u32> {
    let mut slots: Vec<u32> = (0..triangles.len() as u32).collect();

    slots.sort_unstable_by_key(|&slot| triangles[slot as usize].id);
    slots
}

/// The WGSL of the module `path_tracer::all_triangles`.
pub(crate) fn all_triangles_wgsl(slots: &[u32]) -> String {
    let mut text = String::from(
        "// Generated: the triangles of the scene, one after the other.\n\
         import package::path_tracer::meet_triangle::{Hit, MeetingRay, meet_triangle};\n\
         fn meet_all_triangles(ray: MeetingRay, best: ptr<function, Hit>) {\n",
    );
    for slot in slots {
        let _ = writeln!(text, "    meet_triangle({slot}u, ray, best);");
    }
    text.push_str("}\n");
    text
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        gpu_scene::{GpuScene, PackOptions},
        scene::{AlphaMode, Material, Scene, framing::frame, shapes},
    };

    fn packed(quads: u32, exhaustive_limit: u32, alpha: AlphaMode) -> GpuScene {
        let mut scene = Scene { materials: vec![Material { alpha, ..Material::default() }], ..Scene::default() };
        for quad in 0..quads {
            // From right to left, so that the hierarchy has another order.
            shapes::quad(&mut scene, Vec3::NEG_X * quad as f32, Vec3::X * 0.5, Vec3::Y, 0);
        }
        let options = PackOptions { exhaustive_limit, ..PackOptions::default() };
        GpuScene::pack(&scene, &frame(scene.bounds(), 1.0), &options).expect("the scene packs")
    }

    // Kills: a triangle too many, a hierarchy that nobody walks, copies of what alpha reads, a module that is missing.
    #[test]
    fn small_scenes_without_alpha_do_without_a_hierarchy() {
        let cutout = AlphaMode::Mask { cutoff: 0.5 };
        for (quads, limit, alpha, expected) in [
            (4, 8, AlphaMode::Opaque, true),
            (4, 7, AlphaMode::Opaque, false),
            (4, 0, AlphaMode::Opaque, false),
            (4, 8, cutout, false),
            (0, 0, AlphaMode::Opaque, true),
        ] {
            let packed = packed(quads, limit, alpha);
            let has_module = packed.program_modules().iter().any(|module| module.path == "path_tracer::all_triangles");
            assert_eq!((packed.facts.exhaustive, has_module), (expected, expected), "{quads} quads, limit {limit}, {alpha:?}");
        }
    }

    // Kills: a triangle that is left out or asked twice, the order of the hierarchy, in which another one of those at the same distance wins.
    #[test]
    fn every_triangle_is_asked_once_in_the_order_of_the_scene() {
        let packed = packed(8, 16, AlphaMode::Opaque);
        let records: &[TriangleRecord] = bytemuck::cast_slice(&packed.triangles[..16 * size_of::<TriangleRecord>()]);
        let slots = slots_in_scene_order(records);
        assert_ne!(slots, (0..16).collect::<Vec<u32>>(), "the hierarchy has the order of the scene, which proves nothing");
        assert_eq!(slots.iter().map(|&slot| records[slot as usize].id).collect::<Vec<_>>(), (0..16).collect::<Vec<u32>>());
        let text = all_triangles_wgsl(&slots);
        let calls: Vec<_> = text.lines().filter_map(|line| line.trim().strip_prefix("meet_triangle(")).collect();
        assert_eq!(calls, slots.iter().map(|slot| format!("{slot}u, ray, best);")).collect::<Vec<_>>());
    }
}
