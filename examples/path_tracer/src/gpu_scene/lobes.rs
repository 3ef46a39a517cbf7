//! Trees of materials as flat lists of lobes.
//!
//! Key decision: a kernel walks no tree. Each leaf becomes a lobe with the product of all constant weights above it, made in f64, and a list of
//! the terms that depend on the point or on the view; what is left of a layer for what lies under it is the same term, taken from 1. Constant
//! layers, and leaves that can get nothing, are gone before anybody pays for them.
//!
//! A lobe has a record of its own, a copy of its leaf's, so that a kernel sees nothing but materials.
//!
//! **Invariant:** the shares of a list add up to at most 1 for every value of its terms.
//! **Invariant:** a leaf without a share is in no list and calls for no effect.

use std::collections::BTreeSet;

use super::{
    error::Error,
    materials::ETA_MIN_STEP,
    record::GpuRecord as _,
    records::{LobeRecord, MaterialRecord, NONE, TermRecord, material_flags, term_kinds},
    textures::Textures,
};
use crate::scene::{Curve, MaterialTree, Scene, TextureUse, Weight};

/// A factor of a lobe's share that is known at a hit only.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// By the angle of view.
    pub curve: Curve,
    /// In 0..=1, multiplies the curve.
    pub weight: f64,
    /// Multiplies the weight.
    pub texture: Option<TextureUse>,
    /// One minus all of that.
    pub is_rest: bool,
}

/// One leaf with its share.
#[derive(Clone, Debug, PartialEq)]
pub struct Lobe {
    /// The scene's material.
    pub material: u32,
    /// The constant part of the share, above 0.
    pub factor: f64,
    /// The rest of it.
    pub terms: Vec<Term>,
}

impl Term {
    /// The value for a cosine of the view, where the texture is white.
    pub fn value(&self, cosine: f64) -> f64 {
        let taken = self.weight * curve_value(self.curve, cosine);
        if self.is_rest { 1.0 - taken } else { taken }
    }
}

/// Share of a curve at a cosine in 0..=1.
pub fn curve_value(curve: Curve, cosine: f64) -> f64 {
    match curve {
        Curve::Constant => 1.0,
        Curve::Fresnel { ior } => {
            let (eta, s2) = (f64::from(ior), (1.0 - cosine) * (1.0 + cosine) / f64::from(ior).powi(2));
            if s2 >= 1.0 {
                return 1.0;
            }
            let inside = (1.0 - s2).sqrt();
            let parallel = (eta * cosine - inside) / (eta * cosine + inside);
            let perpendicular = (cosine - eta * inside) / (cosine + eta * inside);
            0.5 * (parallel * parallel + perpendicular * perpendicular)
        }
        Curve::Custom { normal, grazing, exponent } => {
            let rise = (1.0 - cosine).powf(f64::from(exponent));
            f64::from(normal) + (f64::from(grazing) - f64::from(normal)) * rise
        }
    }
}

/// The list of a tree, leaves from left to right; `told` hears of every number that was out of its range.
pub fn flatten(tree: &MaterialTree, told: &mut Vec<String>) -> Vec<Lobe> {
    let mut lobes = Vec::new();
    flatten_below(tree, 1.0, &mut Vec::new(), &mut lobes, told);
    lobes
}

fn flatten_below(tree: &MaterialTree, factor: f64, above: &mut Vec<Term>, lobes: &mut Vec<Lobe>, told: &mut Vec<String>) {
    if factor <= 0.0 {
        return;
    }
    match tree {
        MaterialTree::Leaf(material) => lobes.push(Lobe { material: *material, factor, terms: above.clone() }),
        MaterialTree::Mix(children) => {
            let weights: Vec<f64> = children.iter().map(|(weight, _)| within("weight", weight.factor, f32::MAX, told)).collect();
            let sum: f64 = weights.iter().sum();
            if sum > 1.0 + 1e-6 {
                told.push(format!("weights that add up to {sum:.4} (textures aside) were divided by it"));
            }
            for (share, (weight, child)) in weights.iter().map(|weight| weight / sum.max(1.0)).zip(children) {
                let varies =
                    weight.texture.map(|texture| Term { curve: Curve::Constant, weight: 1.0, texture: Some(texture), is_rest: false });
                let depth = above.len();
                above.extend(varies);
                flatten_below(child, factor * share, above, lobes, told);
                above.truncate(depth);
            }
        }
        MaterialTree::Layer(layer) => {
            let (weight, curve) = settled(&layer.weight, layer.curve, told);
            if curve == Curve::Constant && layer.weight.texture.is_none() {
                flatten_below(&layer.over, factor * weight, above, lobes, told);
                flatten_below(&layer.under, factor * (1.0 - weight), above, lobes, told);
                return;
            }
            let term = |is_rest| Term { curve, weight, texture: layer.weight.texture, is_rest };
            // A layer of no weight is none.
            if weight > 0.0 {
                above.push(term(false));
                flatten_below(&layer.over, factor, above, lobes, told);
                above.pop();
                above.push(term(true));
            }
            flatten_below(&layer.under, factor, above, lobes, told);
            if weight > 0.0 {
                above.pop();
            }
        }
    }
}

