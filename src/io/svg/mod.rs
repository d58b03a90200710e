//! SVG: reads the curves of a drawing, or their control points, and writes the drawing again with
//! other paths; draws curves that come from elsewhere, also as cubic Béziers.

mod arc;
mod chain;
mod document;
mod length;
pub(super) mod motion;
mod path;
mod read;
mod shape;
mod transform;
mod write;

use super::entry::Entry;

pub(super) const ENTRY: Entry = Entry {
    reads: "paths, lines, polygons, rectangles, circles, ellipses",
    writes: "the same drawing with new paths, or one path a curve; Béziers",
    lacks: "path, polyline, polygon, line, rect, circle and ellipse elements are read",
    dimensions: 2..=2,
    beziers: true,
    fills: write::fills,
    ..Entry::new("svg", "SVG", read::read, |out, batch, options, _| write::write(out, batch, options))
};
