//! A schedule: one choice for every policy.
//!
//! **Invariant:** on one device and driver, with pins, two schedules of the same roulette give the same film, bit for bit.

use std::{fmt, str::FromStr, sync::Arc};

use crate::{
    Error, Result,
    control::MAX_RING,
    policy::{
        BlockInPlace, Choice, Execution, Grain, KeyedQueues, LAUNCHES, LaneCompaction, LaneInPlace, LaunchScope, NeverRegenerate, ORDERS,
        PerGroup, PerLane, ROULETTES, Regeneration, Roulette, Scanline, StreamCompaction, TileOrder,
    },
};

/// One choice for every policy, and the size of the pool.
///
/// # Example
/// ```
/// use wavepool::Schedule;
/// let paper = Schedule::block();
/// let custom: Schedule = "block,threshold=0.25,check_every=1".parse()?;
/// assert_ne!(paper.to_string(), custom.to_string());
/// # Ok::<(), wavepool::Error>(())
/// ```
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Schedule {
    /// How stages become kernels.
    pub execution: Execution,
    /// Which blocks the stages of a wavefront are launched over.
    pub launch: LaunchScope,
    /// Which stages of a wavefront pack the live lanes of a work-group to its front.
    pub local: LaneCompaction,
    /// In which order tiles leave the queue.
    pub order: Arc<dyn TileOrder>,
    /// When dead blocks receive new tiles.
    pub regeneration: Arc<dyn Regeneration>,
    /// How hopeless walks end; used when the program declares `survival`.
    pub roulette: Option<Arc<dyn Roulette>>,
    /// Blocks of 256 lanes; of the megakernel: tiles per launch; of `persistent` and
    /// `megakernel-regen`: work-groups, with four tiles for each in a launch. `None` lets the library choose.
    pub pool_blocks: Option<u32>,
    /// Blocks in a bank, at most; `None` fills a binding of the device.
    pub bank_blocks: Option<u32>,
    /// Steps in a submission; `None` aims at 20 ms each.
    pub submission_steps: Option<u32>,
    /// At most so many passes in flight (1 to 64); 1 makes every pass wait for the one before. `None` lets the library choose. The
    /// megakernel never has more than one.
    pub ring: Option<u32>,
    /// Keep drivers from rewriting algebra across the borders of stages. Without it, executions may differ in the last bits.
    pub pins: bool,
    /// Where there are any: these take turns at whole passes, and the fastest goes on ([`Chooser`](crate::policy::Chooser)). Of the rest, roulette,
    /// order, pins, ring and the size of the pool are theirs.
    pub candidates: Vec<Schedule>,
    /// For tests: fills every leaf that a kernel may not use with this word.
    pub poison: Option<u32>,
}

impl Default for Schedule {
    fn default() -> Self {
        Schedule::block()
    }
}

impl Schedule {
    /// Block-in-place regeneration, the default: half of the live blocks, every second step.
    pub fn block() -> Self {
        Schedule {
            execution: Execution::Wavefront,
            launch: LaunchScope::LiveBlocks,
            local: LaneCompaction::None,
            order: Arc::new(Scanline),
            regeneration: Arc::new(BlockInPlace::default()),
            roulette: Some(Arc::new(PerLane)),
            pool_blocks: None,
            bank_blocks: None,
            submission_steps: None,
            ring: None,
            pins: true,
            candidates: Vec::new(),
            poison: None,
        }
    }

    /// No regeneration: the pool is filled, walked to its end over the live blocks, and filled again.
    pub fn never() -> Self {
        Schedule { regeneration: Arc::new(NeverRegenerate), ..Schedule::block() }
    }

    /// No regeneration and no live list: every stage is launched over the whole fill until its last walk has ended.
    pub fn never_full() -> Self {
        Schedule::never().with_launch(LaunchScope::AllBlocks)
    }

    /// Every dead lane takes the next item where it is, in every step.
    pub fn per_lane() -> Self {
        Schedule { regeneration: Arc::new(LaneInPlace::default()), ..Schedule::block() }
    }

    /// Live lanes are listed without gaps in every fourth step, new items begin behind them, and stages are launched over the list.
    pub fn compaction() -> Self {
        Schedule { regeneration: Arc::new(StreamCompaction::default()), ..Schedule::block() }
    }

