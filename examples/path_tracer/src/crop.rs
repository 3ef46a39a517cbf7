//! A part of a picture as work: the same pixels as in the whole, and no others.
//!
//! Key decision: pixels keep the numbers that they have in the whole picture, because these key the random numbers. So a part shows
//! exactly what the whole shows there; only draws of roulette that lanes share (by group, by block) depend on which lanes stand together.

use wavepool::policy::WorkSource;

/// Pixels per side of a tile.
const TILE_SIDE: u32 = 16;

/// Which part of a picture is rendered, in pixels from its upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// Left column.
    pub x: u32,
    /// Upper row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// The tiles of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CropTiles {
    crop: Crop,
    whole: [u32; 2],
}

impl CropTiles {
    /// Cuts off what lies outside of the picture, and what lies beyond column or row 65,535.
    pub(crate) fn new(crop: Crop, whole: [u32; 2]) -> Self {
        const MOST: u32 = 0xffff;
        let (x, y) = (crop.x.min(whole[0]).min(MOST), crop.y.min(whole[1]).min(MOST));
        let (width, height) = (crop.width.min(whole[0] - x).min(MOST), crop.height.min(whole[1] - y).min(MOST));
        CropTiles { crop: Crop { x, y, width, height }, whole }
    }

    fn columns(&self) -> u32 {
        self.crop.width.div_ceil(TILE_SIDE)
    }
}

impl WorkSource for CropTiles {
    fn tiles(&self) -> u32 {
        self.columns() * self.crop.height.div_ceil(TILE_SIDE)
    }

    fn pixels(&self) -> u32 {
        self.whole[0].saturating_mul(self.whole[1])
    }

    fn items(&self) -> u32 {
        self.crop.width * self.crop.height
    }

    fn parameters(&self) -> [u32; 4] {
        let Crop { x, y, width, height } = self.crop;
        [x | y << 16, width | height << 16, self.columns().max(1), self.whole[0]]
    }

    fn wgsl(&self) -> String {
        include_str!("crop.wgsl").into()
    }

    fn pixel(&self, tile: u32, index: u32) -> Option<u32> {
        let columns = self.columns().max(1);
        let x = tile % columns * TILE_SIDE + index % TILE_SIDE;
        let y = tile / columns * TILE_SIDE + index / TILE_SIDE;
        let is_inside = x < self.crop.width && y < self.crop.height;
        is_inside.then(|| (self.crop.y + y) * self.whole[0] + self.crop.x + x)
    }
}

#[cfg(test)]
mod tests {
    use wavepool::{Schedule, replay::replay};

    use super::*;

    // Kills: pixels numbered within the part, a pixel twice or not at all, a part that reaches beyond the picture.
    #[test]
    fn every_pixel_of_the_part_has_one_item() {
        let crop = Crop { x: 5, y: 7, width: 33, height: 17 };
        for (whole, width, height) in [([64, 64], 33, 17), ([20, 64], 15, 17), ([64, 8], 33, 1)] {
            let source = CropTiles::new(crop, whole);
            let mut pixels: Vec<u32> = (0..source.tiles()).flat_map(|tile| (0..256).filter_map(move |i| source.pixel(tile, i))).collect();
            pixels.sort_unstable();
            let expected: Vec<u32> = (7..7 + height).flat_map(|y| (5..5 + width).map(move |x| y * whole[0] + x)).collect();
            assert_eq!(pixels, expected);
            assert_eq!(source.items() as usize, expected.len());
            assert!(expected.last().is_some_and(|last| *last < source.pixels()));
        }
        assert_eq!(CropTiles::new(Crop { x: 9, ..crop }, [9, 9]).tiles(), 0);
    }

    // Kills: passes that wait for the pixels outside of the part, in the re-enactment of schedules that hand out tiles or lanes.
    #[test]
    fn passes_end_with_the_items_of_the_part() {
        let source = CropTiles::new(Crop { x: 5, y: 7, width: 33, height: 17 }, [64, 64]);
        let lengths = |_: u32, tile: u32, lengths: &mut [u32; 256]| {
            (0..256).for_each(|index| lengths[index as usize] = if source.pixel(tile, index).is_some() { 3 } else { 0 });
        };
        for name in ["block", "per-lane", "compaction,every=2"] {
            let schedule: Schedule = name.parse().unwrap();
            assert_eq!(replay(&schedule, &source, 3, 2, 2, &lengths).resolved_after.len(), 3, "{name}");
        }
    }
}
