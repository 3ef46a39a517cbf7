//! How many of the launched lanes had something to do, for subgroups of devices that are not here.

use crate::layout::BLOCK;

/// Lanes that execute together on common devices: 8 on software drivers, 32 on NVIDIA and AMD RDNA, 64 on AMD GCN and CDNA.
pub const WIDTHS: [u32; 3] = [8, 32, 64];

/// Lane-steps: what was useful, and what was launched at each of [`WIDTHS`], where a subgroup runs as long as one of its lanes lives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Occupancy {
    /// Lanes alive, summed over steps.
    pub useful: u64,
    /// Lanes of subgroups with at least one live lane, summed over steps, per width.
    pub launched: [u64; WIDTHS.len()],
    /// The same for stages that pack the live lanes of a work-group to its front.
    pub launched_local: [u64; WIDTHS.len()],
}

impl Occupancy {
    /// Accounts for one step of a block, or of a list of lanes; returns its live lanes. `left` is not zero where a lane lives.
    pub(crate) fn launch(&mut self, left: &[u32]) -> u32 {
        let live = left.iter().filter(|left| **left > 0).count() as u32;
        self.useful += u64::from(live);
        for (width, launched) in WIDTHS.iter().zip(&mut self.launched) {
            let running = left.chunks(*width as usize).filter(|lanes| lanes.iter().any(|left| *left > 0)).count();
            *launched += running as u64 * u64::from(*width);
        }
        for group in left.chunks(BLOCK as usize) {
            let live = group.iter().filter(|left| **left > 0).count() as u64;
            for (width, launched) in WIDTHS.iter().zip(&mut self.launched_local) {
                *launched += live.next_multiple_of(u64::from(*width));
            }
        }
        live
    }

    /// Useful over launched lane-steps at each of [`WIDTHS`]; 1 is perfect.
    pub fn efficiency(&self) -> [f64; WIDTHS.len()] {
        self.launched.map(|launched| self.share_of(launched))
    }

    /// The same for stages that pack the live lanes of a work-group to its front.
    pub fn efficiency_local(&self) -> [f64; WIDTHS.len()] {
        self.launched_local.map(|launched| self.share_of(launched))
    }

    fn share_of(&self, launched: u64) -> f64 {
        if launched == 0 { 1.0 } else { self.useful as f64 / launched as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: a subgroup counted as running when all its lanes are dead, or as idle when one lives.
    #[test]
    fn a_subgroup_runs_as_long_as_one_lane_lives() {
        let mut left = [0; 256];
        left[9] = 3;
        let mut occupancy = Occupancy::default();
        assert_eq!(occupancy.launch(&left), 1);
        assert_eq!(occupancy.launched, [8, 32, 64]);
        left[63] = 1;
        assert_eq!(occupancy.launch(&left), 2);
        assert_eq!(occupancy.launched, [8 + 16, 32 + 64, 64 + 64]);
        assert_eq!(occupancy.useful, 3);
        assert_eq!(occupancy.launched_local, [8 + 8, 32 + 32, 64 + 64]);
    }
}
