//! [`Plot`]: numbers against numbers.

use std::io::{self, Write};

use faircurve::picture::drawing::{GRID, LINE, Pen, escape, number, text_width};
use glam::DVec2;

/// The palette of Okabe and Ito, darkest first and without yellow, which fades on white.
const COLOURS: [&str; 7] = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#E69F00", "#56B4E9"];

/// The least distance of ticks in pixels, along x and along y.
const APART: [f64; 2] = [56.0, 36.0];

/// Pixels around the axes: on the left for the numbers and the label, and below for those there.
const LEFT: f64 = 74.0;
const BELOW: f64 = 42.0;

/// Height of the axes, if the legend does not need more.
const HEIGHT: f64 = 220.0;

/// One axis of a [`Plot`].
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Axis {
    /// What is measured, with its unit.
    pub label: String,
    /// Whether the axis is logarithmic. Values that are not positive are then not shown.
    pub log: bool,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: impl Into<String>) -> Self {
        Axis { label: label.into(), log: false }
    }

    /// A logarithmic axis.
    pub fn log(label: impl Into<String>) -> Self {
        Axis { label: label.into(), log: true }
    }

    /// The place of a value on the axis, before scaling. NaN or infinite if it has no place.
    fn place(&self, value: f64) -> f64 {
        if self.log { value.log10() } else { value }
    }
}

/// One curve of a [`Plot`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its points, which are joined in order.
    ///
    /// Points without a place (not finite, or not positive on a logarithmic axis) are left out and
    /// interrupt the line.
    pub points: Vec<DVec2>,
}

/// Curves over two axes with a legend to their right.
///
/// An example is the cost of several descents against the iteration.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Plot {
    /// A line above the plot. May be empty.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves. After seven curves the colours repeat, dashed.
    pub series: Vec<Series>,
}

impl Plot {
    /// Pixels from the top of the plot to its bottom.
    pub(super) fn height(&self) -> f64 {
        let head = if self.title.is_empty() { 10.0 } else { LINE + 8.0 };
        head + HEIGHT.max(self.series.len() as f64 * LINE) + BELOW
    }

    /// The box of all points that have a place, a little widened.
    ///
    /// Without points it is one unit wide.
    fn range(&self) -> [DVec2; 2] {
        let points = self.series.iter().flat_map(|series| &series.points).map(|&p| self.place(p));
        let (low, high) = points
            .filter(|p| p.is_finite())
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        if low.x > high.x {
            return [DVec2::ZERO, DVec2::ONE];
        }
        let pad = |low: f64, high: f64| if high > low { 0.03 * (high - low) } else { 0.5 * low.abs().max(1.0) };
        let pad = DVec2::new(pad(low.x, high.x), pad(low.y, high.y));
        [low - pad, high + pad]
    }

    fn place(&self, p: DVec2) -> DVec2 {
        let placed = DVec2::new(self.x.place(p.x), self.y.place(p.y));
        // Squares and differences of larger numbers overflow.
        if placed.abs().max_element() < 1e150 { placed } else { DVec2::NAN }
    }

