//! Materials: what a library says, in terms of the scene's model.
//!
//! Key decision: the exponent of Phong's highlight becomes the width of microfacets with the same curvature at its peak, `Ks` decides
//! whether there is a highlight at all, and `illum` what is glass or a mirror. `Pr` and `Pm`, where they are, say it directly, and their maps
//! instead of them, because exporters write the number that a map has replaced.
//!
//! **Source:** B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, section 5.3, for the exponent.

use std::collections::HashMap;
use std::path::Path;

use glam::Vec3;

use super::super::gltf::{Warnings, texture};
use super::super::limits;
use super::super::model::{AlphaMode, Image, Material, TextureUse};
use super::beside;
use super::mtl::Definition;
use super::texture_map::Map;
use crate::error::Fault;

/// Makes materials on demand, and decodes each image once.
pub(super) struct Materials<'a> {
    definitions: &'a HashMap<String, Definition>,
    scene: &'a Path,
    images: Vec<Image>,
    /// `None` for a file that cannot be shown.
    known: HashMap<String, Option<u32>>,
    /// Images made of two: colours, opacities, and whether the colours count.
    cut: HashMap<(u32, u32, bool), u32>,
    /// Images made of two: roughness and metal.
    surfaces: HashMap<[Option<u32>; 2], u32>,
    n_texels: u64,
}

