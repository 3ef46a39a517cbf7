//! Contact sheets: small pictures in a grid, each with a line of text beneath it.
//!
//! Key decision: a sheet holds bytes as a display shows them, and a picture is reduced and tone-mapped when it is put in. So hundreds of
//! pictures take the memory of one, whatever their size.
//!
//! **Invariant:** nothing that is put into a cell reaches another one.

use std::path::Path;

use super::{Options, Picture, check_place, font, png};
use crate::error::Error;

const PAPER: u8 = 244;
const INK: u8 = 24;
/// Behind a picture that does not fill its cell.
const BEHIND: u8 = 64;
/// Instead of a picture.
const GREY: u8 = 128;
/// Pixels between cells and around them.
const GAP: u32 = 6;
/// Pixels above and beneath a line of text.
const LEADING: u32 = 3;

/// Bytes of the largest sheet.
const MOST_BYTES: u64 = 1 << 30;

/// A grid of pictures.
#[derive(Clone, Debug)]
pub struct Sheet {
    cell: [u32; 2],
    columns: u32,
    width: u32,
    height: u32,
    texels: Vec<[u8; 3]>,
}

impl Sheet {
    /// Room for `n` pictures of at most `cell` pixels. Without a number of columns the sheet is about as wide as high.
    ///
    /// # Errors
    /// When a sheet of this size cannot be held; the text says how large it would be.
    pub fn new(n: usize, cell: [u32; 2], columns: Option<u32>) -> Result<Sheet, String> {
        let pitch = pitch(cell);
        let n = n.max(1) as u64;
        let columns = columns.map_or_else(|| square(n, pitch), u64::from).clamp(1, n);
        let side = |number: u64, pitch: u32| number.saturating_mul(u64::from(pitch)).saturating_add(u64::from(GAP));
        let (width, height) = (side(columns, pitch[0]), side(n.div_ceil(columns), pitch[1]));
        let bytes = width.saturating_mul(height).saturating_mul(3);
        let sides = (u32::try_from(width), u32::try_from(height), u32::try_from(columns));
        let (Ok(width), Ok(height), Ok(columns), true) = (sides.0, sides.1, sides.2, bytes <= MOST_BYTES) else {
            return Err(format!("{n} pictures make a sheet of {width}x{height} pixels, {bytes} bytes; the largest has {MOST_BYTES}"));
        };
        let texels = vec![[PAPER; 3]; width as usize * height as usize];
        Ok(Sheet { cell, columns, width, height, texels })
    }

    /// Columns and rows in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Puts a picture into a cell, counted from the upper left along the rows, reduced to fit. Of `options` exposure and tone map count.
    pub fn show(&mut self, index: usize, caption: &str, picture: &Picture, options: &Options) {
        let fitted = fit(picture, self.cell);
        let bytes = png::bytes(&fitted, options);
        let [x, y] = self.corner(index);
        self.fill([x, y], self.cell, BEHIND);
        let offset = [(self.cell[0] - fitted.width) / 2, (self.cell[1] - fitted.height) / 2];
        let (colors, _) = bytes.as_chunks::<3>();
        for (row, colors) in (0u32..).zip(colors.chunks(fitted.width.max(1) as usize)) {
            for (column, &color) in (0u32..).zip(colors) {
                self.set(x + offset[0] + column, y + offset[1] + row, color);
            }
        }
        self.caption(index, caption);
    }

    /// Makes a cell grey, with a text that says why there is no picture.
    pub fn refuse(&mut self, index: usize, caption: &str, why: &str) {
        let [x, y] = self.corner(index);
        self.fill([x, y], self.cell, GREY);
        let room = [self.cell[0].saturating_sub(LEADING), self.cell[1].saturating_sub(LEADING)];
        let line_height = font::HEIGHT + LEADING;
        if room[0] < font::ADVANCE {
            return self.caption(index, caption);
        }
        let lines = font::wrap(why, (room[0] / font::ADVANCE) as usize);
        for (line, row) in lines.iter().zip(0..room[1] / line_height) {
            self.write_line([x + LEADING, y + LEADING + row * line_height], line, PAPER);
        }
        self.caption(index, caption);
    }

