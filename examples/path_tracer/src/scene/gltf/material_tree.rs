//! The custom property `material_tree` of a material: other materials of the file, put together.
//!
//! Key decision: glTF has no extension for it and Blender no panel, so it is a property like the others, in JSON or in a text that holds JSON.
//! Leaves are materials of the file, by name or by number, which no mesh needs to have.
//!
//! ```json
//! {"over": "lacquer", "weight": 1, "fresnel": 1.5,
//!  "under": {"mix": [{"weight": 0.7, "of": "paint"}, {"weight": 0.3, "of": "flakes"}]}}
//! ```
//!
//! A layer has a `fresnel` index, a `curve` of three numbers (at the normal, at the horizon, exponent), or neither; `weight_texture` beside a
//! weight is a glTF texture reference. It gives up on nothing that [`MaterialTree`] can say.
//!
//! **Invariant:** no text makes the reader recurse deeper than [`MaterialTree::MOST_NODES`]; a member that means nothing is an error.

use std::fmt::Display;

use serde::Deserialize;
use serde_json::{Map, Value};

use super::json::TextureInfo;
use crate::error::Fault;
use crate::scene::{Curve, MaterialTree, TextureUse, Weight};

/// The rest of the file, as a tree sees it.
pub(super) trait Surroundings {
    /// The scene's number of the material of that name or number.
    fn leaf(&mut self, named: &Value) -> Result<u32, Fault>;
    /// A texture of the file.
    fn texture(&mut self, info: &TextureInfo) -> Result<Option<TextureUse>, Fault>;
}

/// Reads the value of the property.
pub(super) fn read(value: &Value, file: &mut impl Surroundings) -> Result<MaterialTree, Fault> {
    let mut n_nodes = 0;
    match value {
        Value::String(text) if text.trim_start().starts_with('{') => {
            let parsed: Value = serde_json::from_str(text).map_err(|error| fault(format_args!("its text is no JSON: {error}")))?;
            read_node(&parsed, &mut n_nodes, file)
        }
        other => read_node(other, &mut n_nodes, file),
    }
}

fn fault(what: impl Display) -> Fault {
    Fault::invalid("material_tree", what)
}

fn read_node(value: &Value, n_nodes: &mut usize, file: &mut impl Surroundings) -> Result<MaterialTree, Fault> {
    *n_nodes += 1;
    if *n_nodes > MaterialTree::MOST_NODES {
        return Err(fault(format_args!("it has more than {} nodes", MaterialTree::MOST_NODES)));
    }
    let Value::Object(members) = value else { return file.leaf(value).map(MaterialTree::Leaf) };
    match (members.get("mix"), members.get("over"), members.get("under")) {
        (Some(children), None, None) => {
            only(members, &["mix"])?;
            let Value::Array(children) = children else { return Err(fault("`mix` is no list")) };
            let read_child = |child: &Value| {
                let Value::Object(members) = child else { return Err(fault("a child in `mix` is no object with `weight` and `of`")) };
                only(members, &["weight", "weight_texture", "of"])?;
                let of = members.get("of").ok_or_else(|| fault("a child in `mix` has no `of`"))?;
                Ok((read_weight(members, file)?, read_node(of, n_nodes, file)?))
            };
            children.iter().map(read_child).collect::<Result<_, Fault>>().map(MaterialTree::Mix)
        }
        (None, Some(over), Some(under)) => {
            only(members, &["over", "under", "weight", "weight_texture", "fresnel", "curve"])?;
            let (weight, curve) = (read_weight(members, file)?, read_curve(members)?);
            Ok(MaterialTree::layer(weight, curve, read_node(over, n_nodes, file)?, read_node(under, n_nodes, file)?))
        }
        _ => Err(fault("a node is the name of a material, or has `mix`, or has `over` and `under`")),
    }
}

fn only(members: &Map<String, Value>, known: &[&str]) -> Result<(), Fault> {
    match members.keys().find(|name| !known.contains(&name.as_str())) {
        Some(name) => Err(fault(format_args!("`{name}` means nothing here, only {} do", known.join(", ")))),
        None => Ok(()),
    }
}

fn number(name: &str, value: &Value) -> Result<f32, Fault> {
    let number = value.as_f64().map(|number| number as f32).filter(|number| number.is_finite());
    number.ok_or_else(|| fault(format_args!("`{name}` is no finite number")))
}

fn read_weight(members: &Map<String, Value>, file: &mut impl Surroundings) -> Result<Weight, Fault> {
    let factor = members.get("weight").map_or(Ok(1.0), |value| number("weight", value))?;
    let texture = match members.get("weight_texture") {
        None => None,
        Some(value) => {
            let info = TextureInfo::deserialize(value).map_err(|error| fault(format_args!("`weight_texture`: {error}")))?;
            file.texture(&info)?
        }
    };
    Ok(Weight { factor, texture })
}

