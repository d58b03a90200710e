//! [`Panel`]: one field of a [`Sheet`](super::Sheet), with curves and dots.

use std::io::{self, Write};

use glam::{DVec2, DVec3};

use super::DOTS;
use super::layout::{Bounds, Frame};
use super::page::{Page, number, text_width};
use super::svg::{Pen, escape};

/// A colour in sRGB.
type Colour = [u8; 3];

/// Colours of values, from the smallest to the largest.
///
/// They are steps of Matplotlib's plasma (CC0), which rises in lightness all the way. Its yellow
/// end is left out, as it fades on white.
pub const VALUES: [Colour; 4] = [[13, 8, 135], [126, 3, 168], [204, 71, 120], [248, 149, 64]];

/// Room for curves around the dots, as a part of the dots' size.
const ROOM: f64 = 1.0 / 3.0;

/// Height of a colour bar with its text, and length of its strip, in pixels.
const BAR: f64 = 24.0;
const STRIP: f64 = 140.0;

/// A polyline in a [`Panel`].
///
/// Vertices that are not finite are left out. A closed curve repeats its first vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// The vertices, y up.
    pub points: Vec<DVec2>,
    /// Red, green and blue (sRGB).
    pub colour: [u8; 3],
    /// Width of the line in pixels.
    pub width: f64,
    /// The name in the legend. `None` has no entry.
    ///
    /// Strokes of one name share an entry, with the looks of the first.
    pub name: Option<String>,
}

/// What the colours of a panel mean: a colour strip below it, with the values at its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// What the values are, such as "end angle".
    pub text: String,
    /// The value of the first colour.
    pub from: f64,
    /// The value of the last colour.
    pub to: f64,
    /// The unit after the values, such as "°". May be empty.
    pub unit: String,
    /// The colours, evenly spaced from the first value to the last.
    pub colours: Vec<[u8; 3]>,
}

/// One field of a [`Sheet`](super::drawing::Sheet): curves, dots on top, a title above.
///
/// Both axes have one scale, and y points up.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// The title above the panel. Long titles are broken into lines.
    pub title: String,
    /// The curves, the first at the bottom.
    pub strokes: Vec<Stroke>,
    /// The dots. Those that are not finite are left out.
    pub dots: Vec<DVec2>,
    /// Curves are cut off this many times the size of the dots' box away from the box.
    pub room: f64,
    /// What the colours mean. Default none.
    pub bar: Option<Bar>,
}

impl Default for Panel {
    fn default() -> Self {
        Panel { title: String::new(), strokes: Vec::new(), dots: Vec::new(), room: ROOM, bar: None }
    }
}

impl Panel {
    /// Curves in the colours of values: 0 has the first colour of the bar, and 1 the last.
    ///
    /// A curve whose value is not finite is left out. Curves are cut off at a third of the dots' size
    /// away.
    pub fn by_value(title: impl Into<String>, curves: &[(f64, Vec<DVec2>)], dots: &[DVec2], bar: Bar) -> Self {
        let finite = curves.iter().filter(|(part, _)| part.is_finite());
        let stroke = |(part, points): &(f64, Vec<DVec2>)| Stroke {
            points: points.clone(),
            colour: mix(&bar.colours, *part),
            width: 1.6,
            name: None,
        };
        let strokes = finite.map(stroke).collect();
        Panel { title: title.into(), strokes, dots: dots.to_vec(), bar: Some(bar), ..Panel::default() }
    }

    /// The box of dots and curves, cut off at `room` times the dots' size away from the dots.
    pub(super) fn bounds(&self) -> Bounds {
        let finite = |points: &[DVec2], bounds: Bounds| {
            points.iter().filter(|p| p.is_finite()).copied().fold(bounds, Bounds::with)
        };
        let dots = finite(&self.dots, Bounds::EMPTY);
        let all = self.strokes.iter().fold(dots, |bounds, stroke| finite(&stroke.points, bounds));
        // A single place has no size to measure by.
        if dots.size() <= 0.0 {
            return all;
        }
        let room = DVec2::splat(self.room * dots.size());
        Bounds { low: all.low.max(dots.low - room), high: all.high.min(dots.high + room) }
    }

    /// Pixels that the panel needs below its frame.
    pub(super) fn foot(&self) -> f64 {
        if self.bar.is_some() { BAR } else { 0.0 }
    }

