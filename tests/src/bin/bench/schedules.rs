//! All schedules on the built-in scenes at many depths: counted, timed in turns, swept for their best settings and taken apart.
//!
//! Key decision: a cell has a budget of time and a least number of rounds, so that the whole ends on a slow driver and a fast one is asked
//! more often. On a software driver the image is small: there counts are what matters, and they need no large one.
//! Source: Frolov and Galaktionov, *Low overhead path regeneration*, 2016, figures 2 to 5.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use path_tracer::{
    Renderer, Settings,
    scene::{self, Scene},
};
use wavepool::{GpuContext, ImageTiles, Instruments, SCHEDULES, Schedule, Scheduler, policy::WorkSource};
use wavepool_lab::rivals::{
    Cell, Rival, Rounds, STAGES_HEAD, Subject, TABLE_HEAD, Terms, ablation, chart, choosing, claims, compare_across_roulettes,
    compare_schedules, csv, glance, stages, sweep, table, willing,
};

use crate::{Failure, commit};

/// The scenes of the paper, in its order.
const SCENES: [&str; 4] = ["mirror-corridor", "cornell-box", "corridor", "glass"];
/// Everything is compared with this schedule: the baseline of the paper.
const BASELINE: &str = "never-full";
/// What a cell's workload and its place are called.
const COLUMNS: [&str; 2] = ["scene", "depth"];

/// The stages that trace rays.
const TRACING: [&str; 2] = ["trace", "trace_shadow"];
/// Where paths are long.
const DEEP: u32 = 16;

/// How much is done.
struct Sizes {
    /// Pixels across and down.
    side: u32,
    passes: u32,
    depths: &'static [u32],
    rounds: Rounds,
    /// Where settings are swept.
    sweep_depth: u32,
    sweep_rounds: Rounds,
    settings: &'static [(&'static str, &'static [&'static str])],
    /// Sizes of the pool, in quarters of a pass; settings are swept at the first.
    pool_quarters: &'static [u32],
    ablation_depths: &'static [u32],
    ablation_rounds: Rounds,
}

impl Sizes {
    fn new(is_software: bool, is_quick: bool) -> Self {
        let rounds = |least, most, seconds| Rounds { least, most, budget: Duration::from_secs(seconds) };
        let (side, passes) = match (is_software, is_quick) {
            (true, true) => (64, 2),
            (true, false) => (128, 6),
            (false, true) => (512, 4),
            (false, false) => (1024, 16),
        };
        if is_quick {
            return Sizes {
                side,
                passes,
                depths: &[4, 32],
                rounds: rounds(2, 5, 1),
                sweep_depth: 32,
                sweep_rounds: rounds(1, 3, 1),
                settings: &[("threshold", &["0", "0.5"]), ("every", &["4", "8"])],
                pool_quarters: &[2, 4],
                ablation_depths: &[32],
                ablation_rounds: rounds(2, 5, 1),
            };
        }
        Sizes {
            side,
            passes,
            depths: &[2, 4, 8, 16, 20, 32, 64, 128],
            rounds: rounds(3, 31, 10),
            sweep_depth: 32,
            sweep_rounds: rounds(2, 15, 10),
            settings: &[("threshold", &["0", "0.25", "0.5", "1"]), ("check_every", &["1", "2", "4"]), ("every", &["1", "2", "4", "8"])],
            pool_quarters: &[2, 1, 4, 8],
            ablation_depths: &[16, 64],
            ablation_rounds: rounds(3, 31, 12),
        }
    }
}

/// A renderer among its rivals.
struct Rendering(Renderer);

impl Subject for Rendering {
    fn scheduler(&mut self) -> &mut Scheduler {
        self.0.scheduler_mut()
    }
}

/// What has been found so far; printed as it grows.
#[derive(Default)]
struct Findings {
    text: String,
    cells: Vec<Cell>,
    trials: Vec<(String, u32, Vec<sweep::Trial>)>,
    ablations: Vec<(String, u32, Vec<ablation::Row>)>,
    /// Every rival that ran, in the order of the charts.
    names: Vec<String>,
}

impl Findings {
    fn say(&mut self, words: &str) {
        print!("{words}");
        self.text += words;
    }

