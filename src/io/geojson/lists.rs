//! Lists of positions, and which curves have which.

use std::io;

use super::Document;
use crate::batch::CurveBatch;
use crate::io::text::Text;

pub(super) fn list(
    text: &mut Text,
    count: usize,
    mut entry: impl FnMut(&mut Text, usize) -> io::Result<()>,
) -> io::Result<()> {
    text.push("[")?;
    for k in 0..count {
        if k > 0 {
            text.push(",")?;
        }
        entry(text, k)?;
    }
    text.push("]")
}

/// Lists of one line, or a list of them.
pub(super) fn nested(
    text: &mut Text,
    lines: usize,
    mut line: impl FnMut(&mut Text, usize) -> io::Result<()>,
) -> io::Result<()> {
    if lines == 1 { line(text, 0) } else { list(text, lines, line) }
}

/// Whether curve `i` came without altitudes, in a document that has altitudes.
pub(super) fn is_flat(batch: &CurveBatch, i: usize) -> bool {
    Document::of(batch).is_some_and(|document| document.flat.binary_search(&i).is_ok())
}

/// Whether every point of curve `i` has a longitude and a latitude.
pub(super) fn has_places(batch: &CurveBatch, i: usize) -> bool {
    batch.points(i).chunks_exact(batch.dimension()).all(|point| point[0].is_finite() && point[1].is_finite())
}

/// Writes a point. An altitude that is NaN is left out.
pub(super) fn position(text: &mut Text, point: &[f64]) -> io::Result<()> {
    let axes = point.len() - usize::from(point.last().is_some_and(|x| !x.is_finite()));
    text.push("[")?;
    text.point(&point[..axes], ",")?;
    text.push("]")
}
