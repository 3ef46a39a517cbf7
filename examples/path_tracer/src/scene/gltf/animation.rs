//! What an animation does to nodes at a moment: translation, rotation, scale and the weights of morph targets.
//!
//! Key decision: an animation is sampled once, at the time that was asked for, and becomes a pose: values that replace those of the nodes.
//! Without a time no animation is looked at. Sampling is done in f64; before the first and after the last key the curve stands still.
//!
//! Source: glTF 2.0 specification, section 3.11 and appendix C (interpolation modes).

use std::collections::HashMap;

use glam::{DQuat, DVec3};
use serde::Deserialize;
use serde_json::Value;

use super::super::{LoadOptions, model};
use super::Warnings;
use super::accessor::Accessors;
use super::json::{self, Document};
use crate::error::{Fault, one_line};

/// Elements of accessors that the channels of an animation may read together; one accessor may serve many channels.
const ELEMENTS: usize = 1 << 28;

#[derive(Default, Deserialize)]
#[serde(default)]
struct Animation {
    channels: Vec<Channel>,
    samplers: Vec<Sampler>,
}

#[derive(Deserialize)]
struct Channel {
    sampler: usize,
    target: Target,
}

#[derive(Deserialize)]
struct Target {
    node: Option<usize>,
    path: String,
}

#[derive(Deserialize)]
struct Sampler {
    input: usize,
    output: usize,
    interpolation: Option<String>,
}

/// What replaces the values of nodes.
#[derive(Default)]
pub(super) struct Pose {
    nodes: HashMap<usize, NodePose>,
}

/// What replaces the values of one node.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NodePose {
    pub(super) translation: Option<DVec3>,
    /// Of any length; whoever uses it normalises it.
    pub(super) rotation: Option<DQuat>,
    pub(super) scale: Option<DVec3>,
    pub(super) weights: Option<Vec<f32>>,
}

impl Pose {
    #[cfg(test)]
    pub(super) fn of_weights(node: usize, weights: Vec<f32>) -> Pose {
        Pose { nodes: HashMap::from([(node, NodePose { weights: Some(weights), ..NodePose::default() })]) }
    }

    /// What an animation says about a node.
    pub(super) fn of(&self, node: usize) -> Option<&NodePose> {
        self.nodes.get(&node)
    }

    /// The pose that the options ask for.
    pub(super) fn read(
        document: &Document,
        accessors: &Accessors<'_>,
        options: &LoadOptions,
        warnings: &mut Warnings,
    ) -> Result<Pose, Fault> {
        let n_animations = document.animations.len();
        let Some(time) = options.time else {
            if options.animation.is_some() {
                return Err(Fault::invalid("animation", "it is named, but no time is asked for"));
            }
            if n_animations > 0 {
                warnings.push(format!("{n_animations} animations are left out, everything is shown in rest pose"));
            }
            return Ok(Pose::default());
        };
        if !time.is_finite() {
            return Err(Fault::invalid("animation", format_args!("{time} is no time")));
        }
        let Some(index) = choose(document, options.animation.as_deref(), warnings)? else {
            warnings.push(format!("there is no animation to show at {time} seconds"));
            return Ok(Pose::default());
        };
        sample(document, index, accessors, time, warnings).map_err(|f| f.within(format_args!("animation {index}")))
    }
}

/// All animations of the file with the times that it claims for them. A broken one is listed too: nothing of it is read.
pub(super) fn list(document: &Document) -> Vec<model::Animation> {
    let claimed = |accessor: &json::Accessor| {
        let time = |bound: &Value| bound.get(0)?.as_f64().map(|time| time as f32).filter(|time| time.is_finite());
        Some([time(&accessor.min)?, time(&accessor.max)?])
    };
    let seconds = |animation: &Value| {
        let samplers = animation.get("samplers")?.as_array()?;
        let inputs = samplers.iter().filter_map(|sampler| usize::try_from(sampler.get("input")?.as_u64()?).ok());
        let keys = inputs.filter_map(|input| claimed(document.accessors.get(input)?));
        keys.reduce(|all, keys| [all[0].min(keys[0]), all[1].max(keys[1])])
    };
    let listed = |(index, animation)| model::Animation { name: one_line(&name(document, index)), seconds: seconds(animation) };
    document.animations.iter().enumerate().map(listed).collect()
}

fn name(document: &Document, index: usize) -> String {
    match document.animations[index].get("name").and_then(|name| name.as_str()) {
        Some(name) => String::from(name),
        None => format!("animation {index}"),
    }
}

