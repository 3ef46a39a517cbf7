//! Pictures against the replay, against the rules of XML, and against their bounds.

use wavepool::{
    ImageTiles, Instruments, LinearRange, Program, Schedule, Scheduler,
    profile::{StepRecord, Steps},
    replay::{Replay, replay},
};

use super::{
    Chart, Error, Pool, check, html, lanes_by_step,
    panel::{MOST_ACROSS, MOST_DOWN, Scale},
    raster::{Raster, base64},
    svg,
    svg::escape,
};

/// The steps that a device would write down.
fn steps_of(seen: &Replay) -> Steps {
    let mut steps: Vec<StepRecord> = seen
        .live_blocks
        .iter()
        .zip(&seen.live_lanes)
        .map(|(live_blocks, live_lanes)| StepRecord {
            live_blocks: *live_blocks,
            launched_blocks: *live_blocks,
            live_lanes: *live_lanes,
            new_blocks: 0,
        })
        .collect();
    seen.assignments.iter().for_each(|assignment| steps[assignment.step as usize - 1].new_blocks += 1);
    Steps { steps, assignments: seen.assignments.clone(), resolved_after: seen.resolved_after.clone() }
}

/// Walks of 1 to `longest` steps; the last tile of every pass is partial.
fn walks(longest: u32, tiles: u32) -> impl Fn(u32, u32, &mut [u32; 256]) {
    move |pass_index, tile, lengths| {
        let mut word = (pass_index * 8191 + tile).wrapping_mul(2_654_435);
        let reach = 1 + (tile * 7 + pass_index) % longest;
        for (place, length) in lengths.iter_mut().enumerate() {
            word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let has_item = tile + 1 < tiles || place < 100;
            *length = if has_item { 1 + (word >> 16) % reach } else { 0 };
        }
    }
}

/// A chart of a replay, and the replay.
fn drawn(schedule: &str, blocks: u32, tiles: u32, passes: u32, longest: u32) -> (Chart, Replay) {
    let schedule: Schedule = schedule.parse().expect("a schedule");
    let lengths = walks(longest, tiles);
    let seen = replay(&schedule, &LinearRange { count: (tiles - 1) * 256 + 100 }, passes, blocks, 4, &lengths);
    let pool = Pool { blocks, banks: 1, stages: 5 };
    let chart = Chart::new(&schedule.to_string(), pool, &steps_of(&seen), &lengths).expect("records agree");
    (chart, seen)
}

const SCHEDULES: [&str; 4] = ["never", "block", "block,threshold=0,check_every=1", "block,order=depth-max"];