    /// Dead lanes take items and live ones are listed in every step; after the first stage the list is ordered by the program's `queue_key`.
    pub fn keyed() -> Self {
        Schedule { regeneration: Arc::new(KeyedQueues), ..Schedule::block() }
    }

    /// All stages in one kernel.
    pub fn megakernel() -> Self {
        Schedule { execution: Execution::Megakernel, ..Schedule::never() }
    }

    /// All stages in one kernel, whose work-groups stay and take tile after tile.
    pub fn persistent() -> Self {
        Schedule { execution: Execution::Persistent, ..Schedule::never() }
    }

    /// All stages in one kernel, whose lanes take item after item. Without a shared draw of roulette, which needs lanes that stay together.
    pub fn megakernel_regen() -> Self {
        Schedule { execution: Execution::MegakernelRegen, ..Schedule::never() }
    }

    /// Whatever is fastest here: the megakernel without and with regeneration, block-in-place regeneration, compaction and keyed queues do a
    /// pass each, then the fastest goes on; whoever is close is looked at again now and then, and all are when the work changes.
    pub fn auto() -> Self {
        let candidates =
            [Schedule::megakernel(), Schedule::megakernel_regen(), Schedule::block(), Schedule::compaction(), Schedule::keyed()];
        Schedule::of_candidates(candidates.to_vec())
    }

    /// The same with candidates of one's own.
    pub fn of_candidates(candidates: Vec<Schedule>) -> Self {
        Schedule { candidates, ..Schedule::block() }
    }

    /// The candidates with what this schedule says of roulette, order, pins, ring and pool.
    pub(crate) fn candidates_as_asked(&self) -> Vec<Schedule> {
        let as_asked = |candidate: &Schedule| Schedule {
            roulette: self.roulette.clone(),
            order: self.order.clone(),
            pins: self.pins,
            poison: self.poison,
            pool_blocks: self.pool_blocks,
            bank_blocks: self.bank_blocks.filter(|_| candidate.execution.is_wavefront()),
            submission_steps: self.submission_steps,
            ring: self.ring,
            ..candidate.clone()
        };
        self.candidates.iter().map(as_asked).collect()
    }

    /// In which portions a pool receives work: what the regeneration says, whole tiles where there is no pool.
    pub fn grain(&self) -> Grain {
        if self.execution.is_wavefront() { self.regeneration.grain() } else { Grain::Tiles }
    }

    /// Fixes the size of the pool; one that is larger than the work is cut down to it.
    pub fn with_pool_blocks(self, blocks: u32) -> Self {
        Schedule { pool_blocks: Some(blocks), ..self }
    }

    /// Spreads the pool over banks of at most so many blocks.
    pub fn with_bank_blocks(self, blocks: u32) -> Self {
        Schedule { bank_blocks: Some(blocks), ..self }
    }

    /// Fixes the number of steps in a submission.
    pub fn with_submission_steps(self, steps: u32) -> Self {
        Schedule { submission_steps: Some(steps.max(1)), ..self }
    }

    /// Lets at most `passes` passes be in flight; with 1 no pass begins before the one before it is complete.
    pub fn with_ring(self, passes: u32) -> Self {
        Schedule { ring: Some(passes), ..self }
    }

    /// Replaces the regeneration policy.
    pub fn with_regeneration(self, regeneration: impl Regeneration + 'static) -> Self {
        Schedule { regeneration: Arc::new(regeneration), ..self }
    }

    /// Replaces the blocks that the stages of a wavefront are launched over.
    pub fn with_launch(self, launch: LaunchScope) -> Self {
        Schedule { launch, ..self }
    }

    /// Replaces the stages that pack the live lanes of a work-group.
    pub fn with_local(self, local: LaneCompaction) -> Self {
        Schedule { local, ..self }
    }

    /// Replaces the tile order.
    pub fn with_order(self, order: impl TileOrder + 'static) -> Self {
        Schedule { order: Arc::new(order), ..self }
    }

    /// Replaces the roulette policy.
    pub fn with_roulette(self, roulette: Option<Arc<dyn Roulette>>) -> Self {
        Schedule { roulette, ..self }
    }

