//! Options that say whence the scene is seen.
//!
//! Key decision: a place given by hand replaces the whole camera; a field of view alone changes the lens of the one that there is.

use glam::{Mat4, Vec3};
use path_tracer::scene::{Camera, Projection, Scene, framing::NOTE};

use super::{Failure, value};

#[derive(Debug, clap::Args)]
pub(crate) struct ViewArguments {
    /// A camera of the scene by its name; the first one when not given.
    #[arg(long, value_name = "NAME", conflicts_with = "look_from")]
    camera: Option<String>,
    /// Where a camera of your own stands, in metres.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = value::vector, requires = "look_at")]
    look_from: Option<Vec3>,
    /// What it looks at.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = value::vector, requires = "look_from")]
    look_at: Option<Vec3>,
    /// What it has above itself; 0,1,0 when not given.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = value::vector, requires = "look_from")]
    up: Option<Vec3>,
    /// Vertical field of view; the camera's own when not given, 40 for one of your own.
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = value::field_of_view)]
    fov: Option<f32>,
}

/// The field of view of a camera of which only the place is given.
const DEGREES: f32 = 40.0;

impl ViewArguments {
    /// What a scene says of itself, without what it says of a camera that is not used.
    pub(crate) fn notes<'a>(&self, scene: &'a Scene) -> impl Iterator<Item = &'a String> {
        let is_chosen = self.look_from.is_some() || self.camera.is_some();
        scene.warnings.iter().filter(move |line| !(is_chosen && *line == NOTE))
    }

    /// The camera that is asked for; `None` when it is the scene's first.
    pub(crate) fn camera(&self, scene: &Scene) -> Result<Option<Camera>, Failure> {
        let mut camera = match (&self.camera, self.look_from, self.look_at) {
            (_, Some(from), Some(at)) => Some(look(from, at, self.up, self.fov.unwrap_or(DEGREES))?),
            (Some(name), ..) => Some(named(scene, name)?),
            _ if self.fov.is_some() => scene.cameras.first().cloned(),
            _ => None,
        };
        if let (Some(degrees), Some(camera)) = (self.fov, &mut camera) {
            match &mut camera.projection {
                Projection::Perspective { vertical_fov } => *vertical_fov = degrees.to_radians(),
                Projection::Orthographic { .. } => {
                    return Err(Failure::Usage(format!("--fov {degrees}: camera '{}' is parallel and has no angle", camera.name)));
                }
            }
        }
        Ok(camera)
    }
}

fn named(scene: &Scene, name: &str) -> Result<Camera, Failure> {
    let found = scene.cameras.iter().find(|camera| camera.name == name);
    found.cloned().ok_or_else(|| {
        let names: Vec<String> = scene.cameras.iter().map(|camera| format!("'{}'", camera.name)).collect();
        Failure::Usage(format!("--camera {name}: no such camera; the scene has {}", names.join(", ")))
    })
}

fn look(from: Vec3, at: Vec3, up: Option<Vec3>, degrees: f32) -> Result<Camera, Failure> {
    let up_asked = up.unwrap_or(Vec3::Y);
    // In doubles, because places may be far from the origin and close to each other.
    let back = (from.as_dvec3() - at.as_dvec3()).try_normalize();
    let back = back.ok_or_else(|| Failure::Usage(format!("--look-at {}: it is where the camera stands", spelled(at))))?;
    let right = up_asked.as_dvec3().cross(back);
    if right.length() <= 1e-6 * up_asked.as_dvec3().length() || up_asked == Vec3::ZERO {
        let what = "it should have a length and not lie along the line of sight; choose another one with --up";
        return Err(Failure::Usage(format!("--up {}: {what}", spelled(up_asked))));
    }
    let right = right.normalize();
    let up = back.cross(right);
    let axis = |axis: glam::DVec3| axis.as_vec3().extend(0.0);
    Ok(Camera {
        name: String::from("look-at"),
        world_from_camera: Mat4::from_cols(axis(right), axis(up), axis(back), from.extend(1.0)),
        projection: Projection::Perspective { vertical_fov: degrees.to_radians() },
    })
}

fn spelled(vector: Vec3) -> String {
    format!("{},{},{}", vector.x, vector.y, vector.z)
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    // Kills: a camera that looks away, a picture upside down or mirrored, an up that is not straightened.
    #[test]
    fn a_camera_looks_where_it_is_told() {
        let camera = look(vec3(1.0, 2.0, 3.0), vec3(1.0, 2.0, -4.0), Some(vec3(0.0, 5.0, 5.0)), 90.0).unwrap_or_else(|e| panic!("{e}"));
        assert!(camera.world_from_camera.abs_diff_eq(Mat4::from_translation(vec3(1.0, 2.0, 3.0)), 1e-6), "{camera:?}");
        assert_eq!(camera.projection, Projection::Perspective { vertical_fov: std::f32::consts::FRAC_PI_2 });
        let camera = look(vec3(0.0, 0.0, 0.0), vec3(3.0, 0.0, 0.0), None, 40.0).unwrap_or_else(|e| panic!("{e}"));
        assert!((camera.world_from_camera.transform_vector3(Vec3::X) - Vec3::Z).length() < 1e-6);
    }

    // Kills: a camera of NaN, from a place equal to what it looks at or an up along the line of sight.
    #[test]
    fn impossible_views_are_refused() {
        let text = |outcome: Result<Camera, Failure>| outcome.err().map(|failure| failure.to_string()).unwrap_or_default();
        assert!(text(look(Vec3::ONE, Vec3::ONE, None, 40.0)).starts_with("--look-at 1,1,1"));
        assert!(text(look(Vec3::ZERO, Vec3::Y, None, 40.0)).starts_with("--up 0,1,0"));
        assert!(text(look(Vec3::ZERO, Vec3::X, Some(Vec3::ZERO), 40.0)).starts_with("--up 0,0,0"));
    }
}