    /// All files, as far as they are.
    fn write(&self, folder: &Path, device: &str) -> Result<(), Failure> {
        fs::create_dir_all(folder)?;
        let write = |name: String, text: String| {
            let path = folder.join(name);
            fs::write(&path, text).map_err(|why| format!("{}: {why}", path.display()))
        };
        write("schedules.md".into(), self.text.clone())?;
        write("schedules.csv".into(), csv(COLUMNS, &self.cells))?;
        write("sweep.csv".into(), sweep::csv(COLUMNS, &self.trials))?;
        write("ablation.csv".into(), ablation::csv(COLUMNS, &self.ablations))?;
        for scene in SCENES {
            let cells: Vec<Cell> = self.cells.iter().filter(|cell| cell.workload == scene).cloned().collect();
            if !cells.is_empty() {
                write(format!("{scene}.svg"), chart(&format!("{scene}\n{device}"), "maximum depth", &self.names, &cells))?;
            }
        }
        Ok(())
    }
}

/// The whole bench; what it finds is printed, and written into `out` where that is asked for.
pub(crate) fn schedules(gpu: &GpuContext, is_quick: bool, out: Option<PathBuf>) -> Result<(), Failure> {
    let begun = Instant::now();
    let sizes = Sizes::new(gpu.facts.is_software(), is_quick);
    let source = ImageTiles { width: sizes.side, height: sizes.side };
    let pools: Vec<u32> = sizes.pool_quarters.iter().map(|quarters| (source.tiles() * quarters / 4).max(1)).collect();
    let facts = &gpu.facts;
    // Before files are written, which belong to the repository where the book's own are made anew.
    let commit = commit();
    let mut found = Findings::default();
    found.say(&format!(
        "# Schedules on the built-in scenes\n\n- device: {} ({})\n- driver: {}\n- command: `cargo xtask bench schedules{}`\n- commit: {}\n- work: {side}x{side} \
         pixels in {} tiles, {} samples each, roulette by lane; pools of {pools:?} blocks are tried\n\nEqual films are asserted. Runs are timed in \
         turns, forwards and backwards; intervals are of 95 %, by resampling. `time over the first` is against `{BASELINE}`.\n",
        facts.name,
        facts.backend,
        facts.driver,
        if is_quick { " --quick" } else { "" },
        commit,
        source.tiles(),
        sizes.passes,
        side = sizes.side,
    ));
    for name in SCENES {
        let scene = scene::builtin(name).ok_or_else(|| format!("there is no built-in scene `{name}`"))?;
        found.say(&format!("\n## {name}\n"));
        bench_scene(gpu, (name, &scene), &sizes, &pools, &mut found)?;
        if let Some(out) = &out {
            found.write(out, &facts.to_string())?;
        }
        eprintln!("{name}: done, {:.0} s since the beginning", begun.elapsed().as_secs_f64());
    }
    // Of a device that is no software the processor only waits for it.
    let work = if facts.is_software() { Rival::processor_seconds } else { |rival: &Rival| Some(rival.seconds()) };
    let terms = Terms { tracing: &TRACING, deep: DEEP, work };
    let head =
        format!("# What the literature claims, in numbers of one run\n\nOf `schedules.csv` and `ablation.csv`; {facts}, {commit}.\n\n");
    let claims = head + &claims(&found.cells, &found.ablations, &terms);
    println!("\n{claims}");
    if let Some(out) = &out {
        fs::write(out.join("claims.md"), claims).map_err(|why| format!("{}: {why}", out.join("claims.md").display()))?;
        println!("\nschedules.md, claims.md, schedules.csv, sweep.csv, ablation.csv and a chart of each scene are in {}", out.display());
    }
    Ok(())
}

/// The names of the registry, the baseline first.
fn registered() -> Vec<&'static str> {
    let mut names: Vec<&str> = SCHEDULES.iter().map(|choice| choice.name).collect();
    names.sort_by_key(|name| *name != BASELINE);
    names
}

