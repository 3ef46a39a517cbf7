//! Trees of materials against closed forms: what the viewer's angle gives to each leaf, that no light is lost or made, and that what light sampling
//! and chance find is the same light.
//!
//! **Invariant:** many trees stand in one picture, so that a kernel which works for one of them only is seen.

use glam::{Vec2, Vec3, Vec4};
use path_tracer::{
    LayerRequest, Settings,
    gpu_scene::{LightStrategy, lobes},
    layers::Values,
    scene::{Curve, Environment, Image, LightKind, Material, MaterialTree, PunctualLight, Scene, TextureUse, Vertex, Weight, Wrap, shapes},
    wavepool::Schedule,
};

use wavepool_tests::{
    device::{level, levels, place_among_levels},
    moments::Sample,
};

use crate::{assert_mean, lambert, layers::render, metal, parallel_camera};

/// Pixels along a side of a picture.
const SIDE: u32 = 48;

/// Squares in the plane y = 0, one for each tree, row by row; under a sky of radiance 1.
fn mosaic(leaves: &[Material], trees: &[MaterialTree]) -> Scene {
    let mut scene = Scene { materials: leaves.to_vec(), environment: Some(Environment::constant([1.0; 3])), ..Scene::default() };
    for (number, tree) in (0..).zip(trees) {
        let corner = Vec3::new((number % 4) as f32, 0.0, (number / 4) as f32);
        let material = scene.materials.len() as u32;
        shapes::quad(&mut scene, corner, Vec3::Z, Vec3::X, material);
        scene.materials.push(Material { tree: Some(tree.clone()), ..lambert(0.5, 0.0) });
    }
    scene
}

/// The mosaic from above, at an angle of this cosine.
fn settings(cosine: f32, samples: u32, strategy: LightStrategy) -> Settings {
    let middle = Vec3::new(2.0, 0.0, 2.0);
    let towards = Vec3::new((1.0 - cosine * cosine).sqrt(), cosine, 0.0);
    let camera = Some(parallel_camera(middle + towards * 10.0, middle, 2.0));
    let schedule: Schedule = "block,roulette=none".parse().expect("a schedule");
    Settings { depth: 2, schedule, camera, light_strategy: strategy, ..Settings::new(SIDE, SIDE, samples) }
}

/// Green of the pixels of each square, without its border.
fn squares(scene: &Scene, settings: &Settings) -> Option<Vec<Vec<f64>>> {
    let seen = render(scene, settings)?;
    let camera = settings.camera.as_ref().expect("there is one");
    let clip = |at: Vec3| {
        let local = camera.world_from_camera.inverse().transform_point3(at);
        let path_tracer::scene::Projection::Orthographic { half_height } = camera.projection else { panic!("it is parallel") };
        Vec2::new(0.5 + 0.5 * local.x / half_height, 0.5 - 0.5 * local.y / half_height) * SIDE as f32
    };
    let inside = |number: usize, pixel: usize| {
        let corner = Vec3::new((number % 4) as f32, 0.0, (number / 4) as f32);
        let ends = [corner + Vec3::new(0.1, 0.0, 0.1), corner + Vec3::new(0.9, 0.0, 0.9)].map(clip);
        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let at = Vec2::new((pixel as u32 % SIDE) as f32, (pixel as u32 / SIDE) as f32);
        at.cmpge(low).all() && (at + 1.0).cmple(high).all()
    };
    let n_trees = scene.materials.iter().filter(|material| material.tree.is_some()).count();
    let of = |number: usize| {
        let pixels = (0..seen.film.pixels()).filter(|pixel| inside(number, *pixel));
        pixels.map(|pixel| seen.film.mean(pixel, 1)).collect::<Vec<f64>>()
    };
    Some((0..n_trees).map(of).collect())
}

fn leaf(material: u32) -> MaterialTree {
    MaterialTree::Leaf(material)
}

