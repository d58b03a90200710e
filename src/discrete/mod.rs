//! Discrete fair curves by Sobolev gradients.

#[doc(hidden)]
pub mod at;
mod compose;
mod edges;
mod energy;
mod evaluate;
#[doc(hidden)]
pub mod evaluate_gpu;
mod hessian;
#[cfg(test)]
mod tests;

pub use energy::*;
pub use evaluate::{Evaluate, Evaluation};
pub(crate) use evaluate_gpu::evaluate_kernels;
