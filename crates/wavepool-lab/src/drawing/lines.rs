//! Lines over an axis, with intervals, in panels side by side, as SVG.
//!
//! Key decision: a line is told by its colour, its mark and its place in the legend, the same in all panels. Lines that coincide take turns
//! along their way, so that none hides another. The picture has its own paper, by day and by night, whatever page it stands on.
//!
//! **Invariant:** what is not a finite number has no place, and is left out of the picture.

use std::fmt::Write as _;

use super::{
    axis::Axis,
    color,
    svg::{GAP, escape, text, text_width},
};
use crate::Interval;

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Which of the legend's names it belongs to.
    pub series: usize,
    /// Where and what, from left to right; an interval without width has no bar.
    pub points: Vec<(f64, Interval)>,
}

/// Lines over the same axes.
#[derive(Clone, Debug, PartialEq)]
pub struct LinePanel {
    /// What is shown.
    pub title: String,
    /// Across.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// The lines.
    pub lines: Vec<Line>,
}

/// A panel without its labels.
const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 300.0;
/// Room for the numbers of an axis and its name.
const LEFT: f64 = 62.0;
const BELOW: f64 = 46.0;
/// Title, second line and titles of the panels.
const HEAD: f64 = 78.0;
/// A line of the legend.
const ROW: f64 = 22.0;
/// Text of axes and legend, against that of the other pictures.
const LARGER: f64 = 1.2;
/// Half a mark.
const MARK: f64 = 4.2;
/// From the ends of the axis across to the first and the last place on it.
const INSET: f64 = 16.0;
/// From one line to the next, across, and from the first to the last of many: bars of neighbours must not hide each other.
const ASIDE: f64 = 3.0;
const MOST_ASIDE: f64 = 20.0;
/// A dash of lines that coincide.
const DASH: usize = 7;

/// A picture of panels side by side under a title, which may have a second line, with the names of the lines below.
pub fn lines(title: &str, series: &[String], panels: &[LinePanel]) -> String {
    let width = (GAP + panels.len() as f64 * (LEFT + WIDTH + GAP)).max(560.0);
    let (legend, rows) = legend(series, width, HEAD + HEIGHT + BELOW + GAP);
    let height = HEAD + HEIGHT + BELOW + GAP / 2.0 + rows as f64 * ROW + GAP / 2.0;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"DejaVu Sans, Verdana, sans-serif\" font-size=\"12\">\n<title>{}</title>\n<style>{}</style>\n\
         <rect width=\"{width}\" height=\"{height}\" class=\"paper\"/>\n",
        escape(title),
        style(series.len()),
    );
    let (first, second) = title.split_once('\n').unwrap_or((title, ""));
    out += &text(GAP, 26.0, "class=\"ink\" font-size=\"16\" font-weight=\"bold\"", first);
    out += &text(GAP, 44.0, "class=\"soft\"", second);
    for (index, panel) in panels.iter().enumerate() {
        let x = GAP + LEFT + index as f64 * (LEFT + WIDTH + GAP);
        let _ = write!(out, "<g transform=\"translate({x} {HEAD})\">\n{}</g>\n", draw(panel, series.len()));
    }
    out + &legend + "</svg>\n"
}

/// Colours by day and by night.
fn style(series: usize) -> String {
    let of = |time: usize, [ink, soft, grid]: [&str; 3]| {
        let paper = color::css(color::PAPER[time]);
        let mut rules =
            format!(".paper{{fill:{paper}}}.ink{{fill:{ink}}}.soft{{fill:{soft}}}.grid{{stroke:{grid}}}.edge{{stroke:{soft};fill:none}}");
        for index in 0..series {
            let color = color::css(color::of_line(index)[time]);
            let fill = if is_second_round(index) { &paper } else { &color };
            let _ = write!(rules, ".s{index}{{fill:{fill};stroke:{color}}}");
        }
        rules
    };
    let (day, night) = (of(0, ["#1f2328", "#57606a", "#dde1e6"]), of(1, ["#e6e8eb", "#a3abb6", "#343a43"]));
    format!(
        "{day}@media (prefers-color-scheme:dark){{{night}}}.line{{fill:none;stroke-width:2;stroke-linejoin:round}}.bar{{stroke-width:1.2}}.mark{{stroke-width:1}}"
    )
}

