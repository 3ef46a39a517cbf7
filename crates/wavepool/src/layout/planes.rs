//! Which leaves need memory between kernels, and what each kernel loads and stores.
//!
//! Key decision: backward liveness over the cycle of stages, cell by cell. A leaf is stored by a kernel only when a later one, perhaps in the next
//! step, reads it before writing it; it is loaded where it is read first, or where it may stay unwritten and is stored. What only
//! `finish` reads is loaded late, by the lanes that finish.
//!
//! **Invariant:** a kernel never uses a leaf that it neither loaded nor wrote; filling the others with garbage changes nothing.

use super::{
    BLOCK, Cell, Leaf, over_cells,
    sharing::{most_live, share},
};
use crate::{
    policy::{Grain, RouletteScope},
    shader::{Interface, LeafSet, StateArray, Summary, Written, join_alternatives, then},
};

/// What one kernel moves per live lane and step.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KernelTraffic {
    /// The stage it wraps.
    pub stage: String,
    /// Loaded before the stage runs.
    pub load: LeafSet,
    /// Loaded by lanes that finish, for `finish` alone.
    pub load_late: LeafSet,
    /// Loaded by lanes that block roulette has killed before the stage, for `finish` alone; empty for all but the first stage.
    pub load_killed: LeafSet,
    /// Stored by lanes that continue.
    pub store: LeafSet,
    words: (usize, usize),
    /// Words that the lane's item and the list of lanes add to what is read, and what is remembered of a seat.
    item_words: (usize, usize),
    /// True when `finish` may run in it.
    pub(super) ends: bool,
}

impl KernelTraffic {
    /// Bytes read and written per lane that continues, the lane's flag included.
    pub fn bytes(&self) -> (usize, usize) {
        (4 + 4 * (self.words.0 + self.item_words.0), 4 * (self.words.1 + self.item_words.1))
    }
}

/// Where an array lies that stages reach through accessors.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ArrayPlanes {
    /// The member of the state.
    pub name: String,
    /// Elements.
    pub length: u32,
    /// The stored words of one element, as reached from it.
    pub cells: Vec<Cell>,
    /// Word `cell` of element `index` lies in plane `plane + index * cells + cell`; `None` when nobody loads.
    pub plane: Option<u32>,
    /// Functions of the contract that call its accessors: name, loads, stores.
    pub users: Vec<(String, bool, bool)>,
}

impl ArrayPlanes {
    /// Planes of the whole array, when it has any.
    pub fn planes(&self) -> u32 {
        self.length * self.cells.len() as u32
    }
}

/// Where every leaf lies and who moves it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// All leaves of the state.
    pub leaves: Vec<Leaf>,
    /// The stored words that the leaves make up, in their order.
    pub cells: Vec<Cell>,
    /// The plane of each leaf; `None` for those that never outlive a kernel. Plane 0 is the lane's flag.
    pub plane_of: Vec<Option<u32>>,
    /// What a newly assigned block stores.
    pub generate: LeafSet,
    /// In the order of the stages.
    pub kernels: Vec<KernelTraffic>,
    /// Behind the other planes, and never shared.
    pub arrays: Vec<ArrayPlanes>,
    /// Where items are handed out to single lanes, behind all others: the place of the lane's item and its pass; of packed lanes also the
    /// list of the lanes, and, when groups of them share a draw, the seat in which the lane announced its chance; of keyed lanes the key and the
    /// list ordered by it.
    pub item_plane: Option<u32>,
    pub(super) item_planes: u32,
    unshared: u32,
    least: u32,
}

impl Layout {
    /// 32-bit planes per block, the flag included.
    pub fn planes(&self) -> u32 {
        self.state_planes() + self.item_planes
    }

    /// Those that are not the scheduler's own.
    fn state_planes(&self) -> u32 {
        let end = |array: &ArrayPlanes| array.plane.map(|plane| plane + array.planes());
        self.arrays.iter().filter_map(end).max().unwrap_or(self.leaf_planes())
    }

    /// Planes of the flag and of all leaves outside of arrays.
    fn leaf_planes(&self) -> u32 {
        1 + self.plane_of.iter().flatten().max().copied().unwrap_or(0)
    }

    /// Planes that there would be if each cell had one of its own.
    pub fn planes_unshared(&self) -> u32 {
        self.unshared + self.item_planes
    }

    /// Fewer planes are impossible: what is kept at the busiest border of stages.
    pub fn planes_at_least(&self) -> u32 {
        self.least + self.item_planes
    }

    /// Bytes of state per lane.
    pub fn bytes_per_lane(&self) -> u32 {
        4 * self.planes()
    }

