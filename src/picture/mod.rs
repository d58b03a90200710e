//! SVG pictures.
//!
//! - [`Picture`]: a fit with its data points, and optionally with curvature combs.
//! - [`ReliefSheet`]: surfaces over grids.

mod comb;
mod layout;
mod page;
mod panel;
mod relief;
mod sheet;
mod svg;

#[cfg(test)]
mod tests;

/// Drawings of the program and of the papers' crate. They promise nothing.
#[doc(hidden)]
pub mod drawing {
    pub use super::page::{GRID, LINE, SIDE, number, text_width, thousands};
    pub use super::panel::{Bar, Panel, Stroke, VALUES, mix};
    pub use super::sheet::{Below, GAP, Sheet, column};
    pub use super::svg::{Pen, escape};
}

use std::io::{self, Write};

use glam::{DVec2, DVec3};

use crate::batch::CurveBatch;
use crate::curve::vector;
use crate::parallel;
use crate::report::Fit;
use crate::status::CurveStatus;
use comb::Combs;
use layout::{Bounds, Frame, Plane};
use page::{Entry, Page};
pub use relief::{Net, Relief, ReliefSheet};
use svg::{Pen, escape};

/// The palette of Okabe and Ito.
///
/// Its colours are distinct for colour-blind readers and in greyscale.
const FITTED: &str = "#0072B2";
const NOT_USABLE: &str = "#D55E00";
const COMB: &str = "#CC79A7";
const GIVEN: &str = "#A9A9A9";
const DOTS: &str = "#333333";
const CORRIDOR: &str = "#E6F0E2";
const OBSTACLE: &str = "#D9D4CC";

/// The tolerance of Béziers, in pixels.
const TOLERANCE_PX: f64 = 0.05;

/// The least distance between points, in pixels, for drawing the input. Below it the input cannot
/// be distinguished from the curve.
const LEAST_ROOM: f64 = 2.0;

/// Number of curves converted to text at a time. The whole picture is never in memory.
const CHUNK: usize = 2048;

/// The most curves with tooltips.
const MOST_TOOLTIPS: usize = 5000;

/// A picture of a fit.
///
/// The page is white, the input grey, fitted curves blue and combs purple. A curve that is not
/// usable is dashed in vermilion. Both axes have one scale, and y points up. 3-D curves are
/// projected onto the two widest principal axes of their points. Lines keep their width when the
/// picture is scaled.
///
/// An unfitted curve farther from the others than their size is not drawn, and the legend says so.
///
/// Curves are cubic Béziers within 0.05 pixel of the fit. Pieces smaller than a pixel are merged,
/// so the size of the file depends on what is visible.
///
/// ```no_run
/// # use faircurve::{CurveBatch, Fit, picture::Picture};
/// # fn show(batch: &CurveBatch, fit: &Fit) -> std::io::Result<()> {
/// let picture = Picture { comb: Some(1.0), title: Some("Storms".into()), ..Picture::default() };
/// std::fs::write("storms.svg", picture.draw(batch, fit))
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels. The height follows from the data. Default 1200, at least 160.
    pub width: f64,
    /// Draws curvature combs at this scale. `None`, the default, draws none.
    ///
    /// A comb has quills of length |κ| away from the centre of curvature, and an envelope through
    /// their tips. At scale 1 the 95 % quantile of |κ| gives a quill of 4 % of the picture, less
    /// for more than 20 curves. Quills are limited to three times that.
    pub comb: Option<f64>,
    /// Whether the input points and their polyline are drawn, if there is room. Default true.
    pub points: bool,
    /// The title above the picture. Default none.
    pub title: Option<String>,
    /// The method in the caption, such as "natural cubic splines". Default empty.
    pub method: String,
    /// Polygons that planar curves stay out of, filled. Default none.
    pub obstacles: Vec<Vec<[f64; 2]>>,
    /// The half-width of the corridor around the input, in units of the input, filled. Default none.
    pub corridor: Option<f64>,
}

impl Default for Picture {
    fn default() -> Self {
        Picture {
            width: 1200.0,
            comb: None,
            points: true,
            title: None,
            method: String::new(),
            obstacles: vec![],
            corridor: None,
        }
    }
}

