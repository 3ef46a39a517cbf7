//! Triangles and vertex attributes as one buffer.
//!
//! Key decision: a triangle carries its corners, so that the walk reads nine contiguous words and no index; attributes are shared per vertex
//! and hold only what the scene's materials ask for. Corners are sorted: two triangles run through a common edge in the same direction, which
//! the walk's test relies on; a flag says whether that turned the triangle over.
//!
//! **Invariant:** every packed triangle has an area and finite corners; what is dropped is counted.

use glam::Vec3;

use super::{
    effects::Effects,
    error::Error,
    hierarchy::Hierarchy,
    materials,
    normalise::Normalisation,
    records::{MaterialRecord, NONE, TriangleRecord, triangle_flags},
};
use crate::scene::{Scene, Vertex};

/// Triangles in the order of the hierarchy's leaves.
#[derive(Clone, Debug)]
pub(crate) struct Geometry {
    pub(crate) hierarchy: Hierarchy,
    pub(crate) triangles: Vec<TriangleRecord>,
    /// Normalised, per slot.
    pub(crate) areas: Vec<f64>,
}

/// Normalises, drops what has no area, and sorts the rest into leaves.
pub(crate) fn pack(
    scene: &Scene,
    normalisation: &Normalisation,
    materials: &[MaterialRecord],
    warnings: &mut Vec<String>,
) -> Result<Geometry, Error> {
    let (mut corners, mut kept) = (Vec::with_capacity(scene.triangles.len()), Vec::with_capacity(scene.triangles.len()));
    for (index, triangle) in scene.triangles.iter().enumerate() {
        if triangle.material as usize >= materials.len() {
            let (value, count) = (triangle.material, materials.len());
            return Err(Error::Dangling { what: "triangle", index, target: "material", value, count });
        }
        let mut positions = [Vec3::ZERO; 3];
        for (position, &value) in positions.iter_mut().zip(&triangle.vertices) {
            let count = scene.vertices.len();
            let vertex = scene.vertices.get(value as usize);
            let vertex = vertex.ok_or(Error::Dangling { what: "triangle", index, target: "vertex", value, count })?;
            *position = normalisation.point(vertex.position);
            if !position.is_finite() {
                return Err(Error::OutOfRange { what: "position of vertex", index: value as usize, value: vertex.position.to_string() });
            }
        }
        if has_area(&positions) {
            corners.push(positions);
            kept.push(index);
        }
    }
    if kept.len() < scene.triangles.len() {
        warnings.push(format!("{} triangles have no area and were dropped", scene.triangles.len() - kept.len()));
    }
    let hierarchy = Hierarchy::build(&corners)?;
    let record = |&leaf: &u32| {
        let id = kept[leaf as usize];
        let triangle = scene.triangles[id];
        let (order, is_clockwise) = canonical_order(&corners[leaf as usize]);
        let [v0, [v1_x, a, b], [c, d, v2_z]] = order.map(|corner| corners[leaf as usize][corner].to_array());
        let turn = if is_clockwise { triangle_flags::CLOCKWISE } else { 0 };
        let material = triangle.material | flags(&materials[triangle.material as usize]) | turn;
        let vertices = order.map(|corner| triangle.vertices[corner]);
        TriangleRecord { v0, v1_x, v1_yz_v2_xy: [a, b, c, d], v2_z, id: id as u32, material, light: NONE, vertices, pad: 0 }
    };
    let triangles = hierarchy.order.iter().map(record).collect();
    let areas = hierarchy.order.iter().map(|&leaf| doubled_area(&corners[leaf as usize]) * 0.5).collect();
    Ok(Geometry { hierarchy, triangles, areas })
}

/// The corners from the least to the greatest, by x, then y, then z, and whether that turns a triangle over.
fn canonical_order(corners: &[Vec3; 3]) -> ([usize; 3], bool) {
    let mut order = [0, 1, 2];
    let key = |corner: usize| corners[corner].to_array();
    order.sort_by(|&a, &b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
    (order, matches!(order, [0, 2, 1] | [1, 0, 2] | [2, 1, 0]))
}

fn flags(material: &MaterialRecord) -> u32 {
    let mut flags = 0;
    if materials::has_alpha(material) {
        flags |= triangle_flags::ALPHA;
    }
    if materials::is_emissive(material) {
        flags |= triangle_flags::EMISSIVE;
    }
    flags
}

fn doubled_area(corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a).length()
}