/// Weight and curve of a layer within their ranges; a curve that is the same everywhere is part of the weight.
fn settled(weight: &Weight, curve: Curve, told: &mut Vec<String>) -> (f64, Curve) {
    let factor = within("weight", weight.factor, 1.0, told);
    match curve {
        Curve::Constant => (factor, curve),
        Curve::Fresnel { ior } => {
            let kept = ior.clamp(0.1, 100.0);
            if kept != ior {
                told.push(format!("index of a curve {ior} became {kept}"));
            }
            let reflects = (kept - 1.0).abs() > ETA_MIN_STEP;
            if reflects { (factor, Curve::Fresnel { ior: kept }) } else { (0.0, Curve::Constant) }
        }
        Curve::Custom { normal, grazing, exponent } => {
            let ends = [("curve at the normal", normal), ("curve at the horizon", grazing)];
            let [normal, grazing] = ends.map(|(what, end)| within(what, end, 1.0, told) as f32);
            if exponent <= 0.0 {
                told.push(format!("exponent of a curve {exponent}: the curve is {grazing} everywhere"));
            }
            if exponent <= 0.0 || normal == grazing {
                return (factor * f64::from(grazing), Curve::Constant);
            }
            (factor, Curve::Custom { normal, grazing, exponent })
        }
    }
}

fn within(what: &str, value: f32, most: f32, told: &mut Vec<String>) -> f64 {
    let kept = value.clamp(0.0, most);
    if kept != value {
        told.push(format!("{what} {value} became {kept}"));
    }
    f64::from(kept)
}

/// The lists of all trees of a scene.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Lobes {
    /// One row that counts the lobes of a tree, then the lobes, for each tree; then all terms. Lobes address terms from the first row on.
    pub(crate) rows: Vec<[u32; 4]>,
}

impl Lobes {
    /// The records that triangles ask for, by their materials and by the leaves of these.
    pub(crate) fn in_sight(&self, scene: &Scene, records: &[MaterialRecord]) -> Vec<MaterialRecord> {
        let used: BTreeSet<u32> = scene.triangles.iter().map(|triangle| triangle.material).collect();
        let own = used.into_iter().filter_map(|index| records.get(index as usize).copied());
        let with_leaves = |record: MaterialRecord| std::iter::once(record).chain(self.leaves(&record).map(|leaf| records[leaf as usize]));
        own.flat_map(with_leaves).collect()
    }

    /// Length of the longest list of these records; 0 without a tree.
    pub(crate) fn most(&self, records: &[MaterialRecord]) -> u32 {
        records.iter().map(|record| self.list(record).count() as u32).max().unwrap_or(0)
    }

    /// True when a share of one of these records looks into an image.
    pub(crate) fn have_textures(&self, records: &[MaterialRecord]) -> bool {
        let terms = |lobe: LobeRecord| (0..lobe.term_count).map(move |term| (lobe.terms + term * TermRecord::ROWS) as usize);
        let texture = |row: usize| bytemuck::cast::<[[u32; 4]; 2], TermRecord>([self.rows[row], self.rows[row + 1]]).texture;
        records.iter().flat_map(|record| self.list(record)).flat_map(terms).any(|row| texture(row) != NONE)
    }

    fn leaves(&self, record: &MaterialRecord) -> impl Iterator<Item = u32> + use<'_> {
        self.list(record).map(|lobe| lobe.material)
    }

    fn list(&self, record: &MaterialRecord) -> impl Iterator<Item = LobeRecord> + use<'_> {
        let list = record.tree.checked_sub(1).map_or(&[][..], |first| &self.rows[first as usize..]);
        let count = list.first().map_or(0, |row| row[0] as usize);
        list.iter().skip(1).take(count).map(|row| bytemuck::cast(*row))
    }
}