/// True for lines beyond the first of each colour: these are dotted, and their marks are hollow.
fn is_second_round(series: usize) -> bool {
    series / color::LINES.len() % 2 == 1
}

/// A number for the file, in tenths.
fn tenths(value: f64) -> f64 {
    (value * 10.0).round() / 10.0 + 0.0
}

fn draw(panel: &LinePanel, series: usize) -> String {
    let mut out = text(0.0, -10.0, "class=\"ink\" font-weight=\"bold\"", &panel.title);
    for (tick, words) in panel.x.ticks() {
        let Some(x) = across(panel, tick).map(tenths) else { continue };
        let _ = writeln!(out, "<path class=\"grid\" d=\"M{x} 0V{HEIGHT}\"/>");
        out += &text(x, HEIGHT + 17.0, "class=\"soft\" text-anchor=\"middle\"", &words);
    }
    for (tick, words) in panel.y.ticks() {
        let Some(y) = panel.y.place(tick).map(|share| tenths((1.0 - share) * HEIGHT)) else { continue };
        let _ = writeln!(out, "<path class=\"grid\" d=\"M0 {y}H{WIDTH}\"/>");
        out += &text(-7.0, y + 4.0, "class=\"soft\" text-anchor=\"end\"", &words);
    }
    let _ = writeln!(out, "<path class=\"edge\" d=\"M0 0V{HEIGHT}H{WIDTH}\"/>");
    out += &text(WIDTH / 2.0, HEIGHT + 38.0, "class=\"ink\" text-anchor=\"middle\"", panel.x.label());
    let sideways = format!("class=\"ink\" text-anchor=\"middle\" transform=\"translate({} {}) rotate(-90)\"", -LEFT + 14.0, HEIGHT / 2.0);
    out += &text(0.0, 0.0, &sideways, panel.y.label());

    let placed: Vec<(usize, Vec<Placed>)> = panel.lines.iter().map(|line| (line.series, place(panel, line))).collect();
    let mut marks = String::new();
    let apart = ASIDE.min(MOST_ASIDE / (series as f64 - 1.0).max(1.0));
    for (index, (own, points)) in placed.iter().enumerate() {
        let alike: Vec<usize> = (0..placed.len()).filter(|other| placed[*other].1 == *points).collect();
        let aside = (*own as f64 - (series as f64 - 1.0) / 2.0) * apart;
        let turn = alike.iter().position(|other| *other == index).unwrap_or_default();
        // Lines that coincide share their way; the others stand aside from each other.
        let is_shared = alike.len() > 1;
        let dash = match is_shared {
            true => format!(" stroke-dasharray=\"{DASH} {}\" stroke-dashoffset=\"-{}\"", DASH * (alike.len() - 1), DASH * turn),
            false => dots(*own).to_owned(),
        };
        let shift = if is_shared { 0.0 } else { aside };
        let steps = points.iter().map(|point| format!("{} {}", tenths(point.x + shift), tenths(point.y)));
        let way = steps.collect::<Vec<_>>().join("L");
        if points.len() > 1 {
            let _ = writeln!(out, "<path class=\"s{own} line\"{dash} d=\"M{way}\"/>");
        }
        for point in points {
            let x = point.x + aside;
            if let Some([low, high]) = point.bar {
                let (low, high, left, right) = (tenths(low), tenths(high), tenths(x - 3.0), tenths(x + 3.0));
                let _ = writeln!(
                    marks,
                    "<path class=\"s{own} bar\" d=\"M{} {low}V{high}M{left} {low}H{right}M{left} {high}H{right}\"/>",
                    tenths(x)
                );
            }
            let y = if is_shared { height_at(points, x) } else { point.y };
            let _ = writeln!(marks, "<path class=\"s{own} mark\" d=\"{}\"/>", mark(*own, x, y));
        }
    }
    out + &marks
}