fn layer(weight: f32, curve: Curve, over: MaterialTree, under: MaterialTree) -> MaterialTree {
    MaterialTree::layer(Weight::constant(weight), curve, over, under)
}

fn mix(parts: &[(f32, u32)]) -> MaterialTree {
    MaterialTree::Mix(parts.iter().map(|(weight, material)| (Weight::constant(*weight), leaf(*material))).collect())
}

/// Sixteen trees of at most seven leaves, numbered up to `n_leaves`, whose shares add up to 1.
fn sixteen_trees(n_leaves: u32) -> Vec<MaterialTree> {
    let curves = [
        Curve::Constant,
        Curve::Fresnel { ior: 1.5 },
        Curve::Custom { normal: 0.1, grazing: 0.8, exponent: 3.0 },
        Curve::Fresnel { ior: 0.8 },
        Curve::Custom { normal: 0.9, grazing: 0.2, exponent: 0.5 },
    ];
    (0..16_u32)
        .map(|seed| {
            let of = |step: u32| leaf((seed * 5 + step * 3) % n_leaves);
            let curve = |step: u32| curves[((seed + step) % 5) as usize];
            let weight = |step: u32| 0.35 + 0.6 * ((seed * 7 + step * 11) % 10) as f32 / 10.0;
            let lower = layer(weight(0), curve(0), of(0), of(1));
            let parts = [0.2, 0.3, 0.5].map(Weight::constant);
            match seed % 4 {
                0 => lower,
                1 => layer(weight(1), curve(1), of(2), lower),
                2 => MaterialTree::Mix(parts.into_iter().zip([of(3), lower, layer(weight(2), curve(2), of(4), of(5))]).collect()),
                _ => layer(weight(3), curve(3), MaterialTree::Mix(parts.into_iter().zip([of(6), of(7), of(8)]).collect()), lower),
            }
        })
        .collect()
}

/// Shares of a tree's leaves by the host's formulas, which its unit tests hold against the tree itself.
fn shares(tree: &MaterialTree, cosine: f64) -> Vec<(usize, f64)> {
    let lobes = lobes::flatten(tree, &mut Vec::new());
    let share = |lobe: &lobes::Lobe| lobe.factor * lobe.terms.iter().map(|term| term.value(cosine)).product::<f64>();
    lobes.iter().map(|lobe| (lobe.material as usize, share(lobe))).collect()
}

/// Kills: a share of the wrong leaf, a curve in the cosine of another angle, a rest that is not what is left, a mean of leaves in place of their sum,
/// a list that is cut off after some leaves.
#[test]
fn matte_leaves_add_up_by_their_shares() {
    let albedos = [0.9_f32, 0.05, 0.5, 0.25, 0.75];
    let mut trees = sixteen_trees(albedos.len() as u32);
    // As many leaves as a tree may have.
    let parts: Vec<(f32, u32)> = (0..MaterialTree::MOST_LEAVES as u32).map(|leaf| (0.01 + 0.001 * leaf as f32, leaf % 5)).collect();
    trees[7] = mix(&parts);
    let scene = mosaic(&albedos.map(|albedo| lambert(albedo, 0.0)), &trees);
    for cosine in [1.0, 0.7, 0.25] {
        // Every lobe has the same density, so a single sample knows the answer.
        let Some(seen) = squares(&scene, &settings(cosine, 2, LightStrategy::Bsdf)) else { return };
        for (number, (tree, pixels)) in trees.iter().zip(&seen).enumerate() {
            let truth: f64 = shares(tree, f64::from(cosine)).iter().map(|(leaf, share)| share * f64::from(albedos[*leaf])).sum();
            assert!(pixels.len() >= 4, "tree {number} is not seen: {}", pixels.len());
            for value in pixels {
                assert!((value / truth - 1.0).abs() < 2e-5, "tree {number} at {cosine}: {value} for {truth}, {tree:?}");
            }
        }
    }
}

