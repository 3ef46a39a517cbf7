//! The same picture from every schedule: the path tracer's stages, with textures, glass, roulette and all.

use std::{ops::ControlFlow, path::PathBuf};

use path_tracer::{
    Renderer, Settings,
    scene::{self, Scene},
    wavepool::{Report, Schedule},
};
use wavepool_tests::device::{gpu, skip};

const SCHEDULES: [(&str, u32); 8] = [
    ("never", 16),
    ("block", 1),
    ("block,threshold=0.1,check_every=1", 5),
    ("block,threshold=0,check_every=2", 5),
    ("block,threshold=2,check_every=3", 5),
    ("block", 500),
    ("megakernel", 4),
    ("block,threshold=0.25,order=depth-max", 5),
];

/// Renders under every schedule; asserts one hash, and that the schedules did different things.
fn compare(scene: &Scene) {
    let Some(gpu) = gpu() else { return };
    let mut results: Vec<(String, u64, Report)> = Vec::new();
    for (text, pool_blocks) in SCHEDULES {
        let mut settings = Settings::new(40, 56, 3);
        settings.depth = 12;
        settings.schedule = text.parse::<Schedule>().expect("a schedule").with_pool_blocks(pool_blocks);
        let name = format!("{}, {text}, {pool_blocks} blocks", scene.name);
        let mut renderer = Renderer::new(gpu, scene, &settings).unwrap_or_else(|error| panic!("{name}: {error}"));
        let rendering = renderer.render(|_| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{name}: {error}"));
        let pixels = rendering.pixels();
        let lit = pixels.iter().filter(|pixel| pixel.iter().any(|value| *value > 0.0)).count();
        assert!(lit * 2 > pixels.len(), "{name}: a black picture proves nothing");
        assert_eq!(rendering.report.not_finite, 0, "{name}");
        results.push((name, rendering.film.hash(), rendering.report));
    }
    for (name, hash, _) in &results {
        assert_eq!(*hash, results[0].1, "`{}` and `{name}` differ", results[0].0);
    }
    let mut work: Vec<_> = results.iter().map(|(.., report)| (report.steps, report.launches, report.regenerations)).collect();
    work.sort_unstable();
    work.dedup();
    assert!(work.len() + 1 >= results.len(), "the schedules hardly differ: {work:?}");
    assert!(results[1].2.regenerations > 10 && results[2].2.regenerations > results[4].2.regenerations);
    assert!(results[6].2.launches < results[0].2.launches);
}

/// Kills: a pin left out between two stages, a random number keyed by lane or block, a path that keeps the state of the tile before.
#[test]
fn built_in_scenes_have_the_same_bits_under_every_schedule() {
    for (name, _) in scene::BUILTIN {
        let mut scene = scene::builtin(name).expect("it is in the list");
        scene.reframe(40.0 / 56.0);
        compare(&scene);
    }
}

/// Kills: a texture, a normal map, alpha or a panorama looked up with what another lane has left.
#[test]
fn a_real_file_has_the_same_bits_under_every_schedule() {
    let Some(assets) = std::env::var_os("WAVEPOOL_ASSETS").map(PathBuf::from) else { return skip("WAVEPOOL_ASSETS is not set") };
    let mut scene = scene::load(&assets.join("gltf/FlightHelmet/FlightHelmet.gltf")).expect("the file loads");
    let (environment, _) = scene::load_environment(&assets.join("env/small/rle.hdr")).expect("the panorama loads");
    scene.environment = Some(environment);
    scene.reframe(40.0 / 56.0);
    compare(&scene);
}
