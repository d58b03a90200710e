//! [`Sheet`]: panels side by side on one page.

use std::io::{self, Write};

use glam::DVec2;

use super::layout::{Bounds, Frame};
use super::page::{Entry, LINE, Page, SIDE, wrap};
use super::panel::{Panel, hex, width};
use super::svg::escape;

/// Pixels between neighbours, and between a panel's frame and its content.
pub const GAP: f64 = 20.0;
const MARGIN: f64 = 18.0;

/// Least and largest height of a panel, as parts of its width.
const LOWEST: f64 = 0.25;
const HIGHEST: f64 = 1.3;

/// Several [`Panel`]s in rows of `columns`.
///
/// The panels share one legend. Panels of a row have one scale and one size, so that their curves
/// can be compared. Each panel has its own middle.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Width in pixels. The height follows from what is drawn. Default 1000, at least 160.
    pub width: f64,
    /// Panels a row. Default 2. 0 counts as 1.
    pub columns: usize,
    /// A line above all panels. Default none.
    pub title: Option<String>,
    /// Text below the legend. Default empty.
    pub caption: String,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
}

impl Default for Sheet {
    fn default() -> Self {
        Sheet { width: 1000.0, columns: 2, title: None, caption: String::new(), panels: Vec::new() }
    }
}

/// A panel's title in lines, the place of its first line, and the panel's frame.
struct Placed {
    title: Vec<String>,
    corner: [f64; 2],
    frame: Frame,
}

/// What stands below the panels of a [`Sheet`].
pub trait Below {
    /// Pixels from its top to its bottom on a page of this width. 0 if there is nothing.
    fn height(&self, width: f64) -> f64;

    /// Writes it from `top` on.
    ///
    /// # Errors
    /// Those of `out`.
    fn write(&self, out: &mut dyn Write, width: f64, top: f64) -> io::Result<()>;
}

impl Below for () {
    fn height(&self, _: f64) -> f64 {
        0.0
    }

    fn write(&self, _: &mut dyn Write, _: f64, _: f64) -> io::Result<()> {
        Ok(())
    }
}

impl Sheet {
    /// Writes the sheet, and something below its panels, piece by piece.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, out: &mut dyn Write, below: &dyn Below) -> io::Result<()> {
        let width = if self.width.is_nan() { 160.0 } else { self.width.clamp(160.0, 1e5) };
        let columns = self.columns.max(1);
        let mut y = if self.title.is_some() { 44.0 } else { 16.0 };
        let mut placed = Vec::new();
        let wide = column(width, columns.min(self.panels.len().max(1)));
        for row in self.panels.chunks(columns) {
            y = place(row, wide, y, &mut placed) + GAP;
        }
        let top = y;
        let height = below.height(width);
        y += if height > 0.0 { height + GAP } else { 0.0 };

        let bottom = (y - GAP).max(0.0);
        let whole = Frame::inside(Bounds::EMPTY, DVec2::ONE, [0.0, 0.0, width, bottom], 0.0);
        let page = Page { frame: &whole, width, title: self.title.as_deref() };
        page.open(out, &self.legend(), &self.caption)?;
        for (k, (panel, at)) in self.panels.iter().zip(&placed).enumerate() {
            for (line, text) in at.title.iter().enumerate() {
                let [x, y] = at.corner;
                let y = y + LINE * line as f64;
                writeln!(out, r#"<text x="{x:.1}" y="{y:.1}" font-size="13">{}</text>"#, escape(text))?;
            }
            panel.write(out, &at.frame, &format!("panel{k}"))?;
        }
        below.write(out, width, top)?;
        page.close(out)
    }

    /// One entry for each name, in the order in which names appear.
    fn legend(&self) -> Vec<Entry> {
        let mut entries: Vec<Entry> = Vec::new();
        for stroke in self.panels.iter().flat_map(|panel| &panel.strokes) {
            if let Some(name) = stroke.name.as_ref().filter(|name| entries.iter().all(|entry| entry.text != **name)) {
                let (colour, width) = (hex(stroke.colour).into(), width(stroke));
                entries.push(Entry { colour, width, dashed: false, dot: None, text: name.clone() });
            }
        }
        entries
    }
}

/// The width of one of `columns` columns on a page of this width.
pub fn column(width: f64, columns: usize) -> f64 {
    ((width - 2.0 * SIDE - GAP * (columns - 1) as f64) / columns as f64).max(20.0)
}

/// Places a row of panels from `top` on. Returns where the row ends.
fn place(row: &[Panel], wide: f64, top: f64, placed: &mut Vec<Placed>) -> f64 {
    // Titles are 13 pixels high, but `wrap` counts with 12.
    let titles: Vec<_> = row.iter().map(|panel| wrap(&panel.title, wide * 12.0 / 13.0)).collect();
    let lines = titles.iter().map(Vec::len).max().unwrap_or(0);
    let bounds: Vec<Bounds> = row.iter().map(Panel::bounds).collect();
    let sizes = bounds.iter().map(|b| b.high - b.low).filter(|size| size.is_finite());
    let extent = sizes.fold(DVec2::ZERO, DVec2::max);
    let side = if extent.max_element() > 0.0 { extent.max_element() } else { 1.0 };
    let extent = extent.max(DVec2::splat(side * 1e-9));
    let inner = wide - 2.0 * MARGIN;
    let high = (inner * extent.y / extent.x).clamp(LOWEST * inner, HIGHEST * inner) + 2.0 * MARGIN;
    let head = top + LINE * lines as f64;
    for (k, (bounds, title)) in bounds.into_iter().zip(titles).enumerate() {
        let left = SIDE + k as f64 * (wide + GAP);
        let frame = Frame::inside(bounds, extent, [left, head, left + wide, head + high], MARGIN);
        placed.push(Placed { title, corner: [left, top + 13.0], frame });
    }
    head + high + row.iter().map(Panel::foot).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::panel::Bar;

    fn wave(length: f64) -> Panel {
        let at = |k: i32| f64::from(k) / 60.0;
        let sine = (0..=60).map(at).map(|t| DVec2::new(length * t, 0.2 * length * (6.0 * t).sin())).collect();
        let dots = [DVec2::ZERO, DVec2::X * length];
        Panel::by_value(format!("a wave {length} long"), &[(0.5, sine)], &dots, Bar::new("value", [0.0, 1.0]))
    }

    #[test]
    fn panels_of_a_row_have_one_scale_and_nothing_overlaps() {
        let (mut placed, width) = (Vec::new(), 1000.0);
        let wide = column(width, 2);
        let end = place(&[wave(2.0), wave(4.0)], wide, 44.0, &mut placed);
        assert_eq!(placed[0].frame.scale, placed[1].frame.scale);
        let [a, b] = [placed[0].frame.plot, placed[1].frame.plot];
        assert!(a[2] < b[0] && b[2] <= width && a[3] == b[3] && a[3] <= end, "{a:?} {b:?}");
        // The longer wave fills its panel from margin to margin, the shorter one stands in the
        // middle.
        let across =
            |at: &Placed, length: f64| [0.0, length].map(|x| at.frame.map(DVec2::new(x, 0.0)).x - at.frame.plot[0]);
        assert_eq!(across(&placed[1], 4.0), [MARGIN, wide - MARGIN]);
        let [left, right] = across(&placed[0], 2.0);
        assert!((left + right - wide).abs() < 1e-9 && (right - left - 0.5 * (wide - 2.0 * MARGIN)).abs() < 1e-9);
    }
}
