//! Radiance `.hdr`: shared-exponent texels, plain or run-length encoded in two ways, scanlines in any of eight orders.
//!
//! Key decision: a reader of our own, strict about lengths, because general decoders refuse the old run-length encoding, ignore
//! EXPOSURE, or read mirrored orders as if they were upright.
//!
//! **Invariant:** memory grows with the scanlines that were really decoded, never with what the header promises.
//!
//! **Source:** G. Ward, "Real Pixels", Graphics Gems II, and the format notes of the Radiance manual.

use super::Panorama;
use crate::error::Fault;
use crate::scene::limits;

/// Reads all texels, EXPOSURE divided out, XYZ converted to linear Rec. 709.
pub(super) fn read(bytes: &[u8]) -> Result<Panorama, Fault> {
    let (header, body) = Header::read(bytes)?;
    let mut rest = body;
    let mut scanlines: Vec<[u8; 4]> = Vec::new();
    for line in 0..header.n_lines {
        read_scanline(&mut rest, header.line_length, &mut scanlines)
            .map_err(|what| Fault::invalid(format_args!("scanline {line}"), what))?;
    }
    let colors: Vec<[f32; 3]> = scanlines.iter().map(|&texel| header.color(texel)).collect();
    drop(scanlines);

    // Upright files are done; the others are turned.
    let texels = match header.order {
        Order { rows: true, down: true, right: true } => colors,
        order => {
            let (width, height) = header.size();
            let mut turned = Vec::with_capacity(colors.len());
            for y in 0..height {
                for x in 0..width {
                    let row = if order.down { y } else { height - 1 - y };
                    let column = if order.right { x } else { width - 1 - x };
                    let (line, at) = if order.rows { (row, column) } else { (column, row) };
                    turned.push(colors[line * header.line_length + at]);
                }
            }
            turned
        }
    };
    let (width, height) = header.size();
    Ok(Panorama { width: width as u32, height: height as u32, texels, warnings: header.warnings })
}

/// How scanlines lie in the picture.
#[derive(Clone, Copy)]
struct Order {
    /// A scanline is a row; otherwise a column.
    rows: bool,
    /// y runs from the top to the bottom in the file.
    down: bool,
    /// x runs from the left to the right in the file.
    right: bool,
}

struct Header {
    n_lines: usize,
    line_length: usize,
    order: Order,
    exposure: f64,
    /// What COLORCORR says each channel was multiplied with.
    correction: [f64; 3],
    xyz: bool,
    warnings: Vec<String>,
}

/// A scanline of old runs that repeat their first texel takes three words at most; no honest picture is flatter.
const TEXELS_PER_BYTE: usize = 1024;

impl Header {
    fn read(bytes: &[u8]) -> Result<(Header, &[u8]), Fault> {
        if !bytes.starts_with(b"#?") {
            return Err(Fault::invalid("header", "the file does not start with #?RADIANCE or #?RGBE"));
        }
        let mut rest = bytes;
        let (mut exposure, mut correction, mut xyz) = (1.0f64, [1.0f64; 3], false);
        let mut warnings = Vec::new();
        loop {
            let line = next_line(&mut rest).ok_or_else(|| Fault::invalid("header", "the file ends before the empty line"))?;
            if line.is_empty() {
                break;
            }
            let (key, value) = line.split_once('=').unwrap_or((line, ""));
            match key.trim() {
                "FORMAT" => match value.trim() {
                    "32-bit_rle_rgbe" => xyz = false,
                    "32-bit_rle_xyze" => xyz = true,
                    other => return Err(Fault::unsupported("header", format_args!("the format '{other}'"))),
                },
                "EXPOSURE" => match value.trim().parse::<f64>() {
                    // Several exposures multiply.
                    Ok(factor) if factor > 0.0 && (exposure * factor).is_normal() => exposure *= factor,
                    _ => return Err(Fault::invalid("header", format_args!("EXPOSURE '{}' is no positive number", value.trim()))),
                },
                "COLORCORR" => {
                    let factors: Vec<f64> = value.split_ascii_whitespace().take(4).map_while(|word| word.parse().ok()).collect();
                    for (whole, factor) in correction.iter_mut().zip(&factors) {
                        *whole *= factor;
                    }
                    if factors.len() != 3 || !correction.iter().all(|&whole| whole > 0.0 && whole.is_normal()) {
                        return Err(Fault::invalid("header", format_args!("COLORCORR '{}' is no three positive numbers", value.trim())));
                    }
                }
                "PRIMARIES" => warnings.push(String::from("PRIMARIES is left out: the colours are taken as those of Rec. 709")),
                "PIXASPECT" => warnings.push(String::from("PIXASPECT is left out: the picture spans the whole sphere")),
                _ => {}
            }
        }
        let line = next_line(&mut rest).ok_or_else(|| Fault::invalid("resolution", "the line is missing or endless"))?;
        let (n_lines, line_length, order) = resolution(line).map_err(|what| Fault::invalid("resolution", what))?;
        // The shortest scanline of any encoding takes four bytes.
        if rest.len() / 4 < n_lines {
            return Err(Fault::invalid("resolution", format_args!("{} bytes cannot hold {n_lines} scanlines", rest.len())));
        }
        if n_lines * line_length / TEXELS_PER_BYTE > rest.len() {
            let what = format!("{} bytes cannot hold {n_lines} x {line_length} texels", rest.len());
            return Err(Fault::invalid("resolution", what));
        }
        Ok((Header { n_lines, line_length, order, exposure, correction, xyz, warnings }, rest))
    }