/// Kills: a tile that lives a step too long or too short, a beginning marked twice or in the wrong block, lanes of another step.
#[test]
fn the_cells_are_those_of_the_replay() {
    for schedule in SCHEDULES {
        let (chart, seen) = drawn(schedule, 8, 16, 3, 12);
        let raster = Raster::new(&chart, &Scale::of(std::slice::from_ref(&chart)));
        assert_eq!((raster.columns, raster.rows as usize), (8, seen.live_blocks.len()), "{schedule}");
        for (step, cells) in raster.cells.chunks(8).enumerate() {
            let alive = cells.iter().filter(|cell| cell.live_blocks > 0).count() as u32;
            assert_eq!(alive, seen.live_blocks[step], "{schedule}, step {step}");
            assert_eq!(cells.iter().map(|cell| cell.live_lanes).sum::<u64>(), u64::from(seen.live_lanes[step]), "{schedule}, step {step}");
        }
        for assignment in &seen.assignments {
            let cell = &raster.cells[((assignment.step - 1) * 8 + assignment.block) as usize];
            assert_eq!((cell.beginnings, cell.tile), (1, assignment.tile), "{schedule}: {assignment:?}");
        }
        let beginnings: u32 = raster.cells.iter().map(|cell| cell.beginnings).sum();
        assert_eq!(beginnings as usize, seen.assignments.len(), "{schedule}");
        let text = svg("", std::slice::from_ref(&chart));
        assert_eq!(text.matches("class=\"c\"").count() as u64, seen.block_steps(), "{schedule}: live cells");
        let marks = text.split("class=\"m\" d=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("marks");
        assert_eq!(marks.matches('M').count(), seen.assignments.len(), "{schedule}: marks");
    }
}

/// Kills: lengths of another run drawn all the same; a megakernel that becomes an empty picture.
#[test]
fn what_was_not_recorded_is_refused() {
    let (_, seen) = drawn("block", 8, 16, 1, 12);
    let pool = Pool { blocks: 8, banks: 1, stages: 5 };
    let refused = Chart::new("", pool, &steps_of(&seen), &walks(11, 16)).expect_err("lengths of another run");
    assert!(matches!(refused, Error::Contradiction { step: 1..=12, .. }), "{refused}");
    let text = check(&Schedule::megakernel()).expect_err("no steps").to_string();
    assert!(text.contains("megakernel") && text.contains("steps"), "{text}");
    assert_eq!(check(&Schedule::never()), Ok(()));
}

/// Kills: a launch of a bank without a live block counted; a beginning, a tick or a resolve left out.
#[test]
fn launches_are_counted_by_bank() {
    let schedule = Schedule::never();
    let lengths = |_: u32, tile: u32, lengths: &mut [u32; 256]| lengths.fill([2, 1, 1, 1][tile as usize]);
    let seen = replay(&schedule, &LinearRange { count: 4 * 256 }, 1, 4, 2, &lengths);
    let launches = |banks| {
        let chart = Chart::new("", Pool { blocks: 4, banks, stages: 5 }, &steps_of(&seen), &lengths).expect("records agree");
        (chart.rows().iter().map(|row| row.launches).collect::<Vec<_>>(), chart.launches())
    };
    assert_eq!(launches(1), (vec![1 + 5 + 1, 5 + 1 + 1], 15));
    assert_eq!(launches(2), (vec![2 + 10 + 1, 5 + 1 + 1], 21));
}

/// Kills: an off-by-one in how long a walk lives.
#[test]
fn a_walk_of_n_steps_is_alive_in_n_steps() {
    let mut lengths = [0; 256];
    lengths[..6].copy_from_slice(&[1, 1, 1, 2, 4, 4]);
    assert_eq!(lanes_by_step(&lengths), [6, 3, 2, 2]);
    assert_eq!(lanes_by_step(&[0; 256]), [0; 0]);
    assert_eq!(lanes_by_step(&[1; 256]), [256]);
}

/// Kills: a queue that holds what runs already, an event told a step late, a name that two tiles share.
#[test]
fn the_words_are_those_of_the_worked_example() {
    let depths = [3, 1, 1, 2];
    let lengths = move |_: u32, tile: u32, lengths: &mut [u32; 256]| lengths.fill(depths[tile as usize]);
    let schedule: Schedule = "block,threshold=0,check_every=1".parse().expect("a schedule");
    let pool = Pool { blocks: 2, banks: 1, stages: 1 };
    let words = |passes| {
        let seen = replay(&schedule, &LinearRange { count: 4 * 256 }, passes, 2, 2, &lengths);
        let chart = Chart::new("", pool, &steps_of(&seen), &lengths).expect("records agree");
        let names = |spans: &[super::Span]| spans.iter().map(|span| chart.name(span)).collect::<Vec<_>>().join(" ");
        (0..chart.rows().len() as u32).map(|step| (names(chart.queue(step)), chart.happened(step, 8))).collect::<Vec<_>>()
    };
    let told: Vec<_> =
        [("2 3", "first fill"), ("3", "died: 1; begin: 2"), ("", "died: 2; begin: 3; none left"), ("", "died: 0")].into_iter().collect();
    assert_eq!(words(1), told.into_iter().map(|(queue, event)| (queue.to_owned(), event.to_owned())).collect::<Vec<_>>());
    assert_eq!(words(2)[0].0, "2₀ 3₀ 0₁ 1₁ 2₁ 3₁");
}

/// Every tag closes in order; returns how many there are. Texts of scripts and styles are no tags.
pub(super) fn balanced(text: &str) -> usize {
    let (mut open, mut tags, mut rest) = (Vec::new(), 0, text);
    while let Some(start) = rest.find('<') {
        let outside = &rest[..start];
        assert!(!outside.contains('>'), "a stray > near {outside:?}");
        let end = rest.find('>').expect("a tag ends");
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        assert!(!tag.contains('<') && tag.matches('"').count() % 2 == 0, "{tag}");
        tags += 1;
        let name = tag.split_whitespace().next().unwrap_or_default();
        match name.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop(), Some(name), "closed in order"),
            None if tag.starts_with('!') || tag.ends_with('/') => {}
            None => open.push(name),
        }
        if matches!(name, "script" | "style") {
            rest = &rest[rest.find(&format!("</{name}>")).expect("it ends")..];
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
    tags
}

/// Kills: a name that opens a tag, ends an attribute or ends the script; an unclosed element.
#[test]
fn names_cannot_become_markup() {
    let nasty = "</script><b a=\"'&\u{1}";
    let (mut chart, _) = drawn("block", 8, 16, 2, 12);
    let plain = [balanced(&svg("", std::slice::from_ref(&chart))), balanced(&html("", std::slice::from_ref(&chart)))];
    chart.title = nasty.into();
    let charts = [chart];
    let (still, page) = (svg(nasty, &charts), html(nasty, &charts));
    // The title of the picture is the only element more.
    assert_eq!([balanced(&still), balanced(&page)], plain.map(|tags| tags + 2));
    assert!(still.contains("&lt;/script&gt;&lt;b a=&quot;&#39;&amp; "), "{}", escape(nasty));
    assert_eq!(page.matches("</script>").count(), 2);
    assert!(still.starts_with("<svg ") && page.starts_with("<!DOCTYPE html>"));
    assert!(!page.contains("http://") || page.matches("http://").count() == page.matches("http://www.w3.org/2000/svg").count());
    assert!(!page.contains("https://") && !page.contains("src="), "nothing is fetched");
}

/// Kills: a file that grows with the numbers of blocks and steps, cells lost where pixels stand for several, labels too small to read.
#[test]
fn many_cells_become_few_pixels() {
    let (chart, seen) = drawn("block,threshold=0,check_every=1", 4096, 8192, 2, 700);
    let steps = seen.live_blocks.len();
    assert!(steps >= 1000, "{steps}");
    let charts = [chart.clone(), chart.clone()];
    let scale = Scale::of(&charts);
    assert!(scale.is_raster && scale.blocks_per_column == 8, "{scale:?}");
    let raster = Raster::new(&chart, &scale);
    assert!(raster.columns * scale.width <= MOST_ACROSS && raster.rows * scale.height <= MOST_DOWN);
    assert_eq!(raster.cells.iter().map(|cell| cell.live_lanes).sum::<u64>(), seen.lane_steps());
    assert_eq!(raster.cells.iter().map(|cell| u64::from(cell.live_blocks)).sum::<u64>(), seen.block_steps());
    let (still, page) = (svg("many", &charts), html("many", &charts));
    balanced(&still);
    balanced(&page);
    assert!(still.len() < 4_000_000 && page.len() < 10_000_000, "{} and {} bytes", still.len(), page.len());
    assert!(still.matches("<text").count() < 200, "labels");
}

/// Kills: a size of nothing that divides by zero.
#[test]
fn nothing_is_drawn_as_nothing() {
    let pool = Pool { blocks: 0, banks: 0, stages: 0 };
    let nothing = Chart::new("", pool, &Steps::default(), &walks(1, 1)).expect("empty");
    balanced(&svg("", std::slice::from_ref(&nothing)));
    balanced(&html("", &[nothing]));
    balanced(&html("", &[]));
}

/// Kills: a wrong digit or a missing filler. **Source:** RFC 4648, section 10.
#[test]
fn base64_is_that_of_the_rfc() {
    for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")] {
        assert_eq!(base64(bytes.as_bytes()), text);
    }
}

