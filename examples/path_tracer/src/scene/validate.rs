//! What every [`Scene`] keeps, whether it was read from a file or built by hand.
//!
//! Key decision: one pass over everything, once. The renderer indexes without checks afterwards.
//! It gives up on repairs: besides dropping triangles without an area, a violation is an error.

use glam::{DVec3, Vec3, Vec4};

use super::material_tree::{MaterialTree, Weight};
use super::model::{AlphaMode, Camera, LightKind, Material, Projection, PunctualLight, Scene, Triangle, Vertex};
use crate::error::{Error, Fault};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Scene {
    /// Checks the invariants of [`Scene`] and drops triangles without an area, with one counted warning.
    ///
    /// # Errors
    /// At the first number that is not finite and at the first index out of range; the message starts with the scene's name.
    pub fn validate(&mut self) -> Result<(), Error> {
        self.check().map_err(|fault| fault.in_named(&self.name))
    }

    /// [`Scene::validate`] for readers that know the file.
    pub(crate) fn check(&mut self) -> Result<(), Fault> {
        for (index, vertex) in self.vertices.iter().enumerate() {
            check_vertex(vertex).map_err(|what| Fault::invalid(format_args!("vertex {index}"), what))?;
        }
        for (index, triangle) in self.triangles.iter().enumerate() {
            let place = || format!("triangle {index}");
            if let Some(vertex) = triangle.vertices.iter().find(|&&v| v as usize >= self.vertices.len()) {
                return Err(Fault::invalid(place(), format_args!("vertex {vertex} does not exist")));
            }
            if triangle.material as usize >= self.materials.len() {
                return Err(Fault::invalid(place(), format_args!("material {} does not exist", triangle.material)));
            }
        }
        if !self.object_of.is_empty() && self.object_of.len() != self.triangles.len() {
            let what = format_args!("{} numbers for {} triangles", self.object_of.len(), self.triangles.len());
            return Err(Fault::invalid("objects", what));
        }
        if let Some(object) = self.object_of.iter().find(|&&object| object as usize >= self.objects.len()) {
            return Err(Fault::invalid("objects", format_args!("object {object} does not exist")));
        }
        for material in &self.materials {
            check_material(material, self.images.len())
                .map_err(|what| Fault::invalid(format_args!("material '{}'", material.name), what))?;
        }
        for material in &self.materials {
            if let Some(what) = material.tree.as_ref().and_then(|tree| tree.fault(&self.materials)) {
                return Err(Fault::invalid(format_args!("material '{}'", material.name), what));
            }
        }
        for image in &self.images {
            if image.texels.is_empty() || image.texels.len() as u64 != u64::from(image.width) * u64::from(image.height) {
                return Err(Fault::invalid(format_args!("image '{}'", image.name), "the texels do not fill the size"));
            }
        }
        for (index, light) in self.lights.iter().enumerate() {
            check_light(light).map_err(|what| Fault::invalid(format_args!("light {index}"), what))?;
            if let Some(profile) = light.profile.filter(|&profile| profile as usize >= self.profiles.len()) {
                return Err(Fault::invalid(format_args!("light {index}"), format_args!("profile {profile} does not exist")));
            }
        }
        for camera in &self.cameras {
            check_camera(camera).map_err(|what| Fault::invalid(format_args!("camera '{}'", camera.name), what))?;
        }
        if let Some(environment) = &self.environment {
            environment.check()?;
        }
        self.drop_degenerate();
        Ok(())
    }

    fn drop_degenerate(&mut self) {
        let before = self.triangles.len();
        let vertices = &self.vertices;
        let stays = |t: &Triangle| has_area(t.vertices.map(|v| vertices[v as usize].position));
        // Numbers of objects go with their triangles.
        let mut triangles = self.triangles.iter();
        self.object_of.retain(|_| triangles.next().is_some_and(stays));
        self.triangles.retain(stays);
        let dropped = before - self.triangles.len();
        if dropped > 0 {
            self.warnings.push(format!("{dropped} triangles without an area are left out"));
        }
    }

    /// The box around all triangles, or `None` when there are none.
    pub fn bounds(&self) -> Option<Bounds> {
        let mut corners = self.triangles.iter().flat_map(|t| t.vertices).map(|v| self.vertices[v as usize].position);
        let first = corners.next()?;
        let around = |b: Bounds, p: Vec3| Bounds { min: b.min.min(p), max: b.max.max(p) };
        Some(corners.fold(Bounds { min: first, max: first }, around))
    }
}

