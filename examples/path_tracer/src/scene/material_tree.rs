//! Materials put together from other materials, in the manner of mental ray's layering library (Mila): leaves are the lobes of whole
//! materials, inner nodes say how much of the light goes to which child.
//!
//! Key decision: shares depend on the point and on the direction of the viewer, not on where light comes from. What one child takes is what
//! the others lack, so that under light of one strength from everywhere a tree shows nobody more than its brightest leaf would. The price is
//! that a curve is not reciprocal: of a single beam at a grazing angle, summed over all viewers, more than all may come back (1.3 times at 80
//! degrees from a mirror over white under the reflectance of glass). It gives up on layers with a thickness between them.
//!
//! The material that carries the tree keeps what belongs to the surface as a whole: its emission, its alpha, whether it bounds a solid and what
//! that absorbs, and the normal map that the curves follow. Everything else of it is replaced by the leaves, each with its own normal map.
//!
//! **Invariant:** shares of all leaves add up to at most 1 in every direction.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016 (trees of materials on a GPU); KHR_materials_clearcoat for a layer whose
//! share is a curve of the angle of view.

use super::model::{Material, TextureUse};

/// A material as a tree: [`Material::tree`].
#[derive(Clone, Debug, PartialEq)]
pub enum MaterialTree {
    /// The lobes of a material of the scene, by its number. It has no tree of its own.
    Leaf(u32),
    /// Each child by its weight. Factors that add up to more than 1 are divided by their sum, textures or not; what they lack to 1 absorbs.
    /// Two children that divide a surface by a mask are a [`Layer`].
    Mix(Vec<(Weight, MaterialTree)>),
    /// One child over another.
    Layer(Box<Layer>),
}

/// `over` gets the share `weight * curve`, `under` the rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// How much of the surface the layer covers.
    pub weight: Weight,
    /// How much of the light it takes, by the angle.
    pub curve: Curve,
    /// The layer.
    pub over: MaterialTree,
    /// What the layer lies on.
    pub under: MaterialTree,
}

/// A number in 0..=1 that a texture may vary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight {
    /// The number.
    pub factor: f32,
    /// Its red channel, linear, multiplies the factor.
    pub texture: Option<TextureUse>,
}

impl Weight {
    /// A weight that is the same everywhere.
    pub fn constant(factor: f32) -> Weight {
        Weight { factor, texture: None }
    }
}

/// Share of the light that a layer takes, by the cosine of the angle between the view and the shading normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// All of it from everywhere.
    Constant,
    /// What a smooth dielectric of this index of refraction reflects; the same from inside of a solid.
    Fresnel {
        /// Against the outside.
        ior: f32,
    },
    /// `normal + (grazing - normal) * (1 - cosine)^exponent`; 0.04, 1 and 5 are Schlick's form of an index of 1.5.
    Custom {
        /// At normal incidence, 0..=1.
        normal: f32,
        /// At the horizon, 0..=1.
        grazing: f32,
        /// How late it rises, more than 0.
        exponent: f32,
    },
}

impl MaterialTree {
    /// A tree with more nodes is refused.
    pub const MOST_NODES: usize = 64;
    /// A tree with more leaves is refused: lobes lie in a kernel's own memory, of which WGSL promises 8 KiB.
    pub const MOST_LEAVES: usize = 32;

    /// A layer over something.
    pub fn layer(weight: Weight, curve: Curve, over: MaterialTree, under: MaterialTree) -> MaterialTree {
        MaterialTree::Layer(Box::new(Layer { weight, curve, over, under }))
    }

    /// The materials of all leaves, from left to right.
    pub fn leaves(&self) -> Vec<u32> {
        let mut leaves = Vec::new();
        self.visit(&mut |node| {
            if let MaterialTree::Leaf(material) = node {
                leaves.push(*material);
            }
        });
        leaves
    }

    /// The weights of all inner nodes.
    pub fn weights(&self) -> Vec<&Weight> {
        let mut weights = Vec::new();
        self.visit(&mut |node| match node {
            MaterialTree::Leaf(_) => {}
            MaterialTree::Mix(children) => weights.extend(children.iter().map(|(weight, _)| weight)),
            MaterialTree::Layer(layer) => weights.push(&layer.weight),
        });
        weights
    }

    /// Parents before their children.
    fn visit<'a>(&'a self, see: &mut impl FnMut(&'a MaterialTree)) {
        see(self);
        match self {
            MaterialTree::Leaf(_) => {}
            MaterialTree::Mix(children) => children.iter().for_each(|(_, child)| child.visit(see)),
            MaterialTree::Layer(layer) => {
                layer.over.visit(see);
                layer.under.visit(see);
            }
        }
    }

    /// What keeps the tree from being part of a valid scene with these materials.
    pub(super) fn fault(&self, materials: &[Material]) -> Option<String> {
        let mut n_nodes = 0;
        self.visit(&mut |_| n_nodes += 1);
        if n_nodes > Self::MOST_NODES {
            return Some(format!("its tree has {n_nodes} nodes, the most is {}", Self::MOST_NODES));
        }
        let n_leaves = self.leaves().len();
        if n_leaves > Self::MOST_LEAVES {
            return Some(format!("its tree has {n_leaves} leaves, the most is {}", Self::MOST_LEAVES));
        }
        for leaf in self.leaves() {
            match materials.get(leaf as usize) {
                None => return Some(format!("material {leaf} of its tree does not exist")),
                Some(material) if material.tree.is_some() => {
                    return Some(format!("'{}' of its tree has a tree of its own: write that one out in its place", material.name));
                }
                Some(_) => {}
            }
        }
        if !self.weights().iter().all(|weight| weight.factor.is_finite()) {
            return Some(String::from("a weight of its tree is not finite"));
        }
        let mut is_finite = true;
        self.visit(&mut |node| {
            let numbers = match node {
                MaterialTree::Layer(layer) => match layer.curve {
                    Curve::Constant => [0.0; 3],
                    Curve::Fresnel { ior } => [ior; 3],
                    Curve::Custom { normal, grazing, exponent } => [normal, grazing, exponent],
                },
                MaterialTree::Leaf(_) | MaterialTree::Mix(_) => [0.0; 3],
            };
            is_finite &= numbers.iter().all(|number| number.is_finite());
        });
        (!is_finite).then(|| String::from("a curve of its tree is not finite"))
    }
}
