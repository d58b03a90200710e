//! Batched linear algebra on plain slices.
//!
//! [`solve_tridiagonal_batch`] solves many tridiagonal systems at once, open and cyclic, of any and different lengths.
//! Systems lie side by side in the lanes of the CPU's vector registers, so that a batch is solved many times faster
//! than one system after the other, with the same bits for each.

mod elimination;
mod lanes;
mod pentadiagonal;
mod real;
pub mod ring;
mod singular;
mod tasks;
pub mod thomas;
mod tridiagonal;

pub(crate) use lanes::{Part, Scratch};
pub use pentadiagonal::{
    factor_cyclic_pentadiagonal, factor_pentadiagonal, solve_cyclic_pentadiagonal, solve_pentadiagonal,
};
pub use real::Real;
pub(crate) use tasks::{take, tasks};
pub use tridiagonal::{Cyclic, Matrix, Solutions, TridiagonalBatch, solve_tridiagonal_batch};
