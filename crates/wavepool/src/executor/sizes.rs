//! How large everything is: a pure function of the program, the schedule and the limits of the device.
//!
//! **Invariant:** what [`Sizes::choose`] returns fits into the bindings of the device; what cannot fit is an error that says how much is
//! missing, before anything is allocated.

use crate::{
    Error, Result,
    control::{MAX_BANKS, MAX_RING, queues, record},
    film::planes_of,
    layout::{BLOCK, Leaf},
    policy::{Execution, Grain, RouletteScope},
    shader::extra_counters,
};

/// What a run asks for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand<'a> {
    pub(super) execution: Execution,
    /// Blocks that the schedule asks for.
    pub(super) pool_blocks: Option<u32>,
    /// Blocks to take when it does not.
    pub(super) default_blocks: u32,
    /// Passes in flight that the schedule allows.
    pub(super) ring: Option<u32>,
    pub(super) tiles: u32,
    pub(super) passes: u32,
    /// Blocks that the schedule wants in a bank, at most.
    pub(super) bank_blocks: Option<u32>,
    /// True when the steps of every walk are kept.
    pub(super) keeps_lengths: bool,
    /// True when the tick writes down what it decides.
    pub(super) records: bool,
    /// Words of state per block.
    pub(super) stride: u32,
    pub(super) result: &'a [Leaf],
    /// Words of counters that the order of the tiles keeps per tile; 0 when nothing is sorted.
    pub(super) order_words: u32,
    /// True when this order comes from results, so that what these said is kept with the lengths.
    pub(super) is_estimated: bool,
    /// In which portions work is handed out.
    pub(super) grain: Grain,
    /// Who shares a draw of roulette, if there is any.
    pub(super) scope: Option<RouletteScope>,
    /// Items of a pass.
    pub(super) pass_items: u32,
    /// Bytes that one binding can hold.
    pub(super) binding: u64,
}

/// How large everything is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sizes {
    pub(super) pool_blocks: u32,
    /// Passes whose results are kept at once.
    pub(super) ring: u32,
    pub(super) tiles: u32,
    /// Tiles that are sorted; 0 for formulas.
    pub(super) ordered_tiles: u32,
    /// Words of counters for that.
    pub(super) order_words: u64,
    /// Words of counters per block besides those that every block has.
    pub(super) extra_words: u32,
    /// Words of counters for queues by key.
    pub(super) queue_words: u32,
    /// What a pass waits for: tiles, or items where lanes receive these.
    pub(super) outstanding: u32,
    pub(super) result_planes: u32,
    pub(super) film_planes: u32,
    /// Blocks in every bank but the last, which may have fewer.
    pub(super) bank_blocks: u32,
    pub(super) banks: u32,
    /// Words of state per block; 0 where the state is in registers.
    pub(super) stride: u32,
    /// Words behind the results for the steps of every walk, then for the keys of tiles after every pass.
    pub(super) length_words: u64,
    /// Steps that the record has room for; 0 without.
    pub(super) record_steps: u32,
}

/// Steps between two looks at the record.
pub(super) const RECORD_STEPS: u32 = 64;

/// The threshold arithmetic of the tick is exact up to here.
const MAX_POOL_BLOCKS: u32 = 1 << 19;

