//! A picture of schedules side by side, as SVG.
//!
//! Key decision: the text is written by hand, since it is a handful of shapes; whatever comes from outside goes through [`escape`].
//!
//! **Invariant:** the size of the file is bounded, whatever the numbers of blocks and steps: more cells become pixels, more pixels stand
//! for several cells.

use super::{
    Chart, color,
    panel::{Panel, Scale, beginning, draw},
};

/// Between and around panels.
pub(super) const GAP: f64 = 24.0;
/// Height of the picture's title.
const TITLE: f64 = 40.0;
/// Height of the legend.
const LEGEND: f64 = 84.0;
/// Width of a letter of the font, generously.
const LETTER: f64 = 6.4;

/// A picture of `charts` side by side under a title, as a file. The title may have a second line, which is set smaller.
///
/// **Cost:** at most 2 MB per chart.
pub fn svg(title: &str, charts: &[Chart]) -> String {
    Picture::new(title, charts).svg()
}

/// The panels of a picture with their places.
#[derive(Debug)]
pub(super) struct Picture<'a> {
    title: &'a str,
    pub(super) scale: Scale,
    pub(super) panels: Vec<([f64; 2], Panel)>,
    pub(super) size: [f64; 2],
}

impl<'a> Picture<'a> {
    pub(super) fn new(title: &'a str, charts: &[Chart]) -> Self {
        let scale = Scale::of(charts);
        let mut x = GAP;
        let panels: Vec<_> = charts
            .iter()
            .map(|chart| {
                let panel = draw(chart, &scale);
                let at = [x, TITLE + GAP / 2.0];
                x += panel.width + GAP * 1.5;
                (at, panel)
            })
            .collect();
        let (first, second) = title.split_once('\n').unwrap_or((title, ""));
        let title_width = (text_width(first) * 1.4).max(text_width(second));
        let height = panels.iter().map(|(_, panel)| panel.height).fold(0.0, f64::max);
        let width = x.max(title_width + 2.0 * GAP).max(560.0);
        Picture { title, scale, panels, size: [width.ceil(), (TITLE + GAP / 2.0 + height + LEGEND).ceil()] }
    }

    pub(super) fn svg(&self) -> String {
        let [width, height] = self.size;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"DejaVu Sans, Verdana, sans-serif\" font-size=\"10\">\n<title>{}</title>\n<style>.t{{font-size:12px;\
             font-weight:bold}}.h{{fill:#555}}.c{{stroke:#fff;stroke-width:.5}}.m{{fill:#000}}</style>\n<defs><pattern id=\"dead\" \
             width=\"5\" height=\"5\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\"><rect width=\"5\" height=\"5\" \
             fill=\"{}\"/><path d=\"M0 0h5\" stroke=\"{}\"/></pattern></defs>\n<rect width=\"{width}\" height=\"{height}\" \
             fill=\"#fff\"/>\n",
            escape(self.title),
            color::css(color::DEAD[0]),
            color::css(color::DEAD[1]),
        );
        let (first, second) = self.title.split_once('\n').unwrap_or((self.title, ""));
        out += &text(GAP, 22.0, "font-size=\"14\"", first);
        out += &text(GAP, 38.0, "", second);
        for ([x, y], panel) in &self.panels {
            out += &format!("<g transform=\"translate({x} {y})\">\n{}</g>\n", panel.body);
        }
        out += &self.legend();
        out += "</svg>\n";
        out
    }

    fn legend(&self) -> String {
        let y = self.size[1] - LEGEND + 16.0;
        let mut out = String::from("<g>\n");
        let mut x = GAP;
        let mut entry = |shape: &dyn Fn(f64) -> String, words: &str| {
            out += &shape(x);
            out += &text(x + 26.0, y + 12.0, "", words);
            x += 26.0 + text_width(words) + 18.0;
        };
        let cell = |x: f64, y: f64, fill: &str| format!("<rect x=\"{x}\" y=\"{y}\" width=\"20\" height=\"16\" fill=\"{fill}\"/>\n");
        let is_exact = !self.scale.is_raster || (self.scale.blocks_per_column, self.scale.steps_per_row) == (1, 1);
        let shade = |alive: f64| color::css(if is_exact { color::of_tile(1, alive) } else { color::of_share(alive) });
        entry(&|x| cell(x, y, &shade(1.0)), "all lanes alive");
        entry(&|x| cell(x, y, &shade(0.5)), "half");
        entry(&|x| cell(x, y, &shade(0.004)), "few");
        entry(&|x| cell(x, y, "url(#dead)"), if self.scale.is_raster { "no block lives" } else { "\u{d7} dead block" });
        if is_exact {
            let mark = |x: f64| {
                let mark = if self.scale.is_raster { format!("M{x} {y}h20v3h-20z") } else { beginning(x, y, 20.0) };
                format!("{}<path class=\"m\" d=\"{mark}\"/>\n", cell(x, y, &shade(1.0)))
            };
            entry(&mark, "a tile begins (black on top)");
        }
        let words = match self.scale {
            Scale { is_raster: false, .. } => {
                "Colour: tile. Bars: blue, lanes alive of the pool; outlined, live blocks; hatched, dead ones.".into()
            }
            Scale { blocks_per_column: 1, steps_per_row: 1, .. } => "Colour: tile.".into(),
            Scale { blocks_per_column, steps_per_row, .. } => {
                format!(
                    "A pixel stands for {blocks_per_column} block(s) in {steps_per_row} step(s); its shade for the share of lanes alive."
                )
            }
        };
        out += &text(GAP, y + 34.0, "", &words);
        if self.scale.is_raster {
            let words = "Profile: blue, lanes alive of the pool; black line, live blocks; orange from the right, blocks that begin a tile. \
                         Launches: sum so far.";
            out += &text(GAP, y + 50.0, "", words);
        }
        out + "</g>\n"
    }
}

/// A line of text.
pub(super) fn text(x: f64, y: f64, attributes: &str, words: &str) -> String {
    if words.is_empty() {
        return String::new();
    }
    let space = if attributes.is_empty() { "" } else { " " };
    format!("<text x=\"{x}\" y=\"{y}\"{space}{attributes}>{}</text>\n", escape(words))
}

/// About how wide a line of text is.
pub(super) fn text_width(words: &str) -> f64 {
    let width = |c: char| match c {
        ' ' => LETTER / 2.0,
        '\u{2080}'..='\u{2089}' => LETTER * 0.7,
        _ => LETTER,
    };
    words.chars().map(width).sum()
}

/// Text for SVG and HTML, inside and outside of attributes; characters that XML forbids become spaces.
pub(super) fn escape(words: &str) -> String {
    let mut out = String::with_capacity(words.len());
    for c in words.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
