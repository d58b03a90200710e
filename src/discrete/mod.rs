//! Discrete fair curves by Sobolev gradients.

mod descent;
mod edges;
mod energy;
mod line_search;
mod metric;
mod problem;

pub use descent::{Direction, Step};
pub use energy::*;
