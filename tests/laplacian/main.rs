//! Laplacian subdivision of grids.

#[path = "../common/programmes.rs"]
mod programmes;

mod curves;
mod exact;
mod rules;
mod sparse;
mod unbounded;
