//! [`ReliefSheet`]: shaded surfaces over grids, side by side on one page.

mod paint;
mod scene;

#[cfg(test)]
mod tests;

use std::io::{self, Write};

use glam::DVec2;

use super::DOTS;
use super::layout::{Bounds, Frame};
use super::page::{Entry, LINE, Page, SIDE, short, thousands, wrap};
use super::panel::Bar;
use super::svg::{Pen, escape};
use scene::{HEIGHTS, Scene, View};

/// Pixels between neighbouring panels, and around the content of a panel.
const GAP: f64 = 20.0;
const MARGIN: f64 = 10.0;

/// Least and largest height of a panel, as fractions of its width.
const LOWEST: f64 = 0.2;
const HIGHEST: f64 = 1.1;

/// The most panels. The caption says if there are more.
const MOST_PANELS: usize = 24;

/// The most quadrangles of a panel, and of all panels together. Larger surfaces are drawn with
/// fewer lines.
const MOST_QUADS: usize = 10_000;
const MOST_QUADS_TOGETHER: usize = 60_000;

/// The most points of a net. A larger net would cover the surface.
const MOST_NET_POINTS: usize = 2_500;

/// The control points of a surface: rows and columns, and values of the same kind as the surface's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Net<'a> {
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Values row after row, with as many values a point as the surface has.
    pub values: &'a [f64],
}

/// A surface over a rectangular grid: one panel of a [`ReliefSheet`].
///
/// Heights (one value a point) stand over rows and columns, and are tinted by height. Points of the
/// plane are seen from above. Points of space are seen in a parallel view from the front and above.
/// Values that are not finite are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Relief<'a> {
    /// A line above the panel.
    pub title: String,
    /// Values a point: 1, 2 or 3. If there are more, the first three are drawn.
    pub dimension: usize,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// The values, row after row, point after point.
    pub values: &'a [f64],
    /// The control points, drawn as a thin net over the surface.
    pub net: Option<Net<'a>>,
    /// The heights of the first and the last tint. By default they are the extremes of surface and
    /// net.
    ///
    /// Give the same range to panels that are to be compared.
    pub range: Option<[f64; 2]>,
}

/// Several [`Relief`]s on one page, as SVG.
///
/// ```
/// use faircurve::picture::{Relief, ReliefSheet};
/// let heights = [0.0, 1.0, 0.0, 1.0, 2.0, 1.0, 0.0, 1.0, 0.0];
/// let hill = Relief { title: "hill".into(), dimension: 1, shape: [3, 3], values: &heights, net: None, range: None };
/// let svg = ReliefSheet { reliefs: vec![hill], ..ReliefSheet::default() }.draw();
/// assert!(svg.contains("1 grid, 9 points"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ReliefSheet<'a> {
    /// Width in pixels. The height follows from what is drawn. Default 1000, at least 160.
    pub width: f64,
    /// Panels a row. Default 0: 1 for a single panel, 2 up to four, else 3.
    pub columns: usize,
    /// A line above all panels. Default none.
    pub title: Option<String>,
    /// Text of the caption after the numbers of grids and points. Default empty.
    pub caption: String,
    /// The panels, row by row. The first 24 are drawn.
    pub reliefs: Vec<Relief<'a>>,
}

impl Default for ReliefSheet<'_> {
    fn default() -> Self {
        ReliefSheet { width: 1000.0, columns: 0, title: None, caption: String::new(), reliefs: Vec::new() }
    }
}

/// A panel's scene and its place on the page.
struct Placed<'a> {
    relief: &'a Relief<'a>,
    scene: Scene,
    title: Vec<String>,
    top: f64,
    frame: Frame,
    foot: Vec<String>,
}

