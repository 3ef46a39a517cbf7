//! FLIP: how different two pictures look to somebody who flips between them on a display.
//!
//! Key decision: the metric for displayed pictures, as published, on linear colours clipped to what a display shows. Filters are applied as
//! written, not split in two passes, because they are small and a comparison is no inner loop.
//!
//! **Invariant:** 0 for equal pictures, never more than 1.
//!
//! **Source:** Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator for Alternating Images"
//! (2020); constants and order of operations as in the authors' `FLIP.h`.

use glam::{Mat3, Vec3, vec3};

use super::{Picture, tone_map::between_0_and};

/// Pixels per degree of somebody 0.7 m in front of a display 0.7 m wide with 3840 pixels: the authors' default.
pub const PIXELS_PER_DEGREE: f32 = 67.020_645;

/// Exponent of colour differences.
const COLOR_EXPONENT: f32 = 0.7;
/// The share of the largest colour difference that is spread over ...
const KNEE: f32 = 0.4;
/// ... this share of the range of errors.
const KNEE_ERROR: f32 = 0.95;
/// Exponent of feature differences.
const FEATURE_EXPONENT: f32 = 0.5;
/// Width of an edge, in degrees.
const EDGE_WIDTH: f32 = 0.082;

/// The mean over pixels of the error that is seen.
///
/// **Cost:** about a thousand multiplications per pixel.
///
/// # Errors
/// A text that says which sizes do not agree.
pub fn mean(picture: &Picture, reference: &Picture) -> Result<f64, String> {
    picture.check()?;
    reference.check()?;
    if (picture.width, picture.height) != (reference.width, reference.height) {
        return Err(format!(
            "{}x{} pixels, where the reference has {}x{}",
            picture.width, picture.height, reference.width, reference.height
        ));
    }
    let (a, b) = (Seen::of(picture), Seen::of(reference));
    let most = largest_color_error();
    let errors = a.pixels.iter().zip(&b.pixels).map(|(a, b)| {
        let color = spread(hyab(a.color, b.color).powf(COLOR_EXPONENT), most);
        let feature = (a.edge - b.edge).abs().max((a.point - b.point).abs());
        let feature = (feature * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT).min(1.0);
        f64::from(color.powf(1.0 - feature))
    });
    Ok(errors.sum::<f64>() / a.pixels.len() as f64)
}

/// What is seen of a pixel.
struct SeenPixel {
    /// L*a*b*, with the chroma that its lightness leaves.
    color: Vec3,
    edge: f32,
    point: f32,
}

struct Seen {
    pixels: Vec<SeenPixel>,
}

impl Seen {
    fn of(picture: &Picture) -> Seen {
        let shown = |color: &[f32; 3]| Vec3::from(color.map(|value| between_0_and(1.0, value)));
        let opponent = Plane {
            width: i64::from(picture.width),
            height: i64::from(picture.height),
            values: picture.color.iter().map(|color| opponent_of(shown(color))).collect(),
        };
        let (sensitivity, features) = (Filter::of_contrast_sensitivity(), Filter::of_features());
        let grey = Plane { values: opponent.values.iter().map(|color| Vec3::splat((color.x + 16.0) / 116.0)).collect(), ..opponent };
        let pixels = (0..opponent.height).flat_map(|y| (0..opponent.width).map(move |x| (x, y))).map(|(x, y)| {
            let filtered = linear_of(opponent.filtered(&sensitivity, x, y)).clamp(Vec3::ZERO, Vec3::ONE);
            let [edge_x, point_x, _] = grey.filtered(&features, x, y).to_array();
            let [edge_y, point_y, _] = grey.filtered_transposed(&features, x, y).to_array();
            SeenPixel { color: hunt(lab_of(filtered)), edge: edge_x.hypot(edge_y), point: point_x.hypot(point_y) }
        });
        Seen { pixels: pixels.collect() }
    }
}

/// Three numbers per pixel; the border goes on for ever.
struct Plane {
    width: i64,
    height: i64,
    values: Vec<Vec3>,
}

