//! Options that say what is rendered: a scene and what lights it.

use std::path::{Path, PathBuf};

use path_tracer::scene::{self, Bounds, Environment, LoadOptions, Scene};

use super::{Failure, value};

#[derive(Debug, clap::Args)]
pub(crate) struct SceneArguments {
    /// A built-in scene (see `path-tracer scenes`) or a .glb, .gltf, .obj or .ply file.
    pub(crate) scene: String,
    /// Show animations at this moment; without it everything is in its rest pose.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = value::finite)]
    time: Option<f32>,
    /// Which animation, when a file has several; the first one when not given.
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    /// A variant of the materials.
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// Light the scene with an equirectangular .hdr or .exr image.
    #[arg(long, value_name = "FILE")]
    pub(crate) env: Option<PathBuf>,
    /// Multiply the radiance of the environment.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true, value_parser = value::not_negative)]
    env_intensity: f32,
    /// Turn the environment about +Y, counter-clockwise seen from above.
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = value::finite)]
    env_rotation: f32,
}

impl SceneArguments {
    /// The scene, lit by something; what had to be assumed is in its warnings.
    pub(crate) fn load(&self) -> Result<Scene, Failure> {
        self.loader().load(self.time)
    }

    /// The moment that is asked for.
    pub(crate) fn time(&self) -> Option<f32> {
        self.time
    }

    /// For more than one moment.
    pub(crate) fn loader(&self) -> Loader<'_> {
        Loader { arguments: self, panorama: None }
    }

    fn options(&self, time: Option<f32>) -> LoadOptions {
        LoadOptions { time, animation: self.animation.clone(), variant: self.variant.clone() }
    }

    /// What changes an environment, and whether it is asked for.
    fn environment_options(&self) -> [(&'static str, bool); 2] {
        [("--env-intensity", self.env_intensity != 1.0), ("--env-rotation", self.env_rotation != 0.0)]
    }

    /// Turned and scaled as the options have it, with what had to be clamped.
    fn prepared(&self, environment: &mut Environment) -> Option<String> {
        turn(environment, self.env_rotation);
        let n_clamped = scale(environment, self.env_intensity);
        (n_clamped > 0).then(|| format!("--env-intensity {}: {n_clamped} values became the largest finite number", self.env_intensity))
    }
}

/// Loads the scene again and again; the file of the environment is read once, as long as scenes give it back.
pub(crate) struct Loader<'a> {
    arguments: &'a SceneArguments,
    panorama: Option<Panorama>,
}

/// A file's environment as the options want it.
struct Panorama {
    /// Away while a scene has it.
    environment: Option<Environment>,
    warnings: Vec<String>,
}

impl Loader<'_> {
    /// The scene at a moment, or in its rest pose; lit by something. What had to be assumed is in its warnings.
    pub(crate) fn load(&mut self, time: Option<f32>) -> Result<Scene, Failure> {
        let arguments = self.arguments;
        if let (Some(name), None) = (&arguments.animation, time) {
            return Err(Failure::Usage(format!("--animation {name}: it needs a moment, --time, or several, --frames of render")));
        }
        let mut scene = unlit(&arguments.scene, &arguments.options(time))?;
        if let Some(path) = &arguments.env {
            let (environment, warnings) = match self.panorama.take() {
                Some(Panorama { environment: Some(environment), warnings }) => (environment, warnings),
                _ => {
                    let (mut environment, mut warnings) = scene::load_environment(path)?;
                    warnings.extend(arguments.prepared(&mut environment));
                    (environment, warnings)
                }
            };
            scene.environment = Some(environment);
            scene.warnings.extend(warnings.iter().cloned());
            self.panorama = Some(Panorama { environment: None, warnings });
            return Ok(scene);
        }
        light(&mut scene);
        if let Some(environment) = &mut scene.environment {
            scene.warnings.extend(arguments.prepared(environment));
            return Ok(scene);
        }
        for (option, is_given) in arguments.environment_options() {
            if is_given {
                let what = "the scene has no environment that it could apply to";
                return Err(Failure::Usage(format!("{option}: {what}; --env FILE gives it one")));
            }
        }
        Ok(scene)
    }

    /// The box around the scene in its rest pose.
    pub(crate) fn rest_bounds(&self) -> Result<Option<Bounds>, Failure> {
        let options = LoadOptions { animation: None, ..self.arguments.options(None) };
        Ok(unlit(&self.arguments.scene, &options)?.bounds())
    }

    /// The environment of a scene that needs it no longer.
    pub(crate) fn take_back(&mut self, scene: &mut Scene) {
        if let Some(panorama) = &mut self.panorama {
            panorama.environment = scene.environment.take();
        }
    }
}