    fn size(&self) -> (usize, usize) {
        if self.order.rows { (self.line_length, self.n_lines) } else { (self.n_lines, self.line_length) }
    }

    fn color(&self, [r, g, b, e]: [u8; 4]) -> [f32; 3] {
        // An exponent of zero means black, whatever the mantissas are.
        if e == 0 {
            return [0.0; 3];
        }
        let scale = 2f64.powi(i32::from(e) - 136) / self.exposure;
        let [x, y, z] = [r, g, b].map(|mantissa| f64::from(mantissa) * scale);
        let [x, y, z] = [x / self.correction[0], y / self.correction[1], z / self.correction[2]];
        let rgb = if self.xyz {
            [
                3.240_97 * x - 1.537_383 * y - 0.498_611 * z,
                -0.969_244 * x + 1.875_968 * y + 0.041_555 * z,
                0.055_63 * x - 0.203_977 * y + 1.056_972 * z,
            ]
        } else {
            [x, y, z]
        };
        rgb.map(|value| value as f32)
    }
}

/// The text up to the next line break, which is taken too; `None` for lines that are endless or no text.
fn next_line<'a>(rest: &mut &'a [u8]) -> Option<&'a str> {
    const LONGEST: usize = 1 << 16;
    let end = rest.iter().take(LONGEST).position(|&c| c == b'\n')?;
    let line = std::str::from_utf8(&rest[..end]).ok()?;
    *rest = &rest[end + 1..];
    Some(line.strip_suffix('\r').unwrap_or(line))
}

/// Number of scanlines, their length and their order, from a line like `-Y 512 +X 1024`.
fn resolution(line: &str) -> Result<(usize, usize, Order), String> {
    let words: Vec<&str> = line.split_ascii_whitespace().take(5).collect();
    let [first, n_lines, second, line_length] = words[..] else {
        return Err(format!("'{line}' does not have four words"));
    };
    let number = |word: &str| word.parse::<u32>().ok().filter(|&n| n > 0).ok_or_else(|| format!("'{word}' is no positive number"));
    let (n_lines, line_length) = (number(n_lines)? as usize, number(line_length)? as usize);
    if n_lines.checked_mul(line_length).is_none_or(|n| n > limits::ENVIRONMENT_TEXELS) {
        return Err(format!("{n_lines} x {line_length} texels are too many"));
    }
    let axis = |word: &str| match word {
        "-Y" => Ok(('y', true)),
        "+Y" => Ok(('y', false)),
        "+X" => Ok(('x', true)),
        "-X" => Ok(('x', false)),
        _ => Err(format!("'{word}' is no axis")),
    };
    match (axis(first)?, axis(second)?) {
        (('y', down), ('x', right)) => Ok((n_lines, line_length, Order { rows: true, down, right })),
        (('x', right), ('y', down)) => Ok((n_lines, line_length, Order { rows: false, down, right })),
        _ => Err(format!("'{line}' names one axis twice")),
    }
}

