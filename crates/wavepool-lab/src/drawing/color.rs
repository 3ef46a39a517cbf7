//! Colours that stay apart for readers with any colour vision.
//!
//! Key decision: the hue says which tile, the lightness how many of its lanes live, and what must not be missed (a beginning, a dead
//! block) has a mark or a pattern besides.
//! Source: Okabe and Ito, *Color Universal Design*, 2008.

/// Red, green, blue, 0 to 255.
pub(super) type Rgb = [u8; 3];

/// The palette without its black.
const HUES: [Rgb; 7] = [[230, 159, 0], [86, 180, 233], [0, 158, 115], [240, 228, 66], [0, 114, 178], [213, 94, 0], [204, 121, 167]];
const WHITE: Rgb = [255; 3];
const BLACK: Rgb = [0; 3];
/// Shades of a tile; few, so that raster pictures stay small.
const SHADES: f64 = 16.0;
/// How far a tile with a single live lane is from white.
const FAINTEST: f64 = 0.18;
/// The two greys of a dead block.
pub(super) const DEAD: [Rgb; 2] = [[218; 3], [140; 3]];

fn mix(from: Rgb, to: Rgb, share: f64) -> Rgb {
    [0, 1, 2].map(|channel| (f64::from(from[channel]) + (f64::from(to[channel]) - f64::from(from[channel])) * share).round() as u8)
}

/// A tile with this share of its lanes alive.
pub(super) fn of_tile(tile: u32, alive: f64) -> Rgb {
    let hues = HUES.len() as u32;
    let full = mix(HUES[(tile % hues) as usize], BLACK, f64::from(tile / hues % 3) * 0.22);
    let share = (alive * SHADES).ceil() / SHADES;
    mix(WHITE, full, FAINTEST + (1.0 - FAINTEST) * share)
}

/// Many tiles at once, with this share of all their lanes alive.
pub(super) fn of_share(alive: f64) -> Rgb {
    let share = (alive * SHADES * 2.0).ceil() / (SHADES * 2.0);
    if share < 0.5 { mix(WHITE, HUES[4], 0.1 + 1.8 * share) } else { mix(HUES[4], BLACK, share * 1.6 - 0.8) }
}

/// Where a tile begins and no mark fits.
pub(super) fn of_beginning(color: Rgb) -> Rgb {
    mix(color, BLACK, 0.7)
}

/// Black or white, whichever can be read on it.
pub(super) fn of_label(color: Rgb) -> &'static str {
    let linear = color.map(|value| (f64::from(value) / 255.0).powf(2.2));
    if 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] > 0.18 { "#000" } else { "#fff" }
}

/// The backgrounds of a chart, by day and by night.
pub(super) const PAPER: [Rgb; 2] = [WHITE, [20, 23, 28]];
/// Hues of lines, those that differ most first; a grey is among them.
pub(super) const LINES: [Rgb; 8] = [HUES[4], HUES[5], HUES[2], HUES[6], HUES[0], HUES[1], [120; 3], HUES[3]];
/// What a line needs to be seen. **Source:** Web Content Accessibility Guidelines 2.1, criterion 1.4.11.
const SEEN: f64 = 3.0;

/// Of a line, by day and by night: its hue, as much darker or lighter as it needs to be seen.
pub(super) fn of_line(index: usize) -> [Rgb; 2] {
    let hue = LINES[index % LINES.len()];
    [(PAPER[0], BLACK), (PAPER[1], WHITE)].map(|(paper, ink)| {
        let shades = (0..=20).map(|shade| mix(hue, ink, f64::from(shade) / 20.0));
        shades.into_iter().find(|color| contrast(*color, paper) >= SEEN).unwrap_or(ink)
    })
}

/// How well two colours are told apart, 1 to 21. **Source:** Web Content Accessibility Guidelines 2.1, definitions.
pub(super) fn contrast(one: Rgb, other: Rgb) -> f64 {
    let luminance = |color: Rgb| {
        let linear =
            color.map(|value| f64::from(value) / 255.0).map(|v| if v <= 0.03928 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] + 0.05
    };
    let ratio = luminance(one) / luminance(other);
    ratio.max(1.0 / ratio)
}

/// As in CSS.
pub(super) fn css([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
