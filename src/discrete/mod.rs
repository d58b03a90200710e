//! Discrete fair curves by Sobolev gradients.

mod edges;
mod energy;

pub use energy::*;