impl<'a> Materials<'a> {
    pub(super) fn new(definitions: &'a HashMap<String, Definition>, scene: &'a Path) -> Materials<'a> {
        Materials {
            definitions,
            scene,
            images: Vec::new(),
            known: HashMap::new(),
            cut: HashMap::new(),
            surfaces: HashMap::new(),
            n_texels: 0,
        }
    }

    pub(super) fn into_images(self) -> Vec<Image> {
        self.images
    }

    /// The material of a name; the empty name is that of faces without one.
    ///
    /// # Errors
    /// When the images of the scene together are too large.
    pub(super) fn make(&mut self, name: &str, warnings: &mut Warnings) -> Result<Material, Fault> {
        let Some(definition) = self.definitions.get(name) else {
            warnings.push(match name {
                "" => String::from("faces without a material are white and matt under a thin coat"),
                _ => format!("material '{name}' is not defined and becomes white and matt under a thin coat"),
            });
            return Ok(Material { name: name.to_owned(), ..Material::default() });
        };
        let mut material = factors(name, definition, warnings);
        if let Some(map) = &definition.map_diffuse {
            material.base_color_texture = self.texture(map, warnings)?;
        }
        if let Some(map) = &definition.map_emissive {
            material.emissive_texture = self.texture(map, warnings)?;
            if material.emissive_texture.is_some() && definition.emissive.is_none_or(|color| color == Vec3::ZERO) {
                material.emissive = Vec3::ONE;
            }
        }
        if let Some(map) = definition.map_normal.as_ref().or(definition.map_bump.as_ref()) {
            material.normal_texture = self.texture(map, warnings)?;
            material.normal_scale = map.strength;
            let image = material.normal_texture.and_then(|texture| self.images.get(texture.image as usize));
            if definition.map_normal.is_none() && image.is_some_and(is_grey) {
                warnings.push(format!("material '{name}': the heights of map_Bump '{}' are left out, normals are read", map.name));
                material.normal_texture = None;
            }
        }
        self.surface(&mut material, definition, warnings)?;
        if let Some(map) = &definition.map_opacity {
            self.cut_out(&mut material, map, warnings)?;
        }
        Ok(material)
    }

    /// How a material looks into the image of a map; `None` after a warning when there is none.
    fn texture(&mut self, map: &Map, warnings: &mut Warnings) -> Result<Option<TextureUse>, Fault> {
        let image = match self.known.get(&map.name) {
            Some(&known) => known,
            None => {
                let image = match self.decode(&map.name) {
                    Ok(image) => Some(self.add(image)?),
                    Err(what) => {
                        warnings.push(format!("texture {what}; it is left out"));
                        None
                    }
                };
                self.known.insert(map.name.clone(), image);
                image
            }
        };
        Ok(image.map(|image| TextureUse { image, uv_set: 0, wrap: map.wrap(), linear: true, transform: map.transform() }))
    }

    fn decode(&self, name: &str) -> Result<Image, String> {
        let bytes = beside(name, self.scene).map_err(|what| format!("{name}: {what}"))?;
        let n_left = limits::IMAGE_TEXELS - self.n_texels;
        texture::decode(&bytes, name.to_owned(), n_left).map_err(|fault| fault.in_named(name).to_string())
    }

    fn add(&mut self, image: Image) -> Result<u32, Fault> {
        let n_texels = self.n_texels + image.texels.len() as u64;
        if n_texels > limits::IMAGE_TEXELS {
            return Err(Fault::unsupported("textures", format_args!("a scene of more than {} texels", limits::IMAGE_TEXELS)));
        }
        self.n_texels = n_texels;
        self.images.push(image);
        // As many as there are files, and each has a texel.
        Ok(u32::try_from(self.images.len() - 1).unwrap_or(u32::MAX))
    }

    /// Puts `map_Pr` and `map_Pm` into the green and the blue of one image, where the scene's model has them.
    fn surface(&mut self, material: &mut Material, definition: &Definition, warnings: &mut Warnings) -> Result<(), Fault> {
        let mut texture = |map: &Option<Map>| map.as_ref().map_or(Ok(None), |map| self.texture(map, warnings));
        let [roughness, metallic] = [texture(&definition.map_roughness)?, texture(&definition.map_metallic)?];
        let Some(first) = roughness.or(metallic) else { return Ok(()) };
        if metallic.is_some_and(|second| (first.transform, first.wrap) != (second.transform, second.wrap)) {
            warnings.push(format!("material '{}': map_Pm lies as map_Pr does", material.name));
        }
        let key = [roughness, metallic].map(|texture| texture.map(|texture| texture.image));
        let image = match self.surfaces.get(&key) {
            Some(&known) => known,
            None => {
                let [roughness, metallic] = key.map(|image| self.images.get(image? as usize));
                let Some(made) = surface_of(roughness, metallic) else { return Ok(()) };
                let image = self.add(made)?;
                self.surfaces.insert(key, image);
                image
            }
        };
        material.metallic_roughness_texture = Some(TextureUse { image, ..first });
        if roughness.is_some() {
            material.roughness = 1.0;
        }
        if metallic.is_some() {
            material.metallic = 1.0;
        }
        Ok(())
    }

    /// Puts `map_d` into the alpha of the base colour, where the scene's model has it.
    fn cut_out(&mut self, material: &mut Material, map: &Map, warnings: &mut Warnings) -> Result<(), Fault> {
        let Some(mask) = self.texture(map, warnings)? else { return Ok(()) };
        let color = material.base_color_texture.unwrap_or(mask);
        if (color.transform, color.wrap) != (mask.transform, mask.wrap) {
            warnings.push(format!("material '{}': map_d '{}' lies as map_Kd does", material.name, map.name));
        }
        let with_color = material.base_color_texture.is_some();
        let key = (color.image, mask.image, with_color);
        let image = match self.cut.get(&key) {
            Some(&known) => known,
            None => {
                let (colors, opacities) = (self.images.get(color.image as usize), self.images.get(mask.image as usize));
                let (Some(colors), Some(opacities)) = (colors, opacities) else { return Ok(()) };
                let made = with_alpha(colors, opacities, with_color);
                let image = self.add(made)?;
                self.cut.insert(key, image);
                image
            }
        };
        material.base_color_texture = Some(TextureUse { image, ..color });
        material.alpha = AlphaMode::Blend;
        Ok(())
    }
}

