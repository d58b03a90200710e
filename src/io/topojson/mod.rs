//! TopoJSON: maps as arcs that neighbours share, quantised or not.
//!
//! A topology is read by way of GeoJSON, with a note of its objects, and written from the document
//! of GeoJSON. So each of both is written from each. Arcs are found anew when a batch is written,
//! since its curves may have any points by then.

mod read;
mod write;

pub(super) use read::as_geojson;
pub(super) use write::write;