fn read_curve(members: &Map<String, Value>) -> Result<Curve, Fault> {
    match (members.get("fresnel"), members.get("curve")) {
        (None, None) => Ok(Curve::Constant),
        (Some(ior), None) => Ok(Curve::Fresnel { ior: number("fresnel", ior)? }),
        (None, Some(Value::Array(parts))) if parts.len() == 3 => {
            let [normal, grazing, exponent] = [0, 1, 2].map(|index| number("curve", &parts[index]));
            Ok(Curve::Custom { normal: normal?, grazing: grazing?, exponent: exponent? })
        }
        (None, Some(_)) => Err(fault("`curve` is no list of three numbers: at the normal, at the horizon, exponent")),
        (Some(_), Some(_)) => Err(fault("a layer has either `fresnel` or `curve`")),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Materials `a` (5) and `b` (7), and texture 3.
    struct File;

    impl Surroundings for File {
        fn leaf(&mut self, named: &Value) -> Result<u32, Fault> {
            match named.as_str() {
                Some("a") => Ok(5),
                Some("b") => Ok(7),
                _ => Err(fault("no such material")),
            }
        }

        fn texture(&mut self, info: &TextureInfo) -> Result<Option<TextureUse>, Fault> {
            let transform = [glam::Vec3::X, glam::Vec3::Y];
            let wrap = [crate::scene::Wrap::Repeat; 2];
            let found = TextureUse { image: 0, uv_set: info.tex_coord, wrap, linear: true, transform };
            if info.index == 3 { Ok(Some(found)) } else { Err(fault("no such texture")) }
        }
    }

    // Kills: over and under exchanged, a weight that is not 1 when it is not there, a curve read in another order, a text that is taken for a name.
    #[test]
    fn trees_are_read_as_they_are_written() {
        let written = json!({"over": "a", "curve": [0.1, 0.9, 4], "weight_texture": {"index": 3, "texCoord": 1},
            "under": {"mix": [{"weight": 0.25, "of": "b"}, {"of": {"over": "b", "fresnel": 1.5, "weight": 0.5, "under": "a"}}]}});
        let tree = read(&written, &mut File).unwrap();
        let MaterialTree::Layer(top) = &tree else { panic!("{tree:?}") };
        assert_eq!(top.weight.factor, 1.0);
        assert_eq!(top.weight.texture.map(|texture| texture.uv_set), Some(1));
        assert_eq!((top.curve, &top.over), (Curve::Custom { normal: 0.1, grazing: 0.9, exponent: 4.0 }, &MaterialTree::Leaf(5)));
        let inner = MaterialTree::layer(Weight::constant(0.5), Curve::Fresnel { ior: 1.5 }, MaterialTree::Leaf(7), MaterialTree::Leaf(5));
        let mix = vec![(Weight::constant(0.25), MaterialTree::Leaf(7)), (Weight::constant(1.0), inner)];
        assert_eq!(top.under, MaterialTree::Mix(mix));
        assert_eq!(read(&Value::String(written.to_string()), &mut File).unwrap(), tree);
        assert_eq!(read(&json!("b"), &mut File).unwrap(), MaterialTree::Leaf(7));
    }

    // Kills: a mistake that is read as something else, one whose text does not say what would be right, a recursion without an end.
    #[test]
    fn mistakes_are_told() {
        let mut deep = json!("a");
        for _ in 0..60 {
            deep = json!({"over": deep, "under": "b"});
        }
        for (written, expected) in [
            (json!({"over": "a"}), "a node is the name of a material, or has `mix`, or has `over` and `under`"),
            (json!({"over": "a", "under": "b", "wieght": 1}), "`wieght` means nothing here"),
            (json!({"over": "a", "under": "b", "weight": "1"}), "`weight` is no finite number"),
            (json!({"over": "a", "under": "b", "fresnel": 1.5, "curve": [0, 1, 5]}), "either `fresnel` or `curve`"),
            (json!({"over": "a", "under": "b", "curve": [0, 1]}), "no list of three numbers"),
            (json!({"over": "a", "under": "b", "weight_texture": 3}), "`weight_texture`"),
            (json!({"mix": {"a": 1}}), "`mix` is no list"),
            (json!({"mix": ["a"]}), "no object with `weight` and `of`"),
            (json!({"mix": [{"weight": 1}]}), "has no `of`"),
            (json!("{\"over\": "), "its text is no JSON"),
            (json!({"over": "c", "under": "b"}), "no such material"),
            (deep, "more than 64 nodes"),
        ] {
            let told = read(&written, &mut File).unwrap_err().in_named("x").to_string();
            assert!(told.contains(expected), "{told}");
        }
    }
}