/// Everything but textures.
fn factors(name: &str, definition: &Definition, warnings: &mut Warnings) -> Material {
    let unit = |color: Vec3| color.clamp(Vec3::ZERO, Vec3::ONE);
    let diffuse = unit(definition.diffuse.unwrap_or(Vec3::splat(if definition.map_diffuse.is_some() { 1.0 } else { 0.8 })));
    let specular = unit(definition.specular.unwrap_or(Vec3::ZERO));
    let opacity = definition.opacity.unwrap_or(1.0).clamp(0.0, 1.0);
    let has_maps = definition.map_roughness.is_some() || definition.map_metallic.is_some();
    let physical = definition.roughness.is_some() || definition.metallic.is_some() || has_maps;
    // A number below 1 is what exporters write that do not know it, and no glass.
    let ior = definition.ior.filter(|&ior| ior > 1.0);
    let model = definition.model.unwrap_or(2.0);
    let mut material = Material {
        name: name.to_owned(),
        base_color: diffuse.extend(opacity),
        metallic: definition.metallic.unwrap_or(0.0).clamp(0.0, 1.0),
        emissive: definition.emissive.unwrap_or(Vec3::ZERO).max(Vec3::ZERO),
        alpha: if opacity < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
        ior: ior.unwrap_or(1.5),
        ..Material::default()
    };
    let highlight = specular.max_element() > 0.0 && model >= 2.0;
    material.roughness = match (definition.roughness, highlight) {
        (Some(roughness), _) => roughness.clamp(0.0, 1.0),
        (None, true) => roughness_of(definition.exponent.unwrap_or(0.0)),
        (None, false) => 1.0,
    };

    let is = |models: &[f32]| models.contains(&model);
    let refracts = is(&[4.0, 6.0, 7.0]) && (opacity < 1.0 || definition.ior.is_none_or(|ior| ior > 1.0));
    if refracts || (is(&[5.0]) && opacity < 1.0) {
        // Opacity stands for the share of the light that passes, and is spent on that.
        material.transmission = 1.0;
        material.solid = true;
        material.base_color = unit(definition.filter.unwrap_or(Vec3::ONE)).extend(1.0);
        material.alpha = AlphaMode::Opaque;
        material.roughness = definition.roughness.unwrap_or(0.0).clamp(0.0, 1.0);
    } else if is(&[3.0, 5.0]) && !physical && highlight && diffuse == Vec3::ZERO && definition.map_diffuse.is_none() {
        // A black base under a reflection that is traced: a mirror.
        material.metallic = 1.0;
        material.base_color = specular.extend(opacity);
        material.roughness = 0.0;
    } else if !highlight && !physical {
        // Lambert's law alone: the same index on both sides reflects nothing.
        material.ior = 1.0;
    } else if highlight && !physical {
        warnings.push(String::from("the strength and colour of highlights (Ks) are left out: they are those of a dielectric"));
    }
    material
}

/// Perceptual roughness of a Phong exponent: the width of microfacets is the root of 2 / (Ns + 2), and roughness the root of that.
fn roughness_of(exponent: f32) -> f32 {
    (2.0 / (exponent.max(0.0) + 2.0)).sqrt().sqrt()
}

/// Heights are stored in grey; a normal map is blue.
fn is_grey(image: &Image) -> bool {
    image.texels.iter().all(|[r, g, b, _]| r.abs_diff(*g) <= 2 && g.abs_diff(*b) <= 2)
}

/// The colours of one image with the opacities of another: its alpha where it has one, its brightness where it has none.
fn with_alpha(colors: &Image, opacities: &Image, with_color: bool) -> Image {
    let has_alpha = opacities.texels.iter().any(|texel| texel[3] < 255);
    let texels = colors.texels.iter().zip(below(colors, opacities)).map(|(&[r, g, b, _], mask)| {
        let alpha = if has_alpha { mask[3] } else { brightness(mask) };
        if with_color { [r, g, b, alpha] } else { [255, 255, 255, alpha] }
    });
    let name = format!("{} cut out by {}", colors.name, opacities.name);
    Image { name, width: colors.width, height: colors.height, texels: texels.collect() }
}

/// Roughness in green and metal in blue, of the size of the first; what is not given is 1.
fn surface_of(roughness: Option<&Image>, metallic: Option<&Image>) -> Option<Image> {
    let first = roughness.or(metallic)?;
    let ones = Image { name: String::new(), width: 1, height: 1, texels: vec![[255; 4]] };
    let [green, blue] = [roughness, metallic].map(|image| image.unwrap_or(&ones));
    let texels = below(first, green).zip(below(first, blue)).map(|(green, blue)| [255, brightness(green), brightness(blue), 255]);
    let names: Vec<&str> = [roughness, metallic].into_iter().flatten().map(|image| image.name.as_str()).collect();
    Some(Image { name: names.join(" with "), width: first.width, height: first.height, texels: texels.collect() })
}

/// For each texel of an image the one of another that lies below its middle.
fn below(image: &Image, other: &Image) -> impl Iterator<Item = [u8; 4]> {
    let at = |place: u32, from: u32, to: u32| (2 * u64::from(place) + 1) * u64::from(to) / (2 * u64::from(from));
    let texel = move |x: u32, y: u32| {
        let index = at(y, image.height, other.height) * u64::from(other.width) + at(x, image.width, other.width);
        usize::try_from(index).ok().and_then(|index| other.texels.get(index)).copied().unwrap_or([255; 4])
    };
    (0..image.height).flat_map(move |y| (0..image.width).map(move |x| texel(x, y)))
}

