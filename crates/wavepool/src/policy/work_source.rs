//! What there is to do: items, cut in tiles of 256.

use std::fmt::Debug;

use crate::layout::BLOCK;

/// Pixels per side of an image tile.
const TILE_SIDE: u32 = 16;

/// A set of pixels (image points, range elements) cut in tiles, each to be walked once per pass.
///
/// Must: give every pixel to at most one (tile, index); keep at least one item in every tile; give the same answers on both faces.
/// The pass number is the sample number. May: leave out pixels, which then have no samples in the film (and no item:
/// [`items`](Self::items)).
pub trait WorkSource: Debug + Send + Sync {
    /// Tiles per pass.
    fn tiles(&self) -> u32;

    /// Pixels of the film: more than every number that [`pixel`](Self::pixel) returns.
    fn pixels(&self) -> u32;

    /// Items per pass: how many pixels have one. All of them unless said otherwise.
    fn items(&self) -> u32 {
        self.pixels()
    }

    /// Four words that the device face finds in `wf_control.work`, so that sizes need no new kernels. The third is the number of tile
    /// columns, for orders that follow a grid; 0 where there is none.
    fn parameters(&self) -> [u32; 4];

    /// WGSL that declares `fn wf_tile_pixel(tile: u32, index: u32) -> u32` (`0xffffffffu` where a tile has no item),
    /// `fn wf_tile_items(tile: u32) -> u32` and `fn item_coordinates(item: Item) -> vec2u`.
    fn wgsl(&self) -> String;

    /// The pixel of place `index` (0 to 255) in `tile`; `None` where the tile has no item.
    fn pixel(&self, tile: u32, index: u32) -> Option<u32>;
}

/// How the tiles of a pass lie: in rows of equal length, of which the last may be shorter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TileGrid {
    tiles: u32,
    columns: u32,
}

impl TileGrid {
    /// So many tiles in so many columns, which are brought to 1 at least and a single row at most.
    pub fn new(tiles: u32, columns: u32) -> Self {
        TileGrid { tiles, columns: columns.clamp(1, tiles.max(1)) }
    }

    /// The grid of a work source.
    pub fn of(source: &dyn WorkSource) -> Self {
        TileGrid::new(source.tiles(), source.parameters()[2])
    }

    /// Tiles.
    pub fn tiles(self) -> u32 {
        self.tiles
    }

    /// Tiles per row, at least 1.
    pub fn columns(self) -> u32 {
        self.columns
    }

    /// Rows, the shorter one included.
    pub fn rows(self) -> u32 {
        self.tiles.div_ceil(self.columns)
    }
}

/// An image in tiles of 16x16 pixels; `item.pixel` is `y * width + x`, row 0 at the top. Tiles at the right and lower edge may be
/// partial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageTiles {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

impl WorkSource for ImageTiles {
    fn tiles(&self) -> u32 {
        self.width.div_ceil(TILE_SIDE).saturating_mul(self.height.div_ceil(TILE_SIDE))
    }

    fn pixels(&self) -> u32 {
        self.width.saturating_mul(self.height)
    }

    fn parameters(&self) -> [u32; 4] {
        [self.width, self.height, self.width.div_ceil(TILE_SIDE), 0]
    }

    fn wgsl(&self) -> String {
        include_str!("image_tiles.wgsl").into()
    }

    fn pixel(&self, tile: u32, index: u32) -> Option<u32> {
        let columns = self.width.div_ceil(TILE_SIDE);
        let x = tile % columns * TILE_SIDE + index % TILE_SIDE;
        let y = tile / columns * TILE_SIDE + index / TILE_SIDE;
        (x < self.width && y < self.height).then(|| y * self.width + x)
    }
}

/// The numbers 0 to `count - 1`, 256 to a tile; `item.pixel` is the number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinearRange {
    /// How many items a pass has.
    pub count: u32,
}

impl WorkSource for LinearRange {
    fn tiles(&self) -> u32 {
        self.count.div_ceil(BLOCK)
    }

    fn pixels(&self) -> u32 {
        self.count
    }

    fn parameters(&self) -> [u32; 4] {
        [self.count, 1, 0, 0]
    }

    fn wgsl(&self) -> String {
        include_str!("linear_range.wgsl").into()
    }

    fn pixel(&self, tile: u32, index: u32) -> Option<u32> {
        let pixel = tile * BLOCK + index;
        (pixel < self.count).then_some(pixel)
    }
}
