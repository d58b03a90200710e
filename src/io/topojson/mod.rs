//! TopoJSON: maps as arcs that neighbours share, quantised or not.
//!
//! A topology is read by way of GeoJSON, with a note of its objects, and written from the document
//! of GeoJSON. So both formats convert to each other. Arcs are found again when a batch is written,
//! since its curves may have other points by then.

mod write;

use super::entry::Entry;
use super::geojson;

pub(super) const ENTRY: Entry = Entry {
    reads: "the same, quantised or not; also as `.json`",
    writes: "the same objects with arcs of new coordinates, quantised with `--digits`; also as `.json`",
    lacks: geojson::LACKS,
    statuses: true,
    fills: geojson::fills,
    // Both end in .json. A topology says that it is one.
    ..Entry::new("topojson", "TopoJSON", geojson::read, |out, batch, options, _| write::write(out, batch, options))
};
