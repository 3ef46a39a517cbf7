//! A camera for scenes that have none.
//!
//! Key decision: the distance is the smallest that keeps every corner of the bounding box inside the frustum, not that of a sphere
//! around the box, so that flat and long scenes fill the picture too.

use glam::{Mat4, Vec3};

use super::model::{Camera, Projection, Scene};
use super::validate::Bounds;

/// The name of a camera that no file contained.
pub const FRAMED: &str = "framed";
/// What is said of a scene that is seen by such a camera.
pub const NOTE: &str = "the file has no camera: the scene is framed from the front";

/// From the middle of the box towards the camera: the front (+Z), slightly right and above.
const TOWARDS_CAMERA: Vec3 = Vec3::new(0.35, 0.3, 1.0);
const VERTICAL_FOV: f32 = 0.7;
const MARGIN: f32 = 1.05;

/// A perspective camera that sees all of `bounds` in an image of the given width over height.
pub fn frame(bounds: Option<Bounds>, aspect: f32) -> Camera {
    let bounds = bounds.unwrap_or(Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE });
    // Halving before the sum keeps boxes at the end of the number range finite.
    let middle = bounds.min * 0.5 + bounds.max * 0.5;
    let half = (bounds.max * 0.5 - bounds.min * 0.5).max(Vec3::splat(1e-6 * middle.abs().max_element().max(1e-6)));
    let back = TOWARDS_CAMERA.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);

    // Each corner asks for its own distance; the farthest wish wins.
    let tan_y = (0.5 * VERTICAL_FOV).tan();
    let tan_x = tan_y * if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 };
    let mut distance = 0.0f32;
    for corner in 0..8 {
        let sign = |bit: u32| if corner & bit == 0 { -1.0 } else { 1.0 };
        let offset = half * Vec3::new(sign(1), sign(2), sign(4));
        let needed = (offset.dot(right).abs() / tan_x).max(offset.dot(up).abs() / tan_y) * MARGIN;
        distance = distance.max(offset.dot(back) + needed);
    }
    let eye = (middle + back * distance).clamp(Vec3::splat(f32::MIN), Vec3::splat(f32::MAX));
    Camera {
        name: String::from(FRAMED),
        world_from_camera: Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), eye.extend(1.0)),
        projection: Projection::Perspective { vertical_fov: VERTICAL_FOV },
    }
}

impl Scene {
    /// Fits the framed camera to an image of the given width over height; cameras of the file stay as they are.
    pub fn reframe(&mut self, aspect: f32) {
        self.reframe_around(self.bounds(), aspect);
    }

    /// [`reframe`](Self::reframe) around something else than this scene: another moment of it.
    pub fn reframe_around(&mut self, bounds: Option<Bounds>, aspect: f32) {
        for camera in self.cameras.iter_mut().filter(|camera| camera.name == FRAMED) {
            *camera = frame(bounds, aspect);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn widest(bounds: Bounds, aspect: f32) -> f32 {
        let camera = frame(Some(bounds), aspect);
        let camera_from_world = camera.world_from_camera.inverse();
        let tan_y = (0.5 * VERTICAL_FOV).tan();
        let mut widest = 0.0f32;
        for corner in 0..8 {
            let pick = |bit: u32, axis: usize| if corner & bit == 0 { bounds.min[axis] } else { bounds.max[axis] };
            let seen = camera_from_world.transform_point3(Vec3::new(pick(1, 0), pick(2, 1), pick(4, 2)));
            assert!(seen.z < 0.0, "corner {corner} lies behind the camera");
            widest = widest.max(seen.x.abs() / (-seen.z * tan_y * aspect)).max(seen.y.abs() / (-seen.z * tan_y));
        }
        widest
    }

    // Kills: swapping width and height, a distance from the middle instead of from the corners, and a far too large margin.
    #[test]
    fn every_corner_is_visible_and_the_picture_is_filled() {
        let cube = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let long = Bounds { min: Vec3::new(-50.0, 3.0, -1.0), max: Vec3::new(50.0, 4.0, 1.0) };
        let flat = Bounds { min: Vec3::new(0.0, 5.0, 0.0), max: Vec3::new(10.0, 5.0, 10.0) };
        for bounds in [cube, long, flat] {
            for aspect in [0.5, 1.0, 2.0] {
                let widest = widest(bounds, aspect);
                assert!(widest <= 1.0 && widest > 0.8, "{bounds:?} at {aspect}: {widest}");
            }
        }
    }

    // Kills: a division by zero for a scene of one point or of nothing.
    #[test]
    fn scenes_without_extent_have_a_camera() {
        for bounds in [None, Some(Bounds { min: Vec3::ZERO, max: Vec3::ZERO }), Some(Bounds { min: Vec3::MAX, max: Vec3::MAX })] {
            assert!(frame(bounds, 1.0).world_from_camera.is_finite(), "{bounds:?}");
        }
    }
}
