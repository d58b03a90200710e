//! Batched tridiagonal systems.
