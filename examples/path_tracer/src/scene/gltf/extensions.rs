//! Which extensions are understood, which can be left out, and which end the reading.
//!
//! Key decision: an extension is refused only when the file requires it; otherwise it is named once and the file's fallback is shown.

use super::Warnings;
use super::json::Document;
use crate::error::Fault;

/// Read in full, or kept in full though not shown yet (which is said in one line where it happens).
const READ: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_transform",
];

/// Leaving these out changes no default picture, so even a requirement is no reason to refuse the file.
const HARMLESS: &[&str] = &["KHR_xmp", "KHR_xmp_json_ld"];

pub(super) fn check(document: &Document, warnings: &mut Warnings) -> Result<(), Fault> {
    let listed = |list: &[&str], name: &String| list.contains(&name.as_str());
    for name in &document.extensions_required {
        if !listed(READ, name) && !listed(HARMLESS, name) {
            return Err(Fault::unsupported("extensionsRequired", name));
        }
    }
    for name in document.extensions_used.iter().chain(&document.extensions_required) {
        if !listed(READ, name) {
            warnings.push(format!("extension {name} is left out"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(used: &[&str], required: &[&str]) -> Result<Vec<String>, String> {
        let owned = |names: &[&str]| names.iter().copied().map(String::from).collect();
        let document = Document { extensions_used: owned(used), extensions_required: owned(required), ..Document::default() };
        let mut warnings = Warnings::default();
        check(&document, &mut warnings).map_err(|fault| fault.in_named("x").to_string())?;
        Ok(warnings.into_lines())
    }

    // Kills: showing a scene whose required part is missing, and refusing without a name.
    #[test]
    fn required_extensions_are_refused_by_name() {
        for name in ["KHR_draco_mesh_compression", "EXT_lights_ies", "KHR_texture_basisu", "VENDOR_unheard_of"] {
            assert!(checked(&[name], &[name]).unwrap_err().contains(name));
            assert_eq!(checked(&[name, name], &[]).unwrap(), [format!("extension {name} is left out")]);
        }
        assert!(checked(READ, READ).unwrap().is_empty());
        assert_eq!(checked(HARMLESS, HARMLESS).unwrap().len(), HARMLESS.len());
    }
}
