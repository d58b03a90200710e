//! GeoJSON, read straight into flat coordinates and written back into the document that was read.
//!
//! The document's text is kept without its coordinates. So features, order, ids, properties,
//! foreign members and even the layout come back unchanged. Neither reading nor writing builds a
//! tree of numbers. (The `geojson` crate allocates a vector for each position and holds numbers of
//! properties as f64. The tests use it as a second opinion.)

mod along;
mod coordinates;
mod cut;
mod lists;
mod read;
mod topology;
mod write;

use std::ops::Range;

use super::entry::Entry;
use crate::batch::CurveBatch;
pub(super) use read::read;
pub(super) use write::{fills, holds, is_own, objects, write, write_with};

pub(super) const ENTRY: Entry = Entry {
    extensions: &["json"],
    reads: "lines, rings and polygons",
    writes: "the same document with new coordinates",
    lacks: LACKS,
    statuses: true,
    fills: write::fills,
    parameters: true,
    ..Entry::new("geojson", "GeoJSON", read, |out, batch, options, _| write::write(out, batch, options))
};

/// What a document without a curve lacks.
pub(super) const LACKS: &str = "LineString, MultiLineString, Polygon and MultiPolygon geometries are read";

/// A document without its coordinates.
#[derive(Debug, Default)]
pub(crate) struct Document {
    /// The text without the coordinates of lines and rings, and without the bounding boxes around
    /// them.
    text: String,
    /// Where coordinates and types belong, in order.
    slots: Vec<Slot>,
    /// The first curve of every geometry, and how its curves nest.
    shapes: Vec<(usize, Shape)>,
    /// Number of curves of all slots together.
    curves: usize,
    /// Curves without altitudes in a document that has altitudes, in order. They are at 0.
    flat: Vec<usize>,
    /// The objects of a topology that the features are of, in order. GeoJSON has none.
    objects: Vec<Object>,
}

impl Document {
    /// The document that the batch came from, if it has the same curves still.
    fn of(batch: &CurveBatch) -> Option<&Document> {
        let document: &Document = batch.origin().document.as_ref()?.downcast_ref()?;
        (document.curves == batch.len()).then_some(document)
    }
}

/// An object of a topology.
#[derive(Clone, Debug)]
pub(super) struct Object {
    pub name: String,
    /// Number of its features.
    pub features: usize,
    /// Those of them that are null.
    pub nulls: Vec<usize>,
}

/// A part of the text taken out.
#[derive(Debug)]
struct Slot {
    /// Byte of the text before which the part stood.
    at: usize,
    part: Part,
}

/// What is taken out of a geometry, by its number.
#[derive(Debug)]
enum Part {
    /// The value of its type.
    Kind(usize),
    Coordinates(usize),
    /// The status of curves, where it is written.
    Status(Mark),
}

/// A place for the status of curves.
#[derive(Debug)]
struct Mark {
    /// The curves of a feature.
    curves: Range<usize>,
    /// The member's name.
    name: &'static str,
    /// What stands around the member, and what stands there without it.
    around: [&'static str; 2],
    otherwise: &'static str,
}

/// How the curves of one geometry nest.
#[derive(Debug)]
enum Shape {
    /// LineString: one curve.
    Line,
    /// MultiLineString: the number of its curves.
    Lines(usize),
    /// Polygon: the number of its rings.
    Polygon(usize),
    /// MultiPolygon: the rings of each polygon.
    Polygons(Vec<usize>),
}

impl Shape {
    /// The type in GeoJSON's words.
    fn kind(&self) -> &'static str {
        match self {
            Shape::Line => "LineString",
            Shape::Lines(_) => "MultiLineString",
            Shape::Polygon(_) => "Polygon",
            Shape::Polygons(_) => "MultiPolygon",
        }
    }

    fn curves(&self) -> usize {
        match self {
            Shape::Line => 1,
            Shape::Lines(curves) | Shape::Polygon(curves) => *curves,
            Shape::Polygons(rings) => rings.iter().sum(),
        }
    }
}
