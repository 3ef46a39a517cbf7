//! Moves a primitive from its own space into the world, as a whole or vertex by vertex as its joints say.
//!
//! Key decision: transforms are applied in f64 and rounded once. Normals go through the cofactor matrix, which exists for every
//! transform, also for one that flattens; it equals the inverse transpose but for a positive factor and the sign of the determinant.
//!
//! **Invariant:** a transform that mirrors flips the winding, the normals with it, and the sign of the bitangents, so that what was the
//! front stays the front.

use glam::{DMat3, DMat4, DVec3, Vec4};

use super::super::model::{Scene, Triangle, Vertex};
use super::mesh::{Primitive, perpendicular};
use crate::error::Fault;

/// What takes the vertices of a primitive into the world.
pub(super) enum Transforms<'a> {
    /// The same for all.
    Rigid(DMat4),
    /// One for each vertex of the file's primitive.
    Skinned(&'a [DMat4]),
}

impl Transforms<'_> {
    fn of(&self, source: u32) -> DMat4 {
        match self {
            Transforms::Rigid(matrix) => *matrix,
            Transforms::Skinned(matrices) => matrices.get(source as usize).copied().unwrap_or(DMat4::IDENTITY),
        }
    }

    /// True when most vertices are mirrored: single ones of a badly bent skin do not turn the whole inside out.
    fn mirrors(&self) -> bool {
        let mirrors = |matrix: &DMat4| DMat3::from_mat4(*matrix).determinant() < 0.0;
        match self {
            Transforms::Rigid(matrix) => mirrors(matrix),
            Transforms::Skinned(matrices) => 2 * matrices.iter().filter(|matrix| mirrors(matrix)).count() > matrices.len(),
        }
    }
}

/// Appends a primitive to the scene.
pub(super) fn bake(scene: &mut Scene, primitive: &Primitive, transforms: &Transforms<'_>) -> Result<(), Fault> {
    let mirrored = transforms.mirrors();
    let sign = if mirrored { -1.0 } else { 1.0 };
    // The corners of a flat triangle would each turn its normal by their own joints; so it is computed anew.
    let reshaped = primitive.flat && matches!(transforms, Transforms::Skinned(_));

    let base = u32::try_from(scene.vertices.len()).map_err(|_| Fault::unsupported("size", "a scene with so many vertices"))?;
    let mut moved = Primitive { vertices: Vec::with_capacity(primitive.vertices.len()), ..Primitive::default() };
    for (index, (vertex, &source)) in primitive.vertices.iter().zip(&primitive.sources).enumerate() {
        let world_from_mesh = transforms.of(source);
        let position = world_from_mesh.transform_point3(vertex.position.as_dvec3()).as_vec3();
        if !position.is_finite() {
            return Err(Fault::invalid("POSITION", format_args!("vertex {index} is not finite after its node's transform")));
        }
        let linear = DMat3::from_mat4(world_from_mesh);
        let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
        let cofactor = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        let normal = if reshaped { DVec3::ZERO } else { cofactor * vertex.normal.as_dvec3() };
        let normal = normal.normalize_or_zero().as_vec3();
        moved.vertices.push(Vertex { position, normal, ..*vertex });
    }
    moved.triangles = primitive.triangles.iter().map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }).collect();
    moved.repair_normals();

    for (vertex, &source) in moved.vertices.iter_mut().zip(&primitive.sources).filter(|(v, _)| v.tangent != Vec4::ZERO) {
        let linear = DMat3::from_mat4(transforms.of(source));
        // Unequal scales bend the right angle between normal and tangent.
        let tangent = (linear * vertex.tangent.truncate().as_dvec3()).normalize_or_zero().as_vec3();
        let tangent = tangent.reject_from_normalized(vertex.normal).normalize_or(perpendicular(vertex.normal));
        vertex.tangent = tangent.extend(vertex.tangent.w * sign as f32);
    }
    scene.vertices.append(&mut moved.vertices);
    let material = primitive.material;
    scene.triangles.extend(moved.triangles.iter().map(|t| Triangle { vertices: t.map(|v| base + v), material }));
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    fn corner(position: Vec3) -> Vertex {
        Vertex { position, normal: Vec3::Z, tangent: Vec4::new(1.0, 0.0, 0.0, 1.0), uv: [Vec2::ZERO; 2], color: Vec4::ONE }
    }

    fn baked(transform: DMat4) -> Scene {
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y].map(corner).to_vec();
        let mut scene = Scene::default();
        let primitive = Primitive { vertices, triangles: vec![[0, 1, 2]], sources: vec![0, 1, 2], ..Primitive::default() };
        bake(&mut scene, &primitive, &Transforms::Rigid(transform)).unwrap();
        scene
    }

    // Kills: no flip of the winding for mirrors, normals that turn inside out, and bitangents that keep their sign.
    #[test]
    fn mirrors_keep_front_and_bitangent() {
        for scale in [DVec3::new(1.0, 1.0, 1.0), DVec3::new(-1.0, 2.0, 1.0), DVec3::new(1.0, 1.0, -3.0), DVec3::new(-1.0, -1.0, -1.0)] {
            let transform = DMat4::from_rotation_y(0.7) * DMat4::from_scale(scale);
            let scene = baked(transform);
            let [a, b, c] = scene.triangles[0].vertices.map(|v| scene.vertices[v as usize].position);
            let vertex = scene.vertices[0];
            assert!((b - a).cross(c - a).dot(vertex.normal) > 0.0, "{scale}");
            let bitangent = vertex.normal.cross(vertex.tangent.truncate()) * vertex.tangent.w;
            let expected = transform.transform_vector3(DVec3::Y).as_vec3();
            assert!(bitangent.dot(expected) > 0.99 * expected.length(), "{scale}: {bitangent} against {expected}");
        }
    }

    // Kills: normals moved like directions, which unequal scales tilt, and NaN from a transform without an inverse.
    #[test]
    fn normals_stay_perpendicular_and_finite() {
        let shear = DMat4::from_cols_array(&[1., 0., 0.5, 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]);
        for transform in [shear, DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0)), DMat4::from_scale(DVec3::new(0.0, 1.0, 1.0))] {
            let scene = baked(transform);
            let [a, b, c] = scene.triangles[0].vertices.map(|v| scene.vertices[v as usize].position);
            let normal = scene.vertices[0].normal;
            assert!(normal.is_finite() && (b - a).dot(normal).abs() < 1e-6 && (c - a).dot(normal).abs() < 1e-6);
        }
        assert!(baked(shear).vertices[0].normal.is_normalized());
    }
}