    /// 32-bit words from one block to the next.
    pub fn stride(&self) -> u32 {
        self.planes() * BLOCK
    }

    /// Leaves that have memory.
    pub fn kept(&self) -> LeafSet {
        let mut kept = LeafSet::default();
        self.plane_of.iter().enumerate().filter(|(_, plane)| plane.is_some()).for_each(|(leaf, _)| kept.insert(leaf));
        kept
    }

    /// Planes of leaves in which `generate` leaves nothing.
    pub(crate) fn planes_not_born(&self) -> Vec<u32> {
        let born = |plane: &u32| self.generate.iter().any(|leaf| self.plane_of[leaf] == Some(*plane));
        (1..self.leaf_planes()).filter(|plane| !born(plane)).collect()
    }

    /// Words that the leaves of a set make up.
    pub(super) fn words(&self, set: &LeafSet) -> usize {
        words(&self.cells, set)
    }
}

fn words(cells: &[Cell], set: &LeafSet) -> usize {
    cells.iter().filter(|cell| cell.touches(set)).count()
}

/// Reads, and what is written at the two kinds of exit, of the first kernel when block roulette may reweight before its stage.
fn reweighted_first(stage: &Summary, reweight: &Summary) -> Summary {
    // Perhaps it does not: nothing is certain to be written.
    let before = join_alternatives(Some(Written::default()), Some(reweight.on_return())).unwrap_or_default();
    Summary {
        reads: reweight.reads.union(&stage.reads),
        on_continue: stage.on_continue.as_ref().map(|written| then(&before, written)),
        on_finish: stage.on_finish.as_ref().map(|written| then(&before, written)),
        widened: Vec::new(),
    }
}

/// Reads, and what is written at the two kinds of exit, of the last kernel when it announces its lane's chance to block roulette.
fn announcing_last(stage: &Summary, survival: &Summary) -> Summary {
    let mut whole = stage.clone();
    if let Some(survivor) = &stage.on_continue {
        whole.reads = whole.reads.union(&survival.reads.difference(&survivor.must));
        whole.on_continue = Some(then(survivor, &survival.on_return()));
    }
    whole
}

/// What a kernel reads that asks its lane for a key after the stage.
fn asking_for_a_key(mut kernel: Summary, key: &Summary) -> Summary {
    if let Some(going_on) = &kernel.on_continue {
        kernel.reads = kernel.reads.union(&key.reads.difference(&going_on.must));
    }
    kernel
}

/// Reads, and what is written at the two kinds of exit, of a kernel that draws for its lane after the stage.
fn kernel_summary(stage: &Summary, survival: &Summary, reweight: &Summary) -> Summary {
    let mut whole = stage.clone();
    let Some(survivor) = stage.on_continue.clone() else { return whole };
    whole.reads = whole.reads.union(&survival.reads.difference(&survivor.must));
    let survivor = then(&survivor, &survival.on_return());
    whole.reads = whole.reads.union(&reweight.reads.difference(&survivor.must));
    let reweighted = then(&survivor, &reweight.on_return());
    whole.on_finish = join_alternatives(stage.on_finish.clone(), Some(survivor.clone()));
    whole.on_continue = join_alternatives(Some(survivor), Some(reweighted));
    whole
}

