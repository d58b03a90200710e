//! Batched tridiagonal systems.

mod pentadiagonal;
mod real;

pub use pentadiagonal::{
    factor_cyclic_pentadiagonal, factor_pentadiagonal, solve_cyclic_pentadiagonal, solve_pentadiagonal,
};
pub use real::Real;
