//! Discrete fair curves by Sobolev gradients.

#[doc(hidden)]
pub mod at;
mod compose;
mod edges;
mod energy;
#[doc(hidden)]
pub mod evaluate_gpu;
mod hessian;

pub use energy::*;
pub(crate) use evaluate_gpu::evaluate_kernels;
