//! Which layers a rendering is asked for beside its colour, and what the kernels need for them.
//!
//! Key decision: a request is a set of features, like the effects of a scene: what is not asked for has no code in any kernel, no bytes in
//! the state, no leaf in the film and no row in a table. Numbers of things cannot be averaged; they are those of the first sample alone,
//! so the tables tell the kernels which one that is.
//!
//! **Invariant:** without a request, program, state, buffers and film are those of a renderer that knows of no layers.

use std::{fmt, str::FromStr};

use super::{
    error::Error,
    records::{NONE, TriangleRecord},
    tables::Tables,
};

/// The layers that a rendering is asked for; the colour is always there, and so is the number of samples.
///
/// **Shape:** `albedo` and `variance` have channels `R G B`, `normal` and `position` `X Y Z`; depth is the layer `Z`, and it, `object` and
/// `material` are their only channel. All are in the order of these fields.
///
/// A path that ends before it meets a surface that scatters (by roulette, absorption or its depth) counts with albedo and normal 0, as it
/// counts with no colour.
///
/// **Cost:** a word of state per lane and component while paths are in flight, three words of the film per component (two for numbers), a
/// stage per step; `variance` has no state and no stage. The film must fit one binding: the colour takes 10 words per pixel, albedo and
/// normal 18 more, everything together 55.
///
/// **Source:** Open Image Denoise, documentation of the filter `RT`, for albedo and normal: perfect mirrors and glass are followed, so that
/// glass is the Fresnel blend of what it reflects and transmits; metals have their reflectivity at normal incidence; coats that absorb
/// nothing are left out. OpenEXR, standard channel names, for `Z`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct LayerRequest {
    /// In 0..=1, the mean over the samples: base colour of the first surface that is not a mirror or smooth glass alone, times what mirrors
    /// and glass before it let through. Light that the surface emits is added and cut at 1; so is the environment's where a path leaves the
    /// scene and sees it.
    pub albedo: bool,
    /// In -1..=1, the mean over the samples: world-space shading normal of the same surface, turned to the viewer; 0 where there is none.
    pub normal: bool,
    /// Metres along the camera's axis (planar, not along the ray) to the first surface, the mean over the samples that meet one; infinite
    /// where none does.
    pub depth: bool,
    /// World-space metres of the first surface, the mean over the samples that meet one; 0 where none does.
    pub position: bool,
    /// Number of the first surface's object, into [`Scene::objects`](crate::scene::Scene::objects): that of the first sample, because
    /// numbers have no mean. [`LayerRequest::NOTHING`] where this sample meets nothing.
    pub object: bool,
    /// The same for its material, into [`Scene::materials`](crate::scene::Scene::materials).
    pub material: bool,
    /// Of the mean colour: the unbiased variance of the samples over their number; infinite with fewer than two samples.
    pub variance: bool,
}

