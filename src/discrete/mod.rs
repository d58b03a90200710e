//! Discrete fair curves by Sobolev gradients.

#[doc(hidden)]
pub mod at;
mod compose;
mod descent;
mod edges;
mod energy;
#[doc(hidden)]
pub mod evaluate_gpu;
mod graph;
mod hessian;
mod line_search;
mod metric;
mod minimisation;
mod newton;
mod problem;
#[cfg(test)]
mod tests;

pub use descent::{Direction, Step};
pub use energy::*;
pub(crate) use evaluate_gpu::evaluate_kernels;
pub use graph::{Graph, GraphIteration, GraphMove, GraphTrace, Mesh};
pub use minimisation::{Ending, InnerProduct, Iterate, Minimisation, Minimised, Minimiser};
