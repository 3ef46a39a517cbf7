//! Custom properties (`extras`): IES profiles of lights and height maps of materials, for which glTF has no place and Blender a panel. Trees of
//! materials are read elsewhere.
//!
//! Key decision: a property holds for everything inside and below the thing that carries it, and the innermost wins: the light or the
//! material itself, its mesh, its node, the nodes above, the scene. The files are looked for and named here and not read.
//!
//! **Invariant:** a file that is kept exists and lies in the folder of the scene or below, as with textures; a property that reaches
//! nothing is told.

use std::collections::HashSet;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value;

use super::super::material_extensions::HeightMap;
use super::super::model::IesProfile;
use super::Warnings;
use super::json::{Document, Light};
use super::nodes::Placed;
use super::uri;
use crate::error::Fault;

/// What is understood of an `extras`; everything else in it is somebody else's.
#[derive(Default, Deserialize)]
#[serde(from = "Value")]
pub(super) struct Extras {
    ies: Option<Value>,
    height_map: Option<Value>,
    height_scale: Option<Value>,
    /// See [`material_tree`](super::material_tree).
    pub(super) material_tree: Option<Value>,
}

impl From<Value> for Extras {
    fn from(value: Value) -> Extras {
        let Value::Object(mut members) = value else { return Extras::default() };
        let mut take = |name: &str| members.remove(name).filter(|value| !value.is_null());
        Extras {
            ies: take("ies"),
            height_map: take("height_map"),
            height_scale: take("height_scale"),
            material_tree: take("material_tree"),
        }
    }
}

/// A thing that can carry properties.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Carrier {
    Scene(usize),
    Node(usize),
    Mesh(usize),
    Material(usize),
    Light(usize),
}

impl fmt::Display for Carrier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Carrier::Scene(index) => write!(f, "scene {index}"),
            Carrier::Node(index) => write!(f, "node {index}"),
            Carrier::Mesh(index) => write!(f, "mesh {index}"),
            Carrier::Material(index) => write!(f, "material {index}"),
            Carrier::Light(index) => write!(f, "light {index}"),
        }
    }
}

/// The properties that name a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Property {
    Ies,
    HeightMap,
}

impl Property {
    const ALL: [Property; 2] = [Property::Ies, Property::HeightMap];

    fn of(self, extras: &Extras) -> Option<&Value> {
        match self {
            Property::Ies => extras.ies.as_ref(),
            Property::HeightMap => extras.height_map.as_ref(),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Property::Ies => "ies",
            Property::HeightMap => "height_map",
        }
    }

    /// What it is for.
    fn bearer(self) -> &'static str {
        match self {
            Property::Ies => "light",
            Property::HeightMap => "material",
        }
    }
}

/// The properties of a file, and who has asked for them.
pub(super) struct CustomProperties<'a> {
    document: &'a Document,
    lights: &'a [Light],
    /// The scene's own file.
    file: &'a Path,
    /// For each node the carrier at it or outside of it, per property.
    outer: [Vec<Option<Carrier>>; 2],
    used: HashSet<(Property, Carrier)>,
    /// Files of the lights that asked, each once.
    pub(super) profiles: Vec<IesProfile>,
}

impl<'a> CustomProperties<'a> {
    /// `placed` has parents before their children.
    pub(super) fn new(document: &'a Document, lights: &'a [Light], file: &'a Path, placed: &[Placed]) -> Self {
        let outer = Property::ALL.map(|_| vec![None; document.nodes.len()]);
        let mut made = CustomProperties { document, lights, file, outer, used: HashSet::new(), profiles: Vec::new() };
        let scene = Carrier::Scene(document.scene.unwrap_or(0));
        for property in Property::ALL {
            let mut outer = vec![made.carries(property, scene).then_some(scene); document.nodes.len()];
            for Placed { node, .. } in placed {
                if made.carries(property, Carrier::Node(*node)) {
                    outer[*node] = Some(Carrier::Node(*node));
                }
                for &child in &document.nodes[*node].children {
                    outer[child] = outer[*node];
                }
            }
            made.outer[property as usize] = outer;
        }
        made
    }

