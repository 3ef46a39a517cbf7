//! One schedule of a picture: its cells, and beside each step what it launched, how full it was, what waited and what happened.
//!
//! Key decision: all panels of a picture share one scale, so that their steps stand at equal heights. Few cells are shapes with names,
//! many are pixels.

use std::fmt::Write as _;

use super::{
    BLOCK, Chart, color, listed,
    raster::{Raster, base64},
    svg::{escape, text, text_width},
};

/// How cells become shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) blocks_per_column: u32,
    pub(super) steps_per_row: u32,
    /// Pixels instead of shapes.
    pub(super) is_raster: bool,
    /// Names of the queue that are written beside each step; half as many of each kind of event.
    pub(super) names: usize,
}

/// Most cells drawn as shapes, per panel.
const MOST_SHAPES: u64 = 4096;
const MOST_SHAPES_ACROSS: u32 = 64;
/// Most blocks whose queue is written out.
const MOST_BLOCKS_IN_WORDS: u32 = 16;
/// Most pixels of a raster.
pub(super) const MOST_ACROSS: u32 = 512;
pub(super) const MOST_DOWN: u32 = 720;

impl Scale {
    pub(super) fn of(charts: &[Chart]) -> Self {
        let blocks = charts.iter().map(Chart::blocks).max().unwrap_or(1).max(1);
        let steps = charts.iter().map(|chart| chart.rows().len() as u32).max().unwrap_or(1).max(1);
        if u64::from(blocks) * u64::from(steps) <= MOST_SHAPES && blocks <= MOST_SHAPES_ACROSS {
            let lengths = charts.iter().flat_map(|chart| chart.spans().iter().map(|span| chart.name(span).chars().count()));
            let width = (lengths.max().unwrap_or(1) as u32 * 6 + 8).max(20);
            let names = if blocks > MOST_BLOCKS_IN_WORDS { 0 } else { [16, 8][usize::from(charts.len() > 1)] };
            return Scale { width, height: 16, blocks_per_column: 1, steps_per_row: 1, is_raster: false, names };
        }
        let (blocks_per_column, steps_per_row) = (blocks.div_ceil(MOST_ACROSS), steps.div_ceil(MOST_DOWN));
        let fit = |most: u32, count: u32| (most / count).clamp(1, 12);
        let (width, height) = (fit(MOST_ACROSS, blocks.div_ceil(blocks_per_column)), fit(MOST_DOWN, steps.div_ceil(steps_per_row)));
        Scale { width, height, blocks_per_column, steps_per_row, is_raster: true, names: 0 }
    }
}

/// A drawn panel, and where its cells lie within it.
#[derive(Debug)]
pub(super) struct Panel {
    pub(super) body: String,
    pub(super) width: f64,
    pub(super) height: f64,
    /// Upper left corner of the first cell.
    pub(super) cells_at: [f64; 2],
}

/// Height of title, totals and headings.
const HEAD: f64 = 58.0;
/// Room for the numbers of steps.
const LEFT: f64 = 34.0;
/// Width of the bars and of the profile.
const BAR: f64 = 60.0;

pub(super) fn draw(chart: &Chart, scale: &Scale) -> Panel {
    let raster = Raster::new(chart, scale);
    let (across, down) = (f64::from(raster.columns * scale.width), f64::from(raster.rows * scale.height));
    let totals = format!(
        "{} steps, {} launches, {} regenerations; {:.0} % of the lanes in {} alive",
        chart.rows().len(),
        chart.launches(),
        chart.rows().iter().filter(|row| if chart.is_mixed { row.new_lanes > 0 } else { row.new_blocks > 0 }).count(),
        chart.occupancy() * 100.0,
        if chart.is_mixed { "launched work-groups" } else { "live blocks" }
    );
    let mut body = text(0.0, 14.0, "class=\"t\"", chart.title());
    body += &text(0.0, 30.0, "", &totals);
    let heading = format!("{} blocks", chart.blocks());
    body += &text(LEFT, HEAD - 6.0, "class=\"h\"", &heading);
    body += &text(0.0, HEAD - 6.0, "class=\"h\"", "step");
    let beside = LEFT + across + 8.0;
    let end = if scale.is_raster {
        let file = base64(&raster.png(scale.width, scale.height));
        let place = format!("x=\"{LEFT}\" y=\"{HEAD}\" width=\"{across}\" height=\"{down}\"");
        let _ = writeln!(body, "<image {place} image-rendering=\"pixelated\" href=\"data:image/png;base64,{file}\"/>");
        beside_raster(&mut body, chart, scale, &raster, beside.max(LEFT + text_width(&heading) + 8.0))
    } else {
        cells(&mut body, chart, scale);
        beside_cells(&mut body, chart, scale, beside)
    };
    let width = end.max(text_width(&totals)).max(text_width(chart.title()) * 1.25);
    Panel { body, width, height: HEAD + down + 8.0, cells_at: [LEFT, HEAD] }
}