    /// Writes the plot into `left..right`, from `top` on.
    pub(super) fn write(&self, out: &mut dyn Write, [left, right]: [f64; 2], top: f64) -> io::Result<()> {
        writeln!(out, r#"<g class="plot">"#)?;
        let mut y0 = top + 10.0;
        if !self.title.is_empty() {
            writeln!(
                out,
                r#"<text x="{left:.1}" y="{:.1}" font-size="13">{}</text>"#,
                top + 14.0,
                escape(&self.title)
            )?;
            y0 = top + LINE + 8.0;
        }
        let legend = self.series.iter().map(|s| text_width(&s.name)).fold(0.0, f64::max) + 48.0;
        let (x0, y1) = (left + LEFT, top + self.height() - BELOW);
        let x1 = (right - legend).max(x0 + 60.0);
        let [low, high] = self.range();
        let size = DVec2::new(x1 - x0, y0 - y1) / (high - low);
        let map = |p: DVec2| DVec2::new(x0, y1) + (p - low) * size;

        writeln!(out, r#"<g stroke="{GRID}">"#)?;
        for (at, text) in ticks(&self.x, [low.x, high.x], x1 - x0, APART[0]) {
            let x = map(DVec2::new(at, low.y)).x;
            writeln!(out, r#"<path d="M{x:.1} {y0:.1}V{y1:.1}"/>"#)?;
            writeln!(
                out,
                r#"<text x="{x:.1}" y="{:.1}" font-size="10" text-anchor="middle">{text}</text>"#,
                y1 + 14.0
            )?;
        }
        for (at, text) in ticks(&self.y, [low.y, high.y], y1 - y0, APART[1]) {
            let y = map(DVec2::new(low.x, at)).y;
            writeln!(out, r#"<path d="M{x0:.1} {y:.1}H{x1:.1}"/>"#)?;
            let (x, y) = (x0 - 6.0, y + 3.5);
            writeln!(out, r#"<text x="{x:.1}" y="{y:.1}" font-size="10" text-anchor="end">{text}</text>"#)?;
        }
        writeln!(out, "</g>")?;
        writeln!(out, r##"<path d="M{x0:.1} {y0:.1}V{y1:.1}H{x1:.1}" stroke="#888888"/>"##)?;
        let (middle, below) = (0.5 * (x0 + x1), y1 + 32.0);
        writeln!(out, r#"<text x="{middle:.1}" y="{below:.1}" text-anchor="middle">{}</text>"#, escape(&self.x.label))?;
        let (x, y) = (left + 12.0, 0.5 * (y0 + y1));
        let label = escape(&self.y.label);
        writeln!(
            out,
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="middle" transform="rotate(-90 {x:.1} {y:.1})">{label}</text>"#
        )?;

        for (k, series) in self.series.iter().enumerate() {
            let colour = COLOURS[k % COLOURS.len()];
            let dashes = if k < COLOURS.len() { "" } else { r#" stroke-dasharray="5 4""# };
            let style = format!(r#"stroke="{colour}" stroke-width="1.6"{dashes}"#);
            let path = self.path(series, map);
            writeln!(out, r#"<path class="series" d="{path}" {style}/>"#)?;
            let (x, y) = (x1 + 12.0, y0 + LINE * (k as f64 + 0.5));
            writeln!(out, r#"<path d="M{x:.1} {y:.1}h24" {style}/>"#)?;
            writeln!(out, r#"<text x="{:.1}" y="{:.1}">{}</text>"#, x + 32.0, y + 4.0, escape(&series.name))?;
        }
        writeln!(out, "</g>")
    }

    /// Path data. A point between two that have no place is a dot.
    fn path(&self, series: &Series, map: impl Fn(DVec2) -> DVec2) -> String {
        let mut pen = Pen::new(1);
        let placed: Vec<DVec2> = series.points.iter().map(|&p| self.place(p)).collect();
        for run in placed.split(|p| !p.is_finite()).filter(|run| !run.is_empty()) {
            pen.dot(map(run[0]));
            run[1..].iter().for_each(|&p| pen.line_to(map(p)));
        }
        pen.finish()
    }
}

/// The places and labels of ticks between two places.
///
/// On `pixels` they are at least `apart` pixels from each other.
fn ticks(axis: &Axis, [low, high]: [f64; 2], pixels: f64, apart: f64) -> Vec<(f64, String)> {
    let least = (high - low) * apart / pixels;
    let most = 1.0 + pixels / apart;
    if axis.log {
        let decades = multiples(low, high, least.ceil().max(1.0), most);
        if decades.len() > 1 {
            // All ticks in one notation.
            let plain = decades.iter().all(|k| (-4.0..=5.0).contains(k));
            let text = |k: f64| if plain { format!("{}", 10f64.powf(k)) } else { power_of_ten(k) };
            return decades.into_iter().map(|k| (k, text(k))).collect();
        }
        // Within a decade or two, the round numbers between the powers of ten say more, if they are
        // not too close.
        let between = multiples(low - 1.0, high, 1.0, 4.0).into_iter().flat_map(|k| {
            [1.0, 2.0, 5.0].map(|m: f64| (k + m.log10(), number(m * 10f64.powf(k), 10f64.powf(k.min(0.0)))))
        });
        let between: Vec<_> = between.filter(|tick| (low..=high).contains(&tick.0)).collect();
        if between.len() > 2 && least < 2f64.log10() {
            return between;
        }
        // Otherwise values in even steps.
        let (from, to) = (10f64.powf(low), 10f64.powf(high));
        let step = round_step((to - from) * apart / pixels);
        let spread = multiples(from, to, step, 2.0 * most).into_iter().filter(|&value| value > 0.0);
        return spread.map(|value| (value.log10(), number(value, step))).collect();
    }
    let step = round_step(least);
    multiples(low, high, step, most).into_iter().map(|value| (value, number(value, step))).collect()
}

/// The least of 1, 2 or 5 times a power of ten that is not below `least`.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|m| m * power).find(|&step| step >= least).unwrap_or(10.0 * power)
}

/// The multiples of `step` from `low` to `high`.
///
/// There are none if they are more than `most`, or if the step is below the numbers' spacing.
fn multiples(low: f64, high: f64, step: f64, most: f64) -> Vec<f64> {
    let (from, to) = ((low / step).ceil(), (high / step).floor());
    if !(0.0..=most).contains(&(to - from)) || (low + step) - low < 0.5 * step {
        return Vec::new();
    }
    (0..=(to - from) as i64).map(|k| (from + k as f64) * step).collect()
}

/// 10⁻⁷ for −7.
fn power_of_ten(k: f64) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        _ => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][c.to_digit(10).unwrap_or(0) as usize],
    };
    format!("10{}", format!("{k:.0}").chars().map(raised).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn says(axis: &Axis, range: [f64; 2]) -> Vec<String> {
        ticks(axis, range, 400.0, 70.0).into_iter().map(|tick| tick.1).collect()
    }

    #[test]
    fn ticks_are_round_on_both_kinds_of_axis() {
        let (even, log) = (Axis::linear(""), Axis::log(""));
        assert_eq!(says(&even, [-0.1, 1.03]), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(says(&even, [0.0, 10_400.0]), ["0", "2000", "4000", "6000", "8000", "10000"]);
        assert_eq!(says(&log, [-2.2, 1.1]), ["0.01", "0.1", "1", "10"]);
        assert_eq!(says(&log, [-15.8, 0.2]), ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰"]);
        assert_eq!(says(&log, [-0.55, 0.01]), ["0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(says(&log, [-0.4, 0.8]), ["0.5", "1", "2", "5"]);
        assert_eq!(says(&log, [0.7f64.log10(), 0.98f64.log10()]), ["0.70", "0.75", "0.80", "0.85", "0.90", "0.95"]);
    }

    #[test]
    fn what_has_no_place_interrupts_the_line_and_one_place_is_a_dot() {
        let points = [(0.0, 1.0), (1.0, 2.0), (2.0, 0.0), (3.0, 3.0), (4.0, f64::NAN), (5.0, 1e300)];
        let series = Series { name: "s".into(), points: points.map(|(x, y)| DVec2::new(x, y)).to_vec() };
        let plot = Plot { y: Axis::log("cost"), series: vec![series], ..Plot::default() };
        let path = plot.path(&plot.series[0], |p| p);
        assert_eq!(path, "M0 0h0l1 .3M3 .5h0M5 300h0");
    }
}