    /// Switches the pins.
    pub fn with_pins(self, pins: bool) -> Self {
        Schedule { pins, ..self }
    }

    /// Fills unused leaves with a word, for tests.
    pub fn with_poison(self, word: u32) -> Self {
        Schedule { poison: Some(word), ..self }
    }
}

impl fmt::Display for Schedule {
    /// As [`FromStr`] reads it, all policies spelled out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.execution {
            _ if !self.candidates.is_empty() => f.write_str("auto")?,
            Execution::Wavefront if self.launch == LaunchScope::AllBlocks => write!(f, "{},launch=full", self.regeneration.spec())?,
            Execution::Wavefront => f.write_str(&self.regeneration.spec())?,
            whole_walks => f.write_str(whole_walks.name())?,
        }
        let roulette = self.roulette.as_ref().map_or("none", |roulette| roulette.name());
        write!(f, ",order={},roulette={roulette}", self.order.name())?;
        if self.local != LaneCompaction::None {
            write!(f, ",local={}", self.local)?;
        }
        if let Some(passes) = self.ring {
            write!(f, ",ring={passes}")?;
        }
        if self.pins { Ok(()) } else { f.write_str(",pins=off") }
    }
}

/// The schedules that have a name of their own.
pub const SCHEDULES: &[Choice<Schedule>] = &[
    Choice {
        name: "block",
        about: "block-in-place regeneration: a block of 256 lanes takes the next tile when all its lanes are dead (Frolov and Galaktionov 2016); the default",
        make: Schedule::block,
    },
    Choice {
        name: "never",
        about: "no regeneration, live blocks alone are launched: the next tiles begin when all walks have ended",
        make: Schedule::never,
    },
    Choice {
        name: "never-full",
        about: "no regeneration, every launch covers dead blocks too: the baseline of the paper",
        make: Schedule::never_full,
    },
    Choice {
        name: "per-lane",
        about: "every dead lane takes the next item where it is (Novak, Havran and Dachsbacher 2010)",
        make: Schedule::per_lane,
    },
    Choice {
        name: "compaction",
        about: "live lanes are listed without gaps every few steps, new items begin behind them (van Antwerpen 2011)",
        make: Schedule::compaction,
    },
    Choice {
        name: "keyed",
        about: "as compaction in every step, and after the first stage walks that ask for one kind of work are listed side by side (Laine, Karras and Aila 2013)",
        make: Schedule::keyed,
    },
    Choice {
        name: "megakernel",
        about: "all stages in one kernel that loops, state in registers (Parker et al. 2010 built theirs so)",
        make: Schedule::megakernel,
    },
    Choice {
        name: "megakernel-regen",
        about: "a megakernel in which a lane whose walk has ended takes the next item (Davidovic et al. 2014)",
        make: Schedule::megakernel_regen,
    },
    Choice {
        name: "persistent",
        about: "a megakernel whose work-groups stay and take tile after tile (Gupta, Stuart and Owens 2012)",
        make: Schedule::persistent,
    },
    Choice {
        name: "auto",
        about: "measures megakernel, megakernel-regen, block, compaction and keyed for a pass each and goes on with the fastest; the same bits whatever it chooses",
        make: Schedule::auto,
    },
];

/// Keys that can follow a name, with what they take and what they do.
pub const SCHEDULE_KEYS: &[(&str, &str, &str)] = &[
    ("threshold", "0 to 15", "of block: dead blocks wait until there are more than so many for each live one; 0.5 unless said"),
    ("check_every", "1 or more", "of block and per-lane: steps between two looks at that; 2 for block and 1 for per-lane unless said"),
    ("every", "1 or more", "of compaction: steps between two; 4 unless said"),
    ("launch", "live, full", "of wavefronts: which blocks the stages are launched over"),
    ("local", "none, all, or stages with + between", "of wavefronts: these stages pack the live lanes of a work-group to its front"),
    ("order", "a tile order", "in which order tiles leave the queue"),
    ("roulette", "a roulette", "how hopeless walks end"),
    ("ring", "1 to 64", "passes in flight, at most; 1 lets no pass begin before the one before it is complete"),
    ("pins", "on, off", "keep drivers from rewriting algebra across stages; off trades equal bits for a little time"),
];

