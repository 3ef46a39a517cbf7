//! Lists of lobes against the trees that they were made of.

use super::*;
use crate::scene::{Material, Triangle, Vertex};

/// Shares of the leaves by walking the tree, without terms: what `flatten` must come to.
fn walk(tree: &MaterialTree, share: f64, cosine: f64, shares: &mut Vec<f64>) {
    match tree {
        MaterialTree::Leaf(_) => shares.push(share),
        MaterialTree::Mix(children) => {
            let sum: f64 = children.iter().map(|(weight, _)| f64::from(weight.factor)).sum();
            for (weight, child) in children {
                walk(child, share * f64::from(weight.factor) / sum.max(1.0), cosine, shares);
            }
        }
        MaterialTree::Layer(layer) => {
            let taken = f64::from(layer.weight.factor) * curve_value(layer.curve, cosine);
            walk(&layer.over, share * taken, cosine, shares);
            walk(&layer.under, share * (1.0 - taken), cosine, shares);
        }
    }
}

/// A tree of at most so many nodes whose leaves are numbered from left to right; some weights are 0.
fn random_tree(nodes: u32, next: &mut u32, draw: &mut impl FnMut() -> f32) -> MaterialTree {
    if nodes < 3 {
        *next += 1;
        return MaterialTree::Leaf(*next - 1);
    }
    let weight = |x: f32| Weight::constant(if x < 0.15 { 0.0 } else { x });
    let (kind, half) = (draw(), (nodes - 1) / 2);
    if kind < 0.4 {
        let parts = 2 + (draw() * 2.0) as u32;
        let child = |draw: &mut _, next: &mut _| random_tree((nodes - 1) / parts, next, draw);
        return MaterialTree::Mix((0..parts).map(|_| (weight(draw()), child(draw, next))).collect());
    }
    let curve = match (draw() * 3.0) as u32 {
        0 => Curve::Constant,
        1 => Curve::Fresnel { ior: 0.6 + 2.0 * draw() },
        _ => Curve::Custom { normal: draw(), grazing: draw(), exponent: 0.5 + 6.0 * draw() },
    };
    let weight = weight(draw());
    let over = random_tree(half, next, draw);
    MaterialTree::layer(weight, curve, over, random_tree(half, next, draw))
}

fn draws(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    }
}

// Kills: the rest of a layer given to the layer, a term that reaches a sibling, weights divided by a sum below 1, a share lost with a leaf
// that has none, shares above 1.
#[test]
fn lists_are_the_trees() {
    let mut lengths = std::collections::BTreeSet::new();
    for seed in 0..500 {
        let (mut draw, mut count) = (draws(seed), 0);
        let tree = random_tree(16, &mut count, &mut draw);
        let lobes = flatten(&tree, &mut Vec::new());
        lengths.insert(lobes.len());
        for cosine in [0.0, 1e-3, 0.1, 0.5, 0.9, 1.0] {
            let mut expected = Vec::new();
            walk(&tree, 1.0, cosine, &mut expected);
            assert_eq!(expected.len() as u32, count);
            let mut shares = vec![0.0; expected.len()];
            for lobe in &lobes {
                shares[lobe.material as usize] += lobe.factor * lobe.terms.iter().map(|term| term.value(cosine)).product::<f64>();
            }
            for (leaf, (share, expected)) in shares.iter().zip(&expected).enumerate() {
                // Curves are kept as f32.
                assert!((share - expected).abs() < 1e-6, "seed {seed}, cosine {cosine}, leaf {leaf}: {share} for {expected}, {tree:?}");
            }
            assert!(shares.iter().sum::<f64>() < 1.0 + 1e-6, "seed {seed}: {shares:?}");
        }
    }
    assert!(lengths.len() > 4, "the trees are alike: {lengths:?}");
}

// Kills: a curve off by its complement: Fresnel's formula and the curve at both ends, known by hand.
#[test]
fn curves_have_their_ends() {
    let fresnel = Curve::Fresnel { ior: 1.5 };
    assert!((curve_value(fresnel, 1.0) - 0.04).abs() < 1e-12 && (curve_value(fresnel, 0.0) - 1.0).abs() < 1e-12);
    // Beyond the critical angle of a thinner medium all is reflected.
    assert_eq!(curve_value(Curve::Fresnel { ior: 0.5 }, 0.5), 1.0);
    let custom = Curve::Custom { normal: 0.25, grazing: 0.75, exponent: 2.0 };
    assert_eq!([1.0, 0.5, 0.0].map(|cosine| curve_value(custom, cosine)), [0.25, 0.375, 0.75]);
}

