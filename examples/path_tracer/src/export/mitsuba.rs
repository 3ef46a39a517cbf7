//! Scenes for Mitsuba 3: an XML file, with meshes, textures and the panorama in a folder beside it.
//!
//! Key decision: surfaces are written in one of two ways. [`Materials::Standard`] uses Mitsuba's own plugins, so that the file opens anywhere;
//! where no plugin is this renderer's model (a coat over Lambert, metals under Schlick's reflectance), the nearest one is taken and named.
//! [`Materials::Model`] writes a BSDF of type `wavepool`, which a peer test defines from the formulas alone.
//!
//! A tree of materials is a blend of its leaves: exact where shares are constant.
//!
//! **Invariant:** every approximation is one line of what [`write()`] returns.
//! Source: Mitsuba 3 documentation, plugin reference.

use std::{
    collections::BTreeSet,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use glam::{Mat4, Vec3, Vec4};

use super::{
    ply::{self, Side},
    textures::{self, Take},
};
use crate::{
    Settings,
    error::Error,
    gpu_scene::{effects::ALPHA_MIRROR, lobes},
    output::text,
    scene::{AlphaMode, Camera, LightKind, Material, MaterialTree, Projection, PunctualLight, Scene, TextureUse, Triangle, Wrap},
};

/// In which terms surfaces are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Materials {
    /// Mitsuba's own plugins.
    #[default]
    Standard,
    /// A plugin `wavepool` with this renderer's model.
    Model,
}

/// Writes the scene as `path` and its parts into a folder of the same name with `_parts`; returns what had to be approximated.
///
/// # Errors
/// When the operating system refuses to write.
pub fn write(path: &Path, scene: &Scene, camera: &Camera, settings: &Settings, materials: Materials) -> Result<Vec<String>, Error> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = PathBuf::from(format!("{stem}_parts"));
    let whole = path.with_file_name(&folder);
    fs::create_dir_all(&whole).map_err(|error| Error::write(&whole, error))?;
    let mut file = File { scene, materials, folder, whole, xml: String::new(), notes: BTreeSet::new() };
    file.head(camera, settings);
    for index in 0..scene.materials.len() {
        file.surface(index)?;
    }
    scene.lights.iter().for_each(|light| file.light(light));
    file.panorama()?;
    file.xml.push_str("</scene>\n");
    text::write(path, &file.xml)?;
    Ok(file.notes.into_iter().collect())
}

struct File<'a> {
    scene: &'a Scene,
    materials: Materials,
    /// As the XML names it.
    folder: PathBuf,
    whole: PathBuf,
    xml: String,
    notes: BTreeSet<String>,
}

fn numbers(values: impl IntoIterator<Item = f32>) -> String {
    values.into_iter().map(|value| value.to_string()).collect::<Vec<_>>().join(", ")
}

/// Rows of a matrix, as Mitsuba reads them.
fn matrix(matrix: Mat4) -> String {
    matrix.transpose().to_cols_array().map(|value| value.to_string()).join(" ")
}

fn rgb(name: &str, value: Vec3) -> String {
    format!("<rgb name=\"{name}\" value=\"{}\"/>", numbers(value.to_array()))
}

fn float(name: &str, value: f32) -> String {
    format!("<float name=\"{name}\" value=\"{value}\"/>")
}

/// Of mirrors and smooth glass that are mixed with something else.
const BLEND: &str =
    "mirrors and smooth glass within a mixture are too dark there: `blendbsdf` of Mitsuba 3.9.1 takes their probability for a density";

fn two_sided(bsdf: String) -> String {
    format!("<bsdf type=\"twosided\">{bsdf}</bsdf>")
}

fn one_sided(bsdf: String) -> String {
    bsdf
}

