//! Where the state lies reaches no bit: shared planes.

use wavepool::{
    ImageTiles, Schedule,
    policy::{BlockInPlace, RouletteScope, Statistic},
};
use wavepool_tests::{
    device::{gpu, run},
    memory,
};

/// Kills: two values that are needed at the same border in one plane; a value loaded after the plane has got its next owner, among them
/// what walks that finish or are killed with their block read late.
#[test]
fn shared_planes_change_no_bit() {
    let Some(gpu) = gpu() else { return };
    let source = ImageTiles { width: 40, height: 40 };
    let (shared, apart) = (memory::relay(), memory::relay_with(|builder| builder.share_planes(false)));
    for scope in [None, Some(RouletteScope::Lane), Some(RouletteScope::Block(Statistic::Max))] {
        let layout = shared.layout(scope);
        assert_eq!(apart.layout(scope).planes(), layout.planes_unshared());
        assert!(layout.planes() + 4 <= layout.planes_unshared(), "hardly anything is shared:\n{}", layout.table());
        assert!(layout.planes() >= layout.planes_at_least());
    }
    let mut hashes = Vec::new();
    for roulette in ["none", "lane", "block-max"] {
        let lane: Schedule = format!("block,roulette={roulette}").parse().expect("a schedule");
        let often = lane.clone().with_regeneration(BlockInPlace::new(0.1, 1)).with_pool_blocks(3);
        let film = |program, schedule: &Schedule| run(gpu, program, source, 3, schedule).0;
        let mega = Schedule::megakernel().with_roulette(lane.roulette.clone());
        let expected = film(&shared, &mega);
        for schedule in [&lane, &often, &often.clone().with_poison(0x7fc0_0000)] {
            for program in [&shared, &apart] {
                assert_eq!(film(program, schedule).hash(), expected.hash(), "{schedule}, roulette {roulette}");
            }
        }
        hashes.push(expected.hash());
    }
    hashes.dedup();
    assert_eq!(hashes.len(), 3, "roulette decides nothing");
}
