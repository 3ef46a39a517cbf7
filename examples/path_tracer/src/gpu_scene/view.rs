//! Where the scene is seen from, as the kernel's camera wants it: vectors of one pixel.

use glam::{Vec3, Vec4Swizzles as _};

use super::{error::Error, normalise::Normalisation, records::ViewRecord};
use crate::scene::{Camera, Projection};

/// The camera part of the uniform.
///
/// # Errors
/// When the camera is not finite.
pub(crate) fn of_camera(camera: &Camera, normalisation: &Normalisation, width: u32, height: u32) -> Result<ViewRecord, Error> {
    let matrix = camera.world_from_camera;
    let (right, up, forward) = (matrix.x_axis.xyz(), matrix.y_axis.xyz(), -matrix.z_axis.xyz());
    let (projection, half_height) = match camera.projection {
        Projection::Perspective { vertical_fov } => (0, (f64::from(vertical_fov) * 0.5).tan()),
        Projection::Orthographic { half_height } => (1, normalisation.length(half_height)),
    };
    let pixel = 2.0 * half_height / f64::from(height.max(1));
    let step = |axis: Vec3| (axis.as_dvec3().normalize_or_zero() * pixel).as_vec3().to_array();
    let view = ViewRecord {
        camera_origin: normalisation.point(matrix.w_axis.xyz()).to_array(),
        projection,
        camera_right: step(right),
        width,
        camera_up: step(up),
        height,
        camera_forward: forward.as_dvec3().normalize_or_zero().as_vec3().to_array(),
        ..ViewRecord::default()
    };
    let numbers = [view.camera_origin, view.camera_right, view.camera_up, view.camera_forward].concat();
    if numbers.iter().any(|value| !value.is_finite()) || pixel <= 0.0 {
        return Err(Error::OutOfRange { what: "camera", index: 0, value: format!("{camera:?}") });
    }
    Ok(view)
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Mat4};

    use super::*;

    // Kills: a field of view that spans the width, a half angle taken whole, a parallel camera that is not normalised.
    #[test]
    fn pixels_span_the_height() {
        let normalisation = Normalisation { centre: DVec3::X, scale: 0.5, radius: 1.0 };
        let camera = |projection| Camera { name: String::new(), world_from_camera: Mat4::from_translation(Vec3::X * 3.0), projection };
        let perspective = camera(Projection::Perspective { vertical_fov: std::f32::consts::FRAC_PI_2 });
        let view = of_camera(&perspective, &normalisation, 200, 100).expect("a good camera");
        assert!((view.camera_up[1] * 50.0 - 1.0).abs() < 1e-6 && (view.camera_right[0] * 50.0 - 1.0).abs() < 1e-6, "{view:?}");
        assert_eq!((view.camera_origin, view.camera_forward), ([1.0, 0.0, 0.0], [0.0, 0.0, -1.0]));
        let parallel = camera(Projection::Orthographic { half_height: 3.0 });
        let view = of_camera(&parallel, &normalisation, 200, 100).expect("a good camera");
        assert!((view.camera_up[1] * 50.0 - 1.5).abs() < 1e-6, "{view:?}");
    }
}