fn dots(series: usize) -> &'static str {
    if is_second_round(series) { " stroke-dasharray=\"2 3\"" } else { "" }
}

/// A point in the panel.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Placed {
    x: f64,
    y: f64,
    /// Lower and upper end of the interval, as heights.
    bar: Option<[f64; 2]>,
}

/// Where a value lies across a panel.
fn across(panel: &LinePanel, value: f64) -> Option<f64> {
    panel.x.place(value).map(|share| INSET + share * (WIDTH - 2.0 * INSET))
}

fn place(panel: &LinePanel, line: &Line) -> Vec<Placed> {
    let height = |value: f64| panel.y.place(value).map(|share| (1.0 - share.clamp(0.0, 1.0)) * HEIGHT);
    let placed = line.points.iter().filter_map(|(x, value)| {
        let bar = height(value.low).zip(height(value.high)).filter(|(low, high)| low != high).map(|(low, high)| [low, high]);
        Some(Placed { x: across(panel, *x)?, y: height(value.value)?, bar })
    });
    placed.collect()
}

/// Where the way through `points` passes `x`; beyond its ends as high as these.
fn height_at(points: &[Placed], x: f64) -> f64 {
    let after = points.partition_point(|point| point.x <= x);
    match (after.checked_sub(1).and_then(|before| points.get(before)), points.get(after)) {
        (Some(before), Some(after)) => before.y + (after.y - before.y) * (x - before.x) / (after.x - before.x),
        (Some(end), None) | (None, Some(end)) => end.y,
        (None, None) => 0.0,
    }
}

/// The mark of a line around a point.
fn mark(series: usize, x: f64, y: f64) -> String {
    let corners = |corners: &[(f64, f64)]| {
        let places = corners.iter().map(|(right, down)| format!("{} {}", tenths(x + right * MARK), tenths(y + down * MARK)));
        format!("M{}Z", places.collect::<Vec<_>>().join("L"))
    };
    const THIN: f64 = 0.33;
    match series % color::LINES.len() {
        0 => format!("M{} {}a{MARK} {MARK} 0 1 0 {} 0a{MARK} {MARK} 0 1 0 -{} 0Z", tenths(x - MARK), tenths(y), 2.0 * MARK, 2.0 * MARK),
        1 => corners(&[(-0.85, -0.85), (0.85, -0.85), (0.85, 0.85), (-0.85, 0.85)]),
        2 => corners(&[(0.0, -1.15), (1.1, 0.85), (-1.1, 0.85)]),
        3 => corners(&[(0.0, -1.3), (1.1, 0.0), (0.0, 1.3), (-1.1, 0.0)]),
        4 => corners(&[(0.0, 1.15), (1.1, -0.85), (-1.1, -0.85)]),
        5 => corners(&[
            (-THIN, -1.2),
            (THIN, -1.2),
            (THIN, -THIN),
            (1.2, -THIN),
            (1.2, THIN),
            (THIN, THIN),
            (THIN, 1.2),
            (-THIN, 1.2),
            (-THIN, THIN),
            (-1.2, THIN),
            (-1.2, -THIN),
            (-THIN, -THIN),
        ]),
        6 => corners(&[
            (0.0, -0.4),
            (0.8, -1.2),
            (1.2, -0.8),
            (0.4, 0.0),
            (1.2, 0.8),
            (0.8, 1.2),
            (0.0, 0.4),
            (-0.8, 1.2),
            (-1.2, 0.8),
            (-0.4, 0.0),
            (-1.2, -0.8),
            (-0.8, -1.2),
        ]),
        _ => corners(&[(-0.6, -1.0), (0.6, -1.0), (1.15, 0.0), (0.6, 1.0), (-0.6, 1.0), (-1.15, 0.0)]),
    }
}