impl ReliefSheet<'_> {
    /// The sheet as SVG text.
    ///
    /// # Panics
    /// If the number of values of a relief or its net is not that of its shape and dimension.
    pub fn draw(&self) -> String {
        let mut out = Vec::new();
        self.write(&mut out).expect("a Vec takes all that is written to it");
        String::from_utf8(out).expect("written from strings")
    }

    /// Writes the sheet as SVG text.
    ///
    /// # Errors
    /// Those of `out`.
    ///
    /// # Panics
    /// If the number of values of a relief or its net is not that of its shape and dimension.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let width = if self.width.is_nan() { 160.0 } else { self.width.clamp(160.0, 1e5) };
        let drawn = &self.reliefs[..self.reliefs.len().min(MOST_PANELS)];
        let columns = match (self.columns, drawn.len()) {
            (0, n) => [1, 1, 2, 2, 2].get(n).copied().unwrap_or(3),
            (given, n) => given.min(n.max(1)),
        };
        let wide = ((width - 2.0 * SIDE - GAP * (columns - 1) as f64) / columns as f64).max(20.0);
        let quads = MOST_QUADS.min(MOST_QUADS_TOGETHER / drawn.len().max(1));
        let mut y = if self.title.is_some() { 44.0 } else { 16.0 };
        let mut placed = Vec::new();
        for row in drawn.chunks(columns) {
            y = place(row, wide, quads, y, &mut placed) + GAP;
        }
        let bottom = (y - GAP).max(0.0);
        let whole = Frame::inside(Bounds::EMPTY, DVec2::ONE, [0.0, 0.0, width, bottom], 0.0);
        let page = Page { frame: &whole, width, title: self.title.as_deref() };
        page.open(out, &legend(&placed), &self.caption(&placed))?;
        for panel in &placed {
            panel.write(out)?;
        }
        page.close(out)
    }

    fn caption(&self, placed: &[Placed]) -> String {
        let plural = |n: usize, what: &str| format!("{} {what}{}", thousands(n), if n == 1 { "" } else { "s" });
        let points = self.reliefs.iter().map(|relief| relief.shape[0] * relief.shape[1]).sum();
        let mut parts = vec![format!("{}, {}", plural(self.reliefs.len(), "grid"), plural(points, "point"))];
        if self.reliefs.len() > placed.len() {
            parts.push(format!("the first {} are drawn", placed.len()));
        }
        parts.extend((!self.caption.is_empty()).then(|| self.caption.clone()));
        let seen = |view: View| placed.iter().any(|panel| panel.scene.view == view);
        if seen(View::Oblique) {
            parts.push("parallel view from above".into());
        }
        if seen(View::Above) {
            parts.push("seen from above".into());
        }
        if placed.iter().any(|panel| panel.scene.heights.is_some()) {
            parts.push("heights scaled".into());
        }
        parts.join(" · ")
    }
}

fn legend(placed: &[Placed]) -> Vec<Entry> {
    let net = placed.iter().any(|panel| !panel.scene.net.is_empty() || !panel.scene.dots.is_empty());
    let entry =
        Entry { colour: DOTS.into(), width: 0.8, dashed: false, dot: Some((DOTS, 1.6)), text: "control points".into() };
    if net { vec![entry] } else { Vec::new() }
}

/// Places a row of panels from `top` on. Returns where the row ends.
fn place<'a>(row: &'a [Relief<'a>], wide: f64, quads: usize, top: f64, placed: &mut Vec<Placed<'a>>) -> f64 {
    let inner = wide - 2.0 * MARGIN;
    let scenes: Vec<Scene> = row.iter().map(|relief| Scene::of(relief, quads)).collect();
    // Titles are 13 pixels high, but `wrap` counts with 12.
    let title =
        |relief: &Relief| if relief.title.is_empty() { Vec::new() } else { wrap(&relief.title, wide * 12.0 / 13.0) };
    let titles: Vec<_> = row.iter().map(title).collect();
    let lines = titles.iter().map(Vec::len).max().unwrap_or(0);
    let extent = |scene: &Scene| {
        let extent = scene.bounds.high - scene.bounds.low;
        // Nothing or a single point gets a low box.
        let is_seen = extent.is_finite() && scene.bounds.size() > 0.0;
        if is_seen { extent.max(DVec2::splat(scene.bounds.size() * 1e-9)) } else { DVec2::new(1.0, LOWEST) }
    };
    let high =
        scenes.iter().map(|scene| (inner * extent(scene).y / extent(scene).x).clamp(LOWEST * inner, HIGHEST * inner));
    let high = high.fold(0.0, f64::max) + 2.0 * MARGIN;
    let head = top + LINE * lines as f64;
    let mut end = head + high;
    for (k, ((relief, scene), title)) in row.iter().zip(scenes).zip(titles).enumerate() {
        let left = SIDE + k as f64 * (wide + GAP);
        let frame = Frame::inside(scene.bounds, extent(&scene), [left, head, left + wide, head + high], MARGIN);
        let foot = wrap(&details(relief, &scene), wide);
        let bar = if scene.tints().is_some() { LINE } else { 0.0 };
        end = end.max(head + high + bar + LINE * foot.len() as f64);
        placed.push(Placed { relief, scene, title, top, frame, foot });
    }
    end
}