fn read_scanline(rest: &mut &[u8], length: usize, out: &mut Vec<[u8; 4]>) -> Result<(), String> {
    match *rest {
        // A new-style scanline starts with a texel that no normalised colour has; short and very long ones are never encoded so.
        [2, 2, high, low, ..] if *high < 128 && (8..=0x7FFF).contains(&length) => {
            let declared = usize::from(*high) << 8 | usize::from(*low);
            if declared != length {
                return Err(format!("the encoded length is {declared} instead of {length}"));
            }
            *rest = &rest[4..];
            read_planes(rest, length, out)
        }
        _ => read_old(rest, length, out),
    }
}

/// Four planes of one byte for each texel, in runs and literals.
fn read_planes(rest: &mut &[u8], length: usize, out: &mut Vec<[u8; 4]>) -> Result<(), String> {
    let start = out.len();
    out.resize(start + length, [0; 4]);
    for channel in 0..4 {
        let mut at = start;
        while at < out.len() {
            let code = take(rest, 1)?[0];
            let count = usize::from(if code > 128 { code - 128 } else { code });
            if count == 0 {
                return Err(String::from("a run has no length"));
            }
            let target = out.get_mut(at..at + count).ok_or("a run is longer than the scanline")?;
            if code > 128 {
                let value = take(rest, 1)?[0];
                target.iter_mut().for_each(|texel| texel[channel] = value);
            } else {
                for (texel, &value) in target.iter_mut().zip(take(rest, count)?) {
                    texel[channel] = value;
                }
            }
            at += count;
        }
    }
    Ok(())
}

/// Whole texels; one with three mantissas of 1 repeats the texel before it, and repetitions in a row are digits of one number.
fn read_old(rest: &mut &[u8], length: usize, out: &mut Vec<[u8; 4]>) -> Result<(), String> {
    let end = out.len() + length;
    let start = out.len();
    let mut shift = 0u32;
    while out.len() < end {
        let word = take(rest, 4)?;
        let texel = [word[0], word[1], word[2], word[3]];
        if texel[..3] == [1, 1, 1] {
            let before = match out.last() {
                Some(&before) if out.len() > start => before,
                _ => return Err(String::from("it starts with a repetition")),
            };
            let count = if shift < 32 { usize::from(texel[3]) << shift } else { usize::MAX };
            if count > end - out.len() {
                return Err(String::from("a run is longer than the scanline"));
            }
            out.extend(std::iter::repeat_n(before, count));
            shift += 8;
        } else {
            out.push(texel);
            shift = 0;
        }
    }
    Ok(())
}

