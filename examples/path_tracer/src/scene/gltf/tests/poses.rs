//! Animations, morph targets and skins against closed forms.

use glam::{Quat, Vec2, Vec3};

use super::super::super::LoadOptions;
use super::super::super::model::Scene;
use super::{QUAD, file, file_with};

/// Bytes of each part, one after the other.
fn views(lengths: &[usize]) -> Vec<(usize, usize)> {
    let mut at = 0;
    let mut view = |&n_numbers: &usize| {
        let start = at;
        at += 4 * n_numbers;
        (start, 4 * n_numbers)
    };
    lengths.iter().map(&mut view).collect()
}

fn at(time: f32) -> LoadOptions {
    LoadOptions { time: Some(time), ..LoadOptions::default() }
}

fn has(scene: &Scene, position: Vec3) -> bool {
    scene.vertices.iter().any(|vertex| vertex.position.abs_diff_eq(position, 1e-6))
}

/// A quad that turns by half a turn around Y in one second.
fn turning(options: &LoadOptions) -> Result<Scene, String> {
    let mut numbers = QUAD.to_vec();
    numbers.extend([0., 1.]);
    numbers.extend([0., 0., 0., 1., 0., 1., 0., 0.]);
    let rest = r#""nodes":[{"mesh":0,"translation":[5,0,0]}],
        "meshes":[{"primitives":[{"mode":5,"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":4},
            {"bufferView":1,"componentType":5126,"type":"SCALAR","count":2},
            {"bufferView":2,"componentType":5126,"type":"VEC4","count":2}],
        "animations":[{"name":"turn","channels":[{"sampler":0,"target":{"node":0,"path":"rotation"}}],
            "samplers":[{"input":1,"output":2}]},{"name":"other"}]"#;
    file_with(&numbers, &views(&[12, 2, 8]), rest, options)
}

// Kills: an animation that replaces the other parts of a transform, one that plays without being asked, and a time in frames.
#[test]
fn half_a_turn_takes_its_time() {
    let corner = |options: &LoadOptions| {
        let scene = turning(options).unwrap();
        [Vec3::new(6.0, 0.0, 0.0), Vec3::new(5.0, 0.0, -1.0), Vec3::new(4.0, 0.0, 0.0)].map(|p| has(&scene, p))
    };
    assert_eq!(corner(&LoadOptions::default()), [true, false, false]);
    assert_eq!(corner(&at(0.0)), [true, false, false]);
    assert_eq!(corner(&at(0.5)), [false, true, false]);
    assert_eq!(corner(&at(1.0)), [false, false, true]);
    assert_eq!(corner(&at(7.0)), [false, false, true]);
}

// Kills: a name that is not compared, a wrong name without the list of the right ones, and a time that is no number.
#[test]
fn animations_are_chosen_by_name() {
    let named = |name: &str| turning(&LoadOptions { animation: Some(String::from(name)), ..at(1.0) });
    assert!(has(&named("turn").unwrap(), Vec3::new(4.0, 0.0, 0.0)));
    assert!(has(&named("other").unwrap(), Vec3::new(6.0, 0.0, 0.0)));
    let text = named("walk").unwrap_err();
    assert_eq!(text, "a.gltf: animation: there is no 'walk', there are 'turn', 'other'");
    assert!(turning(&at(f32::NAN)).unwrap_err().contains("NaN is no time"));
    let warnings = turning(&at(1.0)).unwrap().warnings;
    assert!(warnings.iter().any(|line| line == "the animation 'turn' is shown; there are also 'other'"), "{warnings:?}");
    let warnings = turning(&LoadOptions::default()).unwrap().warnings;
    assert!(warnings.iter().any(|line| line.contains("2 animations are left out")), "{warnings:?}");
}

// Kills: a small file whose channels read a large accessor so often that reading never ends.
#[test]
fn the_keys_of_all_channels_are_capped() {
    let channel = r#"{"sampler":0,"target":{"node":0,"path":"weights"}}"#;
    let rest = format!(
        r#""nodes":[{{}}],"accessors":[{{"componentType":5126,"type":"SCALAR","count":131072}}],
        "animations":[{{"channels":[{}],"samplers":[{{"input":0,"output":0}}]}}]"#,
        [channel; 1100].join(",")
    );
    let text = file_with(&[], &[], &rest, &at(0.0)).map(|scene| scene.vertices.len()).unwrap_err();
    assert!(text.contains("channel 1024: an animation with so many keys is not supported"), "{text}");
}

// Kills: splines whose tangents and values are read key by key instead of part by part, and weights that reach the wrong target.
#[test]
fn morph_weights_follow_a_spline() {
    let mut numbers = QUAD.to_vec();
    numbers.extend([[0.0, 0.0, 1.0]; 4].as_flattened());
    numbers.extend([[0.0, 10.0, 0.0]; 4].as_flattened());
    numbers.extend([0., 2.]);
    // Two weights: incoming tangents, values, outgoing tangents; the first goes from 0 to 1 with a slope of 3 at its start.
    numbers.extend([9., 9., 0., 0., 3., 0., 0., 0., 1., 0., 9., 9.]);
    let rest = r#""nodes":[{"mesh":0,"weights":[0.5,0.25]}],
        "meshes":[{"weights":[8,8],
            "primitives":[{"mode":5,"attributes":{"POSITION":0},"targets":[{"POSITION":1},{"POSITION":2}]}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":4},
            {"bufferView":1,"componentType":5126,"type":"VEC3","count":4},
            {"bufferView":2,"componentType":5126,"type":"VEC3","count":4},
            {"bufferView":3,"componentType":5126,"type":"SCALAR","count":2},
            {"bufferView":4,"componentType":5126,"type":"SCALAR","count":12}],
        "animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}],
            "samplers":[{"input":3,"output":4,"interpolation":"CUBICSPLINE"}]}]"#;
    let read = |options: &LoadOptions| file_with(&numbers, &views(&[12, 12, 12, 2, 12]), rest, options).unwrap();
    assert!(has(&read(&LoadOptions::default()), Vec3::new(0.0, 2.5, 0.5)));
    // Half way: h01 = 1/2 of the step and span * h10 = 2 * 1/8 of the slope 3.
    assert!(has(&read(&at(1.0)), Vec3::new(0.0, 0.0, 0.5 + 0.75)));
    assert!(has(&read(&at(2.0)), Vec3::new(0.0, 0.0, 1.0)));
}

// Kills: normals that stay as they were, displacements of attributes that the base lacks, and texture coordinates of one set only.
#[test]
fn targets_move_normals_and_texture_coordinates_too() {
    let mut numbers = QUAD.to_vec();
    numbers.extend([[0.0, 0.0, 1.0]; 4].as_flattened());
    numbers.extend([[1.0, 0.0, 0.0]; 4].as_flattened());
    numbers.extend([0.25; 8]);
    let rest = r#""nodes":[{"mesh":0}],"meshes":[{"weights":[1],"primitives":[{"mode":5,
            "attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":3},"targets":[{"NORMAL":2,"TEXCOORD_0":3,"TANGENT":2}]}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":4},
            {"bufferView":1,"componentType":5126,"type":"VEC3","count":4},
            {"bufferView":2,"componentType":5126,"type":"VEC3","count":4},
            {"bufferView":3,"componentType":5126,"type":"VEC2","count":4}]"#;
    let scene = file(&numbers, &views(&[12, 12, 12, 8]), rest).unwrap();
    let normal = Vec3::new(1.0, 0.0, 1.0).normalize();
    assert!(scene.vertices.iter().all(|vertex| vertex.normal.abs_diff_eq(normal, 1e-6)));
    assert!(scene.vertices.iter().all(|vertex| vertex.uv == [Vec2::splat(0.5); 2] && vertex.tangent == glam::Vec4::ZERO));
}

