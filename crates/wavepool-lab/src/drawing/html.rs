//! The picture as a page that steps through time.
//!
//! Key decision: the page holds the same SVG as the file and one JSON value beside it; its script moves a mark over the picture and looks
//! words up, so picture and page cannot disagree.
//!
//! **Invariant:** the page asks no network for anything, and no text from outside can end the script it stands in.

use serde_json::{Value, json};

use super::{
    BLOCK, Chart, listed,
    raster::{Raster, base64},
    svg::{Picture, escape},
};

/// Tiles whose live lanes are listed step by step; with more block-steps the page knows shares alone.
const MOST_LISTED: u64 = 100_000;
/// Steps with words about queue and events.
const MOST_IN_WORDS: usize = 2000;
/// Blocks up to which words are of use.
const MOST_BLOCKS_IN_WORDS: u32 = 64;

/// Names of tiles in a line.
const NAMES: usize = 32;

/// A page with the picture of `charts`, a slider over the steps, and what is known about the block under the pointer.
///
/// **Cost:** at most 5 MB per chart.
pub fn html(title: &str, charts: &[Chart]) -> String {
    let picture = Picture::new(title, charts);
    let described: Vec<Value> = charts
        .iter()
        .zip(&picture.panels)
        .map(|(chart, (at, panel))| {
            let scale = &picture.scale;
            let mut value = json!({
                "title": chart.title(),
                "x": at[0] + panel.cells_at[0],
                "y": at[1] + panel.cells_at[1],
                "cell": [scale.width, scale.height],
                "each": [scale.blocks_per_column, scale.steps_per_row],
                "blocks": chart.blocks(),
                "rows": chart.rows().iter().map(|row| [row.live_blocks, row.live_lanes, row.new_blocks, row.launches]).collect::<Vec<_>>(),
            });
            let block_steps: u64 = chart.rows().iter().map(|row| u64::from(row.live_blocks)).sum();
            if block_steps <= MOST_LISTED {
                let spans = chart.spans().iter().map(|span| json!([span.block, span.first, chart.name(span), span.live_lanes]));
                value["spans"] = spans.collect();
            } else {
                let raster = Raster::new(chart, scale);
                let shares = raster.cells.iter().enumerate().map(|(place, cell)| match cell.live_blocks {
                    0 => 255,
                    _ => (raster.alive(place) * 254.0).round() as u8,
                });
                value["columns"] = json!(raster.columns);
                value["shares"] = json!(base64(&shares.collect::<Vec<_>>()));
            }
            if chart.blocks() <= MOST_BLOCKS_IN_WORDS && chart.rows().len() <= MOST_IN_WORDS {
                let words = (0..chart.rows().len() as u32).map(|step| {
                    let queue = listed(chart.queue(step).iter().map(|span| chart.name(span)), NAMES);
                    json!([queue, chart.happened(step, NAMES)])
                });
                value["words"] = words.collect();
            }
            value
        })
        .collect();
    // `<` inside of JSON is only ever part of a string.
    let charts = json!({ "lanes": BLOCK, "charts": described }).to_string().replace('<', "\\u003c");
    let title = escape(title);
    let (style, script, svg) = (include_str!("page.css"), include_str!("page.js"), picture.svg());
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" content=\"width=device-width\"/>\n\
         <title>{title}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<div id=\"controls\">\n\
         <button id=\"first\" title=\"first step (Home)\">|&lt;</button>\n<button id=\"back\" title=\"step back (left arrow)\">&lt;</button>\n\
         <button id=\"play\" title=\"play or pause (space)\">play</button>\n<button id=\"next\" title=\"step (right arrow)\">&gt;</button>\n\
         <button id=\"last\" title=\"last step (End)\">&gt;|</button>\n\
         <input id=\"step\" type=\"range\" min=\"1\" value=\"1\" aria-label=\"step\"/>\n<output id=\"now\"></output>\n\
         <label>speed <select id=\"speed\"><option value=\"2\">2 steps/s</option><option value=\"8\" selected=\"selected\">8 steps/s\
         </option><option value=\"30\">30 steps/s</option><option value=\"240\">240 steps/s</option></select></label>\n\
         <label><input id=\"cover\" type=\"checkbox\"/> hide what is to come</label>\n\
         <span class=\"keys\">keys: \u{2190} \u{2192} step, space play, Home, End</span>\n</div>\n\
         <div id=\"cards\"></div>\n<div id=\"picture\">\n{svg}</div>\n<div id=\"tip\"></div>\n\
         <script id=\"charts\" type=\"application/json\">{charts}</script>\n<script>\n{script}</script>\n</body>\n</html>\n"
    )
}