impl LayerRequest {
    /// Nothing but the colour.
    pub const NONE: LayerRequest =
        LayerRequest { albedo: false, normal: false, depth: false, position: false, object: false, material: false, variance: false };
    /// Everything there is.
    pub const ALL: LayerRequest =
        LayerRequest { albedo: true, normal: true, depth: true, position: true, object: true, material: true, variance: true };
    /// What a request written as text may name, besides `all` and `none`.
    pub const NAMES: [&'static str; 7] = ["albedo", "normal", "depth", "position", "object", "material", "variance"];
    /// The number in the layers `object` and `material` where the camera's ray meets nothing.
    pub const NOTHING: u32 = NONE;

    /// True when anything is asked for.
    pub fn any(&self) -> bool {
        *self != LayerRequest::NONE
    }

    /// True when paths must be looked at on their way; the variance needs only what they bring home.
    pub fn needs_stage(&self) -> bool {
        LayerRequest { variance: false, ..*self }.any()
    }

    /// By the names under which `@if` asks for them.
    pub fn features(&self) -> [(&'static str, bool); 7] {
        [
            ("layer_albedo", self.albedo),
            ("layer_normal", self.normal),
            ("layer_depth", self.depth),
            ("layer_position", self.position),
            ("layer_object", self.object),
            ("layer_material", self.material),
            ("layer_variance", self.variance),
        ]
    }

    fn flags(&mut self) -> [&mut bool; 7] {
        [&mut self.albedo, &mut self.normal, &mut self.depth, &mut self.position, &mut self.object, &mut self.material, &mut self.variance]
    }

    /// Appends the table of the layers, where one is asked for: the first sample's number in a row of its own, then the objects of the
    /// triangles by slot. Returns where it begins.
    pub(crate) fn append_table(
        &self,
        tables: &mut Tables,
        first_sample: u32,
        triangles: &[TriangleRecord],
        object_of: &[u32],
    ) -> Option<u32> {
        if !self.object && !self.material {
            return None;
        }
        let row = tables.append(&[first_sample]);
        if self.object {
            let object = |triangle: &TriangleRecord| object_of.get(triangle.id as usize).copied().unwrap_or(0);
            tables.append(&triangles.iter().map(object).collect::<Vec<u32>>());
        }
        Some(row)
    }
}

impl FromStr for LayerRequest {
    type Err = Error;

    /// Names of [`LayerRequest::NAMES`] with commas between them, `all`, or `none`.
    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "all" => return Ok(LayerRequest::ALL),
            "none" => return Ok(LayerRequest::NONE),
            _ => {}
        }
        let mut request = LayerRequest::NONE;
        for name in text.split(',').map(str::trim) {
            let flag = LayerRequest::NAMES.iter().zip(request.flags()).find(|(known, _)| **known == name);
            match flag {
                Some((_, flag)) => *flag = true,
                None => return Err(Error::UnknownLayer { name: name.to_owned() }),
            }
        }
        Ok(request)
    }
}

impl fmt::Display for LayerRequest {
    /// As [`from_str`](Self::from_str) reads it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut request = *self;
        let names: Vec<&str> = LayerRequest::NAMES.iter().zip(request.flags()).filter(|(_, flag)| **flag).map(|(name, _)| *name).collect();
        f.write_str(if names.is_empty() { String::from("none") } else { names.join(",") }.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a name that switches another layer on, a feature under its neighbour's name, a mistake that asks for nothing in silence.
    #[test]
    fn a_request_is_read_as_it_is_written() {
        for (index, name) in LayerRequest::NAMES.iter().enumerate() {
            let request: LayerRequest = name.parse().expect("a layer");
            assert_eq!(request.to_string(), *name);
            let on: Vec<&str> = request.features().iter().filter(|(_, is_on)| *is_on).map(|(feature, _)| *feature).collect();
            assert_eq!(on, [format!("layer_{name}")], "{index}");
            assert_eq!(request.needs_stage(), *name != "variance");
        }
        assert_eq!("depth, albedo".parse(), Ok(LayerRequest { albedo: true, depth: true, ..LayerRequest::NONE }));
        assert_eq!(("all".parse(), "none".parse()), (Ok(LayerRequest::ALL), Ok(LayerRequest::NONE)));
        for text in ["", "depth,", "Depth", "alpha"] {
            let message = text.parse::<LayerRequest>().expect_err("no layer").to_string();
            assert!(message.contains("albedo, normal"), "{message}");
        }
    }

    // Kills: objects in the order of the scene instead of the slots, a table that nobody has asked for.
    #[test]
    fn objects_are_listed_by_slot() {
        let triangles = [4, 0, 2, 1, 9].map(|id| TriangleRecord { id, ..TriangleRecord::default() });
        let mut tables = Tables::default();
        for request in [LayerRequest::NONE, LayerRequest { albedo: true, variance: true, ..LayerRequest::NONE }] {
            assert_eq!(request.append_table(&mut tables, 7, &triangles, &[]), None);
        }
        assert!(tables.rows.is_empty());
        tables.append(&[1; 5]);
        assert_eq!(LayerRequest::ALL.append_table(&mut tables, 7, &triangles, &[10, 11, 12, 13, 14]), Some(2));
        assert_eq!(tables.rows[2..], [[7, 0, 0, 0], [14, 10, 12, 11], [0; 4]]);
    }
}
