//! Every schedule gives the same bits, on every driver at hand; and the ledger balances at every size.
//!
//! Key decision: identity is compared by `Film::hash` over raw sums and sample counts, and every comparison also asserts that the
//! schedules did something different; an identity between equal schedules proves nothing.

#[path = "conformance/array.rs"]
mod array;
#[path = "conformance/auto.rs"]
mod auto;
#[path = "conformance/cache.rs"]
mod cache;
#[path = "conformance/edges.rs"]
mod edges;
#[path = "conformance/exact.rs"]
mod exact;
#[path = "conformance/faults.rs"]
mod faults;
#[path = "conformance/identity.rs"]
mod identity;
#[path = "conformance/lanes.rs"]
mod lanes;
#[path = "conformance/memory.rs"]
mod memory;
#[path = "conformance/order.rs"]
mod order;
#[path = "conformance/pins.rs"]
mod pins;
#[path = "conformance/planted.rs"]
mod planted;
#[path = "conformance/poison.rs"]
mod poison;
#[path = "conformance/replay.rs"]
mod replay;
#[path = "conformance/roulette.rs"]
mod roulette;
#[path = "conformance/sizes.rs"]
mod sizes;
#[path = "conformance/stress.rs"]
mod stress;
#[path = "conformance/subjects.rs"]
mod subjects;

/// Kills: whatever holds on one vendor's driver only.
#[test]
fn second_driver_agrees_with_itself() {
    wavepool_tests::device::run_again_on_swiftshader(&["second_driver_agrees_with_itself", "array::"]);
}
