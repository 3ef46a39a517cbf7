//! Which leaves need memory between kernels, and what each kernel loads and stores.
//!
//! Key decision: backward liveness over the cycle of stages. A leaf is stored by a kernel only when a later one, perhaps in the next
//! step, reads it before writing it; it is loaded where it is read first, or where it may stay unwritten and is stored. What only
//! `finish` reads is loaded late, by the lanes that finish.
//!
//! **Invariant:** a kernel never uses a leaf that it neither loaded nor wrote; filling the others with garbage changes nothing.

use super::{
    BLOCK, Leaf,
    sharing::{most_live, share},
};
use crate::{
    policy::RouletteScope,
    shader::{Interface, LeafSet, Summary, Written, join_alternatives, then},
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
}

impl KernelTraffic {
    /// Bytes read and written per lane that continues, the lane's flag included.
    pub fn bytes(&self) -> (usize, usize) {
        (4 + 4 * self.load.len(), 4 * self.store.len())
    }
}

/// Where every leaf lies and who moves it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// All leaves of the state.
    pub leaves: Vec<Leaf>,
    /// The plane of each leaf; `None` for those that never outlive a kernel. Plane 0 is the lane's flag.
    pub plane_of: Vec<Option<u32>>,
    /// What a newly assigned block stores.
    pub generate: LeafSet,
    /// In the order of the stages.
    pub kernels: Vec<KernelTraffic>,
    unshared: u32,
    least: u32,
}

impl Layout {
    /// 32-bit planes per block, the flag included.
    pub fn planes(&self) -> u32 {
        1 + self.plane_of.iter().flatten().max().copied().unwrap_or(0)
    }

    /// Planes that there would be if each leaf had one of its own.
    pub fn planes_unshared(&self) -> u32 {
        self.unshared
    }

    /// Fewer planes are impossible: what is kept at the busiest border of stages.
    pub fn planes_at_least(&self) -> u32 {
        self.least
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
        (1..self.planes()).filter(|plane| !born(plane)).collect()
    }

    /// The table `leaves x stages`: `r` loaded, `f` loaded when finishing, `k` loaded when killed with the block, `w` stored.
    pub fn table(&self) -> String {
        let width = self.leaves.iter().map(|leaf| leaf.path.len()).max().unwrap_or(0).max(14);
        let mut text = format!("{:width$} {:>5} {:>9}", "leaf", "plane", "generate");
        for kernel in &self.kernels {
            text.push_str(&format!(" {:>1$}", kernel.stage, kernel.stage.len().max(3)));
        }
        for (leaf, plane) in self.plane_of.iter().enumerate() {
            let plane = plane.map_or_else(|| "-".into(), |plane| plane.to_string());
            let born = if self.generate.contains(leaf) { "w" } else { "" };
            text.push_str(&format!("\n{:width$} {plane:>5} {born:>9}", self.leaves[leaf].path.trim_start_matches('.')));
            for kernel in &self.kernels {
                let mark = [(&kernel.load, 'r'), (&kernel.load_late, 'f'), (&kernel.load_killed, 'k'), (&kernel.store, 'w')];
                let mark: String = mark.iter().filter(|(set, _)| set.contains(leaf)).map(|(_, mark)| *mark).collect();
                text.push_str(&format!(" {mark:>0$}", kernel.stage.len().max(3)));
            }
        }
        text.push_str(&format!("\n{:width$} {:>5} {:>9}", "bytes per lane", self.bytes_per_lane(), 4 + 4 * self.generate.len()));
        for kernel in &self.kernels {
            let (read, written) = kernel.bytes();
            text.push_str(&format!(" {:>1$}", format!("{read}/{written}"), kernel.stage.len().max(3)));
        }
        if self.planes() < self.unshared {
            let (planes, unshared, least) = (self.planes(), self.unshared, self.least);
            text.push_str(&format!("\n{planes} planes; {unshared} without sharing, {least} at the busiest border"));
        }
        text
    }
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

/// Reads, and what is written at the two kinds of exit, of a kernel that draws for its lane after the stage.
fn kernel_summary(stage: &Summary, roulette: Option<(&Summary, &Summary)>) -> Summary {
    let mut whole = stage.clone();
    let (Some((survival, reweight)), Some(survivor)) = (roulette, stage.on_continue.clone()) else { return whole };
    whole.reads = whole.reads.union(&survival.reads.difference(&survivor.must));
    let survivor = then(&survivor, &survival.on_return());
    whole.reads = whole.reads.union(&reweight.reads.difference(&survivor.must));
    let reweighted = then(&survivor, &reweight.on_return());
    whole.on_finish = join_alternatives(stage.on_finish.clone(), Some(survivor.clone()));
    whole.on_continue = join_alternatives(Some(survivor), Some(reweighted));
    whole
}

/// Lays out the state of a program under roulette of the given scope, or none.
pub(crate) fn lay_out(interface: &Interface, scope: Option<RouletteScope>, is_sharing: bool) -> Layout {
    let roulette = interface.survival.as_ref().zip(interface.reweight.as_ref());
    let last = interface.stages.len().saturating_sub(1);
    let is_by_block = matches!(scope, Some(RouletteScope::Block(_)));
    let kernels: Vec<Summary> = interface
        .stages
        .iter()
        .enumerate()
        .map(|(index, stage)| match (scope, roulette) {
            (Some(RouletteScope::Block(_)), Some((survival, reweight))) => {
                let whole = if index == last { announcing_last(&stage.summary, survival) } else { stage.summary.clone() };
                if index == 0 { reweighted_first(&whole, reweight) } else { whole }
            }
            (Some(_), roulette) => kernel_summary(&stage.summary, roulette.filter(|_| index == last)),
            _ => stage.summary.clone(),
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
            let wanted = interface.finish.reads.difference(&written.must);
            reads = reads.union(&wanted.intersection(&written.may));
            at_finish = wanted.difference(&written.may);
        }
        late_at_exit.push(at_finish.clone());
        if is_by_block && first_use.is_empty() {
            // The first kernel may also end walks before its stage has written anything.
            at_finish = at_finish.union(&interface.finish.reads);
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
        let load_killed = if is_by_block && index == 0 { interface.finish.reads.difference(&load) } else { LeafSet::default() };
        let load_late = late_at_exit[index].difference(&load);
        kept = kept.union(&load).union(&load_late).union(&load_killed);
        traffic.push(KernelTraffic { stage: interface.stages[index].name.clone(), load, load_late, load_killed, store });
    }
    let cells: Vec<usize> = kept.iter().collect();
    let planes = if is_sharing { share(&cells, &live_in) } else { (0..cells.len() as u32).collect() };
    let mut plane_of = vec![None; interface.leaves.len()];
    cells.iter().zip(planes).for_each(|(leaf, plane)| plane_of[*leaf] = Some(1 + plane));
    let generate = live_in.first().cloned().unwrap_or_default();
    let (unshared, least) = (1 + cells.len() as u32, 1 + most_live(&cells, &live_in));
    Layout { leaves: interface.leaves.clone(), plane_of, generate, kernels: traffic, unshared, least }
}