/// White matte, a mirror, a polished and a dull coat over white, a clear sheet: none of them keeps any light.
fn lossless() -> Vec<Material> {
    let plastic = |roughness| Material { ior: 1.5, roughness, ..lambert(1.0, 0.0) };
    let sheet = Material { transmission: 1.0, roughness: 0.0, ..Material::default() };
    vec![lambert(1.0, 0.0), metal(1.0, 0.0, 0.0), plastic(0.0), plastic(0.5), sheet]
}

/// Kills: shares that add up to more or less than 1, a lobe that is drawn and not counted, or counted and never drawn, a density of the drawn lobe
/// in place of all, single directions weighed against light sampling.
#[test]
fn trees_of_lossless_leaves_lose_nothing() {
    let scene = mosaic(&lossless(), &sixteen_trees(5));
    for (strategy, samples) in [(LightStrategy::Mis, 256), (LightStrategy::Bsdf, 256), (LightStrategy::Lights, 512)] {
        for cosine in [0.9, 0.4] {
            let Some(seen) = squares(&scene, &settings(cosine, samples, strategy)) else { return };
            for (number, pixels) in seen.iter().enumerate() {
                assert_mean(&format!("tree {number} at {cosine}, {strategy:?}"), pixels, 1.0, 0.2);
            }
            let all: Vec<f64> = seen.into_iter().flatten().collect();
            assert_mean(&format!("all trees at {cosine}, {strategy:?}"), &all, 1.0, 0.03);
        }
    }
}

/// A normal map of one texel, bent along u.
fn bent(scene: &mut Scene, material: &mut Material) {
    let wrap = [Wrap::Repeat; 2];
    material.normal_texture = Some(TextureUse { image: 0, uv_set: 0, wrap, linear: false, transform: [Vec3::X, Vec3::Y] });
    if scene.images.is_empty() {
        scene.images.push(Image { name: "bent".into(), width: 1, height: 1, texels: vec![[190, 128, 238, 255]] });
    }
}

/// Mean, and the square of its standard error.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let sample = Sample::of(values);
    (sample.mean, sample.variance / sample.draws)
}

/// Kills: a lobe sampled in one frame and evaluated in another, a density that leaves out a lobe or counts it with another probability, the frame of
/// the tree where that of the leaf belongs: each direction must bring the same light, whether it was found by a light or by chance.
#[test]
fn every_direction_brings_the_same_light_to_both_strategies() {
    let mut leaves = vec![
        Material { base_color: Vec4::new(0.8, 0.6, 0.3, 1.0), ..lambert(0.6, 0.0) },
        metal(0.9, 0.5, 0.0),
        Material { ior: 1.5, roughness: 0.6, ..lambert(0.4, 0.0) },
        metal(0.7, 0.7, 0.0),
    ];
    let mut holder = Scene::default();
    leaves[1..3].iter_mut().for_each(|material| bent(&mut holder, material));
    let mut scene = mosaic(&leaves, &sixteen_trees(4));
    scene.images = holder.images;
    let tangent = Vec4::new(0.0, 0.0, 1.0, 1.0);
    scene.vertices = scene.vertices.iter().map(|vertex| Vertex { tangent, ..*vertex }).collect();
    let (width, height) = (8, 4);
    let (mut chi2, mut n_cells, mut strongest) = (0.0, 0, 0.0_f64);
    // The lower half of the panorama lights nothing.
    for texel in 0..width * height / 2 {
        let mut texels = vec![[0.0; 3]; width * height];
        texels[texel] = [10.0; 3];
        let environment = Environment { name: "one texel".into(), width: width as u32, height: height as u32, texels };
        scene.environment = Some(environment);
        let [by_light, by_chance] = [(LightStrategy::Lights, 32), (LightStrategy::Bsdf, 256)].map(|(strategy, samples)| {
            let settings = Settings { depth: 1, ..settings(0.6, samples, strategy) };
            squares(&scene, &settings)
        });
        let (Some(by_light), Some(by_chance)) = (by_light, by_chance) else { return };
        for (a, b) in by_light.iter().zip(&by_chance) {
            let [(mean_a, error_a), (mean_b, error_b)] = [a, b].map(|values| mean_and_error(values));
            assert!(a.len() >= 8 && mean_a.is_finite() && mean_b.is_finite());
            // A handful of hits is not normal yet.
            if mean_a > 0.02 && error_b > 0.0 {
                chi2 += (mean_a - mean_b).powi(2) / (error_a + error_b);
                n_cells += 1;
                strongest = strongest.max((error_a + error_b).sqrt() / mean_a);
            }
        }
    }
    println!("chi2 {chi2:.1} of {n_cells} cells, errors up to {strongest:.3}");
    assert!(n_cells > 100, "{n_cells}");
    // The distribution of Wilson and Hilferty, 4.9 standard deviations; means of few pixels spread a little more than normal ones.
    let n = f64::from(n_cells);
    let bound = n * (1.0 - 2.0 / (9.0 * n) + 4.9 * (2.0 / (9.0 * n)).sqrt()).powi(3);
    assert!(chi2 < 1.15 * bound, "chi2 {chi2} of {n_cells} cells, bound {bound}");
}

