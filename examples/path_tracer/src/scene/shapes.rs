//! Simple bodies as triangles: what the built-in scenes and the tests are made of.
//!
//! Key decision: functions that append to a [`Scene`]; there is no mesh type besides it.
//!
//! **Invariant:** all bodies are closed or flat, wound counter-clockwise seen from outside, with unit normals that agree.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};

use super::model::{Scene, Triangle, Vertex};

/// Appends a parallelogram with corners `corner`, `corner + u`, `corner + u + v`, `corner + v`; its front is the side `u x v` points to.
pub fn quad(scene: &mut Scene, corner: Vec3, u: Vec3, v: Vec3, material: u32) {
    let normal = u.cross(v).normalize_or_zero();
    let base = next_vertex(scene);
    for uv in [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y] {
        // Rows of images start at the top, v of a surface at its lower edge.
        push_vertex(scene, corner + u * uv.x + v * uv.y, normal, Vec2::new(uv.x, 1.0 - uv.y));
    }
    push_triangles(scene, base, &[[0, 1, 2], [0, 2, 3]], material);
}

/// Appends a box around `center` with the given half edges, turned by `angle` radians about +Y; its front is outside.
pub fn cuboid(scene: &mut Scene, center: Vec3, half: Vec3, angle: f32, material: u32) {
    let (sin, cos) = angle.sin_cos();
    let x = Vec3::new(cos, 0.0, -sin) * half.x;
    let y = Vec3::Y * half.y;
    let z = Vec3::new(sin, 0.0, cos) * half.z;
    for (out, u, v) in [(x, y, z), (y, z, x), (z, x, y)] {
        quad(scene, center + out - u - v, 2.0 * u, 2.0 * v, material);
        quad(scene, center - out - u - v, 2.0 * v, 2.0 * u, material);
    }
}

/// Appends a room: the box of [`cuboid`] without a turn, whose front is inside. The materials are those of the walls
/// -X, +X, -Y, +Y, -Z and +Z.
pub fn room(scene: &mut Scene, min: Vec3, max: Vec3, materials: [u32; 6]) {
    let size = max - min;
    let edges = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    for axis in 0..3 {
        let (u, v) = (edges[(axis + 1) % 3], edges[(axis + 2) % 3]);
        quad(scene, min, u, v, materials[2 * axis]);
        quad(scene, min + edges[axis], v, u, materials[2 * axis + 1]);
    }
}

/// Appends a sphere of `rings` x `segments` facets with smooth normals; at least 2 x 3 are made.
pub fn uv_sphere(scene: &mut Scene, center: Vec3, radius: f32, rings: u32, segments: u32, material: u32) {
    let (rings, segments) = (rings.max(2), segments.max(3));
    let base = next_vertex(scene);
    for ring in 0..=rings {
        for segment in 0..=segments {
            let uv = Vec2::new(segment as f32 / segments as f32, ring as f32 / rings as f32);
            let (sin_polar, cos_polar) = (uv.y * std::f32::consts::PI).sin_cos();
            // The last column repeats the first one bit for bit, so that the sphere has no gap.
            let turn = (segment % segments) as f32 / segments as f32;
            let (sin, cos) = (turn * std::f32::consts::TAU).sin_cos();
            let polar = if ring == rings { Vec3::NEG_Y } else { Vec3::new(sin_polar * sin, cos_polar, sin_polar * cos) };
            let normal = polar.normalize();
            push_vertex(scene, center + normal * radius, normal, uv);
        }
    }
    for ring in 0..rings {
        for segment in 0..segments {
            let upper = ring * (segments + 1) + segment;
            let lower = upper + segments + 1;
            // The facets at the poles are triangles.
            if ring > 0 {
                push_triangles(scene, base, &[[upper, lower, upper + 1]], material);
            }
            if ring + 1 < rings {
                push_triangles(scene, base, &[[upper + 1, lower, lower + 1]], material);
            }
        }
    }
}