fn brightness([r, g, b, _]: [u8; 4]) -> u8 {
    u8::try_from((u16::from(r) + u16::from(g) + u16::from(b)) / 3).unwrap_or(u8::MAX)
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    fn made(definition: Definition) -> (Material, Vec<String>) {
        let mut warnings = Warnings::default();
        let material = factors("m", &definition, &mut warnings);
        (material, warnings.into_lines())
    }

    // Kills: an exponent whose roughness is not squared again, highlights without Ks, and a coat on what is matt.
    #[test]
    fn exponents_become_roughness() {
        let shiny = Definition { specular: Some(Vec3::splat(0.5)), exponent: Some(30.0), ..Definition::default() };
        let (material, warnings) = made(shiny.clone());
        assert!((material.roughness - 0.5).abs() < 1e-6 && material.ior == 1.5, "{}", material.roughness);
        assert_eq!(warnings.len(), 1);
        let (matt, warnings) = made(Definition { model: Some(1.0), ..shiny.clone() });
        assert_eq!((matt.roughness, matt.ior, warnings.len()), (1.0, 1.0, 0));
        let (physical, _) = made(Definition { roughness: Some(0.25), metallic: Some(1.0), ..Definition::default() });
        assert_eq!((physical.roughness, physical.metallic, physical.ior), (0.25, 1.0, 1.5));
        assert_eq!(roughness_of(0.0), 1.0);
    }

    // Kills: glass by the number of the model alone (some programs write 4 for everything), opacity that cuts holes into glass, and
    // mirrors that are black.
    #[test]
    fn illum_makes_glass_and_mirrors() {
        for model in [4.0, 6.0, 7.0] {
            let (glass, _) =
                made(Definition { model: Some(model), opacity: Some(0.1), diffuse: Some(Vec3::ZERO), ..Definition::default() });
            assert!(
                glass.transmission == 1.0 && glass.solid && glass.base_color == Vec4::ONE && glass.alpha == AlphaMode::Opaque,
                "{model}"
            );
            let (plain, _) = made(Definition { model: Some(model), ior: Some(1.0), ..Definition::default() });
            assert_eq!(plain.transmission, 0.0, "{model}");
        }
        let mirror = Definition { specular: Some(Vec3::splat(0.9)), diffuse: Some(Vec3::ZERO), model: Some(5.0), ..Definition::default() };
        let (mirror, _) = made(mirror);
        assert_eq!((mirror.metallic, mirror.roughness, mirror.base_color), (1.0, 0.0, Vec4::new(0.9, 0.9, 0.9, 1.0)));
        let (sheet, _) = made(Definition { model: Some(2.0), opacity: Some(0.25), ..Definition::default() });
        assert_eq!((sheet.transmission, sheet.alpha, sheet.base_color.w), (0.0, AlphaMode::Blend, 0.25));
    }

    // Kills: a mask of another size that is read by index, alpha that is ignored, and colours of the mask on the surface.
    #[test]
    fn masks_of_another_size_fit() {
        let image = |width, height, texels: &[[u8; 4]]| Image { name: String::from("i"), width, height, texels: texels.to_vec() };
        let colors = image(4, 1, &[[1, 2, 3, 255]; 4]);
        let grey = image(2, 2, &[[0, 0, 0, 255], [90, 60, 30, 255], [9, 9, 9, 255], [200, 200, 200, 255]]);
        let alphas: Vec<u8> = with_alpha(&colors, &grey, true).texels.iter().map(|texel| texel[3]).collect();
        assert_eq!(alphas, [9, 9, 200, 200], "the middle of one row lies in the lower of two");
        let alpha = image(1, 1, &[[9, 9, 9, 77]]);
        assert_eq!(with_alpha(&colors, &alpha, true).texels[0], [1, 2, 3, 77]);
        assert_eq!(with_alpha(&alpha, &alpha, false).texels, [[255, 255, 255, 77]]);
        let rough = image(2, 1, &[[10, 10, 10, 255], [20, 20, 20, 255]]);
        assert_eq!(surface_of(Some(&rough), Some(&grey)).expect("two").texels, [[255, 10, 9, 255], [255, 20, 200, 255]]);
    }
}