/// Kills: a leaf that changes when it stands in a tree: its coat, its roughness, its normal map, its glass, what the solid absorbs; a tree that has
/// numbers of its own.
#[test]
fn a_tree_of_one_leaf_is_that_leaf() {
    let amber = Material {
        transmission: 1.0,
        roughness: 0.0,
        solid: true,
        attenuation_color: Vec3::new(0.9, 0.6, 0.2),
        attenuation_distance: 0.7,
        ..Material::default()
    };
    let plastic = Material { roughness: 0.3, ..lambert(0.6, 0.0) };
    let plastic = Material { ior: 1.5, ..plastic };
    let mut dented = metal(0.8, 0.2, 0.0);
    let mut holder = Scene::default();
    bent(&mut holder, &mut dented);
    let all = [("matte", lambert(0.7, 0.0)), ("metal", metal(0.8, 0.4, 0.0)), ("plastic", plastic), ("amber", amber), ("dented", dented)];
    for (name, material) in all {
        let images = holder.images.clone();
        let mut scene = Scene { materials: vec![material.clone(), lambert(0.4, 0.0)], images, ..Scene::default() };
        scene.environment = Some(Environment::constant([0.5, 1.0, 2.0]));
        shapes::icosphere(&mut scene, Vec3::Y * 1.1, 1.0, 3, 0);
        shapes::quad(&mut scene, Vec3::new(-3.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0, 1);
        let tangent = |normal: Vec3| normal.cross(Vec3::new(0.3, 0.9, 0.1)).normalize().extend(1.0);
        scene.vertices.iter_mut().for_each(|vertex| vertex.tangent = tangent(vertex.normal));
        let schedule: Schedule = "block,roulette=none".parse().expect("a schedule");
        let camera = Some(parallel_camera(Vec3::new(1.0, 4.0, 5.0), Vec3::Y, 1.4));
        let settings = Settings { depth: 12, schedule, camera, ..Settings::new(24, 24, 8) };
        let Some(plain) = render(&scene, &settings) else { return };
        scene.materials.push(material.clone());
        let inside = Material {
            attenuation_color: material.attenuation_color,
            attenuation_distance: material.attenuation_distance,
            ..lambert(0.9, 0.0)
        };
        // What the tree's own material says of lobes must not matter.
        scene.materials[0] = Material { tree: Some(leaf(2)), solid: material.solid, metallic: 0.7, roughness: 0.1, ior: 1.8, ..inside };
        let Some(tree) = render(&scene, &settings) else { return };
        let mut far = 0;
        for pixel in 0..plain.film.pixels() {
            for channel in 0..3 {
                let (a, b) = (plain.film.mean(pixel, channel), tree.film.mean(pixel, channel));
                far += usize::from((a - b).abs() > 1e-3 * a.abs().max(0.1));
            }
        }
        // Roundings of a weight, and now and then a path that takes another way for them.
        assert!(far <= 9, "{name}: {far} values of {} differ", plain.film.pixels() * 3);
    }
}

/// Kills: a leaf without a share that costs a line of code, a draw or a bit; a mixture that depends on the order of its children beyond roundings.
#[test]
fn what_has_no_share_changes_nothing() {
    let leaves = [lambert(0.8, 0.0), metal(0.9, 0.3, 0.0), Material { transmission: 1.0, ..Material::default() }];
    let with_glass = [mix(&[(0.5, 0), (0.0, 2), (0.5, 1)]), layer(0.0, Curve::Fresnel { ior: 2.0 }, leaf(2), mix(&[(0.5, 0), (0.5, 1)]))];
    let without = [mix(&[(0.5, 0), (0.5, 1)]), mix(&[(0.5, 0), (0.5, 1)])];
    let turned = [mix(&[(0.5, 1), (0.5, 0)]), mix(&[(0.5, 1), (0.5, 0)])];
    let settings = settings(0.8, 64, LightStrategy::Mis);
    let picture = |trees: &[MaterialTree]| render(&mosaic(&leaves, trees), &settings);
    let (Some(a), Some(b), Some(c)) = (picture(&with_glass), picture(&without), picture(&turned)) else { return };
    assert_eq!(a.film.hash(), b.film.hash());
    let wgsl = |trees: &[MaterialTree]| {
        let program = path_tracer::Renderer::program_with(&mosaic(&leaves, trees), &settings).expect("it links");
        let image = path_tracer::wavepool::ImageTiles { width: SIDE, height: SIDE };
        program.wgsl(&image, &settings.schedule).expect("it links").map(|(_, text)| text)
    };
    // A table more or less changes addresses, which are uniforms.
    assert!(wgsl(&with_glass) == wgsl(&without) && !wgsl(&with_glass)[0].contains("fn sample_glass"));
    let mean = |seen: &path_tracer::Rendering| (0..seen.film.pixels()).map(|pixel| seen.film.mean(pixel, 1)).sum::<f64>();
    assert!((mean(&b) / mean(&c) - 1.0).abs() < 0.01, "{} {}", mean(&b), mean(&c));
    // By light sampling alone nothing is drawn by which the order could matter: only roundings are left.
    let by_light = |trees: &[MaterialTree]| {
        render(&mosaic(&leaves, trees), &Settings { light_strategy: LightStrategy::Lights, depth: 1, ..settings.clone() })
    };
    let (Some(b), Some(c)) = (by_light(&without), by_light(&turned)) else { return };
    for pixel in 0..b.film.pixels() {
        let (b, c) = (b.film.mean(pixel, 1), c.film.mean(pixel, 1));
        assert!((b - c).abs() <= 1e-6 * b.abs(), "pixel {pixel}: {b} {c}");
    }
}

/// Kills: a mask read from another channel or of another point, a rest that forgets the mask, an effect of images that no material asks for but a
/// share does.
#[test]
fn a_mask_divides_the_surface() {
    let mask = |weight| {
        let (wrap, transform) = ([Wrap::Clamp; 2], [Vec3::X, Vec3::Y]);
        let texture = Some(TextureUse { image: 0, uv_set: 0, wrap, linear: false, transform });
        Weight { factor: weight, texture }
    };
    let tree = MaterialTree::layer(mask(0.5), Curve::Constant, leaf(0), leaf(1));
    let mut scene = mosaic(&[lambert(0.8, 0.0), lambert(0.2, 0.0)], &[tree]);
    scene.images.push(Image { name: "mask".into(), width: 2, height: 1, texels: vec![[0, 255, 255, 255], [255, 0, 0, 0]] });
    let camera = Some(parallel_camera(Vec3::new(0.5, 5.0, 0.5), Vec3::new(0.5, 0.0, 0.5), 0.4));
    let Some(seen) = render(&scene, &Settings { camera, ..settings(1.0, 1, LightStrategy::Bsdf) }) else { return };
    let mut seen: Vec<f64> = (0..seen.film.pixels()).map(|pixel| seen.film.mean(pixel, 1)).collect();
    seen.sort_by(f64::total_cmp);
    let (bare, covered) = seen.split_at(seen.len() / 2);
    assert!(bare.iter().all(|value| (value - 0.2).abs() < 1e-5), "{bare:?}");
    assert!(covered.iter().all(|value| (value - 0.5).abs() < 1e-5), "{covered:?}");
}

/// Kills: an albedo of the tree's own material, or without the shares; a tree of mirrors that is not looked through.
#[test]
fn layers_see_the_leaves() {
    let leaves = [lambert(0.8, 0.0), lambert(0.2, 0.0), metal(0.5, 0.0, 0.0)];
    let trees = [mix(&[(0.25, 0), (0.5, 1)]), mix(&[(0.75, 2)])];
    let mut scene = mosaic(&leaves, &trees);
    scene.environment = Some(Environment::constant([0.5; 3]));
    let camera = Some(parallel_camera(Vec3::new(1.0, 5.0, 0.5), Vec3::new(1.0, 0.0, 0.5), 0.45));
    let layers = LayerRequest::ALL;
    let Some(seen) = render(&scene, &Settings { camera, layers, ..settings(1.0, 4, LightStrategy::Mis) }) else { return };
    let found = seen.layers();
    let albedo = found.iter().find(|layer| layer.name == "albedo").expect("it was asked for");
    let Values::F32(values) = &albedo.channels[1].values else { panic!("quantities") };
    let mut values: Vec<f32> = values.clone();
    values.sort_by(f32::total_cmp);
    // The sky of radiance 0.5 by three quarters of a half; a quarter of 0.8 and half of 0.2.
    assert!((values[4] - 0.1875).abs() < 1e-5 && (values[values.len() - 5] - 0.3).abs() < 1e-5, "{values:?}");
}

/// Kills: a lobe whose draw depends on who traces when; arithmetic of a tree that a driver rewrites in one kernel and not in another, at any width.
/// All schedules on the first level, one of each kind on the others.
#[test]
fn no_schedule_changes_a_bit_of_a_tree() {
    if level().is_none() {
        let levels = levels();
        let arguments = ["--exact", "trees::no_schedule_changes_a_bit_of_a_tree"];
        return levels.iter().enumerate().for_each(|(index, level)| level.run_again_as(index, levels.len(), &arguments));
    }
    let leaves = [lambert(0.7, 0.0), metal(0.9, 0.3, 0.0), metal(0.8, 0.0, 0.0), Material { ior: 1.5, ..lambert(0.5, 0.0) }];
    let mut scene = mosaic(&leaves, &sixteen_trees(4));
    shapes::icosphere(&mut scene, Vec3::new(2.0, 1.0, 2.0), 0.9, 2, 7);
    let camera = Some(parallel_camera(Vec3::new(5.0, 5.0, 2.0), Vec3::new(2.0, 0.0, 2.0), 1.9));
    let settings = |schedule: &str| {
        let mut schedule: Schedule = schedule.parse().expect("a schedule");
        schedule.pool_blocks = Some(4);
        Settings { depth: 8, schedule, camera: camera.clone(), ..Settings::new(32, 24, 2) }
    };
    let Some(reference) = render(&scene, &settings("block")) else { return };
    let mut launches = vec![reference.report.launches];
    let all = ["keyed", "megakernel-regen", "never", "megakernel", "compaction", "persistent", "per-lane"];
    let chosen = if place_among_levels().0 == 0 { &all[..] } else { &all[..2] };
    for schedule in chosen {
        let Some(rendering) = render(&scene, &settings(schedule)) else { return };
        assert_eq!(rendering.film.hash(), reference.film.hash(), "{schedule}");
        launches.push(rendering.report.launches);
    }
    launches.sort_unstable();
    launches.dedup();
    assert!(launches.len() > chosen.len() / 2, "the schedules did the same: {launches:?}");
}

/// Kills: a mixture of a mirror and a matte surface that is not the metal by a third which it also is, in a room where light comes from lamps, from
/// points and from the room itself.
#[test]
fn a_mixture_is_the_material_that_says_the_same() {
    let matte = lambert(0.9, 0.0);
    let (mirror, third) = (metal(0.9, 0.0, 0.0), Material { metallic: 0.3, roughness: 0.0, ..matte.clone() });
    let lamp = Material { double_sided: false, ..lambert(0.5, 6.0) };
    let mut scene = Scene { materials: vec![lambert(0.5, 0.0), lamp, third, matte, mirror], ..Scene::default() };
    shapes::room(&mut scene, Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 3.0, 2.0), [0; 6]);
    shapes::quad(&mut scene, Vec3::new(-0.5, 2.99, -0.5), Vec3::X, Vec3::Z, 1);
    shapes::uv_sphere(&mut scene, Vec3::new(0.0, 0.5, 0.0), 0.5, 32, 64, 2);
    scene.lights.push(PunctualLight {
        kind: LightKind::Point,
        position: Vec3::new(1.5, 2.0, 1.5),
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(4.0),
        range: f32::INFINITY,
        profile: None,
    });
    let camera = Some(parallel_camera(Vec3::new(0.3, 1.8, 1.7), Vec3::Y * 0.5, 0.6));
    let runs = |scene: &Scene, first: u32| {
        let run = |seed| {
            let schedule: Schedule = "block,roulette=none".parse().expect("a schedule");
            let settings = Settings { depth: 8, schedule, camera: camera.clone(), seed, ..Settings::new(32, 32, 64) };
            let seen = render(scene, &settings)?;
            // Four by four tiles.
            let tile = |pixel: usize| (pixel / 32 / 8) * 4 + pixel % 32 / 8;
            let mut tiles = [0.0; 16];
            (0..seen.film.pixels()).for_each(|pixel| tiles[tile(pixel)] += seen.film.mean(pixel, 1) / 64.0);
            Some(tiles)
        };
        (first..first + 6).map(run).collect::<Option<Vec<_>>>()
    };
    let Some(plain) = runs(&scene, 1) else { return };
    scene.materials[2] = Material { tree: Some(mix(&[(0.3, 4), (0.7, 3)])), ..lambert(0.5, 0.0) };
    let Some(tree) = runs(&scene, 101) else { return };
    for tile in 0..16 {
        let of = |runs: &[[f64; 16]]| mean_and_error(&runs.iter().map(|tiles| tiles[tile]).collect::<Vec<_>>());
        let ((a, error_a), (b, error_b)) = (of(&plain), of(&tree));
        let error = (error_a + error_b).sqrt();
        println!("tile {tile}: {a:.4} {b:.4}, {:.1} errors of {:.2} %", (a - b).abs() / error, 100.0 * error / a);
        // Student's distribution with about ten degrees of freedom: 8 is exceeded once in 80,000.
        assert!((a - b).abs() < 8.0 * error && error < 0.02 * a, "tile {tile}: {a} and {b}, error {error}");
    }
}

/// Kills: lobes that are read where there are none, a division by their number or by no draws.
#[test]
fn a_tree_without_light_is_black() {
    let leaves = [lambert(0.0, 0.0), metal(0.9, 0.3, 0.0), Material { transmission: 1.0, solid: true, ..Material::default() }];
    let scene = mosaic(&leaves, &[mix(&[]), mix(&[(1.0, 0)]), mix(&[(0.0, 1), (0.0, 2)]), mix(&[(0.5, 0), (0.5, 1)])]);
    let Some(seen) = squares(&scene, &settings(1.0, 16, LightStrategy::Mis)) else { return };
    assert!(seen[..3].iter().flatten().all(|value| *value == 0.0), "{seen:?}");
    assert!(seen[3].iter().all(|value| *value > 0.1), "{seen:?}");
}
