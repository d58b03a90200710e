//! [`Evolution`]: a descent from its first curve to its last, from light to dark.

use std::io::{self, Write};

use glam::DVec2;

use super::layout::{Bounds, Frame};
use super::page::{Entry, Page};
use super::svg::Pen;
use super::{DOTS, GIVEN};

/// The first and the last curve. The colours of those between are mixed from the two.
const FIRST: &str = "#BFDDF0";
const LAST: &str = "#08306B";
const MIX: [[f64; 3]; 2] = [[191.0, 221.0, 240.0], [8.0, 48.0, 107.0]];

/// Room for curves around the data, as a part of the data's size.
pub(super) const ROOM: f64 = 1.0 / 3.0;

/// How an iteration changed a planar curve.
///
/// Polylines go from light to dark blue over the data points, and the last one is bold. Both axes
/// have one scale, and y points up. Curves are cut off a third of the data's size away from the
/// data.
///
/// ```
/// use faircurve::picture::Evolution;
/// use glam::DVec2;
/// let data = [DVec2::ZERO, DVec2::new(2.0, 0.0)];
/// let curves = [1.0, 0.5, 0.2].map(|y| vec![data[0], DVec2::new(1.0, y), data[1]]);
/// let svg = Evolution { title: Some("Sagging".into()), ..Evolution::default() }.draw(&data, &curves);
/// assert_eq!(svg.matches("class=\"e\"").count(), 3);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Evolution {
    /// Width in pixels. The height follows from the data. Default 900, at least 160.
    pub width: f64,
    /// A line above the picture. Default none.
    pub title: Option<String>,
    /// A line below the legend. Default empty.
    pub caption: String,
}

impl Default for Evolution {
    fn default() -> Self {
        Evolution { width: 900.0, title: None, caption: String::new() }
    }
}

impl Evolution {
    /// The picture of the curves, in order, and of the data that they go through, as SVG text.
    pub fn draw(&self, data: &[DVec2], curves: &[Vec<DVec2>]) -> String {
        let mut out = Vec::new();
        self.write(data, curves, &mut out).expect("a Vec takes all that is written to it");
        String::from_utf8(out).expect("written from strings")
    }

    /// Writes the picture piece by piece.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, data: &[DVec2], curves: &[Vec<DVec2>], out: &mut dyn Write) -> io::Result<()> {
        let width = if self.width.is_nan() { 160.0 } else { self.width.clamp(160.0, 1e5) };
        let top = if self.title.is_some() { 44.0 } else { 0.0 };
        let frame = Frame::fit(view(data, curves.iter().map(|curve| &curve[..]), ROOM), width, top, 24.0);
        let entry = |colour: &'static str, width, text: &str| Entry {
            colour: colour.into(),
            width,
            dashed: false,
            dot: None,
            text: text.into(),
        };
        let legend = [
            Entry { dot: Some((DOTS, 2.6)), ..entry(GIVEN, 0.5, "data") },
            entry(FIRST, 1.2, "first curve"),
            entry(LAST, 2.0, "last curve"),
        ];
        let page = Page { frame: &frame, width, title: self.title.as_deref() };
        page.open(out, &legend, &self.caption)?;
        page.grid(out)?;
        let [left, top, right, bottom] = frame.plot;
        let (w, h) = (right - left, bottom - top);
        writeln!(
            out,
            r#"<clipPath id="plot"><rect x="{left:.1}" y="{top:.1}" width="{w:.1}" height="{h:.1}"/></clipPath>"#
        )?;
        writeln!(out, r#"<g clip-path="url(#plot)">"#)?;
        for (k, curve) in curves.iter().enumerate() {
            let part = k as f64 / (curves.len() - 1).max(1) as f64;
            let [red, green, blue] = [0, 1, 2].map(|c| (MIX[0][c] + part * (MIX[1][c] - MIX[0][c])).round() as u8);
            let thick = if k + 1 == curves.len() { 2.0 } else { 1.2 };
            let path = polyline(curve, &frame);
            writeln!(
                out,
                r##"<path class="e" d="{path}" stroke="#{red:02X}{green:02X}{blue:02X}" stroke-width="{thick:.1}"/>"##
            )?;
        }
        writeln!(out, r#"<g stroke="{DOTS}" stroke-width="5.2">"#)?;
        let mut pen = Pen::new(1);
        data.iter().filter(|p| p.is_finite()).for_each(|&p| pen.dot(frame.map(p)));
        writeln!(out, "<path d=\"{}\"/>\n</g>\n</g>", pen.finish())?;
        page.close(out)
    }
}

/// The box of data and curves, cut off at `room` times the data's size away from the data.
pub(super) fn view<'a>(data: &[DVec2], curves: impl Iterator<Item = &'a [DVec2]>, room: f64) -> Bounds {
    let finite =
        |points: &[DVec2], bounds: Bounds| points.iter().filter(|p| p.is_finite()).copied().fold(bounds, Bounds::with);
    let of_data = finite(data, Bounds::EMPTY);
    let all = curves.fold(of_data, |bounds, curve| finite(curve, bounds));
    // A single place has no size to measure by.
    if of_data.size() <= 0.0 {
        return all;
    }
    let room = DVec2::splat(room * of_data.size());
    Bounds { low: all.low.max(of_data.low - room), high: all.high.min(of_data.high + room) }
}

/// Path data. A coordinate far outside the page ends at a hundred pages.
pub(super) fn polyline(curve: &[DVec2], frame: &Frame) -> String {
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

    #[test]
    fn curves_go_from_light_to_dark_and_runaways_do_not_shrink_the_data() {
        let data = [DVec2::ZERO, DVec2::new(4.0, 1.0)];
        let curve = |y: f64| vec![data[0], DVec2::new(2.0, y), data[1]];
        let svg = Evolution::default().draw(&data, &[curve(0.5), curve(1.0), curve(1e6)]);
        roxmltree::Document::parse(&svg).unwrap();
        let at = |what: &str| {
            svg.find(&format!("stroke=\"{what}\" stroke-width=\"{}\"", if what == LAST { "2.0" } else { "1.2" }))
        };
        assert!(at(FIRST).unwrap() < at("#6487AE").unwrap() && at("#6487AE").unwrap() < at(LAST).unwrap(), "{svg}");
        let bounds = view(&data, [&curve(1e6)[..]].into_iter(), ROOM);
        assert_eq!((bounds.low, bounds.high), (DVec2::ZERO, DVec2::new(4.0, 1.0 + 4.0 / 3.0)));
    }
}
