//! Batched linear algebra on plain slices.
//!
//! [`solve_tridiagonal_batch`] solves many tridiagonal systems at once, open and cyclic, of any and
//! different lengths. On the CPU systems lie side by side in the lanes of the vector registers, so
//! that a batch is solved many times faster than one system after the other, with the same bits for
//! each; on a GPU they are solved by the kernels of [`ring`]. [`thomas`] is the textbook's
//! elimination, which the CPU's fast path is tested against, as the kernels are against the CPU.

#[doc(hidden)]
pub mod banded;
#[doc(hidden)]
pub mod block_ring;
mod elimination;
mod lanes;
mod real;
#[doc(hidden)]
pub mod ring;
pub(crate) mod scalar;
mod singular;
mod size;
pub(crate) mod skyline;
mod tasks;
#[doc(hidden)]
pub mod thomas;
mod tridiagonal;
mod wide;

pub(crate) use lanes::{Part, Scratch};
pub use real::Real;
#[doc(hidden)]
pub use scalar::{Lanes, Scalar};
pub(crate) use size::power_of_two;
pub(crate) use tasks::{take, tasks};
pub use tridiagonal::{Cyclic, Matrix, Solutions, TridiagonalBatch, solve_tridiagonal_batch};
#[doc(hidden)]
pub use wide::Operation;
pub(crate) use wide::{has_wide_registers, operation, run, with_wide_registers};