/// Appends an upright cylinder with smooth sides and flat caps, its foot centred at `foot`; at least 3 segments are made.
pub fn cylinder(scene: &mut Scene, foot: Vec3, radius: f32, height: f32, segments: u32, material: u32) {
    let segments = segments.max(3);
    let top = Vec3::Y * height;
    let around: Vec<Vec3> = (0..segments)
        .map(|segment| {
            let (sin, cos) = (segment as f32 / segments as f32 * std::f32::consts::TAU).sin_cos();
            Vec3::new(sin, 0.0, cos)
        })
        .collect();
    let side = next_vertex(scene);
    // The last column repeats the first one bit for bit.
    for segment in 0..=segments {
        let (normal, u) = (around[(segment % segments) as usize], segment as f32 / segments as f32);
        push_vertex(scene, foot + normal * radius, normal, Vec2::new(u, 1.0));
        push_vertex(scene, foot + normal * radius + top, normal, Vec2::new(u, 0.0));
    }
    for segment in 0..segments {
        let lower = 2 * segment;
        push_triangles(scene, side, &[[lower, lower + 2, lower + 3], [lower, lower + 3, lower + 1]], material);
    }
    for (center, normal) in [(foot, Vec3::NEG_Y), (foot + top, Vec3::Y)] {
        let cap = next_vertex(scene);
        push_vertex(scene, center, normal, Vec2::splat(0.5));
        for out in &around {
            push_vertex(scene, center + *out * radius, normal, Vec2::new(0.5 + 0.5 * out.x, 0.5 + 0.5 * out.z));
        }
        for segment in 0..segments {
            let (one, next) = (1 + segment, 1 + (segment + 1) % segments);
            let facet = if normal.y > 0.0 { [0, one, next] } else { [0, next, one] };
            push_triangles(scene, cap, &[facet], material);
        }
    }
}

