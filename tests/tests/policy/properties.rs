//! The replay on thousands of workloads: equal to the brute force in every field, and true to what every schedule promises.

use std::collections::HashSet;

use wavepool::replay::{Replay, WIDTHS};
use wavepool_tests::workloads::{LENGTHS, Order, Portion, Workload};

use crate::{
    brute_force::brute_force,
    brute_lanes::{Found, brute_lanes},
};

/// Workloads per order, with and without regeneration each.
const WORKLOADS: u64 = 1000;

fn for_all(check: impl Fn(&Workload, &Replay) + Sync) {
    std::thread::scope(|scope| {
        for order in Order::ALL {
            let check = &check;
            scope.spawn(move || {
                for (number, regenerates) in (0..WORKLOADS).flat_map(|number| [(number, false), (number, true)]) {
                    let workload = Workload::draw(number, order, regenerates);
                    check(&workload, &workload.replay());
                }
            });
        }
    });
}

/// Kills, each planted by itself in the replay or a host face: a threshold compared with `>=`; checks at odd steps; a block that is not
/// retired; two passes resolved in one tick; a ring one pass too long; a key of a running tile that ignores its age; a decayed key
/// measured against what is known when it ends; ties in reverse; a curve by columns; a fill that forgets its dead blocks, or outlives an empty pool; a subgroup counted by its first lane.
#[test]
fn replay_is_what_brute_force_finds() {
    for_all(|workload, seen| {
        let expected = brute_force(workload);
        let name = workload.name();
        assert_eq!(seen.assignments, expected.assignments, "{name}");
        assert_eq!(seen.live_blocks, expected.live_blocks, "{name}");
        assert_eq!(seen.launched_blocks, expected.launched_blocks, "{name}");
        assert_eq!(seen.live_lanes, expected.live_lanes, "{name}");
        assert_eq!(seen.regenerations, expected.regenerations, "{name}");
        assert_eq!(seen.resolved_after, expected.resolved_after, "{name}");
        assert_eq!(*seen, expected, "{name}");
    });
}

/// Items handed to lanes, in place and packed, in one bank and in several.
/// Kills, each planted by itself in the replay: an item given to a lane that lives; a place without an item that is skipped, or that counts
/// as outstanding; a list made anew only when something is handed out; new lanes before the living ones; a list through all banks; a fill
/// that outlives an empty pool; a ring one pass too long.
#[test]
fn replay_of_lanes_is_what_brute_force_finds() {
    let portions = [1, 3, 4].map(Portion::Lanes).into_iter().chain([1, 4, 8].map(Portion::Packed));
    std::thread::scope(|scope| {
        for (portion, order) in portions.flat_map(|portion| [Order::Scanline, Order::Morton].map(|order| (portion, order))) {
            scope.spawn(move || {
                for number in 0..WORKLOADS / 3 {
                    let mut workload = Workload::draw(number, order, true);
                    workload.portion = Some(portion);
                    workload.shorten(if number % 20 == 0 { 200 } else { 30 });
                    let bank = workload.pool.div_ceil(1 + number as u32 % 3);
                    let seen = workload.replay_in_banks(workload.pool, bank, workload.ring);
                    let expected = brute_lanes(&workload, portion, bank);
                    let occupancy = seen.occupancy;
                    let found = Found {
                        live_blocks: seen.live_blocks,
                        launched_blocks: seen.launched_blocks,
                        live_lanes: seen.live_lanes,
                        regenerations: seen.regenerations,
                        resolved_after: seen.resolved_after,
                        useful: occupancy.useful,
                        launched: occupancy.launched,
                    };
                    assert_eq!(found, expected, "{}, banks of {bank}", workload.name());
                }
            });
        }
    });
}