/// Names of the lines from `y` on, and how many rows they take.
fn legend(series: &[String], width: f64, y: f64) -> (String, usize) {
    let (mut x, mut row) = (GAP, 0);
    let mut out = String::new();
    for (index, name) in series.iter().enumerate() {
        let wide = 34.0 + text_width(name) * LARGER + 20.0;
        if x > GAP && x + wide > width {
            (x, row) = (GAP, row + 1);
        }
        let middle = y + row as f64 * ROW;
        let _ = writeln!(out, "<path class=\"s{index} line\"{} d=\"M{} {middle}h26\"/>", dots(index), tenths(x));
        let _ = writeln!(out, "<path class=\"s{index} mark\" d=\"{}\"/>", mark(index, x + 13.0, middle));
        out += &text(tenths(x + 34.0), middle + 4.0, "class=\"ink\"", name);
        x += wide;
    }
    (out, row + usize::from(!series.is_empty()))
}

#[cfg(test)]
mod tests {
    use super::{
        super::{AxisScale, tests::balanced},
        *,
    };

    fn exact(value: f64) -> Interval {
        Interval { value, low: value, high: value }
    }

    fn panel(lines: Vec<Line>) -> LinePanel {
        let x = Axis::covering("maximum depth", AxisScale::Log2, [2.0, 128.0]);
        LinePanel { title: "speed".into(), x, y: Axis::covering("Mwalks/s", AxisScale::Log, [0.1, 10.0]), lines }
    }

    fn names(count: usize) -> Vec<String> {
        (0..count).map(|index| format!("schedule {index}")).collect()
    }

    /// Kills: a point beside its value, an axis drawn the wrong way, a bar where nothing is uncertain, a bar of another point.
    #[test]
    fn points_stand_where_their_values_are() {
        let points = vec![(2.0, exact(10.0)), (16.0, Interval { value: 1.0, low: 0.1, high: 10.0 }), (128.0, exact(0.1))];
        let text = lines("t", &names(1), &[panel(vec![Line { series: 0, points }])]);
        assert!(
            text.contains(&format!("class=\"s0 line\" d=\"M{INSET} 0L{} {}L{} {HEIGHT}\"", WIDTH / 2.0, HEIGHT / 2.0, WIDTH - INSET)),
            "{text}"
        );
        let bar = format!("class=\"s0 bar\" d=\"M{0} {HEIGHT}V0M", WIDTH / 2.0);
        assert!(text.contains(&bar) && text.matches(" bar\"").count() == 1, "{text}");
        // One mark each, and one in the legend.
        assert_eq!(text.matches(" mark\"").count(), 4);
        for words in [">2<", ">128<", ">0.1<", ">0.5<", ">10<", ">maximum depth<", ">Mwalks/s<", ">speed<", ">schedule 0<"] {
            assert!(text.contains(words), "{words}: {text}");
        }
        balanced(&text);
    }

