//! A chart of many cells as pixels.
//!
//! Key decision: a pixel of the picture that stands for several blocks or steps shows the share of lanes alive among all of them, in one
//! hue, because the mean of the colours of tiles would be the colour of none.
//!
//! **Invariant:** no cell is left out: the lanes behind all pixels are the lanes of the chart.

use image::{
    ExtendedColorType, ImageEncoder,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};

use super::{BLOCK, Chart, color, panel::Scale};

/// What a pixel stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Cell {
    pub(super) live_lanes: u64,
    pub(super) live_blocks: u32,
    pub(super) beginnings: u32,
    pub(super) tile: u32,
}

/// Cells of a chart, row by row.
#[derive(Debug)]
pub(super) struct Raster {
    pub(super) columns: u32,
    pub(super) rows: u32,
    pub(super) cells: Vec<Cell>,
    /// Blocks times steps behind each cell, at the right and the lower edge too.
    most: Vec<u64>,
}

impl Raster {
    pub(super) fn new(chart: &Chart, scale: &Scale) -> Self {
        let (blocks_each, steps_each) = (scale.blocks_per_column, scale.steps_per_row);
        let steps = chart.rows().len() as u32;
        let (columns, rows) = (chart.blocks().div_ceil(blocks_each), steps.div_ceil(steps_each));
        let mut cells = vec![Cell::default(); (columns * rows) as usize];
        for span in chart.spans() {
            for (step, lanes) in (span.first..).zip(&span.live_lanes) {
                let place = step / steps_each * columns + span.block / blocks_each;
                let Some(cell) = cells.get_mut(place as usize) else { continue };
                cell.live_lanes += u64::from(*lanes);
                cell.live_blocks += 1;
                cell.beginnings += u32::from(step == span.first);
                cell.tile = span.tile;
            }
        }
        let extent = |place: u32, each: u32, all: u32| u64::from(each.min(all - place * each));
        let most = (0..columns * rows)
            .map(|place| extent(place % columns, blocks_each, chart.blocks()) * extent(place / columns, steps_each, steps))
            .collect();
        Raster { columns, rows, cells, most }
    }

    /// Lanes alive of all lanes behind a cell, 0 to 1.
    pub(super) fn alive(&self, place: usize) -> f64 {
        self.cells[place].live_lanes as f64 / (self.most[place] * u64::from(BLOCK)).max(1) as f64
    }

    /// A PNG with `width` times `height` pixels for each cell.
    pub(super) fn png(&self, width: u32, height: u32) -> Vec<u8> {
        let is_exact = self.most.iter().all(|most| *most <= 1);
        let (across, down) = (self.columns * width, self.rows * height);
        let mut pixels = Vec::with_capacity((across * down * 3) as usize);
        for y in 0..down {
            for x in 0..across {
                let place = (y / height * self.columns + x / width) as usize;
                let cell = &self.cells[place];
                let shade = if is_exact { color::of_tile(cell.tile, self.alive(place)) } else { color::of_share(self.alive(place)) };
                pixels.extend(match cell.live_blocks {
                    0 => color::DEAD[usize::from((x + y) % 4 == 0)],
                    _ if is_exact && cell.beginnings > 0 && y % height == 0 => color::of_beginning(shade),
                    _ => shade,
                });
            }
        }
        let mut file = Vec::new();
        // Writing to memory fails for sizes of zero alone; then there is nothing to show.
        match PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::NoFilter).write_image(
            &pixels,
            across,
            down,
            ExtendedColorType::Rgb8,
        ) {
            Ok(()) => file,
            Err(_) => Vec::new(),
        }
    }
}

/// Bytes as text, by RFC 4648.
pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word = three.iter().enumerate().fold(0, |word, (place, byte)| word | (u32::from(*byte) << (16 - 8 * place)));
        for digit in 0..4 {
            let value = (word >> (18 - 6 * digit)) & 63;
            text.push(if digit <= three.len() { char::from(DIGITS[value as usize]) } else { '=' });
        }
    }
    text
}
