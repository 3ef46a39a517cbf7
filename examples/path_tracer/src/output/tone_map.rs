//! From scene light to a display's: curves that keep detail above white.
//!
//! Key decision: tone maps take and return linear Rec. 709, so that the sRGB curve is applied in one place, whatever the map.
//!
//! **Invariant:** what comes out lies in 0..=1, whatever goes in; NaN becomes black.

use glam::{Mat3, Vec3};

/// How light above white is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMap {
    /// Clipped.
    #[default]
    None,
    /// AgX.
    Agx,
    /// The reference rendering of ACES, approximately.
    Aces,
}

/// Beyond this everything is white, and sums stay finite.
const BRIGHTEST: f32 = 1.0e9;

impl ToneMap {
    /// The light that a display of Rec. 709 primaries emits for a linear colour.
    pub fn apply(self, color: [f32; 3]) -> [f32; 3] {
        let color = Vec3::from(color.map(|value| between_0_and(BRIGHTEST, value)));
        let mapped = match self {
            ToneMap::None => color,
            ToneMap::Agx => agx(color),
            ToneMap::Aces => aces(color),
        };
        mapped.clamp(Vec3::ZERO, Vec3::ONE).to_array()
    }
}

/// The nearest number in 0 to `most`; NaN becomes 0, where `clamp` keeps it.
pub(super) fn between_0_and(most: f32, value: f32) -> f32 {
    if value > 0.0 { value.min(most) } else { 0.0 }
}

/// AgX without a look: to a wider gamut, logarithm over 16.5 stops, a sigmoid per channel, and back.
///
/// **Source:** Troy Sobotka's AgX as Blender 4 configures it (Rec. 2020 primaries); matrices as in Filament's `ToneMapper.cpp`; the
/// polynomial of sixth degree is Benjamin Wrensch's fit ("Minimal AgX Implementation", mean squared error 3.7e-6).
fn agx(color: Vec3) -> Vec3 {
    const WIDE_FROM_709: Mat3 = columns([[0.6274, 0.0691, 0.0164], [0.3293, 0.9195, 0.0880], [0.0433, 0.0113, 0.8956]]);
    const FROM_WIDE_TO_709: Mat3 = columns([[1.6605, -0.1246, -0.0182], [-0.5876, 1.1329, -0.1006], [-0.0728, -0.0083, 1.1187]]);
    const INSET: Mat3 = columns([
        [0.856_627_15, 0.137_318_97, 0.111_898_21],
        [0.095_121_24, 0.761_242, 0.076_799_42],
        [0.048_251_606, 0.101_439_04, 0.811_302_37],
    ]);
    const OUTSET: Mat3 = columns([
        [1.127_100_6, -0.141_329_76, -0.141_329_76],
        [-0.110_606_64, 1.157_823_7, -0.110_606_64],
        [-0.016_493_939, -0.016_493_939, 1.251_936_4],
    ]);
    // Ten stops below middle grey, and six and a half above it.
    let (least, most) = (-12.473_93, 4.026_069);
    let inset = INSET * (WIDE_FROM_709 * color);
    let encoded = inset.map(|value| (value.max(1e-10).log2().clamp(least, most) - least) / (most - least));
    let shown = OUTSET * encoded.map(agx_sigmoid);
    // The sigmoid encodes for a display with a power of 2.2.
    FROM_WIDE_TO_709 * shown.map(|value| value.max(0.0).powf(2.2))
}

fn agx_sigmoid(x: f32) -> f32 {
    const COEFFICIENTS: [f32; 7] = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232];
    COEFFICIENTS.into_iter().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

/// The reference rendering transform and the output transform for displays of Rec. 709, fitted.
///
/// **Source:** Stephen Hill's fit, as in MJP's BakingLab (`ACES.hlsl`).
fn aces(color: Vec3) -> Vec3 {
    const INPUT: Mat3 = columns([[0.59719, 0.07600, 0.02840], [0.35458, 0.90834, 0.13383], [0.04823, 0.01566, 0.83777]]);
    const OUTPUT: Mat3 = columns([[1.60475, -0.10208, -0.00327], [-0.53108, 1.10813, -0.07276], [-0.07367, -0.00605, 1.07602]]);
    let fitted = (INPUT * color).map(|v| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081));
    OUTPUT * fitted
}