/// The mark of a beginning in a cell of the given width: a line on top, a corner at the left.
pub(super) fn beginning(x: f64, y: f64, width: f64) -> String {
    format!("M{x} {y}h{width}v2h-{}l-4 4h-2z", width - 6.0)
}

fn cells(body: &mut String, chart: &Chart, scale: &Scale) {
    let (width, height) = (f64::from(scale.width), f64::from(scale.height));
    let steps = chart.rows().len() as u32;
    let at = |block: u32, step: u32| (LEFT + f64::from(block) * width, HEAD + f64::from(step) * height);
    let _ = writeln!(
        body,
        "<rect x=\"{LEFT}\" y=\"{HEAD}\" width=\"{}\" height=\"{}\" fill=\"url(#dead)\"/>",
        f64::from(chart.blocks()) * width,
        f64::from(steps) * height
    );
    let mut is_live = vec![false; (chart.blocks() * steps) as usize];
    let (mut labels, mut marks) = (String::new(), String::new());
    for span in chart.spans() {
        let name = escape(&chart.name(span));
        for (step, lanes) in (span.first..steps).zip(&span.live_lanes) {
            let (x, y) = at(span.block, step);
            let fill = color::of_tile(span.tile, f64::from(*lanes) / f64::from(BLOCK));
            let _ = writeln!(
                body,
                "<rect class=\"c\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{}\"/>",
                color::css(fill)
            );
            let (label, x, y) = (color::of_label(fill), x + width / 2.0, y + 12.0);
            let _ = writeln!(labels, "<text x=\"{x}\" y=\"{y}\" fill=\"{label}\">{name}</text>");
            is_live[(step * chart.blocks() + span.block) as usize] = true;
        }
        let (x, y) = at(span.block, span.first);
        marks += &beginning(x, y, width);
    }
    let mut crosses = String::new();
    for place in (0..steps * chart.blocks()).filter(|place| !is_live[*place as usize]) {
        let (x, y) = at(place % chart.blocks(), place / chart.blocks());
        let _ = write!(crosses, "M{} {}l6 6m0 -6l-6 6", x + width / 2.0 - 3.0, y + height / 2.0 - 3.0);
    }
    let _ = writeln!(body, "<path d=\"{crosses}\" stroke=\"#444\" fill=\"none\"/>");
    let _ = writeln!(body, "<path class=\"m\" d=\"{marks}\"/>");
    let _ = writeln!(body, "<g text-anchor=\"middle\">\n{labels}</g>");
}