/// Large enough, relative to its longest edge, for a normal in `f32`; and not smaller than what `f32` can square twice.
fn has_area(corners: &[Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    longest > 2f64.powi(-100) && doubled_area(corners).powi(2) > 2f64.powi(-100) * longest * longest
}

/// The attributes of all vertices, in rows of four words.
pub(crate) fn vertex_rows(vertices: &[Vertex], effects: &Effects) -> Vec<[f32; 4]> {
    let mut rows = Vec::with_capacity(vertices.len() * effects.vertex_rows() as usize);
    for vertex in vertices {
        rows.push(vertex.normal.extend(0.0).to_array());
        if effects.textures {
            let [first, second] = vertex.uv;
            rows.push([first.x, first.y, second.x, second.y]);
        }
        if effects.normal_maps {
            rows.push(vertex.tangent.to_array());
        }
        if effects.vertex_colors {
            rows.push(vertex.color.to_array().map(|value| value.clamp(0.0, 1.0)));
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Triangle};

    fn scene(points: &[Vec3], triangles: &[[u32; 3]]) -> Scene {
        Scene {
            vertices: points.iter().map(|&position| Vertex { position, ..Vertex::default() }).collect(),
            triangles: triangles.iter().map(|&vertices| Triangle { vertices, material: 0 }).collect(),
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    fn packed(scene: &Scene) -> (Result<Geometry, Error>, Vec<String>) {
        let mut warnings = Vec::new();
        let normalisation = Normalisation::of(scene.vertices.iter().map(|vertex| vertex.position));
        (pack(scene, &normalisation, &[MaterialRecord::default()], &mut warnings), warnings)
    }

    // Kills: a needle that divides by zero, a drop without a count, an id that counts kept triangles only.
    #[test]
    fn triangles_without_area_are_dropped_and_counted() {
        let points = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X * 2.0];
        let (geometry, warnings) = packed(&scene(&points, &[[0, 1, 3], [0, 0, 1], [0, 1, 2]]));
        let geometry = geometry.expect("one good triangle");
        assert_eq!(geometry.triangles.iter().map(|triangle| triangle.id).collect::<Vec<_>>(), [2]);
        assert_eq!(warnings, ["2 triangles have no area and were dropped"]);
    }

    // Kills: corners left as they are, a flag that is set for the other half of the orders, attributes that stay behind.
    #[test]
    fn corners_are_sorted_and_their_sense_is_kept() {
        let points = [Vec3::new(0.5, -1.0, 0.0), Vec3::new(0.5, -1.0, -0.25), Vec3::new(-0.5, 0.5, 0.125)];
        for triangle in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            let (geometry, _) = packed(&scene(&points, &[triangle]));
            let record = geometry.expect("one triangle").triangles[0];
            let [a, b, c, d] = record.v1_yz_v2_xy;
            let corners = [Vec3::from(record.v0), Vec3::new(record.v1_x, a, b), Vec3::new(c, d, record.v2_z)];
            let normalisation = Normalisation::of(points.into_iter());
            assert_eq!(record.vertices, [2, 1, 0]);
            assert_eq!(corners, [2, 1, 0].map(|index: usize| normalisation.point(points[index])));
            let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a);
            let front = normal(triangle.map(|index| points[index as usize]));
            let is_clockwise = record.material & triangle_flags::CLOCKWISE != 0;
            assert_eq!(normal(corners).dot(front) < 0.0, is_clockwise, "{triangle:?}");
        }
    }

    // Kills: an index that is looked up without a check.
    #[test]
    fn dangling_indices_are_errors() {
        let (geometry, _) = packed(&scene(&[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 3]]));
        assert_eq!(geometry.expect_err("vertex 3 of 3").to_string(), "triangle 0 refers to vertex 3, there are 3");
    }
}
