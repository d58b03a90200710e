//! Laplacian splines on bounded rectangular grids, after Weimer and Warren, "Variational
//! subdivision for Laplacian splines" (TR97-291, 1997).
//!
//! A grid p of (n+1) × (m+1) control points has the Dirichlet energy pᵀEp ([`energy`]). Subdivision
//! S gives (2n+1) × (2m+1) points with E₂ₙSp = UEₙp, where U puts zeros between: Sp has the least
//! energy of all grids with its values at the old points.
//!
//! ```text
//! Energy ─► linear programme (papers/src/programmes, solved once) ───► tables ─► SparseRule ─┐
//!           cosine transforms and tridiagonal systems ─────────────────► Rule::Exact ────────┴► Subdivide a batch of Grids
//! ```
//!
//! * [`Rule::Exact`] solves these equations. Every point depends on all others.
//! * [`Rule::Sparse`] has weights in a window of 3 to 11 points, by linear programming:
//!   [`SparseRule`].
//! * [`Subdivide`] is the method: batches of grids of any sizes, any number of values per point and
//!   any number of rounds, on a [`Device`](crate::Device).
//!
//! Neither kind of rule interpolates. `docs/jobs/surfaces.md` describes their surfaces.
//!
//! **Accuracy.** The exact rule satisfies its equations to some ε times the largest value, on grids
//! of millions of points too. Sparse rules sum at most 36 products. A GPU is held to 2e-6 of the
//! grid's size in f32 and 1e-12 in f64.

mod dirichlet;
mod exact;
mod gpu;
mod refine;
mod report;
mod rule;
mod sparse;
mod stencil;
mod subdivide;
#[doc(hidden)]
pub mod unknowns;

pub(crate) use gpu::laplacian_kernels;

pub use crate::grids::Grids;
pub use dirichlet::energy;
#[doc(hidden)]
pub use dirichlet::residual;
pub use report::GridReport;
pub use rule::{Reproduces, Rule, SparseRule};
pub use subdivide::{Subdivide, Subdivided};