/// Numbers, bars and words of each step; returns how far they reach.
fn beside_cells(body: &mut String, chart: &Chart, scale: &Scale, from: f64) -> f64 {
    let bars = from + 50.0;
    let queue = bars + BAR + 10.0;
    let steps = 0..chart.rows().len() as u32;
    let waiting = |step: u32| listed(chart.queue(step).iter().map(|span| chart.name(span)), scale.names);
    let longest = |texts: &mut dyn Iterator<Item = f64>| texts.fold(0.0, f64::max);
    let events = queue + longest(&mut steps.clone().map(|step| text_width(&waiting(step)))).max(36.0) + 12.0;
    *body += &text(from, HEAD - 6.0, "class=\"h\"", "launches");
    *body += &text(bars, HEAD - 6.0, "class=\"h\"", "lanes alive");
    if scale.names > 0 {
        *body += &text(queue, HEAD - 6.0, "class=\"h\"", "queue");
        *body += &text(events, HEAD - 6.0, "class=\"h\"", "what happened");
    }
    for (step, row) in (0..).zip(chart.rows()) {
        let y = HEAD + f64::from(step * scale.height);
        *body += &text(LEFT - 6.0, y + 12.0, "text-anchor=\"end\"", &(step + 1).to_string());
        *body += &text(from + 34.0, y + 12.0, "text-anchor=\"end\"", &row.launches.to_string());
        let share = |count: u32, all: u32| f64::from(count) / f64::from(all.max(1)) * BAR;
        let (blocks, lanes) = (share(row.live_blocks, chart.blocks()), share(row.live_lanes, chart.blocks() * BLOCK));
        let top = y + 4.0;
        let _ = writeln!(
            body,
            "<rect x=\"{bars}\" y=\"{top}\" width=\"{BAR}\" height=\"8\" fill=\"url(#dead)\"/><rect x=\"{bars}\" y=\"{top}\" \
             width=\"{blocks:.1}\" height=\"8\" fill=\"#fff\" stroke=\"#000\"/><rect x=\"{bars}\" y=\"{top}\" width=\"{lanes:.1}\" \
             height=\"8\" fill=\"#0072b2\"/>"
        );
        if scale.names > 0 {
            *body += &text(queue, y + 12.0, "", &waiting(step));
            *body += &text(events, y + 12.0, "", &chart.happened(step, scale.names / 2));
        }
    }
    if scale.names == 0 {
        return bars + BAR;
    }
    events + longest(&mut steps.map(|step| text_width(&chart.happened(step, scale.names / 2)))).max(70.0)
}

/// Numbers at some steps and a profile of all of them; returns how far they reach.
fn beside_raster(body: &mut String, chart: &Chart, scale: &Scale, raster: &Raster, from: f64) -> f64 {
    let bars = from + 54.0;
    *body += &text(from, HEAD - 6.0, "class=\"h\"", "launches");
    *body += &text(bars, HEAD - 6.0, "class=\"h\"", "alive, begun");
    let height = f64::from(scale.height);
    let every = (48.0 / height).ceil() as u32;
    let mut launches = 1;
    let (mut lanes_line, mut blocks_line, mut begun) = (format!("M{bars} {HEAD}"), format!("M{bars} {HEAD}"), String::new());
    for (place, rows) in (0..raster.rows).zip(chart.rows().chunks(scale.steps_per_row as usize)) {
        let y = HEAD + f64::from(place) * height;
        launches += rows.iter().map(|row| u64::from(row.launches)).sum::<u64>();
        if place % every == 0 {
            *body += &text(LEFT - 6.0, y + 9.0, "text-anchor=\"end\"", &(place * scale.steps_per_row + 1).to_string());
            *body += &text(from + 46.0, y + 9.0, "text-anchor=\"end\"", &launches.to_string());
        }
        let share = |of: &dyn Fn(&super::Row) -> f64| {
            rows.iter().map(of).sum::<f64>() / (rows.len() as f64 * f64::from(chart.blocks())).max(1.0) * BAR
        };
        let lanes = bars + share(&|row| f64::from(row.live_lanes) / f64::from(BLOCK));
        let blocks = bars + share(&|row| f64::from(row.live_blocks));
        let _ = write!(lanes_line, "H{lanes:.1}v{height}");
        let _ = write!(blocks_line, "H{blocks:.1}v{height}");
        let new = share(&|row| f64::from(row.new_blocks));
        if new > 0.0 {
            let _ = write!(begun, "M{} {}h-{:.1}", bars + BAR, y + height / 2.0, new.max(2.0));
        }
    }
    let down = f64::from(raster.rows) * height;
    let _ = writeln!(body, "<rect x=\"{bars}\" y=\"{HEAD}\" width=\"{BAR}\" height=\"{down}\" fill=\"#f4f4f4\"/>");
    let _ = writeln!(body, "<path d=\"{lanes_line}H{bars}z\" fill=\"#0072b2\"/>");
    let _ = writeln!(body, "<path d=\"{blocks_line}\" fill=\"none\" stroke=\"#000\"/>");
    let _ = writeln!(body, "<path d=\"{begun}\" fill=\"none\" stroke=\"#d55e00\" stroke-width=\"{}\"/>", height.min(3.0));
    bars + BAR
}