impl Sizes {
    /// Chooses the pool and the ring.
    pub(super) fn choose(demand: &Demand) -> Result<Sizes> {
        // Kernels count words in 32 bits.
        let demand = &Demand { binding: demand.binding.min(4 << 32), ..*demand };
        let most = u64::from(MAX_POOL_BLOCKS);
        match demand.pool_blocks {
            Some(0) => return Err(Error::Schedule("a pool needs at least one block".into())),
            Some(blocks) if blocks > MAX_POOL_BLOCKS => {
                let (what, advice) = ("the pool".into(), format!("ask for at most {most} blocks"));
                return Err(Error::Limit { what, need: u64::from(blocks), limit: most, unit: "blocks", advice });
            }
            _ => {}
        }
        if let Some(passes) = demand.ring.filter(|passes| !(1..=MAX_RING).contains(passes)) {
            return Err(Error::Schedule(format!("ring={passes}: allowed is 1 to {MAX_RING}")));
        }
        let tiles = u64::from(demand.tiles);
        let is_wavefront = demand.execution.is_wavefront();
        let tiles_per_group = demand.execution.tiles_per_group();
        let useful = (tiles * u64::from(demand.passes)).min(u64::from(MAX_POOL_BLOCKS)) as u32;
        let block_bytes = u64::from(demand.stride) * 4;
        let limit = |what: String, need: u64, advice: String| match need > demand.binding {
            true => Err(Error::Limit { what, need, limit: demand.binding, unit: "bytes", advice }),
            false => Ok(()),
        };
        if is_wavefront {
            limit("the state of one block".into(), block_bytes, "keep less in the state".into())?;
        }
        // A binding holds one bank; a pool may have many.
        let in_a_bank = if is_wavefront { (demand.binding / block_bytes.max(1)).min(most) as u32 } else { MAX_POOL_BLOCKS };
        let in_a_bank = in_a_bank.min(demand.bank_blocks.unwrap_or(u32::MAX).max(1));
        let fitting = u64::from(in_a_bank).saturating_mul(u64::from(MAX_BANKS)).min(most) as u32;
        let pool_blocks = demand.pool_blocks.unwrap_or((demand.default_blocks / tiles_per_group).min(fitting)).clamp(1, useful.max(1));
        if pool_blocks > fitting {
            let what = format!("a pool of {pool_blocks} blocks in banks of {in_a_bank}");
            let (need, limit) = (u64::from(pool_blocks.div_ceil(in_a_bank)), u64::from(MAX_BANKS));
            return Err(Error::Limit { what, need, limit, unit: "banks", advice: format!("ask for at most {fitting} blocks") });
        }
        let banks = pool_blocks.div_ceil(in_a_bank);
        let bank_blocks = pool_blocks.div_ceil(banks);
        let banks = pool_blocks.div_ceil(bank_blocks);

        let plane_bytes = tiles * u64::from(BLOCK) * 4;
        let result_planes = demand.result.len() as u32 + 1;
        let film_planes = 1 + demand.result.iter().map(|leaf| planes_of(leaf.scalar) as u32).sum::<u32>();
        let smaller = || "run fewer pixels at a time".to_owned();
        limit(format!("the film of {} tiles", demand.tiles), plane_bytes * u64::from(film_planes), smaller())?;
        limit(format!("the results of one pass over {} tiles", demand.tiles), plane_bytes * u64::from(result_planes), smaller())?;
        let key_bytes = if demand.is_estimated { tiles * 4 } else { 0 };
        let length_bytes = if demand.keeps_lengths { (plane_bytes + key_bytes) * u64::from(demand.passes) } else { 0 };
        let what = format!("the lengths of {} passes over {} tiles", demand.passes, demand.tiles);
        limit(what, length_bytes + plane_bytes * u64::from(result_planes), "keep the lengths of fewer passes".into())?;
        let record_steps = if demand.records { RECORD_STEPS } else { 0 };
        let room = demand.binding - length_bytes;
        let fitting = room / (plane_bytes * u64::from(result_planes)).max(1);
        let wanted = match (demand.execution, demand.tiles.max(1)) {
            (Execution::Wavefront, tiles) => 2 + pool_blocks.div_ceil(tiles),
            (Execution::Megakernel, _) => 1,
            // A launch may begin within a pass and hold several.
            (_, tiles) => 1 + (pool_blocks * tiles_per_group).div_ceil(tiles),
        };
        let allowed = demand.ring.unwrap_or(MAX_RING);
        let ring = wanted.min(demand.passes).min(allowed).min(fitting.min(u64::from(u32::MAX)) as u32).max(1);
        let ordered_tiles = if demand.order_words > 0 { demand.tiles } else { 0 };
        Ok(Sizes {
            pool_blocks,
            ring,
            tiles: demand.tiles,
            ordered_tiles,
            order_words: tiles * u64::from(demand.order_words),
            extra_words: if is_wavefront { extra_counters(demand.grain, demand.scope, ring) } else { 0 },
            queue_words: if demand.grain == Grain::KeyedLanes { banks * queues::PER_BANK } else { 0 },
            outstanding: if demand.grain.is_by_lane() { demand.pass_items } else { demand.tiles },
            result_planes,
            film_planes,
            bank_blocks,
            banks,
            stride: if is_wavefront { demand.stride } else { 0 },
            length_words: length_bytes / 4,
            record_steps,
        })
    }

    /// Blocks of a bank.
    pub(super) fn blocks_of(&self, bank: u32) -> u32 {
        self.bank_blocks.min(self.pool_blocks - bank * self.bank_blocks)
    }

    /// Words of the results, the lengths included.
    pub(super) fn result_words(&self) -> u64 {
        self.length_place() + self.length_words
    }

    /// Where the lengths begin among the results, in words.
    pub(super) fn length_place(&self) -> u64 {
        u64::from(self.ring) * u64::from(self.result_planes) * self.places()
    }

    /// Words of the record.
    pub(super) fn record_words(&self) -> u64 {
        let assignments = u64::from(self.pool_blocks) * u64::from(record::PER_ASSIGNMENT);
        u64::from(self.record_steps) * (u64::from(record::PER_STEP) + assignments)
    }

    /// Bytes of lane state.
    pub(super) fn state_bytes(&self) -> u64 {
        4 * u64::from(self.stride) * u64::from(self.pool_blocks)
    }

