//! Discrete fair curves by Sobolev gradients.

mod descent;
mod edges;
mod energy;
mod hessian;
mod line_search;
mod metric;
mod problem;
#[cfg(test)]
mod tests;

pub use descent::{Direction, Step};
pub use energy::*;
