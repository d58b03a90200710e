//! Discrete fair curves by Sobolev gradients.

mod edges;
mod energy;
mod hessian;
#[cfg(test)]
mod tests;

pub use energy::*;