/// Lays out the state of a program under roulette of the given scope, or none, and regeneration of the given grain.
pub(crate) fn lay_out(interface: &Interface, scope: Option<RouletteScope>, grain: Grain, is_sharing: bool) -> Layout {
    let over = |summary: &Summary| over_cells(&interface.cells, summary);
    let roulette = interface.survival.as_ref().map(over).zip(interface.reweight.as_ref().map(over));
    let finish = over(&interface.finish);
    let last = interface.stages.len().saturating_sub(1);
    let is_shared = scope.is_some_and(RouletteScope::is_shared);
    let kernels: Vec<Summary> = interface
        .stages
        .iter()
        .enumerate()
        .map(|(index, stage)| match (scope, &roulette) {
            (Some(scope), Some((survival, reweight))) if scope.is_shared() => {
                let whole = if index == last { announcing_last(&over(&stage.summary), survival) } else { over(&stage.summary) };
                if index == 0 { reweighted_first(&whole, reweight) } else { whole }
            }
            (Some(_), Some((survival, reweight))) if index == last => kernel_summary(&over(&stage.summary), survival, reweight),
            _ => over(&stage.summary),
        })
        .enumerate()
        .map(|(index, kernel)| match &interface.queue_key {
            Some(key) if index == 0 && grain == Grain::KeyedLanes => asking_for_a_key(kernel, &over(key)),
            _ => kernel,
        })
        .collect();

    // What must be there when the kernel starts, apart from what it merely passes on.
    let mut first_use = Vec::new();
    let mut late = Vec::new();
    let mut late_at_exit = Vec::new();
    for kernel in &kernels {
        let mut reads = kernel.reads.clone();
        let mut at_finish = LeafSet::default();
        if let Some(written) = &kernel.on_finish {
            let wanted = finish.reads.difference(&written.must);
            reads = reads.union(&wanted.intersection(&written.may));
            at_finish = wanted.difference(&written.may);
        }
        late_at_exit.push(at_finish.clone());
        if is_shared && first_use.is_empty() {
            // The first kernel may also end walks before its stage has written anything.
            at_finish = at_finish.union(&finish.reads);
        }
        first_use.push(reads);
        late.push(at_finish);
    }

    let count = kernels.len();
    let mut live_in = vec![LeafSet::default(); count];
    loop {
        let before = live_in.clone();
        for index in (0..count).rev() {
            let live_out = live_in[(index + 1) % count].clone();
            let passed = kernels[index].on_continue.as_ref().map(|written| live_out.difference(&written.must)).unwrap_or_default();
            live_in[index] = first_use[index].union(&late[index]).union(&passed);
        }
        if before == live_in {
            break;
        }
    }

    let mut traffic = Vec::new();
    let mut kept = LeafSet::default();
    for index in 0..count {
        let live_out = &live_in[(index + 1) % count];
        let (store, incomplete) = match &kernels[index].on_continue {
            Some(written) => {
                let store = written.may.intersection(live_out);
                let incomplete = store.difference(&written.must);
                (store, incomplete)
            }
            None => Default::default(),
        };
        let load = first_use[index].union(&incomplete);
        let load_killed = if is_shared && index == 0 { finish.reads.difference(&load) } else { LeafSet::default() };
        let load_late = late_at_exit[index].difference(&load);
        kept = kept.union(&load).union(&load_late).union(&load_killed);
        let moved = (words(&interface.cells, &load), words(&interface.cells, &store));
        let ends = kernels[index].on_finish.is_some() || (is_shared && index == 0);
        let stage = interface.stages[index].name.clone();
        let (packs, gambles) = (grain.is_packed(), index == last && scope.is_some() && !is_shared);
        let seats = packs && matches!(scope, Some(RouletteScope::Group(_)));
        let item_words = (
            usize::from(packs) + 2 * usize::from(grain.is_by_lane() && gambles) + usize::from(seats && index == 0),
            usize::from(seats && index == last) + usize::from(grain == Grain::KeyedLanes && index == 0),
        );
        traffic.push(KernelTraffic { stage, load, load_late, load_killed, store, words: moved, item_words, ends });
    }
    let cells: Vec<&Cell> = interface.cells.iter().filter(|cell| cell.touches(&kept)).collect();
    // The sets hold whole cells: the first leaf stands for all.
    let first: Vec<usize> = cells.iter().map(|cell| cell.leaves.start).collect();
    let planes = if is_sharing { share(&first, &live_in) } else { (0..cells.len() as u32).collect() };
    let mut plane_of = vec![None; interface.leaves.len()];
    for (cell, plane) in cells.iter().zip(planes) {
        plane_of[cell.leaves.clone()].fill(Some(1 + plane));
    }
    let generate = live_in.first().cloned().unwrap_or_default();
    let mut next = 1 + plane_of.iter().flatten().max().copied().unwrap_or(0);
    let arrays: Vec<ArrayPlanes> = interface
        .arrays
        .iter()
        .map(|array| {
            let StateArray { name, length, cells, users, .. } = array.clone();
            let plane = array.is_kept().then_some(next);
            let planes = ArrayPlanes { name, length, cells, plane, users };
            next += plane.map_or(0, |_| planes.planes());
            planes
        })
        .collect();
    let in_arrays: u32 = arrays.iter().filter(|array| array.plane.is_some()).map(ArrayPlanes::planes).sum();
    let (unshared, least) = (1 + cells.len() as u32 + in_arrays, 1 + most_live(&first, &live_in) + in_arrays);
    let (leaves, cells) = (interface.leaves.clone(), interface.cells.clone());
    let item_planes = match grain {
        Grain::Tiles => 0,
        Grain::Lanes => 2,
        Grain::KeyedLanes => 5,
        Grain::PackedLanes => 3 + u32::from(matches!(scope, Some(RouletteScope::Group(_)))),
    };
    let mut layout = Layout { leaves, cells, plane_of, generate, kernels: traffic, arrays, item_plane: None, item_planes, unshared, least };
    layout.item_plane = (item_planes > 0).then(|| layout.state_planes());
    layout
}
