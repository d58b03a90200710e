//! Laplacian subdivision of grids.

mod exact;
mod rules;
mod sparse;