fn bench_scene(gpu: &GpuContext, (name, scene): (&str, &Scene), sizes: &Sizes, pools: &[u32], found: &mut Findings) -> Result<(), Failure> {
    let source = ImageTiles { width: sizes.side, height: sizes.side };
    let at_depth = |depth: u32| {
        move |schedule: &Schedule, instruments: Instruments| -> Result<Rendering, Failure> {
            let mut settings = Settings::new(sizes.side, sizes.side, sizes.passes);
            (settings.depth, settings.schedule, settings.instruments) = (depth, schedule.clone(), instruments);
            Ok(Rendering(Renderer::new(gpu, scene, &settings)?))
        }
    };
    let mut candidates = Vec::new();
    for name in registered() {
        candidates.push((name.to_owned(), name.parse::<Schedule>()?));
    }
    let (taken, left_out) = willing(candidates, at_depth(sizes.sweep_depth));
    for (rival, why) in left_out {
        found.say(&format!("\n`{rival}` is left out: {why}\n"));
    }
    let taken: Vec<&str> = taken.iter().map(|(name, _)| name.as_str()).collect();

    let grid = sweep::Grid { settings: sizes.settings, pools };
    let trials = sweep::sweep(&source, &taken, &grid, sizes.passes, sizes.sweep_rounds, at_depth(sizes.sweep_depth))?;
    let label = format!("`{name}`, depth {}", sizes.sweep_depth);
    found.say(&format!("\n### Settings, swept at depth {}\n\n{}{}", sizes.sweep_depth, sweep::HEAD, sweep::markdown(&label, &trials)));
    let (names, schedules): (Vec<String>, Vec<Schedule>) = sweep::best(&trials).into_iter().unzip();
    let new: Vec<String> = names.iter().filter(|name| !found.names.contains(name)).cloned().collect();
    found.names.extend(new);
    found.trials.push((name.to_owned(), sizes.sweep_depth, trials));

    found.say(&format!("\n### Schedules at their best settings\n\n{TABLE_HEAD}"));
    let mut device_times = String::new();
    for depth in sizes.depths {
        let mut rivals = compare_schedules(&source, &schedules, sizes.passes, sizes.rounds, at_depth(*depth))?;
        rivals.iter_mut().zip(&names).for_each(|(rival, name)| rival.name = name.clone());
        let label = format!("`{name}`, depth {depth}");
        found.say(&table(&label, &rivals));
        device_times += &stages(&label, &rivals);
        found.cells.push(Cell { workload: name.to_owned(), at: *depth, rivals });
    }
    let cells: Vec<Cell> = found.cells.iter().filter(|cell| cell.workload == name).cloned().collect();
    found.say(&format!("\nMwalks/s, the fastest in bold:\n\n{}", glance(COLUMNS[1], &names, &cells)));
    match device_times.is_empty() {
        true => found.say("\nThis device has no timestamps: nothing is known about the time of single kernels.\n"),
        false => found.say(&format!("\n{STAGES_HEAD}{device_times}")),
    }

    found.say(&format!(
        "\n### Ideas, one by one\n\nThe paper's values, a pool of {} blocks. Rows of another roulette walk other walks: compare their counters and their \
         time per walk; what a walk is worth is not told.\n\n{}",
        pools[0],
        ablation::HEAD
    ));
    for depth in sizes.ablation_depths {
        let rows = take_apart(&source, sizes, pools[0], at_depth(*depth))?;
        found.say(&ablation::markdown(&format!("`{name}`, depth {depth}"), &rows));
        found.ablations.push((name.to_owned(), *depth, rows));
    }
    Ok(())
}

/// Who is asked how well `auto` chooses: the fixed schedules of the registry, as they are.
const CHOOSER: &str = "auto";

