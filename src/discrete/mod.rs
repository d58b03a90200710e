//! Discrete fair curves: energies of polylines, minimised by Sobolev gradients (R. J. Renka).

mod graph;

pub use graph::{Graph, GraphIteration, GraphMove, GraphTrace, Mesh};