impl Picture {
    /// The picture of `fit`, which was fitted to `batch`, as SVG text.
    ///
    /// # Panics
    /// If `fit` does not have one curve for every curve of `batch`.
    pub fn draw(&self, batch: &CurveBatch, fit: &Fit) -> String {
        let mut out = Vec::new();
        self.write(batch, fit, &mut out).expect("a Vec takes all that is written to it");
        String::from_utf8(out).expect("written from strings")
    }

    /// Writes the picture of `fit`, which was fitted to `batch`.
    ///
    /// # Errors
    /// Those of `out`.
    ///
    /// # Panics
    /// If `fit` does not have one curve for every curve of `batch`.
    pub fn write(&self, batch: &CurveBatch, fit: &Fit, out: &mut dyn Write) -> io::Result<()> {
        assert_eq!(batch.len(), fit.len(), "a picture needs the batch that was fitted");
        let width = if self.width.is_nan() { 160.0 } else { self.width.clamp(160.0, 1e5) };
        let plane = Plane::of(batch);
        let (mut bounds, outside) = Bounds::of(batch, fit, &plane);
        let combs = self.comb.map(|scale| Combs::of(fit, &plane, bounds.size(), scale));
        for (root, tip) in combs.iter().flat_map(|combs| &combs.curves).flatten().flatten() {
            bounds = bounds.with(*root).with(*tip);
        }
        let top = if self.title.is_some() { 44.0 } else { 0.0 };
        let frame = Frame::fit(bounds, width, top, 24.0);
        let look = Look::of(batch, fit, &frame, self.points);
        let drawing = Drawing { batch, fit, plane, frame, look, outside };

        let page = Page { frame: &frame, width, title: self.title.as_deref() };
        page.open(out, &self.legend(&drawing, combs.as_ref()), &self.caption(batch, fit))?;
        self.draw_areas(out, &drawing)?;
        page.grid(out)?;
        if look.given {
            drawing.layer(out, GIVEN, look.thin, "", |i| drawing.given(i))?;
        }
        if let Some(combs) = &combs {
            drawing.layer(out, COMB, look.thin, r#" stroke-opacity=".55""#, |i| drawing.quills(&combs.curves[i]))?;
            drawing.layer(out, COMB, 1.4 * look.thin, "", |i| drawing.envelope(&combs.curves[i]))?;
        }
        // Depth of colour shows the number of crossing lines.
        let ink = if look.line < 1.0 { r#" stroke-opacity=".8""# } else { "" };
        drawing.layer(out, FITTED, look.line, ink, |i| drawing.usable(i).then(|| drawing.fitted(i))?)?;
        let dashes = r#" stroke-dasharray="5 4""#;
        drawing.layer(out, NOT_USABLE, look.line.max(1.2), dashes, |i| {
            (!drawing.usable(i)).then(|| drawing.fitted(i))?
        })?;
        if look.dot > 0.0 {
            drawing.layer(out, DOTS, 2.0 * look.dot, "", |i| drawing.dots(i))?;
        }
        page.close(out)
    }

    /// The corridor and the obstacles of planar curves, as far as they lie in the plot.
    fn draw_areas(&self, out: &mut dyn Write, drawing: &Drawing) -> io::Result<()> {
        let widths = drawing.batch.constraints().widths.as_deref();
        if drawing.batch.dimension() != 2 || self.corridor.is_none() && widths.is_none() && self.obstacles.is_empty() {
            return Ok(());
        }
        let frame = &drawing.frame;
        let [left, top, right, bottom] = frame.plot;
        let [x, y, width, height] = [left, top, right - left, bottom - top].map(|pixels| format!("{pixels:.2}"));
        // An svg within another one is cut at its border.
        writeln!(out, r#"<svg x="{x}" y="{y}" width="{width}" height="{height}" viewBox="{x} {y} {width} {height}">"#)?;
        writeln!(out, r#"<g stroke-linejoin="round" stroke-linecap="round">"#)?;
        if let Some(half) = self.corridor {
            let pixels = 2.0 * half * frame.scale;
            drawing.layer(out, CORRIDOR, pixels, "", |i| drawing.given(i))?;
        }
        if let Some(widths) = widths {
            let fill = format!(r#" fill="{CORRIDOR}""#);
            drawing.layer(out, CORRIDOR, 0.5, &fill, |i| drawing.between_borders(i, widths))?;
        }
        write!(out, r#"<path fill="{OBSTACLE}" stroke="none" d=""#)?;
        for corners in &self.obstacles {
            let mut pen = Pen::new(drawing.look.decimals);
            let mut points = corners.iter().filter_map(|corner| drawing.plane.project(vector(corner)));
            points.next().into_iter().for_each(|first| pen.move_to(frame.map(first)));
            points.for_each(|point| pen.line_to(frame.map(point)));
            pen.close();
            out.write_all(pen.finish().as_bytes())?;
        }
        writeln!(out, "\"/></g></svg>")
    }

    fn legend(&self, drawing: &Drawing, combs: Option<&Combs>) -> Vec<Entry> {
        let (fit, look) = (drawing.fit, drawing.look);
        let mut entries = Vec::new();
        if look.given {
            let dot = (look.dot > 0.0).then_some((DOTS, look.dot));
            entries.push(Entry {
                colour: GIVEN.into(),
                width: look.thin.max(1.0),
                dashed: false,
                dot,
                text: "input".into(),
            });
        }
        let area = |colour: &'static str, text: &str| Entry {
            colour: colour.into(),
            width: 8.0,
            dashed: false,
            dot: None,
            text: text.into(),
        };
        if drawing.batch.dimension() == 2 {
            let has_corridor = self.corridor.is_some() || drawing.batch.constraints().widths.is_some();
            entries.extend(has_corridor.then(|| area(CORRIDOR, "corridor")));
            entries.extend((!self.obstacles.is_empty()).then(|| area(OBSTACLE, "obstacles")));
        }
        let line = |colour: &'static str, dashed, text| Entry {
            colour: colour.into(),
            width: look.line.max(1.2),
            dashed,
            dot: None,
            text,
        };
        if fit.usable() > 0 {
            entries.push(line(FITTED, false, "fitted curve".into()));
        }
        if let Some(combs) = combs {
            let text = format!("curvature comb (95 % of |κ| ≤ {})", page::short(combs.curvature));
            entries.push(line(COMB, false, text));
        }
        if fit.usable() < fit.len() {
            let outside = drawing.outside.iter().filter(|outside| **outside).count();
            let left_out = if outside > 0 {
                format!("; {} far outside, not drawn", page::thousands(outside))
            } else {
                String::new()
            };
            let text = format!("not usable: {}{left_out}", words(fit));
            entries.push(line(NOT_USABLE, true, text));
        }
        entries
    }

    fn caption(&self, batch: &CurveBatch, fit: &Fit) -> String {
        let plural = |n: usize, what: &str| format!("{} {what}{}", page::thousands(n), if n == 1 { "" } else { "s" });
        let mut parts = vec![format!("{}, {}", plural(batch.len(), "curve"), plural(batch.total_points(), "point"))];
        parts.extend(Some(self.method.clone()).filter(|method| !method.is_empty()));
        parts.push(fit.device().to_string());
        if batch.dimension() == 3 {
            parts.push("orthographic view onto the two widest principal axes".into());
        }
        parts.join(" · ")
    }
}

/// The statuses that are not usable, with their counts: "2 invalid, 1 degenerate".
fn words(fit: &Fit) -> String {
    let mut counts: Vec<(CurveStatus, usize)> = Vec::new();
    for status in fit.reports().iter().map(|report| report.status).filter(|status| !status.is_usable()) {
        match counts.iter_mut().find(|(known, _)| *known == status) {
            Some((_, count)) => *count += 1,
            None => counts.push((status, 1)),
        }
    }
    let words = counts.iter().map(|(status, n)| format!("{} {}", page::thousands(*n), status.word().replace('_', " ")));
    words.collect::<Vec<_>>().join(", ")
}

/// Widths by the density of the picture.
#[derive(Clone, Copy, Debug)]
struct Look {
    /// Width of fitted curves, in pixels.
    line: f64,
    /// Width of the input polyline and the quills.
    thin: f64,
    /// Whether the input polyline is drawn.
    given: bool,
    /// Radius of the dots. 0 draws none.
    dot: f64,
    /// Decimal places of a pixel.
    decimals: usize,
    /// Whether curves have tooltips.
    tooltips: bool,
}

impl Look {
    fn of(batch: &CurveBatch, fit: &Fit, frame: &Frame, points: bool) -> Self {
        // The side of a square with a point's share of the page.
        let room = (frame.area() / batch.total_points().max(1) as f64).sqrt();
        let dot = (0.05 * room).min(2.6);
        Look {
            line: (0.08 * room).clamp(0.55, 1.8),
            thin: (0.02 * room).clamp(0.5, 0.9),
            given: points && room >= LEAST_ROOM,
            dot: if points && dot >= 0.8 { dot } else { 0.0 },
            decimals: if batch.total_points() <= 20_000 { 2 } else { 1 },
            tooltips: fit.len() <= MOST_TOOLTIPS,
        }
    }
}

/// The input of the layers.
struct Drawing<'a> {
    batch: &'a CurveBatch,
    fit: &'a Fit,
    plane: Plane,
    frame: Frame,
    look: Look,
    /// The curves that are left out.
    outside: Vec<bool>,
}

impl Drawing<'_> {
    /// The curves' paths, in the batch's order, as a group of one style.
    fn layer<F>(&self, out: &mut dyn Write, colour: &str, width: f64, style: &str, path: F) -> io::Result<()>
    where
        F: Fn(usize) -> Option<Shape> + Sync,
    {
        writeln!(out, r#"<g stroke="{colour}" stroke-width="{width:.2}"{style}>"#)?;
        for start in (0..self.batch.len()).step_by(CHUNK) {
            let end = self.batch.len().min(start + CHUNK);
            let inside = |i: usize| if self.outside[i] { None } else { path(i) };
            let paths: Vec<Shape> =
                parallel::map(end - start, 1, |k| inside(start + k)).into_iter().flatten().collect();
            // Curves without tooltips share an element.
            for shapes in paths.chunk_by(|a, b| a.tooltip.is_none() && b.tooltip.is_none()) {
                out.write_all(b"<path d=\"")?;
                shapes.iter().try_for_each(|shape| out.write_all(shape.data.as_bytes()))?;
                match &shapes[0].tooltip {
                    Some(tooltip) => writeln!(out, "\"><title>{}</title></path>", escape(tooltip))?,
                    None => out.write_all(b"\"/>\n")?,
                }
            }
        }
        writeln!(out, "</g>")
    }

    fn usable(&self, i: usize) -> bool {
        self.fit.reports()[i].status.is_usable()
    }

    /// The points of curve `i` in pixels, `None` for a point that cannot be drawn.
    fn points(&self, i: usize) -> impl Iterator<Item = Option<DVec2>> {
        let points = self.batch.points(i).chunks_exact(self.batch.dimension());
        points.map(|p| Some(self.frame.map(self.plane.project(vector(p))?)))
    }

    /// The input polyline. A vertex less than half a pixel from the last one drawn is left out.
    fn given(&self, i: usize) -> Option<Shape> {
        let mut pen = Pen::new(self.look.decimals);
        let (mut last, mut skipped, mut drawn) = (None, None, 0);
        for point in self.points(i) {
            match (point, last) {
                (Some(p), Some(from)) if p.distance_squared(from) < 0.25 => skipped = Some(p),
                (Some(p), Some(_)) => {
                    pen.line_to(p);
                    (last, skipped, drawn) = (Some(p), None, drawn + 1);
                }
                (Some(p), None) => {
                    pen.move_to(p);
                    (last, skipped) = (Some(p), None);
                }
                (None, _) => last = None,
            }
        }
        if let Some(p) = skipped {
            pen.line_to(p);
        }
        if drawn > 0 && self.batch.is_closed(i) && self.points(i).all(|p| p.is_some()) {
            pen.close();
        }
        path(pen.finish(), None)
    }

    /// The corridor with these widths to the left and to the right of the points of the batch, a quadrilateral per span.
    fn between_borders(&self, i: usize, widths: &[f64]) -> Option<Shape> {
        let own = self.batch.offsets()[i]..self.batch.offsets()[i + 1];
        let points = self.batch.points(i).as_chunks::<2>().0.iter().map(|p| DVec2::from(*p));
        let mut sites: Vec<(DVec2, [f64; 2])> = points.zip(widths.as_chunks::<2>().0[own].iter().copied()).collect();
        sites.dedup_by(|after, before| after.0 == before.0);
        let (count, closed) = (sites.len(), self.batch.is_closed(i));
        let left = |k: usize| (sites[(k + 1) % count].0 - sites[k].0).perp().normalize_or_zero();
        // Along the bisector of the turn at a point.
        let borders = |k: usize| {
            let before = if k > 0 || closed { left((k + count - 1) % count) } else { DVec2::ZERO };
            let after = if k + 1 < count || closed { left(k) } else { DVec2::ZERO };
            let (point, [to_left, to_right]) = sites[k];
            let across = (before + after).normalize_or_zero();
            [point + to_left * across, point - to_right * across]
        };
        let mut pen = Pen::new(self.look.decimals);
        for k in 0..if closed { count } else { count.saturating_sub(1) } {
            let ([a, b], [d, c]) = (borders(k), borders((k + 1) % count));
            let place = |corner: DVec2| Some(self.frame.map(self.plane.project(corner.extend(0.0))?));
            let [Some(a), Some(b), Some(c), Some(d)] = [a, b, c, d].map(place) else { continue };
            pen.move_to(a);
            [b, c, d].into_iter().for_each(|corner| pen.line_to(corner));
            pen.close();
        }
        path(pen.finish(), None)
    }

    fn dots(&self, i: usize) -> Option<Shape> {
        let mut pen = Pen::new(1);
        for p in self.points(i).flatten() {
            pen.dot(p);
        }
        path(pen.finish(), None)
    }

    /// The curve, with its name and any problem as the tooltip.
    fn fitted(&self, i: usize) -> Option<Shape> {
        let curve = self.fit.curve(i);
        let mut pen = Pen::new(self.look.decimals);
        let (mut end, mut whole) = (None, true);
        for piece in curve.beziers(TOLERANCE_PX / self.frame.scale) {
            let Some(piece) = self.project(piece) else {
                (end, whole) = (None, false);
                continue;
            };
            if end.is_none() {
                pen.move_to(piece[0]);
            }
            pen.cubic(piece);
            end = Some(piece[3]);
        }
        if curve.is_closed() && whole && end.is_some() {
            pen.close();
        }
        let report = &self.fit.reports()[i];
        let name = self.batch.name(i);
        let tooltip = match (&report.message, report.status.is_usable()) {
            (Some(message), false) => Some(format!("{name}: {} ({message})", report.status.word())),
            (None, false) => Some(format!("{name}: {}", report.status.word())),
            (_, true) => self.look.tooltips.then(|| name.into_owned()),
        };
        let mut text = pen.finish();
        if text.is_empty() {
            // Points without a line are dots.
            let mut pen = Pen::new(self.look.decimals);
            for p in self.points(i).flatten() {
                pen.dot(p);
            }
            text = pen.finish();
        }
        path(text, tooltip)
    }

    /// The piece in pixels, or `None` when part of it cannot be drawn.
    fn project(&self, piece: [DVec3; 4]) -> Option<[DVec2; 4]> {
        let mut out = [DVec2::ZERO; 4];
        for (to, from) in out.iter_mut().zip(piece) {
            *to = self.frame.map(self.plane.project(from)?);
        }
        Some(out)
    }

    fn quills(&self, quills: &comb::Quills) -> Option<Shape> {
        let mut pen = Pen::new(1);
        for (root, tip) in quills.iter().flatten() {
            pen.move_to(self.frame.map(*root));
            pen.line_to(self.frame.map(*tip));
        }
        path(pen.finish(), None)
    }

    fn envelope(&self, quills: &comb::Quills) -> Option<Shape> {
        let mut pen = Pen::new(1);
        let mut drawing = false;
        for quill in quills {
            match quill {
                Some((_, tip)) if drawing => pen.line_to(self.frame.map(*tip)),
                Some((_, tip)) => pen.move_to(self.frame.map(*tip)),
                None => {}
            }
            drawing = quill.is_some();
        }
        path(pen.finish(), None)
    }
}

/// Path data and its tooltip.
struct Shape {
    data: String,
    tooltip: Option<String>,
}

/// A shape. `None` for empty data.
fn path(data: String, tooltip: Option<String>) -> Option<Shape> {
    (!data.is_empty()).then_some(Shape { data, tooltip })
}
