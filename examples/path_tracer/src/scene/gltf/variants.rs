//! KHR_materials_variants: which material a primitive has when a variant is chosen.
//!
//! Key decision: a variant is chosen by its name for the whole file, before anything is shown; a primitive that does not mention it keeps
//! its default material, as the extension says.

use serde::Deserialize;

use super::Warnings;
use super::json::{Document, Primitive, extension};
use crate::error::Fault;

const NAME: &str = "KHR_materials_variants";

#[derive(Default, Deserialize)]
#[serde(default)]
struct Variants {
    variants: Vec<Variant>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Variant {
    name: String,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Mappings {
    mappings: Vec<Mapping>,
}

#[derive(Deserialize)]
struct Mapping {
    material: usize,
    #[serde(default)]
    variants: Vec<usize>,
}

/// The index of the variant called `wanted`; without a wish the names are told, because the default is only one of several pictures.
pub(super) fn choose(document: &Document, wanted: Option<&str>, warnings: &mut Warnings) -> Result<Option<usize>, Fault> {
    let known = extension::<Variants>(&document.extensions, NAME);
    let Some(wanted) = wanted else {
        // Nobody asks for a variant, so a broken list of them is no reason to refuse the file.
        let names = known.ok().flatten().unwrap_or_default();
        if !names.variants.is_empty() {
            warnings.push(format!("the default materials are shown; there are the variants {}", listed(&names)));
        }
        return Ok(None);
    };
    let known = known?.unwrap_or_default();
    let missing = || match known.variants.is_empty() {
        true => Fault::invalid(NAME, format_args!("there is no variant '{wanted}', the file has none")),
        false => Fault::invalid(NAME, format_args!("there is no variant '{wanted}', there are {}", listed(&known))),
    };
    known.variants.iter().position(|variant| variant.name == wanted).map(Some).ok_or_else(missing)
}

fn listed(variants: &Variants) -> String {
    variants.variants.iter().map(|variant| format!("'{}'", variant.name)).collect::<Vec<_>>().join(", ")
}

/// The material of a primitive under the variant.
pub(super) fn material(primitive: &Primitive, variant: Option<usize>) -> Result<Option<usize>, Fault> {
    let Some(variant) = variant else { return Ok(primitive.material) };
    let mappings = extension::<Mappings>(&primitive.extensions, NAME)?.unwrap_or_default();
    let chosen = mappings.mappings.iter().find(|mapping| mapping.variants.contains(&variant));
    Ok(chosen.map(|mapping| mapping.material).or(primitive.material))
}