impl Plane {
    fn at(&self, x: i64, y: i64) -> Vec3 {
        let (x, y) = (x.clamp(0, self.width - 1), y.clamp(0, self.height - 1));
        self.values[(y * self.width + x) as usize]
    }

    fn filtered(&self, filter: &Filter, x: i64, y: i64) -> Vec3 {
        filter.places.iter().map(|(dx, dy, weight)| self.at(x + dx, y + dy) * *weight).sum()
    }

    fn filtered_transposed(&self, filter: &Filter, x: i64, y: i64) -> Vec3 {
        filter.places.iter().map(|(dx, dy, weight)| self.at(x + dy, y + dx) * *weight).sum()
    }
}

/// Weights of three channels at places around a pixel.
struct Filter {
    places: Vec<(i64, i64, Vec3)>,
}

impl Filter {
    fn new(radius: f32, weight: impl Fn(f32, f32) -> Vec3) -> Filter {
        let radius = radius.ceil() as i64;
        let side = || -radius..=radius;
        Filter { places: side().flat_map(|y| side().map(move |x| (x, y))).map(|(x, y)| (x, y, weight(x as f32, y as f32))).collect() }
    }

    fn weights(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.places.iter().map(|(_, _, weight)| *weight)
    }

    /// What an eye resolves of lightness, red against green and blue against yellow.
    fn of_contrast_sensitivity() -> Filter {
        const SCALES: [[f32; 4]; 3] = [[1.0, 0.0047, 0.0, 1e-5], [1.0, 0.0053, 0.0, 1e-5], [34.1, 0.04, 13.5, 0.025]];
        const WIDEST: f32 = 0.04;
        let pi_squared = std::f32::consts::PI.powi(2);
        let radius = 3.0 * (WIDEST / (2.0 * pi_squared)).sqrt() * PIXELS_PER_DEGREE;
        let mut filter = Filter::new(radius, |x, y| {
            let squared = (x * x + y * y) / PIXELS_PER_DEGREE.powi(2);
            let bell = |height: f32, width: f32| height * (std::f32::consts::PI / width).sqrt() * (-pi_squared * squared / width).exp();
            Vec3::from(SCALES.map(|[height, width, other_height, other_width]| bell(height, width) + bell(other_height, other_width)))
        });
        let sum: Vec3 = filter.weights().sum();
        filter.places.iter_mut().for_each(|(_, _, weight)| *weight /= sum);
        filter
    }

    /// First and second derivative of a bell along x: edges and points. What is above and what is below zero weighs one each.
    fn of_features() -> Filter {
        let deviation = 0.5 * EDGE_WIDTH * PIXELS_PER_DEGREE;
        let squared = deviation * deviation;
        let mut filter = Filter::new(3.0 * deviation, |x, y| {
            let bell = (-(x * x + y * y) / (2.0 * squared)).exp();
            vec3(-x * bell, (x * x / squared - 1.0) * bell, 0.0)
        });
        let above: Vec3 = filter.weights().map(|weight| weight.max(Vec3::ZERO)).sum();
        let below: Vec3 = filter.weights().map(|weight| -weight.min(Vec3::ZERO)).sum();
        for (_, _, weight) in &mut filter.places {
            for channel in 0..2 {
                let total = if weight[channel] > 0.0 { above[channel] } else { below[channel] };
                weight[channel] /= total;
            }
        }
        filter
    }
}

/// Columns: what red, green and blue have of X, Y and Z.
const XYZ_OF_LINEAR: Mat3 = Mat3::from_cols_array(&[
    10_135_552.0 / 24_577_794.0,
    2_613_072.0 / 12_288_897.0,
    1_425_312.0 / 73_733_382.0,
    8_788_810.0 / 24_577_794.0,
    8_788_810.0 / 12_288_897.0,
    8_788_810.0 / 73_733_382.0,
    4_435_075.0 / 24_577_794.0,
    887_015.0 / 12_288_897.0,
    70_074_185.0 / 73_733_382.0,
]);

/// X, Y and Z in units of those of white.
fn relative_xyz_of(linear: Vec3) -> Vec3 {
    (XYZ_OF_LINEAR * linear) / (XYZ_OF_LINEAR * Vec3::ONE)
}