/// The animation of the name, or the first; `None` when the file has none and none is named.
fn choose(document: &Document, wanted: Option<&str>, warnings: &mut Warnings) -> Result<Option<usize>, Fault> {
    let names: Vec<String> = (0..document.animations.len()).map(|index| name(document, index)).collect();
    let listed = |names: &[String]| names.iter().map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ");
    match (wanted, names.as_slice()) {
        (None, []) => Ok(None),
        (None, [_]) => Ok(Some(0)),
        (None, [first, others @ ..]) => {
            warnings.push(format!("the animation '{first}' is shown; there are also {}", listed(others)));
            Ok(Some(0))
        }
        (Some(wanted), []) => Err(Fault::invalid("animation", format_args!("there is no '{wanted}', the file has none"))),
        (Some(wanted), names) => match names.iter().position(|name| name == wanted) {
            Some(index) => Ok(Some(index)),
            None => Err(Fault::invalid("animation", format_args!("there is no '{wanted}', there are {}", listed(names)))),
        },
    }
}

fn sample(document: &Document, index: usize, accessors: &Accessors<'_>, time: f32, warnings: &mut Warnings) -> Result<Pose, Fault> {
    let animation: Animation = json::part(&document.animations[index])?;
    let mut pose = Pose::default();
    let mut n_elements_left = ELEMENTS;
    for (number, channel) in animation.channels.iter().enumerate() {
        let place = format!("channel {number}");
        // Without a node the target is told by an extension.
        let Some(node) = channel.target.node else {
            warnings.push(format!("animation {index}, {place}: it moves no node and is left out"));
            continue;
        };
        if node >= document.nodes.len() {
            return Err(Fault::invalid(place, format_args!("node {node} does not exist")));
        }
        let path = channel.target.path.as_str();
        let width = match path {
            "translation" | "scale" => Some(3),
            "rotation" => Some(4),
            "weights" => None,
            _ => {
                warnings.push(format!("animation {index}, {place}: '{path}' of node {node} is left out"));
                continue;
            }
        };
        let missing = || Fault::invalid(&place, format_args!("sampler {} does not exist", channel.sampler));
        let sampler = animation.samplers.get(channel.sampler).ok_or_else(missing)?;
        let n_elements = accessors.count(sampler.input)?.saturating_add(accessors.count(sampler.output)?);
        let too_many = || Fault::unsupported(&place, "an animation with so many keys");
        n_elements_left = n_elements_left.checked_sub(n_elements).ok_or_else(too_many)?;
        let curve =
            Curve::read(sampler, width, accessors).map_err(|f| f.within(format_args!("sampler {}", channel.sampler)).within(&place))?;
        let value = curve.at(time, path == "rotation");
        let moved = pose.nodes.entry(node).or_default();
        let vector = || DVec3::new(value[0], value[1], value[2]);
        let was_set = match path {
            "translation" => moved.translation.replace(vector()).is_some(),
            "scale" => moved.scale.replace(vector()).is_some(),
            "rotation" => moved.rotation.replace(DQuat::from_slice(&value)).is_some(),
            _ => moved.weights.replace(value.iter().map(|&x| x as f32).collect()).is_some(),
        };
        if was_set {
            warnings.push(format!("animation {index}, {place}: a second channel for '{path}' of node {node} replaces the first"));
        }
    }
    Ok(pose)
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// Keys over time, each a vector of `width` numbers.
///
/// **Invariant:** there is a key, times are finite and do not decrease, and `values` holds `width` numbers for each key, three times as
/// many for splines (incoming tangent, value, outgoing tangent).
struct Curve {
    interpolation: Interpolation,
    times: Vec<f32>,
    values: Vec<f32>,
    width: usize,
}

impl Curve {
    /// Without a `width` the number of values says it.
    fn read(sampler: &Sampler, width: Option<usize>, accessors: &Accessors<'_>) -> Result<Curve, Fault> {
        let interpolation = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(name) => return Err(Fault::invalid("interpolation", format_args!("'{name}' is unknown"))),
        };
        let times = accessors.table(sampler.input, &[1]).map_err(|f| f.within("input"))?.values;
        if times.is_empty() {
            return Err(Fault::invalid("input", "there are no keys"));
        }
        if let Some(key) = times.iter().position(|time| !time.is_finite()) {
            return Err(Fault::invalid("input", format_args!("the time of key {key} is not finite")));
        }
        if let Some(key) = times.windows(2).position(|pair| pair[1] < pair[0]) {
            return Err(Fault::invalid("input", format_args!("key {} is earlier than the one before", key + 1)));
        }
        let values = accessors.table(sampler.output, &[width.unwrap_or(1)]).map_err(|f| f.within("output"))?.values;
        let n_vectors = times.len() * if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let found = width.unwrap_or(values.len() / n_vectors);
        if found == 0 || values.len() != n_vectors * found {
            return Err(Fault::invalid("output", format_args!("{} numbers for {} keys", values.len(), times.len())));
        }
        Ok(Curve { interpolation, times, values, width: found })
    }

    /// The vector at a time; `spherical` for rotations.
    fn at(&self, time: f32, spherical: bool) -> Vec<f64> {
        let (per_key, value_at) = if self.interpolation == Interpolation::CubicSpline { (3, 1) } else { (1, 0) };
        let vector = |key: usize, part: usize| {
            let start = (key * per_key + part) * self.width;
            self.values[start..start + self.width].iter().map(|&x| f64::from(x)).collect::<Vec<f64>>()
        };
        // Keys up to the time: none before the first key, all after the last.
        let n_passed = self.times.partition_point(|&key| key <= time);
        let (before, after) = (n_passed.saturating_sub(1), n_passed);
        let here = vector(before, value_at);
        if n_passed == 0 || after == self.times.len() || self.interpolation == Interpolation::Step {
            return here;
        }
        let next = vector(after, value_at);
        let span = f64::from(self.times[after]) - f64::from(self.times[before]);
        let t = (f64::from(time) - f64::from(self.times[before])) / span;
        match self.interpolation {
            Interpolation::CubicSpline => {
                let (leaving, arriving) = (vector(before, 2), vector(after, 0));
                let (t2, t3) = (t * t, t * t * t);
                let weights = [2.0 * t3 - 3.0 * t2 + 1.0, span * (t3 - 2.0 * t2 + t), 3.0 * t2 - 2.0 * t3, span * (t3 - t2)];
                let sum = |i: usize| weights[0] * here[i] + weights[1] * leaving[i] + weights[2] * next[i] + weights[3] * arriving[i];
                (0..self.width).map(sum).collect()
            }
            _ if spherical => slerp(DQuat::from_slice(&here), DQuat::from_slice(&next), t).to_array().to_vec(),
            _ => here.iter().zip(&next).map(|(a, b)| a + (b - a) * t).collect(),
        }
    }
}

