//! Algebra across the borders of stages: simplified without pins, never with them.

use wavepool::{Film, ImageTiles, Schedule};
use wavepool_tests::{
    border,
    device::{gpu, run},
};

/// Leaves in which two films differ in some pixel.
fn differing(a: &Film, b: &Film) -> Vec<&'static str> {
    let differs = |leaf: &usize| (0..a.pixels()).any(|pixel| a.sum(pixel, *leaf).to_bits() != b.sum(pixel, *leaf).to_bits());
    (0..a.leaves().len()).filter(differs).map(border::leaf_name).collect()
}

/// Regression: two pins by `xor` cancelled on a leaf that was not used between them.
/// Kills: pins left out after `generate`, after a stage or before `finish`, pins on floats only (a float may travel as an integer), and
/// pins that a driver can see through.
#[test]
fn pins_stop_algebra_at_borders() {
    let Some(gpu) = gpu() else { return };
    assert!(border::PATTERNS.len() >= 15);
    let program = border::program();
    let source = ImageTiles { width: 48, height: 48 };
    let film = |schedule: Schedule| run(gpu, &program, source, 1, &schedule).0;
    let (wavefront, megakernel) = (film(Schedule::never()), film(Schedule::megakernel()));
    let with_pins = differing(&wavefront, &megakernel);
    assert!(with_pins.is_empty(), "{}: differ although pinned: {with_pins:?}", gpu.facts);
    assert_eq!(wavefront.hash(), megakernel.hash());
    let (loose_wavefront, loose) = (film(Schedule::never().with_pins(false)), film(Schedule::megakernel().with_pins(false)));
    let without = differing(&loose_wavefront, &loose);
    eprintln!("{}: {} of {} patterns differ without pins: {}", gpu.facts, without.len(), wavefront.leaves().len(), without.join(", "));
    // Memory between two kernels is a pin already; `finish` alone shares a kernel with the last stage.
    let in_memory = differing(&wavefront, &loose_wavefront);
    assert!(in_memory.iter().all(|name| name.starts_with("finish")), "{}: {in_memory:?}", gpu.facts);
    if gpu.facts.is_software() {
        assert!(!without.is_empty(), "{}: no pattern differs without pins: the patterns test nothing here", gpu.facts);
    }
}
