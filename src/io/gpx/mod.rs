//! GPX, GPS Exchange, as receivers write tracks (topografix.com/GPX/1/1).
//!
//! The file is kept, to be written again with other points and all else as it was. (The `gpx` crate
//! drops extensions, such as heart rates, and the layout.)

mod read;
mod write;

use std::ops::Range;

use super::entry::Entry;
use crate::batch::{Column, CurveBatch};
use crate::tracks::ELEVATION;

pub(super) const ENTRY: Entry = Entry {
    reads: "tracks and routes with times, elevations and other numbers of points",
    writes: "the same file with new points, or a track a curve",
    lacks: "there is no track and no route with points",
    dimensions: 2..=2,
    fills: |batch| document(batch).is_some(),
    parameters: true,
    ..Entry::new("gpx", "GPX", read::read, |out, batch, options, _| write::write(out, batch, options))
};

/// The file that tracks were read from.
struct Document {
    text: String,
    /// What changes in the text, in order of the places.
    edits: Vec<(Range<usize>, Edit)>,
    values: Vec<Value>,
    /// Number of curves.
    curves: usize,
}

/// What takes the place of a part of the text.
enum Edit {
    /// Nothing, in place of the bounds of what changes.
    Nothing,
    /// The points of a curve, as elements of this name.
    Points(usize, String),
}

/// Numbers of points, each in an element.
struct Value {
    /// The column that holds them.
    column: String,
    /// The names of the elements around them, from the point on.
    path: Vec<String>,
    /// Whether all are whole. They are rounded then, since heart beats have no fractions.
    is_whole: bool,
}

/// Whether files have a place for a column of a batch.
pub(super) fn holds(batch: &CurveBatch, column: &Column) -> bool {
    let own = |document: &Document| document.values.iter().any(|value| value.column == column.name);
    column.values.numbers().is_some() && (column.name == ELEVATION || document(batch).is_some_and(own))
}

/// The file that the batch came from, if it has the same curves still.
fn document(batch: &CurveBatch) -> Option<&Document> {
    whole(batch).filter(|document| document.curves == batch.len())
}

/// Whether curves of the file were divided, so that it cannot be written again.
pub(super) fn is_divided(batch: &CurveBatch) -> bool {
    whole(batch).is_some() && document(batch).is_none()
}

fn whole(batch: &CurveBatch) -> Option<&Document> {
    batch.origin().document.as_ref()?.downcast_ref()
}
