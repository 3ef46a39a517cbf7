//! Made-up workloads: how many tiles, how long each walk, under which schedule.
//!
//! Key decision: a workload is drawn from its number by a small generator of its own, so that a failure is told by one number and can be
//! run again by itself.

use wavepool::{
    ImageTiles, LinearRange, Schedule,
    policy::{BlockInPlace, DepthDecayed, DepthMax, DepthMean, LaneInPlace, LaunchScope, Morton, Scanline, StreamCompaction, WorkSource},
    replay::{Replay, replay_in_banks},
};

/// Orders of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// By number.
    Scanline,
    /// Along the curve.
    Morton,
    /// By the longest walk.
    DepthMax,
    /// By the mean walk.
    DepthMean,
    /// By the longest walk, averaged over passes.
    DepthDecayed,
}

impl Order {
    /// All of them.
    pub const ALL: [Order; 5] = [Order::Scanline, Order::Morton, Order::DepthMax, Order::DepthMean, Order::DepthDecayed];

    /// True for those that depend on earlier passes.
    pub fn is_measured(self) -> bool {
        !matches!(self, Order::Scanline | Order::Morton)
    }

    fn apply(self, schedule: Schedule) -> Schedule {
        match self {
            Order::Scanline => schedule.with_order(Scanline),
            Order::Morton => schedule.with_order(Morton),
            Order::DepthMax => schedule.with_order(DepthMax),
            Order::DepthMean => schedule.with_order(DepthMean),
            Order::DepthDecayed => schedule.with_order(DepthDecayed),
        }
    }
}

/// How the lengths of walks are distributed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lengths {
    /// All alike.
    Constant,
    /// As of a coin.
    Geometric,
    /// A few are very long.
    HeavyTail,
    /// One is very long.
    OneStraggler,
    /// One step each.
    AllOnes,
    /// Tiles differ, walks of a tile hardly do.
    ByTile,
}

/// Single items to lanes, every so many steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Portion {
    /// In place.
    Lanes(u32),
    /// Packed.
    Packed(u32),
}

impl Portion {
    /// Steps between two looks.
    pub fn every(self) -> u32 {
        match self {
            Portion::Lanes(every) | Portion::Packed(every) => every,
        }
    }
}

/// All distributions.
pub const LENGTHS: [Lengths; 6] =
    [Lengths::Constant, Lengths::Geometric, Lengths::HeavyTail, Lengths::OneStraggler, Lengths::AllOnes, Lengths::ByTile];

/// One workload under one schedule.
#[derive(Clone, Debug)]
pub struct Workload {
    /// Which it is.
    pub number: u64,
    /// Of the tiles.
    pub order: Order,
    /// Threshold and interval of checks; `None` is `never`.
    pub block: Option<(f32, u32)>,
    /// In place of both: items to lanes.
    pub portion: Option<Portion>,
    /// Of the grid of tiles; 1 without.
    pub columns: u32,
    /// Blocks.
    pub pool: u32,
    /// Passes in flight.
    pub ring: u32,
    /// Passes to do.
    pub passes: u32,
    /// Distribution of the lengths.
    pub kind: Lengths,
    /// What there is to do.
    pub source: Source,
    /// By pass, then by tile.
    lengths: Vec<Vec<[u32; 256]>>,
}

/// An image or a range.
#[derive(Clone, Copy, Debug)]
pub enum Source {
    /// Tiles in a grid.
    Image(ImageTiles),
    /// Tiles in a row.
    Range(LinearRange),
}

impl Source {
    fn inner(&self) -> &dyn WorkSource {
        match self {
            Source::Image(image) => image,
            Source::Range(range) => range,
        }
    }
}

impl WorkSource for Source {
    fn tiles(&self) -> u32 {
        self.inner().tiles()
    }

    fn pixels(&self) -> u32 {
        self.inner().pixels()
    }

    fn parameters(&self) -> [u32; 4] {
        self.inner().parameters()
    }

    fn wgsl(&self) -> String {
        self.inner().wgsl()
    }

    fn pixel(&self, tile: u32, index: u32) -> Option<u32> {
        self.inner().pixel(tile, index)
    }
}

/// A sequence of numbers that looks random: splitmix64 of Steele, Lea and Flood, 2014.
#[derive(Clone, Debug)]
pub struct Draws(pub u64);

impl Draws {
    /// The next number.
    pub fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// From `low` to `high`, both included.
    pub fn between(&mut self, low: u32, high: u32) -> u32 {
        low + (self.draw() % u64::from(high - low + 1)) as u32
    }

