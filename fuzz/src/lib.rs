//! What is fuzzed: functions of arbitrary bytes that must not panic, hang, or take memory beyond
//! reason, and that check what faircurve promises of any input. libFuzzer drives them by coverage
//! (`fuzz/run.sh`), `tests/fuzz.rs` for some seconds in every run of the tests.

mod arguments;
mod batches;
mod methods;
mod numbers;
mod readers;

pub use arguments::arguments;
pub use methods::methods;
pub use readers::{csv, geojson, grids, npz, round_trip, svg, tracts};

/// A function of arbitrary bytes.
pub type Target = fn(&[u8]);

/// The targets that need nothing but bytes, by name: each has a folder of that name in
/// `fuzz/corpus`.
pub const TARGETS: [(&str, Target); 8] = [
    ("csv", csv),
    ("geojson", geojson),
    ("svg", svg),
    ("npz", npz),
    ("tracts", tracts),
    ("grids", grids),
    ("round_trip", round_trip),
    ("methods", methods),
];
