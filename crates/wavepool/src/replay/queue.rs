//! The tile queue: which tile comes next, by formula, by what tiles took before or by what results say of them.

use super::Block;
use crate::{
    control::KEY_BITS,
    policy::{MAX_KEY, OrderRule, TileGrid},
};

pub(super) struct Queue<'a> {
    rule: OrderRule<'a>,
    grid: TileGrid,
    tiles: u32,
    next_pass: u32,
    next_position: u32,
    /// Of an order that sorts: the tiles of the pass being handed out.
    current: Vec<u32>,
    /// Of a measured order: per tile, the pass it was measured in and its key.
    estimates: Vec<u32>,
}

impl<'a> Queue<'a> {
    pub(super) fn new(rule: OrderRule<'a>, grid: TileGrid) -> Self {
        let tiles = grid.tiles();
        Queue { rule, grid, tiles, next_pass: 0, next_position: 0, current: (0..tiles).collect(), estimates: vec![0; tiles as usize] }
    }

    /// Tiles of the first `passes` passes that nobody has taken.
    pub(super) fn left(&self, passes: u32) -> u64 {
        u64::from(passes - self.next_pass) * u64::from(self.tiles) - u64::from(self.next_position)
    }

    /// The key remembered of a tile; 0 when there is none.
    pub(super) fn remembered(&self, tile: u32) -> u32 {
        self.estimates[tile as usize] & MAX_KEY
    }

    fn key(&self, remembered: u32, block: &Block, step: u32) -> u32 {
        match self.rule {
            OrderRule::Formula(_) | OrderRule::Estimated(_) => 0,
            OrderRule::Measured(measure) => {
                let lane_steps = if measure.reads_lane_steps() { block.lane_steps } else { 0 };
                measure.key(remembered, step + 1 - block.birth, lane_steps, block.items).min(MAX_KEY)
            }
        }
    }

    /// Remembers what a tile took; of several passes of a tile the latest counts.
    pub(super) fn tile_ended(&mut self, block: &Block, step: u32) {
        let entry = block.pass_index << KEY_BITS | self.key(block.remembered, block, step);
        let estimate = &mut self.estimates[block.tile as usize];
        *estimate = entry.max(*estimate);
    }

    /// The next `count` tiles with their passes. The order of passes that begin here is fixed before any of their tiles is taken.
    /// `estimate` is what results have said of a tile.
    pub(super) fn take<'b>(
        &mut self,
        count: u32,
        running: impl Iterator<Item = &'b Block>,
        step: u32,
        estimate: &dyn Fn(u32) -> u32,
    ) -> Vec<(u32, u32)> {
        let ends_a_pass = self.next_position + count >= self.tiles;
        let next = if ends_a_pass { self.sorted(running, step, estimate) } else { Vec::new() };
        let tiles = (self.next_position..self.next_position + count)
            .map(|place| {
                let (pass_index, position) = (self.next_pass + place / self.tiles, place % self.tiles);
                let tile = match self.rule {
                    OrderRule::Formula(formula) => formula.tile_at(pass_index, position, self.grid),
                    _ if place < self.tiles => self.current[position as usize],
                    _ => next[position as usize],
                };
                (pass_index, tile)
            })
            .collect();
        let place = self.next_position + count;
        self.next_pass += place / self.tiles;
        self.next_position = place % self.tiles;
        if ends_a_pass {
            self.current = next;
        }
        tiles
    }

    /// All tiles, largest key first.
    fn sorted<'b>(&self, running: impl Iterator<Item = &'b Block>, step: u32, estimate: &dyn Fn(u32) -> u32) -> Vec<u32> {
        let key_of = |tile| match self.rule {
            OrderRule::Estimated(_) => estimate(tile).min(MAX_KEY),
            _ => self.remembered(tile),
        };
        let mut keys: Vec<u32> = (0..self.tiles).map(key_of).collect();
        for block in running {
            let key = &mut keys[block.tile as usize];
            *key = self.key(0, block, step).max(*key);
        }
        let mut order: Vec<u32> = (0..self.tiles).collect();
        order.sort_by_key(|tile| std::cmp::Reverse(keys[*tile as usize]));
        order
    }
}