const AROUND_Z: Quat = Quat::from_xyzw(0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2);

/// A bar of two joints, one above the other, whose upper one is turned at time 0; the weights are halved, and those of the
/// upper joint are in a second set.
fn bar(options: &LoadOptions, last_joint: u8, turn: Quat) -> Result<Scene, String> {
    let mut numbers = vec![0., 0., 0., 1., 0., 0., 0., 2., 0., 3., 2., 0.];
    let joints = |joint: u8| [f32::from_bits(u32::from(joint)); 4];
    numbers.extend(joints(0));
    numbers.extend([joints(1)[0], joints(1)[0], joints(1)[0], joints(last_joint)[0]]);
    let weights = |of: [f32; 4]| of.map(|weight| [weight, 0.0, 0.0, 0.0]);
    numbers.extend(weights([0.5, 0.5, 0.25, 0.0]).as_flattened());
    numbers.extend(weights([0.0, 0.0, 0.25, 0.5]).as_flattened());
    numbers.extend(glam::Mat4::IDENTITY.to_cols_array());
    numbers.extend(glam::Mat4::from_translation(-Vec3::Y).to_cols_array());
    numbers.push(0.0);
    numbers.extend(turn.to_array());
    let rest = r#""nodes":[{"mesh":0,"skin":0,"translation":[100,0,0]},{"children":[2]},{"translation":[0,1,0]}],
        "meshes":[{"primitives":[{"mode":5,
            "attributes":{"POSITION":0,"JOINTS_0":1,"JOINTS_1":2,"WEIGHTS_0":3,"WEIGHTS_1":4}}]}],
        "skins":[{"joints":[1,2],"inverseBindMatrices":5}],
        "accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":4},
            {"bufferView":1,"componentType":5121,"type":"VEC4","count":4},
            {"bufferView":2,"componentType":5121,"type":"VEC4","count":4},
            {"bufferView":3,"componentType":5126,"type":"VEC4","count":4},
            {"bufferView":4,"componentType":5126,"type":"VEC4","count":4},
            {"bufferView":5,"componentType":5126,"type":"MAT4","count":2},
            {"bufferView":6,"componentType":5126,"type":"SCALAR","count":1},
            {"bufferView":7,"componentType":5126,"type":"VEC4","count":1}],
        "animations":[{"channels":[{"sampler":0,"target":{"node":2,"path":"rotation"}}],"samplers":[{"input":6,"output":7}]}]"#;
    file_with(&numbers, &views(&[12, 4, 4, 16, 16, 32, 1, 4]), rest, options)
}