/// "65 × 97 points, every 2nd line drawn".
fn details(relief: &Relief, scene: &Scene) -> String {
    let [rows, columns] = relief.shape;
    let mut text = format!("{} × {} points", thousands(rows), thousands(columns));
    if let Some(Net { shape: [rows, columns], .. }) = relief.net {
        text += &format!(" from {} × {}", thousands(rows), thousands(columns));
        if rows * columns > MOST_NET_POINTS {
            text += " (the net is left out)";
        }
    }
    match scene.every {
        1 => {}
        2 => text += ", every 2nd line is drawn",
        3 => text += ", every 3rd line is drawn",
        k => text += &format!(", every {k}th line is drawn"),
    }
    if let (View::Front, Some([low, high])) = (scene.view, scene.heights) {
        let heights =
            if low < high { format!("s from {} to {}", short(low), short(high)) } else { format!(" {}", short(low)) };
        text += &format!(", height{heights}");
    }
    if scene.is_empty() {
        text += ", none of them finite";
    }
    text
}

impl Placed<'_> {
    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let [left, _, _, bottom] = self.frame.plot;
        for (line, text) in self.title.iter().enumerate() {
            let y = self.top + 13.0 + LINE * line as f64;
            writeln!(out, r#"<text x="{left:.1}" y="{y:.1}" font-size="13">{}</text>"#, escape(text))?;
        }
        writeln!(out, r#"<g class="relief">"#)?;
        self.faces(out)?;
        self.lines(out)?;
        writeln!(out, "</g>")?;
        let mut y = bottom + 14.0;
        if let Some([from, to]) = self.scene.tints() {
            let text = if self.relief.title.is_empty() { "height" } else { "" };
            let bar = Bar { text: text.into(), from, to, unit: String::new(), colours: HEIGHTS.to_vec() };
            bar.write(out, left, y)?;
            y += LINE;
        }
        for text in &self.foot {
            writeln!(out, r#"<text x="{left:.1}" y="{y:.1}">{}</text>"#, escape(text))?;
            y += LINE;
        }
        Ok(())
    }

    /// Faces from the back to the front, then the walls below the borders in front.
    fn faces(&self, out: &mut dyn Write) -> io::Result<()> {
        let polygon = |corners: &[DVec2]| {
            let mut pen = Pen::new(1);
            pen.move_to(self.frame.map(corners[0]));
            for &corner in &corners[1..] {
                pen.line_to(self.frame.map(corner));
            }
            pen.close();
            pen.finish()
        };
        // Neighbours overlap by their strokes, so that no gaps show.
        writeln!(out, r#"<g class="faces" stroke-width=".6">"#)?;
        for face in &self.scene.faces {
            let (colour, stroke) = (paint::hex(face.colour), paint::hex(face.stroke));
            writeln!(out, r#"<path fill="{colour}" stroke="{stroke}" d="{}"/>"#, polygon(&face.corners))?;
        }
        writeln!(out, "</g>\n<g class=\"walls\" stroke-width=\".6\">")?;
        for wall in &self.scene.walls {
            let colour = paint::hex(wall.colour);
            writeln!(out, r#"<path fill="{colour}" stroke="{colour}" d="{}"/>"#, polygon(&wall.corners))?;
        }
        writeln!(out, "</g>")
    }

    /// Everything but the faces: the curve of a grid of one row, the net, and its points.
    fn lines(&self, out: &mut dyn Write) -> io::Result<()> {
        let data = |lines: &[Vec<DVec2>]| {
            let mut pen = Pen::new(1);
            for line in lines.iter().filter(|line| !line.is_empty()) {
                match line[..] {
                    [point] => pen.dot(self.frame.map(point)),
                    _ => pen.move_to(self.frame.map(line[0])),
                }
                for &point in &line[1..] {
                    pen.line_to(self.frame.map(point));
                }
            }
            pen.finish()
        };
        if !self.scene.curve.is_empty() {
            let (colour, width) =
                (super::FITTED, if self.scene.curve.iter().any(|line| line.len() > 1) { 1.8 } else { 5.0 });
            writeln!(
                out,
                r#"<path class="curve" stroke="{colour}" stroke-width="{width}" d="{}"/>"#,
                data(&self.scene.curve)
            )?;
        }
        if !self.scene.net.is_empty() {
            let net = data(&self.scene.net);
            writeln!(out, r#"<path class="net" stroke="{DOTS}" stroke-width=".7" stroke-opacity=".55" d="{net}"/>"#)?;
        }
        if !self.scene.dots.is_empty() {
            let mut pen = Pen::new(1);
            for &point in &self.scene.dots {
                pen.dot(self.frame.map(point));
            }
            writeln!(out, r#"<path class="dots" stroke="{DOTS}" stroke-width="2.8" d="{}"/>"#, pen.finish())?;
        }
        Ok(())
    }
}
