//! Lights without extent and cameras: what a node places besides a mesh.
//!
//! Key decision: only the rotation and the position of the node reach them, as the format says; a scale would make no sense for a lens.

use glam::{DMat3, DMat4, DVec3, Mat4, Vec3};

use super::super::model::{Camera, LightKind, Projection, PunctualLight};
use super::Warnings;
use super::json;
use crate::error::Fault;

/// Right, up and back of the node as unit vectors; the identity when the transform flattens them away.
fn frame(world_from_node: DMat4) -> DMat3 {
    let linear = DMat3::from_mat4(world_from_node);
    let back = linear.z_axis.normalize_or(DVec3::Z);
    let up = linear.y_axis.reject_from_normalized(back).normalize_or_zero();
    if up == DVec3::ZERO {
        return DMat3::IDENTITY;
    }
    DMat3::from_cols(up.cross(back), up, back)
}

/// A camera of the file at the place of its node.
pub(super) fn camera(camera: &json::Camera, node_name: Option<&str>, fallback: &str, world_from_node: DMat4) -> Result<Camera, Fault> {
    let projection = match (camera.kind.as_str(), &camera.perspective, &camera.orthographic) {
        ("perspective", Some(lens), _) => Projection::Perspective { vertical_fov: lens.yfov },
        ("orthographic", _, Some(lens)) => Projection::Orthographic { half_height: lens.ymag.abs() },
        (kind, ..) => return Err(Fault::invalid("type", format_args!("'{kind}' comes without its lens"))),
    };
    let name = camera.name.as_deref().or(node_name).filter(|name| !name.is_empty()).unwrap_or(fallback);
    let rotation = frame(world_from_node);
    let rigid = DMat4::from_mat3_translation(rotation, world_from_node.w_axis.truncate());
    let columns = rigid.to_cols_array().map(|x| x as f32);
    Ok(Camera { name: String::from(name), world_from_camera: Mat4::from_cols_array(&columns), projection })
}

/// A light of KHR_lights_punctual at the place of its node.
pub(super) fn light(light: &json::Light, place: &str, world_from_node: DMat4, warnings: &mut Warnings) -> Result<PunctualLight, Fault> {
    let kind = match light.kind.as_str() {
        "point" => LightKind::Point,
        "directional" => LightKind::Directional,
        "spot" => {
            let outer = light.spot.outer_cone_angle.unwrap_or(std::f32::consts::FRAC_PI_4);
            let inner = light.spot.inner_cone_angle.unwrap_or(0.0);
            let right_angle = std::f32::consts::FRAC_PI_2;
            // Cones of angle zero or that open further than a half space have no falloff that could be computed.
            if !(0.0 <= inner && inner < outer && outer <= right_angle * 1.0001) {
                warnings.push(format!("{place}: the cone angles {inner} and {outer} are out of order or range and are moved"));
            }
            let outer = outer.clamp(1e-3, right_angle);
            LightKind::Spot { inner: inner.clamp(0.0, outer * 0.999), outer }
        }
        kind => return Err(Fault::invalid("type", format_args!("'{kind}' is no light"))),
    };
    let color = Vec3::from_array(light.color.unwrap_or([1.0; 3]));
    let intensity = color * light.intensity.unwrap_or(1.0);
    if intensity.cmplt(Vec3::ZERO).any() {
        warnings.push(format!("{place}: negative light becomes none"));
    }
    let range = match light.range {
        Some(range) if range > 0.0 => range,
        Some(range) => {
            warnings.push(format!("{place}: the range {range} is not positive and is left out"));
            f32::INFINITY
        }
        None => f32::INFINITY,
    };
    Ok(PunctualLight {
        kind,
        position: world_from_node.w_axis.truncate().as_vec3(),
        direction: -frame(world_from_node).z_axis.as_vec3(),
        intensity: intensity.max(Vec3::ZERO),
        range,
        profile: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a scale, a mirror or a shear that reaches the camera, and a camera that loses its direction.
    #[test]
    fn cameras_are_rigid_and_keep_looking_where_the_node_looks() {
        let shear = DMat4::from_cols_array(&[1., 0., 0., 0., 0.3, 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]);
        for transform in [DMat4::from_scale(DVec3::new(5.0, -2.0, 0.1)), DMat4::from_scale(DVec3::splat(-1.0)), shear, DMat4::ZERO] {
            let rotation = frame(transform);
            assert!((rotation.determinant() - 1.0).abs() < 1e-12);
            let looks = transform.transform_vector3(DVec3::NEG_Z);
            assert!(looks == DVec3::ZERO || (-rotation.z_axis).dot(looks.normalize()) > 0.999);
        }
    }

    // Kills: candela that forget the colour, light that leaves through +Z, and a spot whose falloff divides by zero.
    #[test]
    fn a_spot_is_read_in_full() {
        let spot = json::Spot { inner_cone_angle: Some(0.5), outer_cone_angle: Some(0.5) };
        let source = json::Light {
            kind: String::from("spot"),
            color: Some([1.0, 0.5, 0.0]),
            intensity: Some(8.0),
            range: None,
            spot,
            extras: Default::default(),
        };
        let mut warnings = Warnings::default();
        let made = light(&source, "light 0", DMat4::from_translation(DVec3::X), &mut warnings).unwrap();
        assert_eq!((made.position, made.direction, made.intensity), (Vec3::X, Vec3::NEG_Z, Vec3::new(8.0, 4.0, 0.0)));
        assert!(matches!(made.kind, LightKind::Spot { inner, outer } if inner < outer));
        assert_eq!(warnings.lines().len(), 1);
    }
}