    /// Writes an 8-bit PNG.
    ///
    /// # Errors
    /// When the operating system refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        png::write_bytes(path, [self.width, self.height], self.texels.as_flattened())
    }

    /// Upper left pixel of a cell's picture.
    fn corner(&self, index: usize) -> [u32; 2] {
        let index = u32::try_from(index).unwrap_or(u32::MAX);
        let [across, down] = pitch(self.cell);
        let place = |number: u32, pitch: u32| number.saturating_mul(pitch).saturating_add(GAP);
        [place(index % self.columns, across), place(index / self.columns, down)]
    }

    fn caption(&mut self, index: usize, text: &str) {
        let [x, y] = self.corner(index);
        let line = font::shorten(text, (self.cell[0] / font::ADVANCE) as usize);
        self.write_line([x, y + self.cell[1] + LEADING], &line, INK);
    }

    fn write_line(&mut self, [x, y]: [u32; 2], text: &str, ink: u8) {
        for (column, row) in font::ink(text) {
            self.set(x + column, y + row, [ink; 3]);
        }
    }

    fn fill(&mut self, [x, y]: [u32; 2], [width, height]: [u32; 2], value: u8) {
        for row in y..y.saturating_add(height) {
            for column in x..x.saturating_add(width) {
                self.set(column, row, [value; 3]);
            }
        }
    }

    /// What lies outside of the sheet is cut off.
    fn set(&mut self, x: u32, y: u32, color: [u8; 3]) {
        if x < self.width
            && let Some(texel) = self.texels.get_mut(y as usize * self.width as usize + x as usize)
        {
            *texel = color;
        }
    }
}

/// Asks, before the long work, whether [`Sheet::write`] can succeed. Nothing stays behind.
///
/// # Errors
/// When the name does not end in `.png`, or the operating system refuses.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    match super::Format::of(path) {
        Ok(super::Format::Png) => check_place(path),
        _ => Err(Error::extension(path, ".png")),
    }
}

/// From one cell to the next.
fn pitch([width, height]: [u32; 2]) -> [u32; 2] {
    [width.saturating_add(GAP), height.saturating_add(GAP + font::HEIGHT + LEADING)]
}

/// The fewest columns with which the sheet is at least as wide as high.
fn square(n: u64, [across, down]: [u32; 2]) -> u64 {
    let (n, across, down) = (n as f64, f64::from(across), f64::from(down));
    // A first guess by area, then by whole rows.
    let mut columns = (n * down / across).sqrt().floor().max(1.0);
    while columns < n && columns * across < (n / columns).ceil() * down {
        columns += 1.0;
    }
    columns as u64
}

/// The picture in at most `cell` pixels, its sides in proportion: means over areas when it is larger, whole multiples when it is
/// smaller.
fn fit(picture: &Picture, cell: [u32; 2]) -> Picture {
    let size = [picture.width.max(1), picture.height.max(1)];
    let ratio = |axis: usize| f64::from(cell[axis]) / f64::from(size[axis]);
    let scale = ratio(0).min(ratio(1));
    let scale = if scale >= 1.0 { scale.floor() } else { scale };
    let side = |axis: usize| ((f64::from(size[axis]) * scale).round() as u32).clamp(1, cell[axis].max(1));
    let (width, height) = (side(0), side(1));
    let (across, down) = (spans(size[0], width), spans(size[1], height));
    let stride = picture.width as usize;
    let mut color = Vec::with_capacity(width as usize * height as usize);
    for rows in &down {
        for columns in &across {
            let mut sum = [0.0f64; 3];
            let mut total = 0.0;
            for &(y, share_y) in rows {
                for &(x, share_x) in columns {
                    let Some(texel) = picture.color.get(y * stride + x) else { continue };
                    let share = share_x * share_y;
                    total += share;
                    (0..3).for_each(|channel| sum[channel] += share * f64::from(texel[channel]));
                }
            }
            color.push(sum.map(|sum| if total > 0.0 { (sum / total) as f32 } else { 0.0 }));
        }
    }
    Picture::of_color(width, height, color)
}

