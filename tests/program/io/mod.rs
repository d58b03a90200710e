//! Files in and out: what is written reads back to the same bits, bad files are sentences, real
//! data comes in whole.

mod atomic;
mod bombs;
mod controls;
mod damage;
mod decimals;
mod documents;
mod errors;
mod formats;
mod gpx;
mod grids;
mod meshes;
mod npz;
mod odd;
mod real_data;
mod rows;
mod sentences;
mod streams;
mod surfaces;
mod tracts;

use std::path::Path;

use faircurve::CurveBatch;
use faircurve::io::{self, WriteOptions};

const FORMATS: [&str; 8] = ["csv", "geojson", "svg", "npz", "csv.gz", "geojson.gz", "svg.gz", "npz.gz"];

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// Same dimension, same curves, same names, same coordinates to the last bit, the same curves
/// closed.
fn assert_same(found: &CurveBatch, wanted: &CurveBatch, what: &str) {
    assert_eq!(found.dimension(), wanted.dimension(), "{what}");
    assert_eq!(found.offsets(), wanted.offsets(), "{what}");
    assert_eq!(bits(found.coords()), bits(wanted.coords()), "{what}");
    for i in 0..wanted.len() {
        assert_eq!(found.name(i), wanted.name(i), "{what}, curve {i}");
        assert_eq!(found.is_closed(i), wanted.is_closed(i), "{what}, curve {i}");
    }
}

fn through(folder: &Path, batch: &CurveBatch, extension: &str) -> CurveBatch {
    let path = folder.join(format!("batch.{extension}"));
    io::write_with(&path, batch, &WriteOptions { overwrite: true, ..WriteOptions::default() }).unwrap();
    io::read(&path).unwrap()
}
