//! Discrete fair curves by Sobolev gradients.

mod edges;
mod energy;
mod evaluate;
mod hessian;
#[cfg(test)]
mod tests;

pub use energy::*;
pub use evaluate::{Evaluate, Evaluation};