impl File<'_> {
    fn line(&mut self, line: &str) {
        let _ = writeln!(self.xml, "    {line}");
    }

    fn note(&mut self, note: impl Into<String>) {
        self.notes.insert(note.into());
    }

    fn head(&mut self, camera: &Camera, settings: &Settings) {
        // A path of n scattering events has n + 1 segments, and Mitsuba counts these.
        let _ = writeln!(
            self.xml,
            "<scene version=\"3.0.0\">\n    \
             <integrator type=\"path\"><integer name=\"max_depth\" value=\"{}\"/><integer name=\"rr_depth\" value=\"5\"/></integrator>",
            u64::from(settings.depth) + 1
        );
        // Mitsuba's cameras look along +z with +x to the left.
        let to_world = matrix(camera.world_from_camera * Mat4::from_scale(Vec3::new(-1.0, 1.0, -1.0)));
        let lens = match camera.projection {
            Projection::Perspective { vertical_fov } => {
                format!("{}<string name=\"fov_axis\" value=\"y\"/>", float("fov", vertical_fov.to_degrees()))
            }
            Projection::Orthographic { .. } => String::new(),
        };
        let (kind, to_world) = match camera.projection {
            Projection::Perspective { .. } => ("perspective", to_world),
            Projection::Orthographic { half_height } => {
                // Theirs shows -1..1 across.
                let half_width = half_height * settings.width as f32 / settings.height.max(1) as f32;
                let scale = Mat4::from_scale(Vec3::new(-half_width, half_width, -1.0));
                ("orthographic", matrix(camera.world_from_camera * scale))
            }
        };
        let _ = writeln!(
            self.xml,
            "    <sensor type=\"{kind}\">\n        {lens}{}\n        <transform name=\"to_world\"><matrix value=\"{to_world}\"/></transform>\n        \
             <sampler type=\"independent\"><integer name=\"sample_count\" value=\"{}\"/></sampler>\n        \
             <film type=\"hdrfilm\"><integer name=\"width\" value=\"{}\"/><integer name=\"height\" value=\"{}\"/>\
             <string name=\"pixel_format\" value=\"rgb\"/><string name=\"component_format\" value=\"float32\"/><rfilter type=\"box\"/></film>\n    \
             </sensor>",
            float("near_clip", 1e-4),
            settings.samples,
            settings.width,
            settings.height
        );
    }

    /// Triangles of one material: its BSDF, its mesh, its light.
    fn surface(&mut self, index: usize) -> Result<(), Error> {
        let scene = self.scene;
        let material = &scene.materials[index];
        let triangles: Vec<Triangle> = scene.triangles.iter().filter(|triangle| triangle.material as usize == index).copied().collect();
        if triangles.is_empty() {
            return Ok(());
        }
        let used = |material: &Material| {
            [material.base_color_texture, material.metallic_roughness_texture, material.normal_texture, material.emissive_texture]
        };
        let leaves = material.tree.iter().flat_map(MaterialTree::leaves).filter_map(|leaf| scene.materials.get(leaf as usize));
        let sets: BTreeSet<u32> = std::iter::once(material).chain(leaves).flat_map(used).flatten().map(|texture| texture.uv_set).collect();
        if sets.len() > 1 {
            self.note(format!("material `{}`: textures of two sets of coordinates, all are looked up with the first", material.name));
        }
        let uv_set = sets.first().map_or(0, |set| *set as usize);
        let has_colors = triangles.iter().flat_map(|t| t.vertices).any(|corner| scene.vertices[corner as usize].color != Vec4::ONE);
        if has_colors {
            self.note(format!("material `{}`: colours of vertices are left out", material.name));
        }
        let bsdf = self.bsdf(index, material)?;
        let emits = material.emissive.max_element() > 0.0;
        let emitter = if emits { self.emission(index, material)? } else { String::new() };
        self.shape(&format!("mesh_{index}.ply"), &triangles, uv_set, Side::Front, &format!("{bsdf}{emitter}"))?;
        if emits && material.double_sided {
            let size = scene.bounds().map_or(1.0, |bounds| (bounds.max - bounds.min).max_element());
            self.note(format!("material `{}`: its back shines from a copy, a ten thousandth of the scene behind it", material.name));
            self.shape(&format!("back_{index}.ply"), &triangles, uv_set, Side::Back(1e-4 * size), &format!("{bsdf}{emitter}"))?;
        }
        Ok(())
    }

    fn shape(&mut self, file: &str, triangles: &[Triangle], uv_set: usize, side: Side, what: &str) -> Result<(), Error> {
        let path = self.whole.join(file);
        let mut bytes = Vec::new();
        let written = ply::write(&mut bytes, self.scene, triangles, uv_set, side).and_then(|()| fs::write(&path, bytes));
        written.map_err(|error| Error::write(&path, error))?;
        let name = self.folder.join(file).display().to_string();
        self.line(&format!("<shape type=\"ply\"><string name=\"filename\" value=\"{name}\"/>{what}</shape>"));
        Ok(())
    }

    fn emission(&mut self, index: usize, material: &Material) -> Result<String, Error> {
        let radiance = match &material.emissive_texture {
            Some(texture) => self.texture("radiance", &format!("emissive_{index}"), texture, Take::Color(material.emissive.extend(1.0)))?,
            None => rgb("radiance", material.emissive),
        };
        Ok(format!("<emitter type=\"area\">{radiance}</emitter>"))
    }

    /// A texture with its transform; the texels are written beside the scene.
    fn texture(&mut self, name: &str, file: &str, texture: &TextureUse, take: Take) -> Result<String, Error> {
        let Some(image) = textures::image(self.scene, texture) else { return Ok(rgb(name, Vec3::ONE)) };
        let file = format!("{file}.exr");
        textures::write(&self.whole.join(&file), image, take)?;
        let wrap = match texture.wrap {
            [Wrap::Repeat, Wrap::Repeat] => "repeat",
            [Wrap::Mirror, Wrap::Mirror] => "mirror",
            [Wrap::Clamp, Wrap::Clamp] => "clamp",
            [first, _] => {
                self.note(format!("image `{}`: wraps differently along u and v, written as {first:?} for both", image.name));
                match first {
                    Wrap::Repeat => "repeat",
                    Wrap::Mirror => "mirror",
                    Wrap::Clamp => "clamp",
                }
            }
        };
        let filter = if texture.linear { "bilinear" } else { "nearest" };
        let [u, v] = texture.transform;
        let rows = [[u.x, u.y, u.z], [v.x, v.y, v.z], [0.0, 0.0, 1.0]].concat();
        let rows: Vec<String> = rows.iter().map(ToString::to_string).collect();
        Ok(format!(
            "<texture name=\"{name}\" type=\"bitmap\"><string name=\"filename\" value=\"{}\"/><boolean name=\"raw\" value=\"true\"/>\
             <string name=\"wrap_mode\" value=\"{wrap}\"/><string name=\"filter_type\" value=\"{filter}\"/>\
             <transform name=\"to_uv\"><matrix value=\"{}\"/></transform></texture>",
            self.folder.join(&file).display(),
            rows.join(" ")
        ))
    }

    fn base_color(&mut self, name: &str, index: usize, material: &Material) -> Result<String, Error> {
        match &material.base_color_texture {
            Some(texture) => self.texture(name, &format!("base_color_{index}"), texture, Take::Color(material.base_color)),
            None => Ok(rgb(name, material.base_color.truncate())),
        }
    }

    fn channel(&mut self, name: &str, index: usize, material: &Material, channel: usize, factor: f32) -> Result<String, Error> {
        match &material.metallic_roughness_texture {
            Some(texture) => self.texture(name, &format!("{name}_{index}"), texture, Take::Channel(channel, factor)),
            None => Ok(float(name, factor)),
        }
    }

    fn bsdf(&mut self, index: usize, material: &Material) -> Result<String, Error> {
        let name = &material.name;
        let bsdf = match &material.tree {
            Some(tree) => self.mixture(material, tree)?,
            None => match material.transmission > 0.0 {
                true => self.lobes(index, material, two_sided)?,
                false => two_sided(self.lobes(index, material, one_sided)?),
            },
        };
        Ok(match material.alpha {
            AlphaMode::Opaque => bsdf,
            alpha => {
                if matches!(alpha, AlphaMode::Mask { .. }) {
                    self.note(format!("material `{name}`: a cutoff of alpha is written as opacity"));
                }
                let opacity = match &material.base_color_texture {
                    Some(texture) => {
                        self.texture("opacity", &format!("opacity_{index}"), texture, Take::Channel(3, material.base_color.w))?
                    }
                    None => float("opacity", material.base_color.w),
                };
                format!("<bsdf type=\"mask\">{opacity}{bsdf}</bsdf>")
            }
        })
    }

    /// The leaves of a tree by their shares.
    fn mixture(&mut self, material: &Material, tree: &MaterialTree) -> Result<String, Error> {
        let scene = self.scene;
        let leaves = lobes::flatten(tree, &mut Vec::new());
        if leaves.iter().any(|leaf| !leaf.terms.is_empty()) {
            self.note(format!("material `{}`: shares of its tree are those at normal incidence, where textures are white", material.name));
        }
        let shares = leaves.iter().map(|leaf| leaf.factor * leaf.terms.iter().map(|term| term.value(1.0)).product::<f64>());
        let parts: Vec<(usize, Material, f64)> = leaves
            .iter()
            .zip(shares)
            .filter(|(_, share)| *share > 0.0)
            .filter_map(|(leaf, share)| Some((leaf.material as usize, scene.materials.get(leaf.material as usize)?, share)))
            .map(|(index, of, share)| (index, Material { solid: material.solid, ..of.clone() }, share))
            .collect();
        let transmits = parts.iter().any(|(_, of, _)| of.transmission > 0.0);
        let sides = if transmits { two_sided } else { one_sided };
        // Mitsuba's own `principled` has no true mirrors.
        let is_mirror = |of: &Material| of.roughness * of.roughness < ALPHA_MIRROR && (of.metallic > 0.0 || of.ior > 1.0);
        let has_mirror = self.materials == Materials::Model && parts.iter().any(|(_, of, _)| is_mirror(of));
        if parts.iter().all(|(.., share)| *share < 1.0) && (transmits || has_mirror) {
            self.note(BLEND);
        }
        // What is missing to 1 absorbs: it is the first part, and everybody else is blended over it.
        let missing = 1.0 - parts.iter().map(|(.., share)| share).sum::<f64>();
        let mut sum = if missing > 1e-6 { missing } else { 0.0 };
        let mut mixed = String::from("<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0, 0, 0\"/></bsdf>");
        for (index, of, share) in &parts {
            let part = self.lobes(*index, of, sides)?;
            sum += share;
            mixed = match sum > *share {
                true => format!("<bsdf type=\"blendbsdf\">{}{mixed}{part}</bsdf>", float("weight", (share / sum) as f32)),
                false => part,
            };
        }
        Ok(if transmits { mixed } else { two_sided(mixed) })
    }

    /// All lobes of one material. Theirs have one side, ours have two; what transmits has two of its own, so that only what is mixed into it is to be
    /// given another by `sides`.
    fn lobes(&mut self, index: usize, material: &Material, sides: fn(String) -> String) -> Result<String, Error> {
        let name = &material.name;
        let share = material.transmission;
        let mut bsdf = String::new();
        if share < 1.0 {
            bsdf = sides(self.opaque(index, material)?);
        }
        if share > 0.0 {
            if material.metallic > 0.0 {
                self.note(format!("material `{name}`: metal is left out of what transmits"));
            }
            let kind = if material.solid { "dielectric" } else { "thindielectric" };
            let tint = self.base_color("specular_transmittance", index, material)?;
            let glass = format!("<bsdf type=\"{kind}\">{}{}{tint}</bsdf>", float("int_ior", material.ior), float("ext_ior", 1.0));
            if share < 1.0 {
                self.note(BLEND);
            }
            bsdf = match share < 1.0 {
                true => format!("<bsdf type=\"blendbsdf\">{}{bsdf}{glass}</bsdf>", float("weight", share)),
                false => glass,
            };
        }
        if let Some(texture) = &material.normal_texture {
            let texture = self.texture("normalmap", &format!("normal_{index}"), texture, Take::Normal(material.normal_scale))?;
            bsdf = format!("<bsdf type=\"normalmap\">{texture}{bsdf}</bsdf>");
            self.note("under normal maps newer versions of Mitsuba darken the edge of shadows unless `use_shadowing_function` is false");
        }
        Ok(bsdf)
    }

    /// All but what transmits.
    fn opaque(&mut self, index: usize, material: &Material) -> Result<String, Error> {
        let name = &material.name;
        let is_lambert = material.metallic == 0.0 && material.ior == 1.0;
        if is_lambert {
            let color = self.base_color("reflectance", index, material)?;
            return Ok(format!("<bsdf type=\"diffuse\">{color}</bsdf>"));
        }
        let color = self.base_color("base_color", index, material)?;
        let metallic = self.channel("metallic", index, material, 2, material.metallic)?;
        let roughness = self.channel("roughness", index, material, 1, material.roughness)?;
        if self.materials == Materials::Model {
            return Ok(format!("<bsdf type=\"wavepool\">{color}{metallic}{roughness}{}</bsdf>", float("ior", material.ior)));
        }
        self.note(format!(
            "material `{name}`: written as `principled`, whose base under the coat and whose sheen at grazing angles differ"
        ));
        let eta = if material.ior > 1.0 { float("eta", material.ior) } else { float("specular", 0.0) };
        Ok(format!("<bsdf type=\"principled\">{color}{metallic}{roughness}{eta}</bsdf>"))
    }

    fn light(&mut self, light: &PunctualLight) {
        if light.range.is_finite() {
            self.note("a light's range is left out");
        }
        let position = format!("<point name=\"position\" value=\"{}\"/>", numbers(light.position.to_array()));
        let line = match light.kind {
            LightKind::Point => format!("<emitter type=\"point\">{position}{}</emitter>", rgb("intensity", light.intensity)),
            LightKind::Directional => format!(
                "<emitter type=\"directional\"><vector name=\"direction\" value=\"{}\"/>{}</emitter>",
                numbers(light.direction.to_array()),
                rgb("irradiance", light.intensity)
            ),
            LightKind::Spot { inner, outer } => {
                self.note("a spot's light falls off linearly in the angle there, by the square of a ramp in the cosine here");
                let up = if light.direction.y.abs() < 0.99 { Vec3::Y } else { Vec3::X };
                let x = up.cross(light.direction).normalize();
                let y = light.direction.cross(x);
                let to_world = Mat4::from_cols(x.extend(0.0), y.extend(0.0), light.direction.extend(0.0), light.position.extend(1.0));
                format!(
                    "<emitter type=\"spot\"><transform name=\"to_world\"><matrix value=\"{}\"/></transform>{}{}{}</emitter>",
                    matrix(to_world),
                    rgb("intensity", light.intensity),
                    float("cutoff_angle", outer.to_degrees()),
                    float("beam_width", inner.to_degrees())
                )
            }
        };
        self.line(&line);
    }

    fn panorama(&mut self) -> Result<(), Error> {
        let Some(environment) = &self.scene.environment else { return Ok(()) };
        let file = self.whole.join("environment.exr");
        textures::write_floats(&file, environment.width, environment.height, environment.texels.clone())?;
        self.note("texels of the panorama are constant here, interpolated there, where the first and the last row lie on the poles");
        // Theirs begins where the middle of ours is.
        let turn = matrix(Mat4::from_rotation_y(std::f32::consts::PI));
        let file = self.folder.join("environment.exr").display().to_string();
        self.line(&format!(
            "<emitter type=\"envmap\"><string name=\"filename\" value=\"{file}\"/><transform name=\"to_world\"><matrix value=\"{turn}\"/></transform>\
             </emitter>"
        ));
        Ok(())
    }
}

#[cfg(test)]
mod tests;
