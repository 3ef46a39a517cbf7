//! Lets values whose lifetimes are disjoint share a plane.
//!
//! Key decision: a lifetime is the set of stage borders at which a value is needed later; two values are in each other's way exactly when
//! some border is in both sets. Greedy colouring, longest lifetime first, then in order of declaration. What is given up: the best
//! colouring of a cycle is a hard problem, so a few planes more than [`most_live`] may be used.
//!
//! **Invariant:** no plane holds two values at one border; the same program gives the same planes.

use std::cmp::Reverse;

use crate::shader::LeafSet;

/// The plane of each of `cells`, counted from zero in order of declaration; `live` tells for each border which cells it crosses.
pub(super) fn share(cells: &[usize], live: &[LeafSet]) -> Vec<u32> {
    let borders = |cell: usize| (0..live.len()).filter(move |border| live[*border].contains(cell));
    let mut order: Vec<usize> = (0..cells.len()).collect();
    order.sort_by_key(|&index| (Reverse(borders(cells[index]).count()), index));
    // Per plane: the borders at which it is taken.
    let mut taken: Vec<Vec<bool>> = Vec::new();
    let mut colour = vec![0; cells.len()];
    for index in order {
        let is_free = |plane: &Vec<bool>| borders(cells[index]).all(|border| !plane[border]);
        let plane = taken.iter().position(is_free).unwrap_or_else(|| {
            taken.push(vec![false; live.len()]);
            taken.len() - 1
        });
        borders(cells[index]).for_each(|border| taken[plane][border] = true);
        colour[index] = plane;
    }
    // A plane is named after its first cell, so that a table without sharing counts upwards.
    let mut names = vec![None; taken.len()];
    let mut next = 0;
    let mut name = |plane: usize| {
        *names[plane].get_or_insert_with(|| {
            next += 1;
            next - 1
        })
    };
    colour.into_iter().map(&mut name).collect()
}

/// The most cells that are live at one border: fewer planes are impossible.
pub(super) fn most_live(cells: &[usize], live: &[LeafSet]) -> u32 {
    live.iter().map(|set| cells.iter().filter(|cell| set.contains(**cell)).count() as u32).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a border forgotten in the comparison; a plane that is not marked as taken; fewer planes than there can be; more than one
    /// plane each.
    #[test]
    fn no_two_live_cells_share_a_plane() {
        let mut state = 1_u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % below
        };
        let mut saved = 0;
        for round in 0..2000 {
            let (count, borders) = (1 + random(40) as usize, 1 + random(8) as usize);
            let cells: Vec<usize> = (0..count).map(|index| index * 3).collect();
            let mut live = vec![LeafSet::default(); borders];
            for &cell in &cells {
                // An interval of the cycle, as lifetimes mostly are, or any set.
                let (start, length, any) = (random(borders as u32), 1 + random(borders as u32), random(4) == 0);
                for step in 0..length {
                    let border = if any { random(borders as u32) } else { (start + step) % borders as u32 };
                    live[border as usize].insert(cell);
                }
            }
            let planes = share(&cells, &live);
            assert_eq!(planes, share(&cells, &live));
            for border in &live {
                let mut there: Vec<u32> = (0..count).filter(|index| border.contains(cells[*index])).map(|index| planes[index]).collect();
                let before = there.len();
                there.sort_unstable();
                there.dedup();
                assert_eq!(there.len(), before, "round {round}: two live cells in one plane: {planes:?}");
            }
            let used = planes.iter().max().map_or(0, |plane| plane + 1);
            let least = most_live(&cells, &live);
            assert!(used >= least && used <= count as u32, "round {round}: {used} planes, at least {least}, {count} cells");
            assert!(
                planes.iter().scan(0, |seen, plane| Some((*plane, std::mem::replace(seen, (*seen).max(plane + 1))))).all(|(p, s)| p <= s)
            );
            saved += count as u32 - used;
        }
        assert!(saved > 2000, "hardly anything was shared: {saved}");
    }

    /// Kills: sharing given up where a cycle needs no more planes than lie at its busiest border.
    #[test]
    fn disjoint_lifetimes_meet_the_bound() {
        let live: Vec<LeafSet> = [[0, 1], [0, 2], [0, 3]]
            .iter()
            .map(|cells| {
                let mut set = LeafSet::default();
                cells.iter().for_each(|cell| set.insert(*cell));
                set
            })
            .collect();
        assert_eq!(share(&[0, 1, 2, 3], &live), [0, 1, 1, 1]);
        assert_eq!(most_live(&[0, 1, 2, 3], &live), 2);
    }
}