/// Lightness and two opponent channels, linear in light: YCxCz.
fn opponent_of(linear: Vec3) -> Vec3 {
    let xyz = relative_xyz_of(linear);
    vec3(116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z))
}

fn linear_of(opponent: Vec3) -> Vec3 {
    let y = (opponent.x + 16.0) / 116.0;
    let relative = vec3(y + opponent.y / 500.0, y, y - opponent.z / 200.0);
    XYZ_OF_LINEAR.inverse() * (relative * (XYZ_OF_LINEAR * Vec3::ONE))
}

fn lab_of(linear: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let root = |t: f32| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let xyz = relative_xyz_of(linear).map(root);
    vec3(116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z))
}

/// Less light, less chroma.
fn hunt(lab: Vec3) -> Vec3 {
    vec3(lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z)
}

/// A distance for large differences: city blocks between lightness and chroma.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    (a.x - b.x).abs() + (a.y - b.y).hypot(a.z - b.z)
}

/// That of green and blue, which no two colours of a display exceed.
fn largest_color_error() -> f32 {
    hyab(hunt(lab_of(Vec3::Y)), hunt(lab_of(Vec3::Z))).powf(COLOR_EXPONENT)
}

/// Brings errors into 0..=1, most of the range for the smaller ones.
fn spread(error: f32, most: f32) -> f32 {
    let knee = KNEE * most;
    if error < knee { error * KNEE_ERROR / knee } else { (KNEE_ERROR + (error - knee) / (most - knee) * (1.0 - KNEE_ERROR)).min(1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(color: impl Fn(u32, u32) -> [f32; 3]) -> Picture {
        let (width, height) = (48, 32);
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| color(x, y));
        Picture::of_color(width, height, pixels.collect())
    }

    fn pattern(x: u32, y: u32) -> [f32; 3] {
        [x as f32 / 47.0, y as f32 / 31.0, ((x / 4 + y / 4) % 2) as f32 * 0.8]
    }

    // Kills: a filter, an exponent, a border or a colour space other than the authors'. The values are those of their own program (Python
    // package flip-evaluator 1.7) for the same linear colours.
    #[test]
    fn errors_are_those_of_the_authors_program() {
        let reference = drawn(pattern);
        let noisy = drawn(|x, y| pattern(x, y).map(|value| (value + ((x * 7 + y * 13) % 5) as f32 * 0.05).min(1.0)));
        let shifted = drawn(|x, y| pattern((x + 47) % 48, y));
        let dim = drawn(|x, y| pattern(x, y).map(|value| value * 0.7));
        let flat = |color: [f32; 3]| drawn(move |_, _| color);
        let cases = [
            ("noisy", &reference, &noisy, 0.282_317),
            ("shifted", &reference, &shifted, 0.176_623),
            ("dim", &reference, &dim, 0.472_083),
            ("black and white", &flat([0.0; 3]), &flat([1.0; 3]), 0.967_399),
            ("green and blue", &flat([0.0, 1.0, 0.0]), &flat([0.0, 0.0, 1.0]), 1.0),
        ];
        for (name, a, b, expected) in cases {
            for (a, b) in [(a, b), (b, a)] {
                let found = mean(a, b).unwrap();
                assert!((found - expected).abs() < 2e-4, "{name}: {found}, not {expected}");
            }
        }
        assert_eq!(mean(&reference, &reference), Ok(0.0));
    }

    // Kills: NaN that spreads through the filters, light above white that counts, sizes that do not agree.
    #[test]
    fn what_a_display_cannot_show_does_not_count() {
        let odd = |value: f32| drawn(move |x, _| [if x == 3 { value } else { 0.5 }; 3]);
        assert_eq!(mean(&odd(f32::NAN), &odd(0.0)), Ok(0.0));
        assert_eq!(mean(&odd(f32::INFINITY), &odd(1.0)), Ok(0.0));
        assert!(mean(&odd(0.0), &Picture::of_color(1, 1, vec![[0.0; 3]])).is_err());
    }
}