const fn columns(columns: [[f32; 3]; 3]) -> Mat3 {
    Mat3::from_cols_array_2d(&columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAPS: [ToneMap; 3] = [ToneMap::None, ToneMap::Agx, ToneMap::Aces];

    fn grey(map: ToneMap, value: f32) -> f32 {
        map.apply([value; 3])[1]
    }

    // Kills: a matrix by rows instead of columns (rows of all of them sum to 1, which keeps grey grey), a curve that turns back.
    #[test]
    fn grey_stays_grey_and_rises() {
        for map in MAPS {
            let mut last = -1.0;
            for step in 0..=160 {
                let value = (step as f32 * 0.125 - 12.0).exp2();
                let [r, g, b] = map.apply([value; 3]);
                assert!((r - g).abs() < 4e-3 && (b - g).abs() < 4e-3, "{map:?} {value}: {r} {g} {b}");
                assert!(g >= last - 2e-4, "{map:?} {value}: {g} after {last}");
                last = g;
            }
        }
    }

    // Kills: an exposure that is built in, an encoding applied twice or not undone, limits of the logarithm for another middle grey.
    #[test]
    fn the_published_anchors_are_met() {
        // AgX: middle grey is encoded as 0.5 for a power of 2.2; black ten stops below it, white 6.5 stops above it.
        assert!((grey(ToneMap::Agx, 0.18).powf(1.0 / 2.2) - 0.5).abs() < 5e-3);
        assert!(grey(ToneMap::Agx, 0.18 * (-10f32).exp2()) < 1e-4);
        assert!(grey(ToneMap::Agx, 0.18 * 6.5f32.exp2()) > 0.97);
        // ACES: 18 % of white are shown as 10 % (4.8 of 48 cd/m2), black as black; the fit ends at 1/0.983729.
        assert!((grey(ToneMap::Aces, 0.18) - 0.1).abs() < 0.01);
        assert_eq!(grey(ToneMap::Aces, 0.0), 0.0);
        assert_eq!(grey(ToneMap::Aces, 1e6), 1.0);
        assert_eq!(grey(ToneMap::None, 0.18), 0.18);
    }

    // Kills: primaries swapped; a curve per channel and nothing else, under which saturated light stays saturated however bright it is.
    #[test]
    fn bright_colours_go_towards_white_and_keep_their_hue() {
        for map in [ToneMap::Agx, ToneMap::Aces] {
            for channel in 0..3 {
                let seen = |strength: f32| {
                    let mut color = [0.0; 3];
                    color[channel] = strength;
                    let shown = map.apply(color);
                    let most = shown.into_iter().fold(0.0, f32::max);
                    assert!(shown[channel] >= most - 0.01, "{map:?} {channel} {strength}: {shown:?}");
                    shown.into_iter().fold(1.0, f32::min) / most
                };
                assert!(seen(50.0) > seen(0.5) + 0.1, "{map:?} {channel}");
            }
        }
    }

    // Kills: a coefficient mistyped, a step of the chain left out or in another order. The values are those of the published formulas,
    // evaluated in doubles by another program.
    #[test]
    fn colours_come_out_as_the_formulas_have_them() {
        let cases = [
            (ToneMap::Aces, [0.5, 0.3, 0.1], [0.367_585, 0.216_310, 0.058_775]),
            (ToneMap::Aces, [4.0, 2.0, 1.0], [0.928_132, 0.811_037, 0.669_907]),
            (ToneMap::Aces, [0.0, 1.0, 0.0], [0.101_613, 0.623_659, 0.028_844]),
            (ToneMap::Agx, [0.5, 0.3, 0.1], [0.433_909, 0.304_003, 0.159_845]),
            (ToneMap::Agx, [4.0, 2.0, 1.0], [0.883_379, 0.744_936, 0.632_765]),
            (ToneMap::Agx, [0.0, 0.0, 1.0], [0.034_013, 0.135_471, 0.730_010]),
        ];
        for (map, color, expected) in cases {
            let shown = map.apply(color);
            assert!(shown.iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-5), "{map:?} {color:?}: {shown:?}");
        }
    }

    // Kills: NaN or numbers beyond 1 that reach an encoder.
    #[test]
    fn nothing_leaves_the_unit_cube() {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, f32::MIN_POSITIVE, f32::MAX];
        for map in MAPS {
            for index in 0..odd.len().pow(3) {
                let color = [odd[index % odd.len()], odd[index / odd.len() % odd.len()], odd[index / odd.len().pow(2)]];
                let shown = map.apply(color);
                assert!(shown.iter().all(|value| (0.0..=1.0).contains(value)), "{map:?} {color:?}: {shown:?}");
            }
            assert!(map.apply([f32::INFINITY; 3])[0] > 0.97);
        }
    }
}
