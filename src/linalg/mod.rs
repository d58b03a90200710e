//! Batched linear algebra on plain slices.
//!
//! [`solve_tridiagonal_batch`] solves many tridiagonal systems at once, open and cyclic, of any
//! lengths. The CPU puts systems side by side into the lanes of its vector registers. That is many
//! times faster than solving them one after the other, with the same bits for each. A GPU solves them
//! by the kernels of [`ring`]. Tests compare the CPU with [`thomas`], the textbook's elimination, and
//! the kernels with the CPU.

#[doc(hidden)]
pub mod banded;
#[doc(hidden)]
pub mod block_ring;
mod elimination;
mod group;
mod lanes;
mod real;
#[doc(hidden)]
pub mod ring;
pub(crate) mod scalar;
mod singular;
mod size;
pub(crate) mod skyline;
mod systems;
mod tasks;
#[doc(hidden)]
pub mod thomas;
mod tridiagonal;
mod wide;

pub use scalar::Real;
#[doc(hidden)]
pub use scalar::{Lanes, Scalar};
pub(crate) use size::power_of_two;
pub use systems::{Cyclic, Matrix, Solutions, TridiagonalBatch};
pub(crate) use systems::{Part, Scratch};
pub(crate) use tasks::{take, tasks};
pub use tridiagonal::solve_tridiagonal_batch;
#[doc(hidden)]
pub use wide::Operation;
pub(crate) use wide::{has_wide_registers, operation, run, with_wide_registers};
