//! Maps: curves that share borders stay together, whatever is done to them.

mod mending;
mod sharing;

use faircurve::{CurveBatch, Sampling, io};

/// The countries of the world, and all land.
fn world() -> CurveBatch {
    io::read("examples/data/world-110m.topojson").unwrap()
}

/// Samples as bits, to be told apart exactly.
fn bits(batch: &CurveBatch, i: usize) -> Vec<[u64; 2]> {
    batch.points(i).as_chunks::<2>().0.iter().map(|point| point.map(f64::to_bits)).collect()
}

const EIGHT: Sampling = Sampling::PerSpan(8);