/// For each of `to` equal parts of `from` texels, which texels it covers and how much of each.
fn spans(from: u32, to: u32) -> Vec<Vec<(usize, f64)>> {
    let edge = |part: u32| f64::from(part) * f64::from(from) / f64::from(to);
    let span = |part: u32| {
        let (begin, end) = (edge(part), edge(part + 1));
        let last = (end.ceil() as u32).min(from);
        let texels = (begin.floor() as u32..last).map(|at| {
            let share = f64::from(at + 1).min(end) - f64::from(at).max(begin);
            (at as usize, share.max(0.0))
        });
        texels.collect()
    };
    (0..to).map(span).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(sheet: &Sheet, x: u32, y: u32) -> [u8; 3] {
        sheet.texels[(y * sheet.width + x) as usize]
    }

    fn flat(width: u32, height: u32, value: f32) -> Picture {
        Picture::of_color(width, height, vec![[value; 3]; (width * height) as usize])
    }

    // Kills: cells that overlap, a row that is forgotten, columns taken for rows, a picture in the cell of its neighbour.
    #[test]
    fn every_picture_has_a_cell_of_its_own() {
        let mut sheet = Sheet::new(5, [16, 8], Some(2)).unwrap();
        assert_eq!(sheet.size(), [2 * 22 + 6, 3 * 26 + 6]);
        for index in 0..5 {
            sheet.show(index, "", &flat(16, 8, if index == 3 { 1.0 } else { 0.0 }), &Options::default());
        }
        let counted = |value: u8| sheet.texels.iter().filter(|&&texel| texel == [value; 3]).count();
        assert_eq!((counted(255), counted(0)), (16 * 8, 4 * 16 * 8));
        assert_eq!((at(&sheet, 28, 32), at(&sheet, 43, 39), at(&sheet, 27, 32)), ([255; 3], [255; 3], [PAPER; 3]));
    }

    // Kills: a sheet of one row however many pictures there are, more columns than pictures, a size that overflows.
    #[test]
    fn a_sheet_is_about_square_and_bounded() {
        for n in [1, 2, 5, 30, 100, 1000] {
            let [width, height] = Sheet::new(n, [32, 32], None).unwrap().size();
            assert!((n < 2 || width >= height) && (n < 5 || width < 2 * height), "{n}: {width} x {height}");
        }
        assert_eq!(Sheet::new(3, [32, 32], Some(9)).unwrap().size(), Sheet::new(3, [32, 32], Some(3)).unwrap().size());
        let text = Sheet::new(1 << 20, [512, 512], None).unwrap_err();
        assert!(text.contains("1048576 pictures") && text.contains(&MOST_BYTES.to_string()), "{text}");
        assert!(Sheet::new(usize::MAX, [u32::MAX; 2], None).is_err() && Sheet::new(1 << 40, [1, 1], Some(1)).is_err());
    }

    // Kills: a picture that is stretched, cut or shown by single texels, light that is lost or made when it is reduced.
    #[test]
    fn pictures_are_fitted_by_means() {
        let ramp = Picture::of_color(6, 3, (0..18).map(|index| [index as f32, 1.0, 0.0]).collect());
        let fitted = fit(&ramp, [4, 4]);
        assert_eq!((fitted.width, fitted.height), (4, 2));
        let mean = |picture: &Picture| picture.color.iter().map(|color| f64::from(color[0])).sum::<f64>() / picture.color.len() as f64;
        assert!((mean(&fitted) - mean(&ramp)).abs() < 1e-5);
        assert!(fitted.color.iter().all(|color| (color[1] - 1.0).abs() < 1e-6 && color[2] == 0.0));
        // The first pixel covers one and a half columns and rows.
        assert!((fitted.color[0][0] - (0.0 + 0.5 * 1.0 + 0.5 * 6.0 + 0.25 * 7.0) / 2.25).abs() < 1e-5);
        let grown = fit(&Picture::of_color(2, 1, vec![[1.0; 3], [2.0; 3]]), [7, 9]);
        assert_eq!((grown.width, grown.height, grown.color[2], grown.color[3]), (6, 3, [1.0; 3], [2.0; 3]));
        assert_eq!((fit(&flat(1000, 1, 0.5), [8, 8]).height, fit(&Picture::default(), [8, 8]).color[0]), (1, [0.0; 3]));
    }

    // Kills: a failure that looks like a picture, a reason or a caption that cannot be read or runs into the neighbour.
    #[test]
    fn what_fails_is_grey_and_says_why() {
        let mut sheet = Sheet::new(2, [60, 40], Some(2)).unwrap();
        let neighbour = sheet.clone();
        sheet.refuse(0, "some/folder/with/a/very-long-name.gltf", &"endless ".repeat(100));
        let counted = |value: u8, range: std::ops::Range<u32>| {
            range.flat_map(|y| (0..sheet.width).map(move |x| (x, y))).filter(|&(x, y)| at(&sheet, x, y) == [value; 3]).count()
        };
        assert!(counted(GREY, 6..46) > 1200 && counted(GREY, 46..sheet.height) == 0);
        assert!(counted(INK, 46..sheet.height) > 50 && counted(INK, 0..46) == 0);
        assert!((0..sheet.height).all(|y| (66..sheet.width).all(|x| at(&sheet, x, y) == at(&neighbour, x, y))));
    }
}