const KEYED_WALK: &str = "
struct Walk { left: u32, sum: u32 }
fn generate(w: ptr<function, Walk>, item: Item) { (*w).left = 1u + (item.pixel * 7u + item.sample * 5u) % 9u; }
fn look(w: ptr<function, Walk>) { (*w).sum += (*w).left; }
fn queue_key(w: ptr<function, Walk>) -> u32 { return (*w).left; }
fn hop(w: ptr<function, Walk>) -> u32 {
    (*w).left -= 1u;
    if ((*w).left == 0u) { return FINISH; }
    return CONTINUE;
}
fn finish(w: ptr<function, Walk>) -> u32 { return (*w).sum; }";

/// Kills: lanes of one step drawn in another; a launch that a row forgets (queues by key, a second bank); a place of a list taken for a lane of a
/// block; a picture of other lengths than the run's.
#[test]
fn lanes_of_several_tiles_add_up_to_the_run() {
    crate::conformance::run(|gpu| {
        let words = |error: &dyn std::fmt::Display| error.to_string();
        let program =
            Program::builder("walk").source("walk.wgsl", KEYED_WALK).stage("look").stage("hop").build().map_err(|error| words(&error))?;
        let source = ImageTiles { width: 40, height: 56 };
        let instruments = Instruments { steps: true, lengths: true, ..Instruments::default() };
        for (text, banks) in [("per-lane", 5), ("per-lane,check_every=3,launch=full", 2), ("compaction,every=2", 2), ("keyed", 3)] {
            let schedule: Schedule = text.parse().expect("a schedule");
            let schedule = schedule.with_pool_blocks(5).with_bank_blocks(banks);
            check(&schedule).expect("there are steps to draw");
            let builder = Scheduler::builder(&program, source).schedule(&schedule).instruments(instruments);
            let (_, mut report) = builder.build_on(gpu).and_then(|mut scheduler| scheduler.run(3)).map_err(|error| words(&error))?;
            let chart = Chart::of_items(&report, 2, &schedule, &source).map_err(|error| format!("{text}: {error}"))?;
            assert_eq!((chart.launches(), chart.rows().len() as u64), (report.launches, report.steps), "{text}");
            let drawn: u64 = chart.spans().iter().flat_map(|span| &span.live_lanes).map(|lanes| u64::from(*lanes)).sum();
            assert_eq!(drawn, report.lane_steps, "{text}");
            assert_eq!(chart.rows().iter().map(|row| u64::from(row.live_blocks)).sum::<u64>(), report.group_steps, "{text}");
            assert!(chart.spans().iter().all(|span| span.block < 5 && span.live_lanes.iter().all(|lanes| (1..=256).contains(lanes))));
            assert!(svg("made up", std::slice::from_ref(&chart)).contains("lanes take items"), "{text}");
            if let Some(steps) = &mut report.observed.steps {
                steps.steps[2].live_lanes += 1;
            }
            let contradiction = Chart::of_items(&report, 2, &schedule, &source);
            assert!(matches!(contradiction, Err(Error::Contradiction { step: 3, .. })), "{text}: {contradiction:?}");
        }
        Ok(())
    });
    assert!(check(&Schedule::auto()).expect_err("several schedules").to_string().contains("take turns"));
}