fn take<'a>(rest: &mut &'a [u8], n: usize) -> Result<&'a [u8], String> {
    let (taken, left) = rest.split_at_checked(n).ok_or("the file ends inside")?;
    *rest = left;
    Ok(taken)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, resolution: &str, body: &[u8]) -> Vec<u8> {
        [format!("#?RADIANCE\n{header}\n{resolution}\n").as_bytes(), body].concat()
    }

    fn reds(file: &[u8]) -> Vec<f32> {
        read(file).unwrap().texels.iter().map(|texel| texel[0]).collect()
    }

    // Kills: each wrong pairing of the two signs and the two axes.
    #[test]
    fn every_order_shows_the_same_picture() {
        // Two rows of three: 1 2 3 / 4 5 6.
        let cases = [
            ("-Y 2 +X 3", [1, 2, 3, 4, 5, 6]),
            ("+Y 2 +X 3", [4, 5, 6, 1, 2, 3]),
            ("-Y 2 -X 3", [3, 2, 1, 6, 5, 4]),
            ("+Y 2 -X 3", [6, 5, 4, 3, 2, 1]),
            ("+X 3 -Y 2", [1, 4, 2, 5, 3, 6]),
            ("-X 3 -Y 2", [3, 6, 2, 5, 1, 4]),
            ("+X 3 +Y 2", [4, 1, 5, 2, 6, 3]),
            ("-X 3 +Y 2", [6, 3, 5, 2, 4, 1]),
        ];
        for (line, values) in cases {
            let body: Vec<u8> = values.iter().flat_map(|&v| [v, 0, 0, 136]).collect();
            assert_eq!(reds(&file("", line, &body)), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "{line}");
        }
    }

    // Kills: multiplying by EXPOSURE, keeping only the last one, and an exponent that is off by one.
    #[test]
    fn exposures_are_divided_out() {
        assert_eq!(reds(&file("", "-Y 1 +X 1", &[128, 0, 0, 129])), [1.0]);
        assert_eq!(reds(&file("EXPOSURE=2\nEXPOSURE= 4\n", "-Y 1 +X 1", &[128, 0, 0, 129])), [0.125]);
        assert!(read(&file("EXPOSURE=0\n", "-Y 1 +X 1", &[0; 4])).is_err());
        assert!(read(&file("EXPOSURE=nan\n", "-Y 1 +X 1", &[0; 4])).is_err());
    }

    // Kills: a correction that is ignored, multiplied, or taken from the last line alone.
    #[test]
    fn color_corrections_are_divided_out() {
        let found = read(&file("COLORCORR=2 4 0.5\nCOLORCORR=1 1 2\nPRIMARIES=0 0\n", "-Y 1 +X 1", &[128, 128, 128, 129])).unwrap();
        assert_eq!((found.texels[0], found.warnings.len()), ([0.5, 0.25, 1.0], 1));
        for bad in ["1 2", "1 2 3 4", "0 1 1", "1 x 1", "1e300 1e300 1e300\nCOLORCORR=1e300 1 1"] {
            assert!(read(&file(&format!("COLORCORR={bad}\n"), "-Y 1 +X 1", &[0; 4])).is_err(), "{bad}");
        }
    }

    // Kills: a run that is not shifted when it continues, and a shift that survives the next texel.
    #[test]
    fn old_runs_are_digits_of_one_number() {
        let body = [7, 0, 0, 136, 1, 1, 1, 2, 1, 1, 1, 1, 9, 0, 0, 136, 1, 1, 1, 1];
        let expected = [vec![7.0; 259], vec![9.0; 2]].concat();
        assert_eq!(reds(&file("", "-Y 1 +X 261", &body)), expected);
        assert!(read(&file("", "-Y 1 +X 258", &body)).is_err(), "longer than the scanline");
        let endless = [[7, 0, 0, 136].as_slice(), &[1, 1, 1, 0].repeat(100)].concat();
        assert!(read(&file("", "-Y 1 +X 261", &endless)).is_err(), "runs of nothing end with the file");
        assert!(read(&file("", "-Y 1 +X 2", &[1, 1, 1, 2])).is_err(), "nothing to repeat");
    }

    // Kills: an endless loop at runs of length zero, writing past the scanline, and planes in the wrong order.
    #[test]
    fn new_runs() {
        let start = [2, 2, 0, 8];
        let planes = [136, 5, 8, 0, 1, 2, 3, 4, 5, 6, 7, 136, 0, 136, 136];
        let found = read(&file("", "-Y 1 +X 8", &[&start[..], &planes].concat())).unwrap().texels;
        assert_eq!((found[0], found[7]), ([5.0, 0.0, 0.0], [5.0, 7.0, 0.0]));
        for planes in [&[0, 0, 0, 0][..], &[128 + 9, 1], &[9, 1, 1, 1, 1, 1, 1, 1, 1, 1], &[136, 1, 136]] {
            assert!(read(&file("", "-Y 1 +X 8", &[&start[..], planes].concat())).is_err(), "{planes:?}");
        }
        assert!(read(&file("", "-Y 1 +X 9", &[&start[..], &planes].concat())).is_err(), "another width");
    }

    // Kills: allocating what the header promises.
    #[test]
    fn promises_are_not_believed() {
        for line in ["-Y 2000000000 +X 2000000000", "-Y 100000 +X 1000", "-Y 0 +X 8", "-Y -1 +X 8", "-Y 1 +Y 8", "-Y a +X 8", "", "-Y 1"] {
            assert!(read(&file("", line, &[0; 64])).is_err(), "{line}");
        }
        // Sixteen bytes that are as many million texels.
        let flat = [[7, 0, 0, 136], [1, 1, 1, 255], [1, 1, 1, 255], [1, 1, 1, 255]].concat();
        let text = read(&file("", "-Y 1 +X 16777216", &flat)).map(|made| made.texels.len()).unwrap_err().in_named("a.hdr").to_string();
        assert_eq!(text, "a.hdr: resolution: 16 bytes cannot hold 1 x 16777216 texels");
    }
}