/// Flattens all trees; records of leaves follow those of the scene's materials, and a tree's own record says where its list is.
pub(crate) fn pack(
    scene: &Scene,
    records: &mut Vec<MaterialRecord>,
    textures: &mut Textures,
    warnings: &mut Vec<String>,
) -> Result<Lobes, Error> {
    let mut packed = Lobes::default();
    let mut terms = Vec::new();
    let mut lists: Vec<(usize, Vec<LobeRecord>)> = Vec::new();
    for (index, material) in scene.materials.iter().enumerate() {
        let Some(tree) = &material.tree else { continue };
        let mut told = Vec::new();
        let lobes = flatten(tree, &mut told);
        if !told.is_empty() {
            warnings.push(format!("tree of material `{}`: {}", material.name, told.join(", ")));
        }
        let (mut list, mut glowing) = (Vec::new(), BTreeSet::new());
        for lobe in &lobes {
            let first = terms.len() as u32;
            for term in &lobe.terms {
                terms.push(term_record(term, textures.add(&scene.images, term.texture.as_ref(), index)?));
            }
            let count = scene.materials.len();
            let dangles = Error::Dangling { what: "tree of material", index, target: "material", value: lobe.material, count };
            let leaf = *records.get(lobe.material as usize).filter(|_| (lobe.material as usize) < count).ok_or(dangles)?;
            if leaf.emissive.iter().any(|&value| value > 0.0) {
                glowing.insert(format!("`{}`", scene.materials[lobe.material as usize].name));
            }
            list.push(LobeRecord {
                material: records.len() as u32,
                factor: lobe.factor as f32,
                terms: first,
                term_count: lobe.terms.len() as u32,
            });
            records.push(as_leaf(leaf, &records[index]));
        }
        if !glowing.is_empty() {
            let names = glowing.into_iter().collect::<Vec<_>>().join(", ");
            warnings.push(format!("tree of material `{}`: the emission of leaves is left out: {names}", material.name));
        }
        let leaves = records.len() - list.len();
        let (own, made) = records.split_at_mut(leaves);
        settle_root(&mut own[index], made);
        lists.push((index, list));
    }
    let n_rows: usize = lists.iter().map(|(_, list)| 1 + list.len()).sum();
    for (index, mut list) in lists {
        // 0 is no tree.
        records[index].tree = packed.rows.len() as u32 + 1;
        packed.rows.push([list.len() as u32, 0, 0, 0]);
        list.iter_mut().for_each(|lobe| lobe.terms = n_rows as u32 + lobe.terms * 2);
        packed.rows.extend_from_slice(bytemuck::cast_slice(&list));
    }
    packed.rows.extend_from_slice(bytemuck::cast_slice(&terms));
    Ok(packed)
}

/// A leaf keeps its lobes; what belongs to the surface as a whole is the tree's.
fn as_leaf(leaf: MaterialRecord, root: &MaterialRecord) -> MaterialRecord {
    let flags = leaf.flags & material_flags::COAT | root.flags & !material_flags::COAT;
    MaterialRecord { flags, emissive: [0.0; 3], emissive_texture: NONE, alpha_cutoff: root.alpha_cutoff, ..leaf }
}

/// Of a material that is a tree nothing is left but what belongs to the surface as a whole; its transmission is the largest of its leaves, so
/// that whoever asks what may pass the surface need not know of trees.
fn settle_root(root: &mut MaterialRecord, leaves: &[MaterialRecord]) {
    let passes = |leaf: &MaterialRecord| {
        let is_metal = leaf.metallic >= 1.0 && leaf.metallic_roughness_texture == NONE;
        if is_metal { 0.0 } else { leaf.transmission }
    };
    root.flags &= !material_flags::COAT;
    (root.metallic, root.roughness, root.metallic_roughness_texture) = (0.0, 1.0, NONE);
    root.transmission = leaves.iter().map(passes).fold(0.0, f32::max);
}

fn term_record(term: &Term, texture: u32) -> TermRecord {
    let (kind, start, grazing, exponent) = match term.curve {
        Curve::Constant => (term_kinds::CONSTANT, 0.0, 0.0, 0.0),
        Curve::Fresnel { ior } => (term_kinds::FRESNEL, ior, 0.0, 0.0),
        Curve::Custom { normal, grazing, exponent } => (term_kinds::CUSTOM, normal, grazing, exponent),
    };
    let kind = if term.is_rest { kind | term_kinds::REST } else { kind };
    TermRecord { kind, weight: term.weight as f32, texture, start, grazing, exponent, ..TermRecord::default() }
}

#[cfg(test)]
mod tests;