/// Along the shorter arc at constant angular speed.
fn slerp(from: DQuat, to: DQuat, t: f64) -> DQuat {
    let (from, to) = (normalized(from), normalized(to));
    from.slerp(to, t)
}

/// Rotations are often normalized integers, whose length is only nearly one; one without a length stays as it is.
fn normalized(rotation: DQuat) -> DQuat {
    let length = rotation.length();
    if length > 0.0 && length.is_finite() { rotation / length } else { rotation }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(interpolation: Interpolation, times: &[f32], values: &[f32], width: usize) -> Curve {
        Curve { interpolation, times: times.to_vec(), values: values.to_vec(), width }
    }

    // Kills: a curve that goes on beyond its keys, one that starts at time zero, and steps that are taken early.
    #[test]
    fn curves_stand_still_outside_of_their_keys() {
        for interpolation in [Interpolation::Step, Interpolation::Linear] {
            let curve = curve(interpolation, &[1.0, 2.0, 4.0], &[10.0, 20.0, 40.0], 1);
            for (time, value) in [(-1.0, 10.0), (0.5, 10.0), (1.0, 10.0), (2.0, 20.0), (4.0, 40.0), (9.0, 40.0)] {
                assert_eq!(curve.at(time, false), [value], "{interpolation:?} {time}");
            }
            let middle = if interpolation == Interpolation::Step { 20.0 } else { 30.0 };
            assert_eq!(curve.at(3.0, false), [middle]);
        }
    }

    // Kills: tangents that are not scaled by the time between keys, swapped tangents, and values read from the place of a tangent.
    #[test]
    fn splines_follow_their_polynomial() {
        // The cubic x(t) = t^3 - 2t on the keys 1 and 3: a Hermite spline with its derivatives reproduces it.
        let (x, slope) = (|t: f64| t * t * t - 2.0 * t, |t: f64| 3.0 * t * t - 2.0);
        let key = |t: f64, other: f64| [other as f32, x(t) as f32, slope(t) as f32];
        let mut values = key(1.0, -77.0).to_vec();
        values.extend([slope(3.0) as f32, x(3.0) as f32, -77.0]);
        let curve = curve(Interpolation::CubicSpline, &[1.0, 3.0], &values, 1);
        for time in [1.0f32, 1.25, 2.0, 2.9, 3.0] {
            let error = curve.at(time, false)[0] - x(f64::from(time));
            assert!(error.abs() < 1e-6, "{time}: {error}");
        }
        assert_eq!(curve.at(0.0, false), [x(1.0)]);
    }

    // Kills: rotations mixed like vectors, which turn at an uneven speed, and the long way round.
    #[test]
    fn rotations_turn_evenly_along_the_shorter_arc() {
        let turn = |angle: f64| DQuat::from_rotation_z(angle);
        let list = |q: DQuat| q.to_array().map(|x| x as f32);
        let (from, to) = (turn(0.0), turn(2.0));
        for sign in [1.0, -1.0] {
            let values = [list(from), list(to * sign)].concat();
            let curve = curve(Interpolation::Linear, &[0.0, 1.0], &values, 4);
            for time in [0.1f32, 0.25, 0.5, 0.9] {
                let angle = DQuat::from_slice(&curve.at(time, true)).angle_between(turn(2.0 * f64::from(time)));
                assert!(angle < 1e-6, "{time}: {angle}");
            }
        }
    }
}
