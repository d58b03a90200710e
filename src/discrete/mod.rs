//! Discrete fair curves by Sobolev gradients.

#[doc(hidden)]
pub mod at;
mod compose;
mod constrain;
mod curves;
mod descent;
mod descent_gpu;
mod edges;
mod energy;
mod evaluate;
#[doc(hidden)]
pub mod evaluate_gpu;
mod fair;
mod graph;
mod hessian;
mod line_search;
mod metric;
mod minimisation;
mod newton;
mod problem;
mod setup;
#[cfg(test)]
mod tests;

pub use descent::{Direction, Step};
pub(crate) use descent_gpu::descent_kernels;
pub use energy::*;
pub use evaluate::{Evaluate, Evaluation};
pub(crate) use evaluate_gpu::evaluate_kernels;
pub use fair::{Fair, Pins, Segments};
pub use graph::{Graph, GraphIteration, GraphMove, GraphTrace, Mesh};
pub use minimisation::{Ending, InnerProduct, Iterate, Minimisation, Minimised, Minimiser};