    fn unit(&mut self) -> f64 {
        (self.draw() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// One of some.
    pub fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[(self.draw() % choices.len() as u64) as usize]
    }
}

impl Workload {
    /// The workload of this number under an order, with or without regeneration.
    pub fn draw(number: u64, order: Order, regenerates: bool) -> Self {
        let draws = &mut Draws(number << 8 | (order as u64) << 1 | u64::from(regenerates));
        let source = if draws.between(0, 2) > 0 {
            Source::Image(ImageTiles { width: draws.between(1, 70), height: draws.between(1, 70) })
        } else {
            Source::Range(LinearRange { count: draws.between(1, 11 * 256) })
        };
        let (tiles, columns) = match source {
            Source::Image(image) => (image.width.div_ceil(16) * image.height.div_ceil(16), image.width.div_ceil(16)),
            Source::Range(range) => (range.count.div_ceil(256), 1),
        };
        let pool = match draws.between(0, 3) {
            0 => 1,
            1 => draws.between(1, tiles),
            2 => draws.between(2, 5),
            _ => draws.between(tiles, 3 * tiles + 2),
        };
        let (ring, passes) = (draws.between(1, 6), draws.between(1, 6));
        let kind = draws.one_of(&LENGTHS);
        let lengths = (0..passes).map(|_| (0..tiles).map(|tile| lengths_of(kind, source, tile, draws)).collect()).collect();
        let thresholds = [0.0, 1.0 / 256.0, 0.25, 0.5, 1.0, 2.0, 15.0];
        let block = regenerates.then(|| (draws.one_of(&thresholds), draws.between(1, 4)));
        Workload { number, order, block, portion: None, columns, pool, ring, passes, kind, source, lengths }
    }

    /// Tiles per pass.
    pub fn tiles(&self) -> u32 {
        self.lengths[0].len() as u32
    }

    /// True when stages are launched over the whole fill: every second workload.
    pub fn is_full(&self) -> bool {
        self.number % 2 == 1
    }

    /// Lengths of a tile; 0 where it has no item.
    pub fn lengths(&self, pass_index: u32, tile: u32) -> &[u32; 256] {
        &self.lengths[pass_index as usize][tile as usize]
    }

    /// Cuts longer walks down to so many steps.
    pub fn shorten(&mut self, most: u32) {
        self.lengths.iter_mut().flatten().flatten().for_each(|length| *length = most.min(*length));
    }

    /// Its policies.
    pub fn schedule(&self) -> Schedule {
        let schedule = match (self.portion, self.block) {
            (Some(Portion::Lanes(every)), _) => Schedule::per_lane().with_regeneration(LaneInPlace::new(every)),
            (Some(Portion::Packed(every)), _) => Schedule::compaction().with_regeneration(StreamCompaction::new(every)),
            (None, Some((threshold, check_every))) => Schedule::block().with_regeneration(BlockInPlace::new(threshold, check_every)),
            (None, None) => Schedule::never(),
        };
        let has_blocks = !matches!(self.portion, Some(Portion::Packed(_)));
        let schedule = if self.is_full() && has_blocks { schedule.with_launch(LaunchScope::AllBlocks) } else { schedule };
        self.order.apply(schedule)
    }

    /// What the library makes of it.
    pub fn replay(&self) -> Replay {
        self.replay_with(self.pool, self.ring)
    }

    /// The same with another pool and ring.
    pub fn replay_with(&self, pool: u32, ring: u32) -> Replay {
        self.replay_in_banks(pool, pool, ring)
    }

    /// The same in banks of so many blocks.
    pub fn replay_in_banks(&self, pool: u32, bank: u32, ring: u32) -> Replay {
        let lengths = |pass_index: u32, tile: u32, lengths: &mut [u32; 256]| *lengths = *self.lengths(pass_index, tile);
        replay_in_banks(&self.schedule(), &self.source, self.passes, [pool, bank], ring, &lengths)
    }

    /// The lengths as the program `given` reads them: the number of pixels, then a word per pass and pixel.
    pub fn words(&self) -> Vec<u32> {
        let pixels = self.source.pixels() as usize;
        let mut words = vec![0; 1 + self.passes as usize * pixels];
        words[0] = pixels as u32;
        for (pass_index, tiles) in self.lengths.iter().enumerate() {
            for (tile, lengths) in tiles.iter().enumerate() {
                for (index, length) in lengths.iter().enumerate() {
                    if let Some(pixel) = self.source.pixel(tile as u32, index as u32) {
                        words[1 + pass_index * pixels + pixel as usize] = *length;
                    }
                }
            }
        }
        words
    }

    /// How a failure is told.
    pub fn name(&self) -> String {
        let Workload { number, order, block, portion, pool, ring, passes, kind, source, .. } = self;
        format!(
            "workload {number}: {order:?}, block {block:?}, {portion:?}, {pool} blocks, ring {ring}, {passes} passes, {kind:?}, {source:?}"
        )
    }
}

fn lengths_of(kind: Lengths, source: Source, tile: u32, draws: &mut Draws) -> [u32; 256] {
    let of_tile = draws.between(1, 24);
    let straggler = draws.between(0, 255) as usize;
    let mut lengths = [0; 256];
    for (index, length) in lengths.iter_mut().enumerate() {
        let there = match source {
            Source::Image(image) => image.pixel(tile, index as u32).is_some(),
            Source::Range(range) => range.pixel(tile, index as u32).is_some(),
        };
        let drawn = match kind {
            Lengths::Constant => 7,
            Lengths::Geometric => 1 + (draws.unit().ln() / 0.8_f64.ln()) as u32,
            Lengths::HeavyTail => draws.unit().max(1e-6).powf(-0.6) as u32,
            Lengths::OneStraggler if index == straggler && tile == 0 => 1100,
            Lengths::OneStraggler => 2,
            Lengths::AllOnes => 1,
            Lengths::ByTile => of_tile + draws.between(0, 1),
        };
        *length = if there { drawn.max(1) } else { 0 };
    }
    lengths
}
