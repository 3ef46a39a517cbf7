//! The state of chosen lanes as a table, between two steps.
//!
//! Key decision: what is shown is what the next step would load. A leaf that nobody reads before it is written again has no value then,
//! and says so instead of showing what was left behind.

use std::{collections::BTreeMap, fmt};

use super::{readback::read_words, run::Run};
use crate::{
    Result,
    control::{BLOCK_BIRTH, BLOCK_PASS, BLOCK_TILE, Control, NONE},
    layout::{BLOCK, Leaf, Scalar, Storage},
};

/// A scalar of the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// IEEE binary32.
    F32(f32),
    /// Unsigned.
    U32(u32),
    /// Two's complement.
    I32(i32),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::F32(value) => write!(f, "{value:?}"),
            Value::U32(value) => write!(f, "{value}u"),
            Value::I32(value) => write!(f, "{value}"),
        }
    }
}

/// One lane of the pool.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LaneState {
    /// Number of the lane in the pool.
    pub lane: u32,
    /// Its block.
    pub block: u32,
    /// The tile of the block, its pass and the pixel of the lane's item; `None` where there is none. Where lanes receive single items, the
    /// tile that the item stems from, while the walk goes on.
    pub tile: Option<u32>,
    /// The pass of the tile.
    pub pass_index: u32,
    /// The item's pixel.
    pub pixel: Option<u32>,
    /// The item's sample.
    pub sample: u32,
    /// Steps the walk has taken.
    pub steps: u32,
    /// True when the walk goes on.
    pub is_alive: bool,
    /// One per field; `None` when the walk is over or the field has no value between two steps.
    pub values: Vec<Option<Value>>,
}

/// Chosen lanes with the fields of the state.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PoolSnapshot {
    /// Steps done.
    pub step: u32,
    /// Names and types, in declaration order.
    pub fields: Vec<Leaf>,
    /// In the order they were asked for.
    pub lanes: Vec<LaneState>,
}

impl Run<'_> {
    /// The state of the given lanes, as the next step will find it. Lanes beyond the pool are left out; the megakernel keeps no state.
    ///
    /// **Cost:** waits for the device, and reads each block that a lane stands in.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::Timeout`](crate::Error::Timeout).
    pub fn snapshot(&mut self, lanes: impl IntoIterator<Item = u32>) -> Result<PoolSnapshot> {
        self.receive_all()?;
        let mut shot = PoolSnapshot { step: 0, fields: self.scheduler.layout.leaves.clone(), lanes: Vec::new() };
        let Some(latest) = &self.latest else { return Ok(shot) };
        let control = latest.control;
        shot.step = control.step;
        let sizes = self.buffers.sizes;
        let (device, queue) = (&self.scheduler.device, &self.scheduler.queue);
        let stride = u64::from(sizes.stride);
        if stride == 0 {
            return Ok(shot);
        }
        let words = Control::block_table() / 4;
        let pool = u64::from(sizes.pool_blocks);
        let table = read_words(device, queue, &self.buffers.control, words, 3 * pool, "reading the table of blocks")?;
        let of_block = |section: u32, block: u32| table[section as usize * sizes.pool_blocks as usize + block as usize];
        let mut blocks: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        let generated = &self.scheduler.layout.generate;
        for lane in lanes.into_iter().filter(|lane| lane / BLOCK < sizes.pool_blocks) {
            let (block, index) = (lane / BLOCK, (lane % BLOCK) as usize);
            let words = match blocks.entry(block) {
                std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
                std::collections::btree_map::Entry::Vacant(entry) => {
                    let bank = &self.buffers.banks[(block / sizes.bank_blocks) as usize];
                    let from = u64::from(block % sizes.bank_blocks) * stride;
                    entry.insert(read_words(device, queue, bank, from, stride, "reading a block")?)
                }
            };
            let layout = &self.scheduler.layout;
            // The tick has counted the step to come, in which what it has just handed out is born.
            let (item, pass_index, born) = match layout.item_plane {
                None => {
                    let tile = Some(of_block(BLOCK_TILE, block)).filter(|tile| *tile != NONE);
                    (tile.map(|tile| (tile, lane % BLOCK)), of_block(BLOCK_PASS, block), of_block(BLOCK_BIRTH, block))
                }
                Some(plane) => {
                    let word = |plane: u32| words[plane as usize * BLOCK as usize + index];
                    let item = Some(word(plane)).filter(|_| words[index] != 0);
                    (item.map(|place| (place / BLOCK, place % BLOCK)), word(plane + 1), words[index])
                }
            };
            let is_alive = item.is_some() && born < control.step && words[index] != 0;
            let mut values = vec![None; shot.fields.len()];
            for cell in layout.cells.iter().filter(|cell| is_alive && generated.contains(cell.leaves.start)) {
                let Some(plane) = layout.plane_of[cell.leaves.start] else { continue };
                let word = words[plane as usize * BLOCK as usize + index];
                for (part, leaf) in cell.leaves.clone().enumerate() {
                    values[leaf] = Some(match (cell.storage, shot.fields[leaf].scalar) {
                        (Storage::Word, Scalar::F32) => Value::F32(f32::from_bits(word)),
                        (Storage::Word, Scalar::U32) => Value::U32(word),
                        (Storage::Word, Scalar::I32) => Value::I32(word as i32),
                        (packed, _) => Value::F32(packed.decode(word)[part]),
                    });
                }
            }
            shot.lanes.push(LaneState {
                lane,
                block,
                tile: item.map(|(tile, _)| tile),
                pass_index,
                pixel: item.and_then(|(tile, index)| self.scheduler.source.pixel(tile, index)),
                sample: control.first_sample + pass_index,
                steps: control.step.saturating_sub(born),
                is_alive,
                values,
            });
        }
        Ok(shot)
    }
}

impl fmt::Display for PoolSnapshot {
    /// A row per lane.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = vec![["lane", "block", "tile", "pixel", "sample", "steps"].map(String::from).to_vec()];
        rows[0].extend(self.fields.iter().map(|field| format!("{}: {}", field.path.trim_start_matches('.'), field.scalar.wgsl())));
        for lane in &self.lanes {
            let or_none = |value: Option<u32>| value.map_or_else(|| "-".into(), |value| value.to_string());
            let steps = if lane.is_alive { lane.steps.to_string() } else { "over".into() };
            let mut row = vec![
                lane.lane.to_string(),
                lane.block.to_string(),
                or_none(lane.tile),
                or_none(lane.pixel),
                lane.sample.to_string(),
                steps,
            ];
            row.extend(lane.values.iter().map(|value| value.map_or_else(|| "-".into(), |value| value.to_string())));
            rows.push(row);
        }
        let widths: Vec<usize> =
            (0..rows[0].len()).map(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0)).collect();
        writeln!(f, "before step {}", self.step)?;
        for row in rows {
            let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
            writeln!(f, "{}", cells.join("  "))?;
        }
        Ok(())
    }
}