// Kills: terms for what is constant, a leaf that is kept though it gets nothing, a number out of its range that nobody hears of.
#[test]
fn what_is_known_beforehand_costs_nothing() {
    let (a, b) = (MaterialTree::Leaf(0), MaterialTree::Leaf(1));
    let layer = |weight, curve| MaterialTree::layer(Weight::constant(weight), curve, a.clone(), b.clone());
    let flat = |tree: &MaterialTree| {
        let mut told = Vec::new();
        let lobes = flatten(tree, &mut told);
        let terms: Vec<usize> = lobes.iter().map(|lobe| lobe.terms.len()).collect();
        (lobes.iter().map(|lobe| (lobe.material, lobe.factor)).collect::<Vec<_>>(), terms, told)
    };
    assert_eq!(flat(&layer(0.25, Curve::Constant)), (vec![(0, 0.25), (1, 0.75)], vec![0, 0], vec![]));
    assert_eq!(flat(&layer(0.0, Curve::Fresnel { ior: 1.5 })), (vec![(1, 1.0)], vec![0], vec![]));
    assert_eq!(flat(&layer(1.0, Curve::Fresnel { ior: 1.0 })), (vec![(1, 1.0)], vec![0], vec![]));
    assert_eq!(flat(&layer(1.0, Curve::Constant)), (vec![(0, 1.0)], vec![0], vec![]));
    let level = Curve::Custom { normal: 0.5, grazing: 0.5, exponent: 5.0 };
    assert_eq!(flat(&layer(0.5, level)).0, [(0, 0.25), (1, 0.75)]);
    assert_eq!(flat(&layer(1.5, Curve::Constant)).2, ["weight 1.5 became 1"]);
    let (lobes, _, told) = flat(&MaterialTree::Mix(vec![(Weight::constant(3.0), a.clone()), (Weight::constant(1.0), b.clone())]));
    assert_eq!((lobes, told.len()), (vec![(0, 0.75), (1, 0.25)], 1), "{told:?}");
    let (lobes, _, told) = flat(&MaterialTree::Mix(vec![(Weight::constant(0.5), a), (Weight::constant(-1.0), b)]));
    assert_eq!((lobes, told), (vec![(0, 0.5)], vec![String::from("weight -1 became 0")]));
}

// Kills: a list that begins a row too late, terms of another lobe, an effect of a leaf that has no share, a leaf that keeps what belongs to the
// whole surface.
#[test]
fn rows_lead_to_leaves_and_terms() {
    let glass = Material { transmission: 1.0, ..Material::default() };
    let glowing = Material { metallic: 1.0, roughness: 0.3, emissive: glam::Vec3::ONE, ..Material::default() };
    let fresnel = Curve::Fresnel { ior: 1.5 };
    let leaf = |weight, of| (Weight::constant(weight), MaterialTree::Leaf(of));
    let layer = MaterialTree::layer(Weight::constant(0.5), fresnel, MaterialTree::Leaf(1), MaterialTree::Leaf(2));
    let trees = [MaterialTree::Mix(vec![leaf(0.0, 0), leaf(0.5, 1)]), layer];
    let mut materials = vec![glass, glowing, Material { ior: 1.0, ..Material::default() }];
    materials.extend(trees.map(|tree| Material { tree: Some(tree), solid: true, ..Material::default() }));
    let scene = Scene {
        vertices: vec![Vertex::default(); 3],
        triangles: [3, 4].map(|material| Triangle { vertices: [0, 1, 2], material }).to_vec(),
        materials,
        ..Scene::default()
    };
    let (mut textures, mut warnings) = (Textures::default(), Vec::new());
    let mut records = super::super::materials::pack(&scene, &mut textures, &mut warnings).unwrap();
    let lobes = pack(&scene, &mut records, &mut textures, &mut warnings).unwrap();
    assert_eq!((records.len(), lobes.most(&records), lobes.rows.len()), (8, 2, 2 + 3 + 4));
    assert_eq!((records[3].tree, records[4].tree), (1, 3));
    assert_eq!((lobes.rows[0][0], lobes.rows[2][0]), (1, 2));
    let lobe = |row: usize| bytemuck::cast::<[u32; 4], LobeRecord>(lobes.rows[row]);
    assert_eq!((lobe(1).material, lobe(1).factor, lobe(1).term_count), (5, 0.5, 0));
    assert_eq!([lobe(3).material, lobe(3).terms, lobe(4).material, lobe(4).terms], [6, 5, 7, 7]);
    let term = |row: u32| bytemuck::cast::<[[u32; 4]; 2], TermRecord>([lobes.rows[row as usize], lobes.rows[row as usize + 1]]);
    assert_eq!((term(5).kind, term(5).weight, term(5).start), (term_kinds::FRESNEL, 0.5, 1.5));
    assert_eq!(term(7).kind, term_kinds::FRESNEL | term_kinds::REST);
    assert_eq!(records[5].emissive, [0.0; 3]);
    assert_eq!(records[5].flags & material_flags::SOLID, material_flags::SOLID);
    assert_eq!(warnings.iter().filter(|line| line.contains("emission")).count(), 2, "{warnings:?}");
    // The glass has no share and no triangle, and the trees' own coats are gone.
    let seen = lobes.in_sight(&scene, &records);
    assert_eq!(seen.len(), 2 + 3);
    assert!(seen.iter().all(|record| record.transmission == 0.0) && !lobes.have_textures(&seen));
    assert_eq!(seen.iter().filter(|record| record.flags & material_flags::COAT != 0).count(), 2);
}