    /// Writes grid, curves and dots, cut off at the frame, and the bar below it.
    ///
    /// `id` is unique in the document.
    pub(super) fn write(&self, out: &mut dyn Write, frame: &Frame, id: &str) -> io::Result<()> {
        let [left, top, right, bottom] = frame.plot;
        let (w, h) = (right - left, bottom - top);
        let area = format!(r#"<rect x="{left:.1}" y="{top:.1}" width="{w:.1}" height="{h:.1}""#);
        writeln!(out, r#"<clipPath id="{id}">{area}/></clipPath>"#)?;
        writeln!(out, r#"<g class="panel" clip-path="url(#{id})">"#)?;
        Page { frame, width: w, title: None }.grid(out)?;
        for stroke in &self.strokes {
            let path = polyline(&stroke.points, frame);
            let colour = hex(stroke.colour);
            writeln!(out, r#"<path class="s" d="{path}" stroke="{colour}" stroke-width="{:.2}"/>"#, width(stroke))?;
        }
        let mut pen = Pen::new(1);
        self.dots.iter().filter(|p| p.is_finite()).for_each(|&p| pen.dot(frame.map(p)));
        writeln!(out, "<path class=\"dots\" d=\"{}\" stroke=\"{DOTS}\" stroke-width=\"4.4\"/>\n</g>", pen.finish())?;
        writeln!(out, r##"{area} stroke="#D0D0D0"/>"##)?;
        self.bar.as_ref().map_or(Ok(()), |bar| bar.write(out, left, bottom + BAR - 6.0))
    }
}

impl Bar {
    /// Values without a unit, in colours that rise in lightness.
    pub fn new(text: impl Into<String>, [from, to]: [f64; 2]) -> Self {
        Bar { text: text.into(), from, to, unit: String::new(), colours: VALUES.to_vec() }
    }

    /// Writes the text, the first value, the strip and the last value on one line.
    pub(super) fn write(&self, out: &mut dyn Write, left: f64, y: f64) -> io::Result<()> {
        let step = ((self.to - self.from).abs() / 100.0).clamp(1e-3, 1.0);
        let value = |value: f64| format!("{}{}", number(value, step), self.unit);
        let head = format!("{} {}", self.text, value(self.from));
        writeln!(out, r#"<text x="{left:.1}" y="{y:.1}">{}</text>"#, escape(&head))?;
        let start = left + text_width(&head) + 6.0;
        let pieces = 28;
        writeln!(out, r#"<g class="bar" stroke-width="8" stroke-linecap="butt">"#)?;
        for k in 0..pieces {
            let colour = hex(mix(&self.colours, k as f64 / (pieces - 1) as f64));
            let (x, piece) = (start + STRIP * k as f64 / pieces as f64, STRIP / pieces as f64);
            // Half a pixel of overlap keeps the page from shining through.
            writeln!(out, r#"<path d="M{x:.1} {:.1}h{:.1}" stroke="{colour}"/>"#, y - 4.0, piece + 0.5)?;
        }
        writeln!(out, "</g>")?;
        let end = start + STRIP + 8.0;
        writeln!(out, r#"<text x="{end:.1}" y="{y:.1}">{}</text>"#, escape(&value(self.to)))
    }
}

/// The width of a line as it is written: never negative or NaN.
pub(super) fn width(stroke: &Stroke) -> f64 {
    if stroke.width.is_finite() { stroke.width.clamp(0.0, 100.0) } else { 1.0 }
}

pub(super) fn hex([red, green, blue]: Colour) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

/// The colour at `part` of the way from the first to the last of evenly spaced colours.
pub fn mix(colours: &[Colour], part: f64) -> Colour {
    mix_exact(colours, part).to_array().map(|c| c.round() as u8)
}

/// The same colour before it is rounded.
pub(super) fn mix_exact(colours: &[Colour], part: f64) -> DVec3 {
    let Some(last) = colours.len().checked_sub(1) else { return DVec3::ZERO };
    let at = part.clamp(0.0, 1.0) * last as f64;
    let k = (at as usize).min(last.saturating_sub(1));
    let [from, to] = [k, last.min(k + 1)].map(|k| DVec3::from(colours[k].map(f64::from)));
    from + (to - from) * (at - k as f64)
}

/// Path data. A coordinate far outside the page ends at a hundred pages.
fn polyline(curve: &[DVec2], frame: &Frame) -> String {
    let mut pen = Pen::new(2);
    let far = DVec2::splat(1e5);
    for (k, p) in curve.iter().filter(|p| p.is_finite()).map(|&p| frame.map(p).clamp(-far, far)).enumerate() {
        if k == 0 {
            pen.move_to(p);
        } else {
            pen.line_to(p);
        }
    }
    pen.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(y: f64) -> Vec<DVec2> {
        vec![DVec2::ZERO, DVec2::new(0.5, y), DVec2::X]
    }

    #[test]
    fn curves_have_the_colours_of_their_values_and_what_has_none_is_left_out() {
        let curves = [1.0, f64::NAN, 0.0, 0.5].map(|part| (part, line(part)));
        let panel = Panel::by_value("values", &curves, &[DVec2::ZERO], Bar::new("value", [2.0, 9.0]));
        let colours: Vec<_> = panel.strokes.iter().map(|s| s.colour).collect();
        assert_eq!(colours, [VALUES[3], VALUES[0], mix(&VALUES, 0.5)]);
        let bar = panel.bar.unwrap();
        assert_eq!((bar.from, bar.to, bar.unit.as_str()), (2.0, 9.0, ""));
    }

    #[test]
    fn runaways_do_not_shrink_the_dots() {
        let dots = [DVec2::ZERO, DVec2::new(4.0, 1.0)];
        let runaway = (0.5, vec![dots[0], DVec2::new(2.0, 1e6), dots[1]]);
        let bounds = Panel::by_value("", &[runaway], &dots, Bar::new("value", [0.0, 1.0])).bounds();
        assert_eq!((bounds.low, bounds.high), (DVec2::ZERO, DVec2::new(4.0, 1.0 + 4.0 / 3.0)));
    }
}