/// `auto` against the best fixed schedule of each cell, against the best that could be fixed for all, and both among wavefronts.
pub(crate) fn choosing(gpu: &GpuContext, is_quick: bool) -> Result<(), Failure> {
    let sizes = Sizes::new(gpu.facts.is_software(), is_quick);
    let source = ImageTiles { width: sizes.side, height: sizes.side };
    let rounds = if is_quick { Rounds::from(4) } else { Rounds { least: 8, most: 48, budget: Duration::from_secs(60) } };
    let depths: &[u32] = if is_quick { &[8] } else { &[4, 16, 64] };
    // A choice among wavefronts alone, as if there were no megakernels.
    let wavefronts = Schedule::of_candidates(vec![Schedule::block(), Schedule::compaction(), Schedule::keyed(), Schedule::never()]);
    let mut schedules = Vec::new();
    for name in registered() {
        schedules.push((name.to_owned(), name.parse::<Schedule>()?));
    }
    schedules.push(("auto among wavefronts".to_owned(), wavefronts));
    let is_choice = |name: &str| name.starts_with(CHOOSER);
    println!(
        "{side}x{side} pixels, {} samples, every run counts but the first; the choosers keep what they have learnt\n",
        sizes.passes,
        side = sizes.side
    );
    let mut cells = Vec::new();
    for name in SCENES {
        let scene = scene::builtin(name).ok_or_else(|| format!("there is no built-in scene `{name}`"))?;
        for depth in depths {
            let build = |schedule: &Schedule, instruments: Instruments| -> Result<Rendering, Failure> {
                let mut settings = Settings::new(sizes.side, sizes.side, sizes.passes);
                (settings.depth, settings.schedule, settings.instruments) = (*depth, schedule.clone(), instruments);
                Ok(Rendering(Renderer::new(gpu, &scene, &settings)?))
            };
            let list: Vec<Schedule> = schedules.iter().map(|(_, schedule)| schedule.clone()).collect();
            let mut rivals = compare_schedules(&source, &list, sizes.passes, rounds, build)?;
            rivals.iter_mut().zip(&schedules).for_each(|(rival, (name, _))| rival.name = name.clone());
            cells.push(Cell { workload: name.to_owned(), at: *depth, rivals });
            eprintln!("{name}, depth {depth}: {} rounds", cells[cells.len() - 1].rivals[0].runs.len());
        }
    }
    let is_fixed = |rival: &Rival| !is_choice(&rival.name);
    let is_wavefront = |rival: &Rival| is_fixed(rival) && !rival.name.starts_with("megakernel") && rival.name != "persistent";
    for (chooser, what, is_rival) in [
        ("auto", "all fixed schedules", &is_fixed as &dyn Fn(&Rival) -> bool),
        ("auto among wavefronts", "fixed wavefronts", &is_wavefront),
    ] {
        println!(
            "`{chooser}` against the best of {what}, chosen on the even rounds and judged on the odd ones\n\n{}",
            choosing::markdown(&choosing::judge(&cells, chooser, is_rival))
        );
        if let Some(constant) = choosing::best_constant(&cells, is_rival) {
            let verdicts = choosing::judge(&cells, chooser, |rival| rival.name == constant);
            println!("`{chooser}` against `{constant}`, the best choice for all cells\n\n{}", choosing::markdown(&verdicts));
        }
    }
    Ok(())
}

/// Every variant that has a schedule, in turns; the baseline is the first, since it is what the others are compared with.
fn take_apart(
    source: &ImageTiles,
    sizes: &Sizes,
    pool_blocks: u32,
    mut build: impl FnMut(&Schedule, Instruments) -> Result<Rendering, Failure>,
) -> Result<Vec<ablation::Row>, Failure> {
    let mut variants: Vec<_> = ablation::Variant::all().collect();
    variants.sort_by_key(|variant| *variant != ablation::Variant::Baseline);
    let mut plan = |variant: ablation::Variant| -> Result<Schedule, String> {
        let schedule = variant.schedule()?.with_pool_blocks(pool_blocks);
        build(&schedule, Instruments::default()).map_err(|why| why.to_string())?;
        Ok(schedule)
    };
    let planned: Vec<_> = variants.into_iter().map(|variant| (variant, plan(variant))).collect();
    let schedules: Vec<Schedule> = planned.iter().filter_map(|(_, schedule)| schedule.clone().ok()).collect();
    let mut rivals = compare_across_roulettes(source, &schedules, sizes.passes, sizes.ablation_rounds, build)?.into_iter();
    let mut rows = Vec::new();
    for (variant, schedule) in planned {
        let row = match schedule {
            Ok(_) => Ok(rivals.next().ok_or("a variant did not run")?),
            Err(why) => Err(why),
        };
        rows.push((variant, row));
    }
    Ok(rows)
}
