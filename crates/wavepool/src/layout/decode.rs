//! Stored words as numbers, on the host: what a snapshot shows.
//!
//! **Source:** the WGSL of `shaders/math/{half_pair, rgb9e5, unit_vector}.wgsl`, whose decoding these functions repeat in double precision.

use super::Storage;

impl Storage {
    /// The numbers that a word holds, as many as the format's shape has; the word itself says nothing about its type, so that
    /// [`Storage::Word`] gives none.
    pub fn decode(self, word: u32) -> Vec<f32> {
        match self {
            Storage::Word => Vec::new(),
            Storage::HalfPair => [word & 0xffff, word >> 16].map(half).to_vec(),
            Storage::Rgb9e5 => {
                let scale = 2_f64.powi((word >> 27) as i32 - 24);
                [word, word >> 9, word >> 18].map(|part| (f64::from(part & 511) * scale) as f32).to_vec()
            }
            Storage::UnitVector => unit_vector(word).to_vec(),
        }
    }
}

fn half(word: u32) -> f32 {
    let magnitude = (word & 0x7fff).min(0x7bff);
    let value = if magnitude >= 0x400 { f32::from_bits((magnitude << 13) + 0x3800_0000) } else { magnitude as f32 / 16_777_216.0 };
    if word & 0x8000 == 0 { value } else { -value }
}

fn unit_vector(word: u32) -> [f32; 3] {
    const STEPS: i32 = 32767;
    if word == 0 {
        return [0.0; 3];
    }
    let place = [word & 0xffff, word >> 16].map(|side| (side as i32 - 32768).max(-STEPS));
    let side = place.map(i32::abs);
    let z = STEPS - side[0] - side[1];
    let sign = place.map(|side| if side < 0 { -1 } else { 1 });
    let xy = if z < 0 { [(STEPS - side[1]) * sign[0], (STEPS - side[0]) * sign[1]] } else { place };
    let v = [xy[0], xy[1], z].map(f64::from);
    let length = v.iter().map(|part| part * part).sum::<f64>().sqrt();
    v.map(|part| (part / length) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a sign, a side or an exponent taken from the wrong bits.
    #[test]
    fn known_words() {
        assert_eq!(Storage::HalfPair.decode(0xc000_3c00), [1.0, -2.0]);
        assert_eq!(Storage::HalfPair.decode(0x0001_7bff), [65504.0, 1.0 / 16_777_216.0]);
        assert_eq!(Storage::Rgb9e5.decode(511 | 256 << 9 | 1 << 18 | 16 << 27), [511.0 / 256.0, 1.0, 1.0 / 256.0]);
        assert_eq!(Storage::UnitVector.decode(0x8000_8000), [0.0, 0.0, 1.0]);
        assert_eq!(Storage::UnitVector.decode(0x8000_0001), [-1.0, 0.0, 0.0]);
        assert_eq!(Storage::UnitVector.decode(0), [0.0; 3]);
    }
}