/// A built-in scene or a file, with its environment and lit by something.
pub(crate) fn load(name: &str, env: Option<&Path>, options: &LoadOptions) -> Result<Scene, Failure> {
    load_in(name, env.map(scene::load_environment).transpose()?, options)
}

/// As [`load`], in an environment that has been read, with what was said about it.
pub(crate) fn load_in(name: &str, environment: Option<(Environment, Vec<String>)>, options: &LoadOptions) -> Result<Scene, Failure> {
    let mut scene = unlit(name, options)?;
    if let Some((environment, warnings)) = environment {
        scene.environment = Some(environment);
        scene.warnings.extend(warnings);
    }
    light(&mut scene);
    Ok(scene)
}

/// As it is built in or in a file.
fn unlit(name: &str, options: &LoadOptions) -> Result<Scene, Failure> {
    match scene::builtin(name) {
        Some(_) if *options != LoadOptions::default() => Err(Failure::Usage(format!(
            "{name}: a built-in scene has no animations and no variants (--time, --frames, --animation, --variant)"
        ))),
        Some(scene) => Ok(scene),
        None => load_file(name, options),
    }
}

/// A scene without any light is lit by a plain sky.
fn light(scene: &mut Scene) {
    if !scene.has_light() {
        scene.environment = Some(Environment::plain_sky());
        scene.warnings.push("the scene has no light: lit by a plain sky".into());
    }
}

/// A name without a known ending that is no file was meant as a built-in scene.
fn load_file(name: &str, options: &LoadOptions) -> Result<Scene, Failure> {
    let path = Path::new(name);
    if path.extension().is_none() && !path.exists() {
        return Err(Failure::Runtime(format!("{name}: no such file, and no built-in scene; these are: {}", value::known_scenes())));
    }
    Ok(scene::load_with(path, options)?)
}

/// Multiplies all radiance; returns how many values would have become infinite.
fn scale(environment: &mut Environment, factor: f32) -> u64 {
    let mut n_clamped = 0;
    for value in environment.texels.as_flattened_mut() {
        *value *= factor;
        if !value.is_finite() {
            n_clamped += 1;
            *value = f32::MAX;
        }
    }
    n_clamped
}

/// Moves every row by the angle. Angles between columns mix neighbours in proportion, which keeps the light of a row.
fn turn(environment: &mut Environment, degrees: f32) {
    let width = environment.width as usize;
    let columns = (f64::from(degrees) / 360.0).rem_euclid(1.0) * width as f64;
    let (whole, share) = (columns as usize, columns.fract() as f32);
    if width < 2 || columns == 0.0 {
        return;
    }
    let mix = |a: f32, b: f32| if share == 0.0 { a } else { a * (1.0 - share) + b * share };
    for row in environment.texels.chunks_exact_mut(width) {
        // Counter-clockwise from above is towards -X of what was towards -Z, and -X lies left of the middle.
        row.rotate_left(whole % width);
        let first = row[0];
        for x in 0..width {
            let next = row.get(x + 1).copied().unwrap_or(first);
            row[x] = std::array::from_fn(|channel| mix(row[x][channel], next[channel]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(values: &[f32]) -> Environment {
        let texels = values.iter().map(|value| [*value; 3]).collect();
        Environment { name: String::new(), width: values.len() as u32, height: 1, texels }
    }

    fn turned(values: &[f32], degrees: f32) -> Vec<f32> {
        let mut environment = strip(values);
        turn(&mut environment, degrees);
        environment.texels.iter().map(|texel| texel[0]).collect()
    }

    // Kills: a turn the other way, light that is lost between columns or at the seam, a blur where columns fit.
    #[test]
    fn an_environment_turns_and_keeps_its_light() {
        let row = [8.0, 0.0, 0.0, 0.0];
        // Column 2 of 4 begins at -Z, column 1 at -X.
        assert_eq!(turned(&[0.0, 0.0, 8.0, 0.0], 90.0), [0.0, 8.0, 0.0, 0.0]);
        assert_eq!(turned(&row, -90.0), [0.0, 8.0, 0.0, 0.0]);
        assert_eq!(turned(&row, 360.0), row);
        assert_eq!(turned(&row, 45.0), [4.0, 0.0, 0.0, 4.0]);
        assert_eq!(turned(&row, 22.5), [6.0, 0.0, 0.0, 2.0]);
        assert_eq!(turned(&[3.0], 77.0), [3.0]);
    }

    // Kills: infinite radiance by a factor, and one that is not counted.
    #[test]
    fn an_environment_is_scaled_and_stays_finite() {
        let mut environment = strip(&[1.0, f32::MAX]);
        assert_eq!(scale(&mut environment, 2.0), 3);
        assert_eq!(environment.texels, [[2.0; 3], [f32::MAX; 3]]);
    }
}