/// Appends a sphere of 20 x 4^`subdivisions` nearly equal facets with smooth normals.
pub fn icosphere(scene: &mut Scene, center: Vec3, radius: f32, subdivisions: u32, material: u32) {
    let golden = (1.0 + 5f32.sqrt()) / 2.0;
    let mut points: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        points.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)].map(Vec3::normalize));
    }
    let mut facets = hull_of_icosahedron(&points);
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut finer = Vec::with_capacity(4 * facets.len());
        for &[a, b, c] in &facets {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(from, to)| {
                *middles.entry((from.min(to), from.max(to))).or_insert_with(|| {
                    points.push((points[from as usize] + points[to as usize]).normalize());
                    points.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        facets = finer;
    }
    let base = next_vertex(scene);
    for normal in points {
        let around = normal.x.atan2(normal.z) / std::f32::consts::TAU;
        let uv = Vec2::new(around - around.floor(), normal.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI);
        push_vertex(scene, center + normal * radius, normal, uv);
    }
    push_triangles(scene, base, &facets, material);
}

/// The 20 facets: all triples of points that are neighbours of each other, wound outwards.
fn hull_of_icosahedron(points: &[Vec3]) -> Vec<[u32; 3]> {
    // The cosine between neighbours is 1/sqrt(5), between others -1/sqrt(5) or -1.
    let near = |a: usize, b: usize| points[a].dot(points[b]) > 0.4;
    let mut facets = Vec::with_capacity(20);
    for a in 0..points.len() {
        for b in a + 1..points.len() {
            for c in b + 1..points.len() {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outwards = (points[b] - points[a]).cross(points[c] - points[a]).dot(points[a]) > 0.0;
                    let [a, b, c] = [a as u32, b as u32, c as u32];
                    facets.push(if outwards { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    facets
}

fn next_vertex(scene: &Scene) -> u32 {
    u32::try_from(scene.vertices.len()).unwrap_or(u32::MAX)
}

fn push_vertex(scene: &mut Scene, position: Vec3, normal: Vec3, uv: Vec2) {
    // Everything here may carry a normal map, so a tangent along u is always there.
    let along_u = if normal.y.abs() < 0.999 { Vec3::Y.cross(normal).normalize() } else { Vec3::X };
    scene.vertices.push(Vertex { position, normal, tangent: along_u.extend(1.0), uv: [uv; 2], color: Vec4::ONE });
}

fn push_triangles(scene: &mut Scene, base: u32, triangles: &[[u32; 3]], material: u32) {
    scene.triangles.extend(triangles.iter().map(|t| Triangle { vertices: t.map(|v| base + v), material }));
}

#[cfg(test)]
mod tests {
    use super::super::model::Material;
    use super::*;

    fn made(make: impl FnOnce(&mut Scene)) -> Scene {
        let mut scene = Scene { materials: vec![Material::default(); 6], ..Scene::default() };
        make(&mut scene);
        scene.validate().unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        scene
    }

    fn corners(scene: &Scene, triangle: &Triangle) -> [Vec3; 3] {
        triangle.vertices.map(|v| scene.vertices[v as usize].position)
    }

    /// Positive when the surface is wound outwards.
    fn volume(scene: &Scene) -> f32 {
        scene.triangles.iter().map(|t| corners(scene, t)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    // Kills: a face wound the wrong way, a missing or double face, and a turn that scales.
    #[test]
    fn bodies_enclose_their_volume() {
        let center = Vec3::new(3.0, -2.0, 1.0);
        let cube = made(|s| cuboid(s, center, Vec3::new(1.0, 2.0, 0.5), 0.6, 0));
        assert!((volume(&cube) - 8.0).abs() < 1e-4 && cube.triangles.len() == 12);
        let room = made(|s| room(s, Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), [0, 1, 2, 3, 4, 5]));
        assert!((volume(&room) + 6.0).abs() < 1e-4 && room.triangles.len() == 12);
        let full = 4.0 / 3.0 * std::f32::consts::PI;
        let sphere = made(|s| uv_sphere(s, center, 1.0, 32, 64, 0));
        assert!((volume(&sphere) / full - 1.0).abs() < 0.01 && sphere.triangles.len() == 2 * 64 * 31);
        let icosphere = made(|s| icosphere(s, center, 1.0, 3, 0));
        assert!((volume(&icosphere) / full - 1.0).abs() < 0.01 && icosphere.triangles.len() == 20 * 64);
        let cylinder = made(|s| cylinder(s, center, 1.0, 2.0, 64, 0));
        assert!((volume(&cylinder) / std::f32::consts::TAU - 1.0).abs() < 0.01 && cylinder.triangles.len() == 4 * 64);
    }

    // Kills: normals that point inside or do not follow the winding, and tangents that are not perpendicular.
    #[test]
    fn normals_follow_the_winding() {
        let scene = made(|s| {
            quad(s, Vec3::ZERO, Vec3::Z, Vec3::X, 0);
            cuboid(s, Vec3::ONE, Vec3::ONE, 1.0, 0);
            room(s, Vec3::NEG_ONE, Vec3::ONE, [0; 6]);
            uv_sphere(s, Vec3::ZERO, 2.0, 8, 16, 0);
            icosphere(s, Vec3::ZERO, 2.0, 1, 0);
            cylinder(s, Vec3::ZERO, 1.0, 3.0, 16, 0);
        });
        for triangle in &scene.triangles {
            let [a, b, c] = corners(&scene, triangle);
            for vertex in triangle.vertices.map(|v| scene.vertices[v as usize]) {
                assert!((b - a).cross(c - a).normalize().dot(vertex.normal) > 0.7);
                assert!(vertex.normal.is_normalized() && vertex.tangent.truncate().is_normalized());
                assert!(vertex.tangent.truncate().dot(vertex.normal).abs() < 1e-5);
            }
        }
    }
}