/// False for a triangle whose normal would be made of rounding errors only.
fn has_area([a, b, c]: [Vec3; 3]) -> bool {
    // Differences of f32 are exact in f64, and neither the square nor the fourth power can leave its range.
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let longest2 = ab.length_squared().max(ac.length_squared()).max(bc.length_squared());
    let threshold = 2f64.powi(-100) * longest2 * longest2;
    // Written so that a NaN would count as degenerate.
    DVec3::cross(ab, ac).length_squared() > threshold
}

fn check_vertex(vertex: &Vertex) -> Result<(), &'static str> {
    if !vertex.position.is_finite() {
        return Err("the position is not finite");
    }
    if !vertex.normal.is_finite() || !vertex.tangent.is_finite() {
        return Err("the normal or the tangent is not finite");
    }
    if !vertex.uv.iter().all(|uv| uv.is_finite()) || !vertex.color.is_finite() {
        return Err("a texture coordinate or the colour is not finite");
    }
    Ok(())
}

fn check_material(material: &Material, n_images: usize) -> Result<(), String> {
    let cutoff = match material.alpha {
        AlphaMode::Mask { cutoff } => cutoff,
        AlphaMode::Opaque | AlphaMode::Blend => 0.0,
    };
    let numbers = [material.metallic, material.roughness, material.normal_scale, material.transmission, material.ior, cutoff];
    if !material.base_color.is_finite() || !material.emissive.is_finite() || !numbers.iter().all(|x| x.is_finite()) {
        return Err(String::from("a factor is not finite"));
    }
    if !material.attenuation_color.is_finite() || material.attenuation_distance.is_nan() || material.attenuation_distance <= 0.0 {
        return Err(String::from("the attenuation is not finite, or its distance not positive"));
    }
    if !material.extensions.is_finite() {
        return Err(String::from("a number of an extension is not finite"));
    }
    let (metallic_roughness, normal) = (&material.metallic_roughness_texture, &material.normal_texture);
    let core = [&material.base_color_texture, metallic_roughness, normal, &material.emissive_texture];
    let weights: Vec<&Weight> = material.tree.iter().flat_map(MaterialTree::weights).collect();
    let of_weights = weights.iter().filter_map(|weight| weight.texture.as_ref());
    for used in core.into_iter().flatten().chain(material.extensions.textures()).chain(of_weights) {
        if used.image as usize >= n_images {
            return Err(format!("image {} does not exist", used.image));
        }
        if used.uv_set > 1 {
            return Err(format!("there is no set {} of texture coordinates", used.uv_set));
        }
        if !used.transform.iter().all(|row| row.is_finite()) {
            return Err(String::from("a texture transform is not finite"));
        }
    }
    Ok(())
}

fn check_light(light: &PunctualLight) -> Result<(), &'static str> {
    let angles = match light.kind {
        LightKind::Spot { inner, outer } => [inner, outer],
        LightKind::Point | LightKind::Directional => [0.0, 0.0],
    };
    if !light.position.is_finite() || !light.direction.is_finite() || !light.intensity.is_finite() || !angles.iter().all(|x| x.is_finite())
    {
        return Err("a number is not finite");
    }
    if light.range.is_nan() || light.range <= 0.0 {
        return Err("the range is not positive");
    }
    Ok(())
}