    /// Kills: NaN or an infinity in the file, a value without a logarithm that moves its line, a single point that becomes a line.
    #[test]
    fn what_has_no_place_is_left_out() {
        let wild = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -3.0];
        let mut points: Vec<(f64, Interval)> = wild.iter().map(|value| (4.0, exact(*value))).collect();
        points.extend(wild.iter().map(|value| (*value, exact(1.0))));
        points.extend(wild.iter().map(|value| (8.0, Interval { value: 1.0, low: *value, high: *value })));
        let text = lines("t", &names(2), &[panel(vec![Line { series: 1, points }, Line { series: 0, points: vec![(2.0, exact(1.0))] }])]);
        for word in ["NaN", "inf", "Inf"] {
            assert!(!text.contains(word), "{word}");
        }
        assert_eq!(text.matches(" bar\"").count(), 0);
        assert_eq!((text.matches("s1 mark\"").count(), text.matches("s0 mark\"").count()), (wild.len() + 1, 2));
        assert_eq!(text.matches("s0 line\"").count(), 1, "the legend's alone");
        balanced(&text);
        balanced(&lines("", &[], &[]));
        balanced(&lines("", &names(1), &[LinePanel { lines: vec![Line { series: 0, points: Vec::new() }], ..panel(Vec::new()) }]));
    }

    /// Kills: a line that hides another one of the same values.
    #[test]
    fn lines_that_coincide_take_turns() {
        let line = |series, value| Line { series, points: vec![(2.0, exact(value)), (8.0, exact(value))] };
        let text = lines("t", &names(4), &[panel(vec![line(0, 1.0), line(1, 2.0), line(2, 1.0), line(3, 1.0)])]);
        for (series, offset) in [(0, 0), (2, DASH), (3, 2 * DASH)] {
            let dash = format!("class=\"s{series} line\" stroke-dasharray=\"{DASH} {}\" stroke-dashoffset=\"-{offset}\"", 2 * DASH);
            assert!(text.contains(&dash), "{series}: {text}");
        }
        assert!(!text.contains("class=\"s1 line\" stroke-dasharray"));
    }

    /// Kills: a name or a title that opens a tag or ends an attribute; a legend that leaves the picture.
    #[test]
    fn words_stay_words() {
        let nasty = "</style><b a=\"'&\u{1}";
        let plain = balanced(&lines("t\nu", &names(1), &[panel(Vec::new())]));
        let text = lines(&format!("{nasty}\n{nasty}"), &[nasty.into()], &[LinePanel { title: nasty.into(), ..panel(Vec::new()) }]);
        assert_eq!(balanced(&text), plain);
        assert!(text.contains("&lt;/style&gt;&lt;b a=&quot;&#39;&amp; "));
        let (legend, rows) = legend(&names(12), 600.0, 0.0);
        let places = legend.split("<text x=\"").skip(1).filter_map(|rest| rest.split('"').next()?.parse::<f64>().ok());
        assert!(rows > 1 && places.clone().count() == 12 && places.clone().all(|x| x < 500.0), "{legend}");
    }

    /// Kills: a line, a letter or a number that cannot be seen on the paper of day or night, lines of the same colour and mark.
    #[test]
    fn everything_can_be_seen_by_day_and_by_night() {
        for index in 0..8 {
            for (color, paper) in color::of_line(index).into_iter().zip(color::PAPER) {
                assert!(color::contrast(color, paper) >= 3.0, "line {index}: {color:?} on {paper:?}");
            }
            for other in 0..index {
                assert!(color::of_line(index) != color::of_line(other) && mark(index, 0.0, 0.0) != mark(other, 0.0, 0.0));
            }
        }
        let text = lines("t", &names(12), &[]);
        assert_eq!(text.matches("line\" stroke-dasharray=\"2 3\"").count(), 4, "lines of the second round are dotted");
        let rule = |index: usize| text.split(&format!(".s{index}{{")).nth(1).and_then(|rest| rest.split('}').next()).expect("a rule");
        assert!((0..12).all(|index| (0..index).all(|other| rule(index) != rule(other))), "{text}");
        let text = style(1);
        let [day, night] = text.split("@media (prefers-color-scheme:dark)").collect::<Vec<_>>()[..] else { panic!("{text}") };
        for (rules, paper) in [(day, color::PAPER[0]), (night, color::PAPER[1])] {
            assert!(rules.contains(&format!(".paper{{fill:{}}}", color::css(paper))));
            for class in [".ink{fill:#", ".soft{fill:#"] {
                let hex = rules.split(class).nth(1).and_then(|rest| u32::from_str_radix(&rest[..6], 16).ok()).expect(class);
                let [_, r, g, b] = hex.to_be_bytes();
                assert!(color::contrast([r, g, b], paper) >= 4.5, "{class} on {paper:?}");
            }
        }
    }
}