    /// Places of a plane of the film, and of the results of a pass.
    pub(super) fn places(&self) -> u64 {
        u64::from(self.tiles) * u64::from(BLOCK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::Scalar;

    fn choose(change: impl Fn(&mut Demand)) -> Result<Sizes> {
        let result: Vec<Leaf> = ["x", "y", "z"].map(|path| Leaf { path: path.into(), scalar: Scalar::F32 }).to_vec();
        let mut demand = Demand {
            execution: Execution::Wavefront,
            pool_blocks: None,
            bank_blocks: None,
            keeps_lengths: false,
            records: false,
            default_blocks: 1000,
            ring: None,
            tiles: 100,
            passes: 8,
            stride: 20 * 256,
            result: &result,
            order_words: 0,
            is_estimated: false,
            grain: Grain::Tiles,
            scope: None,
            pass_items: 100 * 256,
            binding: 128 << 20,
        };
        change(&mut demand);
        Sizes::choose(&demand)
    }

    /// Kills: a pool larger than the work, a ring shorter than what the pool can have in flight, or longer than the passes.
    #[test]
    fn pool_and_ring_follow_the_work() {
        let sizes = choose(|_| {}).expect("fits");
        assert_eq!((sizes.pool_blocks, sizes.ring, sizes.result_planes, sizes.film_planes), (800, 8, 4, 10));
        assert_eq!((sizes.banks, sizes.bank_blocks, sizes.state_bytes()), (1, 800, 800 * 20 * 1024));
        let sizes = choose(|demand| demand.pool_blocks = Some(25)).expect("fits");
        assert_eq!((sizes.pool_blocks, sizes.ring), (25, 3));
        let sizes = choose(|demand| demand.execution = Execution::Megakernel).expect("fits");
        assert_eq!((sizes.ring, sizes.state_bytes()), (1, 0));
        let sizes = choose(|demand| demand.execution = Execution::Persistent).expect("fits");
        assert_eq!((sizes.pool_blocks, sizes.ring, sizes.state_bytes()), (250, 8, 0));
        let sizes = choose(|demand| (demand.execution, demand.pool_blocks) = (Execution::Persistent, Some(50))).expect("fits");
        assert_eq!((sizes.pool_blocks, sizes.ring), (50, 3));
        let sizes = choose(|demand| demand.tiles = 12_000).expect("a short ring");
        assert_eq!((sizes.pool_blocks, sizes.ring), (1000, 2));
    }

    /// Kills: a bank larger than a binding, an empty bank, a block in no bank.
    #[test]
    fn a_pool_that_outgrows_a_binding_has_several_banks() {
        // 20 KiB per block: 6553 blocks in 128 MiB.
        let sizes = choose(|demand| (demand.pool_blocks, demand.tiles) = (Some(7000), 10_000)).expect("two banks");
        assert_eq!((sizes.banks, sizes.bank_blocks, sizes.blocks_of(0), sizes.blocks_of(1)), (2, 3500, 3500, 3500));
        let sizes = choose(|demand| (demand.pool_blocks, demand.bank_blocks) = (Some(5), Some(2))).expect("three banks");
        assert_eq!((sizes.banks, sizes.blocks_of(0), sizes.blocks_of(1), sizes.blocks_of(2)), (3, 2, 2, 1));
        for (pool, bank) in [(9, 4), (10, 4), (1, 1), (64, 1), (127, 2)] {
            let sizes = choose(|demand| (demand.pool_blocks, demand.bank_blocks) = (Some(pool), Some(bank))).expect("fits");
            let blocks: Vec<u32> = (0..sizes.banks).map(|bank| sizes.blocks_of(bank)).collect();
            assert!(blocks.iter().all(|blocks| (1..=bank).contains(blocks)), "{blocks:?}");
            assert_eq!(blocks.iter().sum::<u32>(), pool);
        }
    }

    /// Kills: a ring that ignores the schedule, that is longer than the library's own choice because the schedule allows it, or that
    /// another type of number lets through.
    #[test]
    fn a_schedule_can_only_shorten_the_ring() {
        for (allowed, ring) in [(1, 1), (3, 3), (8, 8), (64, 8)] {
            assert_eq!(choose(|demand| demand.ring = Some(allowed)).expect("fits").ring, ring);
        }
        let megakernel = choose(|demand| (demand.execution, demand.ring) = (Execution::Megakernel, Some(5))).expect("fits");
        assert_eq!(megakernel.ring, 1);
        for refused in [0, 65] {
            let message = choose(|demand| demand.ring = Some(refused)).expect_err("refused").to_string();
            assert!(message.contains(&format!("ring={refused}: allowed is 1 to 64")), "{message}");
        }
    }

    /// Kills: a buffer that the device refuses, after minutes of work or with a message that does not say how much would fit.
    #[test]
    fn what_does_not_fit_is_refused_with_numbers() {
        let refused = |change: &dyn Fn(&mut Demand)| choose(change).expect_err("too large").to_string();
        let message = refused(&|demand| (demand.pool_blocks, demand.bank_blocks, demand.tiles) = (Some(7000), Some(100), 10_000));
        assert!(message.contains("7000 blocks in banks of 100") && message.contains("at most 6400 blocks"), "{message}");
        let message = refused(&|demand| demand.stride = 256 << 20);
        assert!(message.contains("the state of one block"), "{message}");
        let message = refused(&|demand| demand.tiles = 50_000);
        assert!(message.contains("the film of 50000 tiles") && message.contains("134217728"), "{message}");
    }
}