fn keys() -> String {
    SCHEDULE_KEYS.iter().map(|(key, ..)| *key).collect::<Vec<_>>().join(", ")
}

impl FromStr for Schedule {
    type Err = Error;

    /// `NAME[,key=value...]`: a name of [`SCHEDULES`], keys of [`SCHEDULE_KEYS`], values of [`ORDERS`], [`ROULETTES`] and [`LAUNCHES`] where
    /// these are asked for.
    fn from_str(text: &str) -> Result<Self> {
        let mut parts = text.split(',').map(str::trim);
        let name = parts.next().unwrap_or("");
        let mut schedule = Choice::find(SCHEDULES, name)
            .ok_or_else(|| Error::Schedule(format!("unknown name `{name}`; there are: {}", Choice::names(SCHEDULES))))?;
        let (mut threshold, mut steps) = (BlockInPlace::default().threshold(), None);
        for part in parts {
            let Some((key, value)) = part.split_once('=').map(|(key, value)| (key.trim(), value.trim())) else {
                return Err(Error::Schedule(format!("`{part}` is not key=value; keys are: {}", keys())));
            };
            let wrong = |allowed: &str| Error::Schedule(format!("{key}={value}: allowed is {allowed}"));
            match (key, value) {
                ("threshold", _) if name != "block" => {
                    return Err(Error::Schedule(format!("`{key}` belongs to `block`; `{name}` waits for no number of dead blocks")));
                }
                ("check_every", _) if !["block", "per-lane"].contains(&name) => {
                    return Err(Error::Schedule(format!("`{key}` belongs to `block` and `per-lane`, not to `{name}`")));
                }
                ("every", _) if name != "compaction" => {
                    return Err(Error::Schedule(format!("`{key}` belongs to `compaction`; `{name}` compacts nothing")));
                }
                ("threshold", _) => {
                    let range = 0.0..=15.0;
                    threshold = value.parse().ok().filter(|value| range.contains(value)).ok_or_else(|| wrong("0 to 15"))?;
                }
                ("check_every" | "every", _) => {
                    steps = Some(value.parse().ok().filter(|value| *value > 0).ok_or_else(|| wrong("1 or more"))?);
                }
                ("launch" | "local", _) if !schedule.candidates.is_empty() => {
                    return Err(Error::Schedule(format!("`{key}` belongs to one schedule; `{name}` chooses among several")));
                }
                ("launch", _) if !schedule.execution.is_wavefront() => {
                    return Err(Error::Schedule(format!("`launch` belongs to wavefronts; `{name}` launches no blocks")));
                }
                ("launch", _) => schedule.launch = Choice::find(LAUNCHES, value).ok_or_else(|| wrong(&Choice::names(LAUNCHES)))?,
                ("local", _) => {
                    schedule.local = LaneCompaction::named(value).ok_or_else(|| wrong("none, all, or names of stages with + between"))?;
                }
                ("order", _) => schedule.order = Choice::find(ORDERS, value).ok_or_else(|| wrong(&Choice::names(ORDERS)))?,
                ("roulette", _) => {
                    let group = || PerGroup::named(value).map(|group| Some(Arc::new(group) as Arc<dyn Roulette>));
                    let found = Choice::find(ROULETTES, value).or_else(group);
                    schedule.roulette = found.ok_or_else(|| wrong(&Choice::names(ROULETTES)))?;
                }
                ("ring", _) => {
                    let passes = value.parse().ok().filter(|passes| (1..=MAX_RING).contains(passes));
                    schedule.ring = Some(passes.ok_or_else(|| wrong(&format!("1 to {MAX_RING}")))?);
                }
                ("pins", "on") => schedule.pins = true,
                ("pins", "off") => schedule.pins = false,
                ("pins", _) => return Err(wrong("on, off")),
                _ => return Err(Error::Schedule(format!("unknown key `{key}`; keys are: {}", keys()))),
            }
        }
        match (name, steps) {
            ("block", steps) => {
                let steps = steps.unwrap_or(BlockInPlace::default().check_every());
                schedule.regeneration = Arc::new(BlockInPlace::new(threshold, steps));
            }
            ("per-lane", Some(steps)) => schedule.regeneration = Arc::new(LaneInPlace::new(steps)),
            ("compaction", Some(steps)) => schedule.regeneration = Arc::new(StreamCompaction::new(steps)),
            _ => {}
        }
        Ok(schedule)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a parser that ignores unknown keys, values out of range, or keys of another schedule.
    #[test]
    fn mistakes_are_named() {
        for (text, expected) in [
            (
                "blok",
                "unknown name `blok`; there are: block, never, never-full, per-lane, compaction, keyed, megakernel, megakernel-regen,",
            ),
            ("", "unknown name ``; there are: block, never, never-full, per-lane, compaction, keyed, megakernel, megakernel-regen,"),
            ("block,treshold=1", "unknown key `treshold`"),
            ("block,threshold=16", "threshold=16: allowed is 0 to 15"),
            ("block,threshold=nan", "threshold=nan: allowed is 0 to 15"),
            ("block,check_every=0", "check_every=0: allowed is 1 or more"),
            ("never,threshold=0.5", "`threshold` belongs to `block`"),
            ("per-lane,threshold=0.5", "`threshold` belongs to `block`"),
            ("compaction,check_every=2", "`check_every` belongs to `block` and `per-lane`"),
            ("per-lane,every=2", "`every` belongs to `compaction`"),
            ("auto,launch=full", "`launch` belongs to one schedule"),
            ("compaction,every=0", "every=0: allowed is 1 or more"),
            ("block,roulette=warp", "roulette=warp: allowed is none, lane, group:32, block-max, block-mean"),
            ("block,roulette=group:48", "roulette=group:48: allowed is none, lane, group:32, block-max, block-mean"),
            ("block,order=spiral", "order=spiral: allowed is scanline, morton, "),
            ("block,ring=0", "ring=0: allowed is 1 to 64"),
            ("never,ring=65", "ring=65: allowed is 1 to 64"),
            ("block,launch=all", "launch=all: allowed is live, full"),
            ("megakernel,launch=full", "`launch` belongs to wavefronts; `megakernel`"),
            ("block,threshold", "`threshold` is not key=value"),
        ] {
            let message = text.parse::<Schedule>().expect_err(text).to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
        assert!("block, threshold=0.25, check_every=1, order=scanline, roulette=none".parse::<Schedule>().is_ok());
    }

    /// Kills: a printed schedule that is another one when it is typed in again.
    #[test]
    fn a_printed_schedule_can_be_read() {
        for text in [
            "never",
            "block",
            "megakernel",
            "block,threshold=0.25,check_every=3,roulette=none",
            "never,pins=off",
            "never,ring=64,pins=off",
            "never-full",
            "block,launch=full",
            "block,roulette=group:8",
            "block,local=all",
            "per-lane,local=trace+shade",
            "per-lane",
            "per-lane,check_every=3",
            "compaction,every=8",
            "keyed",
            "auto,roulette=none",
            "persistent,order=morton",
            "persistent,roulette=group:8",
            "megakernel-regen",
        ] {
            let printed = text.parse::<Schedule>().expect(text).to_string();
            assert_eq!(printed.parse::<Schedule>().expect(&printed).to_string(), printed);
        }
        assert!(Schedule::never_full().to_string().starts_with("never,launch=full,"));
        assert_eq!(Schedule::never().with_ring(3).to_string().parse::<Schedule>().expect("a schedule").ring, Some(3));
        assert_eq!(Schedule::block().to_string(), "block,threshold=0.5,check_every=2,order=scanline,roulette=lane");
    }

    /// Kills: a device face whose constants are not those of the host face.
    #[test]
    fn threshold_is_kept_in_256ths() {
        let policy = BlockInPlace::new(0.3, 3);
        assert_eq!(policy.threshold(), 77.0 / 256.0);
        assert!(policy.wgsl().contains("live * 77u") && policy.wgsl().contains("step % 3u"));
        assert!(policy.regenerate(256, 78, 3) && !policy.regenerate(256, 77, 3) && !policy.regenerate(256, 78, 4));
        assert!(policy.regenerate(0, 1, 4));
    }
}