// Kills: the transform of the node that carries the mesh, a bind matrix on the wrong side, weights that are not made to add up to one,
// and sets of joints after the first.
#[test]
fn a_bar_of_two_joints_bends() {
    let rest = bar(&LoadOptions::default(), 1, AROUND_Z).unwrap();
    assert!([Vec3::ZERO, Vec3::X, Vec3::Y * 2.0, Vec3::new(3.0, 2.0, 0.0)].into_iter().all(|p| has(&rest, p)));
    let bent = bar(&at(0.0), 1, AROUND_Z).unwrap();
    // The upper joint takes (3, 2) to (-1, 4); the third vertex stays half way between (0, 2) and (-1, 1).
    assert!([Vec3::ZERO, Vec3::X, Vec3::new(-0.5, 1.5, 0.0), Vec3::new(-1.0, 4.0, 0.0)].into_iter().all(|p| has(&bent, p)), "{bent:?}");
    assert!(rest.warnings.iter().all(|line| !line.contains("skin")), "{:?}", rest.warnings);
}

// Kills: flat normals of the rest pose, and ones that each corner turns by its own joints.
#[test]
fn flat_normals_follow_the_bent_triangles() {
    let bent = bar(&at(0.0), 1, Quat::from_rotation_x(1.0)).unwrap();
    for triangle in &bent.triangles {
        let [a, b, c] = triangle.vertices.map(|vertex| bent.vertices[vertex as usize]);
        let normal = (b.position - a.position).cross(c.position - a.position).normalize();
        assert!([a, b, c].iter().all(|corner| corner.normal.abs_diff_eq(normal, 1e-6)), "{normal}");
    }
    assert!(bent.vertices.iter().any(|vertex| vertex.normal.y.abs() > 0.1));
}

// Kills: a joint index that is trusted, and one that is refused although its weight is zero.
#[test]
fn a_joint_that_does_not_exist_is_named() {
    let text = bar(&at(0.0), 2, AROUND_Z).unwrap_err();
    assert_eq!(text, "a.gltf: node 0, mesh 0, primitive 0, JOINTS: vertex 3 follows joint 2, there are 2");
}