fn check_camera(camera: &Camera) -> Result<(), &'static str> {
    if !camera.world_from_camera.to_cols_array_2d().iter().all(|column| Vec4::from_array(*column).is_finite()) {
        return Err("the transform is not finite");
    }
    match camera.projection {
        Projection::Perspective { vertical_fov } if !(vertical_fov > 0.0 && vertical_fov < std::f32::consts::PI) => {
            Err("the vertical field of view is not between 0 and 180 degrees")
        }
        Projection::Orthographic { half_height } if !(half_height > 0.0 && half_height.is_finite()) => {
            Err("the visible height is not positive")
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::{TextureUse, Wrap};
    use super::super::shapes;
    use super::*;

    fn quad() -> Scene {
        let mut scene = Scene { name: String::from("test"), materials: vec![Material::default()], ..Scene::default() };
        shapes::quad(&mut scene, Vec3::ZERO, Vec3::X, Vec3::Y, 0);
        scene
    }

    // Kills: a threshold that is absolute instead of relative to the longest edge.
    #[test]
    fn small_triangles_stay_and_needles_without_area_go() {
        for scale in [1e-15f32, 1.0, 1e15] {
            assert!(has_area([Vec3::ZERO, Vec3::X * scale, Vec3::new(0.0, 1e-3, 0.0) * scale]), "{scale}");
            assert!(!has_area([Vec3::ZERO, Vec3::X * scale, Vec3::X * 2.0 * scale]), "{scale}");
        }
        assert!(!has_area([Vec3::ONE; 3]));
    }

    // Kills: dropping silently, or one warning for each triangle.
    #[test]
    fn dropped_triangles_are_counted_once() {
        let mut scene = quad();
        for triangle in &mut scene.triangles {
            triangle.vertices = [1, 1, 2];
        }
        scene.validate().unwrap();
        assert_eq!(scene.triangles.len(), 0);
        assert_eq!(scene.warnings, ["2 triangles without an area are left out"]);
        assert_eq!(scene.bounds(), None);
    }

    // Kills: numbers of objects that slip to the neighbours of a dropped triangle, an object without triangles.
    #[test]
    fn objects_keep_their_triangles() {
        let mut scene = quad();
        scene.name_object("first");
        scene.name_object("nothing new");
        scene.triangles[0].vertices = [1, 1, 2];
        shapes::quad(&mut scene, Vec3::Z, Vec3::X, Vec3::Y, 0);
        scene.name_object("second");
        scene.validate().unwrap();
        assert_eq!((scene.object_of, scene.objects), (vec![0, 1, 1], vec![String::from("first"), String::from("second")]));
    }

    // Kills: a check that lets the index one past the end through, and one that forgets NaN.
    #[test]
    fn violations_name_their_place() {
        let mut scene = quad();
        scene.triangles[1].vertices[2] = 4;
        assert_eq!(scene.validate().unwrap_err().to_string(), "test: triangle 1: vertex 4 does not exist");
        let mut scene = quad();
        scene.materials[0].extensions.dispersion = Some(f32::INFINITY);
        let expected = "test: material 'default': a number of an extension is not finite";
        assert_eq!(scene.validate().unwrap_err().to_string(), expected);
        let mut scene = quad();
        let transform = [Vec3::X, Vec3::Y];
        let texture = TextureUse { image: 0, uv_set: 0, wrap: [Wrap::Repeat; 2], linear: true, transform };
        scene.materials[0].extensions.transmission_texture = Some(texture);
        assert_eq!(scene.validate().unwrap_err().to_string(), "test: material 'default': image 0 does not exist");
        let tree_fault = |tree: MaterialTree| {
            let mut scene = quad();
            scene.materials.push(Material { tree: Some(tree), ..Material::default() });
            scene.validate().unwrap_err().to_string()
        };
        let mix = |n: usize, leaf: u32| MaterialTree::Mix(vec![(Weight::constant(0.01), MaterialTree::Leaf(leaf)); n]);
        assert_eq!(tree_fault(mix(33, 0)), "test: material 'default': its tree has 33 leaves, the most is 32");
        assert_eq!(tree_fault(mix(64, 0)), "test: material 'default': its tree has 65 nodes, the most is 64");
        assert_eq!(tree_fault(mix(1, 2)), "test: material 'default': material 2 of its tree does not exist");
        assert_eq!(
            tree_fault(mix(1, 1)),
            "test: material 'default': 'default' of its tree has a tree of its own: write that one out in its place"
        );
        let infinite = MaterialTree::Mix(vec![(Weight::constant(f32::INFINITY), MaterialTree::Leaf(0))]);
        assert_eq!(tree_fault(infinite), "test: material 'default': a weight of its tree is not finite");
        let mut scene = quad();
        scene.vertices[3].position.y = f32::NAN;
        assert_eq!(scene.validate().unwrap_err().to_string(), "test: vertex 3: the position is not finite");
        let mut scene = quad();
        scene.name_object("quad");
        shapes::quad(&mut scene, Vec3::Z, Vec3::X, Vec3::Y, 0);
        assert_eq!(scene.clone().validate().unwrap_err().to_string(), "test: objects: 2 numbers for 4 triangles");
        scene.object_of = vec![0, 0, 0, 1];
        assert_eq!(scene.validate().unwrap_err().to_string(), "test: objects: object 1 does not exist");
    }
}