/// Kills: workloads that are all alike, so that the comparison above compares little.
#[test]
fn workloads_cover_what_they_should() {
    for order in Order::ALL {
        let all: Vec<Workload> = (0..WORKLOADS).map(|number| Workload::draw(number, order, true)).collect();
        let kinds: HashSet<_> = all.iter().map(|workload| (workload.kind, workload.ring)).collect();
        assert_eq!(kinds.len(), LENGTHS.len() * 6);
        let share = |is: &dyn Fn(&Workload) -> bool| all.iter().filter(|workload| is(workload)).count();
        assert!(share(&|workload| workload.pool == 1) > 100 && share(&|workload| workload.pool > workload.tiles()) > 100);
        assert!(share(&|workload| workload.columns > 2 && workload.tiles() > workload.columns) > 100);
        assert!(share(&|workload| workload.lengths(0, workload.tiles() - 1).contains(&0)) > 500, "partial tiles");
        assert!(share(&|workload| workload.replay().steps() > 1023) > 10, "keys beyond the largest");
        let in_order = |workload: &Workload| workload.replay().assignments.is_sorted_by_key(|given| (given.pass_index, given.tile));
        let sorted = share(&|workload| in_order(workload));
        assert!(if order == Order::Scanline { sorted == all.len() } else { sorted < all.len() * 9 / 10 }, "{order:?}: {sorted} in order");
    }
}

/// Kills: a tile given twice or never; a block that is given a tile while it has one; a pass that begins while its place in the ring is
/// taken; lane-steps that are lost or counted twice; `never` that regenerates while a block lives; a subgroup that is not counted.
#[test]
fn every_schedule_keeps_its_promises() {
    for_all(|workload, seen| {
        let name = workload.name();
        let mut tiles: Vec<_> = seen.assignments.iter().map(|given| (given.pass_index, given.tile)).collect();
        tiles.sort_unstable();
        let all = (0..workload.passes).flat_map(|pass_index| (0..workload.tiles()).map(move |tile| (pass_index, tile)));
        assert!(tiles.into_iter().eq(all), "{name}: every tile of every pass once");

        let longest = |pass_index: u32, tile: u32| *workload.lengths(pass_index, tile).iter().max().expect("256 places");
        let span = |index: usize| {
            let given = seen.assignments[index];
            given.step..given.step + longest(given.pass_index, given.tile)
        };
        let mut in_block = vec![0; workload.pool as usize];
        for (index, given) in seen.assignments.iter().enumerate() {
            assert!(given.step >= in_block[given.block as usize], "{name}: block {} has a tile already", given.block);
            in_block[given.block as usize] = span(index).end;
            let before = given.pass_index.checked_sub(workload.ring).map(|pass_index| seen.resolved_after[pass_index as usize]);
            assert!(before.is_none_or(|resolved| resolved < given.step), "{name}: {given:?} begins before its place is free");
        }
        assert!(seen.resolved_after.is_sorted() && seen.resolved_after.len() == workload.passes as usize, "{name}: passes in order");

        let total: u64 = (0..workload.passes)
            .flat_map(|pass_index| (0..workload.tiles()).flat_map(move |tile| workload.lengths(pass_index, tile)))
            .map(|length| u64::from(*length))
            .sum();
        assert_eq!(seen.lane_steps(), total, "{name}: lane-steps");
        assert_eq!(seen.occupancy.useful, total, "{name}: useful lane-steps");
        let launched = seen.occupancy.launched;
        assert!(total <= launched[0] && launched.is_sorted() && launched[2] <= seen.block_steps() * 256, "{name}: {launched:?}");
        let packed = seen.occupancy.launched_local;
        assert!(total <= packed[0] && packed.iter().zip(launched).all(|(packed, launched)| *packed <= launched), "{name}: {packed:?}");
        assert!(WIDTHS.iter().zip(launched).all(|(width, launched)| launched % u64::from(*width) == 0), "{name}: {launched:?}");

        assert_eq!(seen.regenerations.iter().sum::<u32>() as usize, seen.assignments.len(), "{name}: regenerations");
        if workload.block.is_none() {
            for given in &seen.assignments {
                let alive = (0..seen.assignments.len()).any(|other| span(other).start < given.step && span(other).end > given.step);
                assert!(!alive, "{name}: {given:?} while a block lives");
            }
        }
    });
}