    fn extras(&self, carrier: Carrier) -> Option<&'a Extras> {
        let document = self.document;
        match carrier {
            Carrier::Scene(index) => document.scenes.get(index).map(|scene| &scene.extras),
            Carrier::Node(index) => document.nodes.get(index).map(|node| &node.extras),
            Carrier::Mesh(index) => document.meshes.get(index).map(|mesh| &mesh.extras),
            Carrier::Material(index) => document.materials.get(index).map(|material| &material.extras),
            Carrier::Light(index) => self.lights.get(index).map(|light| &light.extras),
        }
    }

    fn carries(&self, property: Property, carrier: Carrier) -> bool {
        self.extras(carrier).is_some_and(|extras| property.of(extras).is_some())
    }

    /// The place in `profiles` of the one that a light has at a node.
    ///
    /// # Errors
    /// When the property is no text, or there is no such file where the scene may look.
    pub(super) fn profile(&mut self, light: usize, node: usize) -> Result<Option<u32>, Fault> {
        let own = Carrier::Light(light);
        let carrier = if self.carries(Property::Ies, own) { Some(own) } else { self.outer[Property::Ies as usize][node] };
        let Some((name, path)) = self.file(Property::Ies, carrier)? else { return Ok(None) };
        let known = self.profiles.iter().position(|profile| profile.path == path);
        let index = known.unwrap_or_else(|| {
            self.profiles.push(IesProfile { name, path });
            self.profiles.len() - 1
        });
        Ok(u32::try_from(index).ok())
    }

    /// What gives a height map to those materials of a mesh at a node that have none of their own.
    pub(super) fn height_carrier(&self, mesh: usize, node: usize) -> Option<Carrier> {
        let own = Carrier::Mesh(mesh);
        if self.carries(Property::HeightMap, own) { Some(own) } else { self.outer[Property::HeightMap as usize][node] }
    }

    /// The height map of a material that has `outer` around it.
    ///
    /// # Errors
    /// When the file is no text or not where the scene may look, or the scale is no number.
    pub(super) fn height_map(&mut self, material: Option<usize>, outer: Option<Carrier>) -> Result<Option<HeightMap>, Fault> {
        let own = material.map(Carrier::Material).filter(|own| self.carries(Property::HeightMap, *own));
        let carrier = own.or(outer);
        let Some((name, path)) = self.file(Property::HeightMap, carrier)? else { return Ok(None) };
        let scale = match carrier.and_then(|carrier| self.extras(carrier)?.height_scale.as_ref().map(|value| (carrier, value))) {
            None => None,
            Some((carrier, value)) => {
                let number = value.as_f64().map(|number| number as f32).filter(|number| number.is_finite());
                let fault = || Fault::invalid(within(carrier, "height_scale"), format_args!("{} is no finite number", shortened(value)));
                Some(number.ok_or_else(fault)?)
            }
        };
        Ok(Some(HeightMap { name, path, scale }))
    }

    /// The name and the place of the file that a carrier asks for.
    fn file(&mut self, property: Property, carrier: Option<Carrier>) -> Result<Option<(String, PathBuf)>, Fault> {
        let Some(carrier) = carrier else { return Ok(None) };
        let Some(value) = self.extras(carrier).and_then(|extras| property.of(extras)) else { return Ok(None) };
        self.used.insert((property, carrier));
        let place = || within(carrier, &format!("{} {}", property.name(), shortened(value)));
        let Value::String(text) = value else { return Err(Fault::invalid(place(), "it should be the path of a file as text")) };
        // Blender begins relative paths with two slashes, and Windows separates by backslashes.
        let relative = text.replace('\\', "/");
        let relative = relative.strip_prefix("//").unwrap_or(&relative);
        let path = uri::find_beside(relative, self.file).map_err(|what| Fault::invalid(place(), what))?;
        Ok(Some((String::from(relative), path)))
    }

    /// Tells what nothing asks for: properties of the wrong thing, or with nothing below that could use them.
    pub(super) fn tell_unused(&self, placed: &[Placed], warnings: &mut Warnings) {
        let document = self.document;
        let scene = std::iter::once(Carrier::Scene(document.scene.unwrap_or(0)));
        let nodes =
            placed.iter().flat_map(|placed| [Some(Carrier::Node(placed.node)), document.nodes[placed.node].mesh.map(Carrier::Mesh)]);
        for carrier in scene.chain(nodes.flatten()) {
            for property in Property::ALL.into_iter().filter(|property| self.carries(*property, carrier)) {
                if !self.used.contains(&(property, carrier)) {
                    let (name, bearer) = (property.name(), property.bearer());
                    warnings.push(format!("{}: no {bearer} takes it, and it is left out", within(carrier, name)));
                }
            }
            self.tell_tree(carrier, warnings);
        }
        (0..self.lights.len()).for_each(|index| self.tell_tree(Carrier::Light(index), warnings));
        let materials = (0..document.materials.len()).map(|index| (Carrier::Material(index), Property::Ies));
        let lights = (0..self.lights.len()).map(|index| (Carrier::Light(index), Property::HeightMap));
        for (carrier, property) in materials.chain(lights).filter(|(carrier, property)| self.carries(*property, *carrier)) {
            let (name, bearer) = (property.name(), property.bearer());
            warnings.push(format!("{}: it belongs to a {bearer}, and is left out", within(carrier, name)));
        }
        for carrier in (0..document.materials.len()).map(Carrier::Material) {
            let scales = self.extras(carrier).is_some_and(|extras| extras.height_scale.is_some());
            if scales && !self.carries(Property::HeightMap, carrier) {
                warnings.push(format!("{}: there is no height_map beside it, and it is left out", within(carrier, "height_scale")));
            }
        }
    }
}

impl CustomProperties<'_> {
    /// A tree where there is no material.
    fn tell_tree(&self, carrier: Carrier, warnings: &mut Warnings) {
        if self.extras(carrier).is_some_and(|extras| extras.material_tree.is_some()) {
            warnings.push(format!("{}: it belongs to a material, and is left out", within(carrier, "material_tree")));
        }
    }
}

fn within(carrier: Carrier, what: &str) -> String {
    format!("extras of {carrier}, {what}")
}

/// A value for a message.
fn shortened(value: &Value) -> String {
    const MOST: usize = 80;
    let text = match value {
        Value::String(text) => format!("'{text}'"),
        other => other.to_string(),
    };
    text.chars().take(MOST).collect()
}
