//! How many steps each walk of a run took, and what results said of tiles where an order asks for that: what replay needs to know of a
//! program.

use crate::{layout::BLOCK, replay::WalkLengths};

/// Steps of every walk, by pass and tile.
///
/// **Shape:** `passes x tiles x 256`; 0 where a tile has no item.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lengths {
    tiles: u32,
    words: Vec<u32>,
    keys: Vec<u32>,
}

impl Lengths {
    pub(crate) fn new(tiles: u32, words: Vec<u32>, keys: Vec<u32>) -> Self {
        Lengths { tiles, words, keys }
    }

    /// Passes that are kept.
    pub fn passes(&self) -> u32 {
        self.words.len() as u32 / (self.tiles * BLOCK).max(1)
    }

    /// Tiles per pass.
    pub fn tiles(&self) -> u32 {
        self.tiles
    }

    /// All of them, zeros included.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Of an order by results: the key of every tile after each resolved pass, `passes x tiles`; else empty.
    pub fn keys(&self) -> &[u32] {
        &self.keys
    }

    /// How many walks took how many steps: entry `n` counts those of `n` steps; entry 0 is 0.
    pub fn histogram(&self) -> Vec<u64> {
        let mut counts = vec![0; self.words.iter().max().map_or(0, |longest| *longest as usize + 1)];
        self.words.iter().filter(|steps| **steps > 0).for_each(|steps| counts[*steps as usize] += 1);
        counts
    }
}

impl WalkLengths for Lengths {
    fn of_tile(&self, pass_index: u32, tile: u32, lengths: &mut [u32; BLOCK as usize]) {
        let place = (pass_index as usize * self.tiles as usize + tile as usize) * BLOCK as usize;
        match self.words.get(place..place + BLOCK as usize) {
            Some(words) => lengths.copy_from_slice(words),
            None => lengths.fill(0),
        }
    }

    fn key_after(&self, passes: u32, tile: u32) -> u32 {
        let place = |passes: u32| passes as usize * self.tiles as usize + tile as usize;
        passes.checked_sub(1).and_then(|passes| self.keys.get(place(passes))).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a tile, a pass or a key read from the place of its neighbour; places without an item counted as walks.
    #[test]
    fn a_tile_gets_its_own_lengths() {
        let words: Vec<u32> = (0..2 * 3 * 256).map(|word| if word % 256 == 255 { 0 } else { word / 256 + 1 }).collect();
        let lengths = Lengths::new(3, words, (1..=6).collect());
        let mut found = [9; 256];
        lengths.of_tile(1, 2, &mut found);
        assert_eq!((found[0], found[254], found[255]), (6, 6, 0));
        assert_eq!((lengths.passes(), lengths.histogram()), (2, vec![0, 255, 255, 255, 255, 255, 255]));
        lengths.of_tile(2, 0, &mut found);
        assert_eq!(found, [0; 256]);
        let keys: Vec<u32> = (0..4).map(|passes| lengths.key_after(passes, 2)).collect();
        assert_eq!(keys, [0, 3, 6, 0]);
    }
}
