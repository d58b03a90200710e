//! Laplacian splines on bounded rectangular grids, after Weimer and Warren, "Variational
//! subdivision for Laplacian splines" (TR97-291, 1997).
//!
//! A grid p of (n+1) × (m+1) control points has the Dirichlet energy pᵀEp = Σ w |difference|² over
//! its edges, with w = 1, or ½ at the border ([`energy`]). Subdivision S puts (2n+1) × (2m+1)
//! points in its place, so that E₂ₙSp = UEₙp, where U puts zeros between. So the force on each old
//! point stays what it was, new points have none, and the mean is kept. Sp has the least energy of
//! all grids with its values at the old points, and of all grids under the same load.
//!
//! ```text
//! Energy ─► linear programme (papers/src/programmes, solved once) ───► tables ─► SparseRule ─┐
//!           cosine transforms and tridiagonal systems ─────────────────► Rule::Exact ────────┴► Subdivide a batch of Grids
//! ```
//!
//! * [`Rule::Exact`] solves these equations. Weights fall like the fourth power of the distance,
//!   so all points count.
//! * [`Rule::Sparse`] has weights in a window of 3 to 11 points. Linear programming found them, so
//!   that ‖E₂ₙS − UEₙ‖∞ is least: [`SparseRule`].
//! * [`Subdivide`] is the method: batches of grids of any sizes, any number of values a point, any
//!   number of rounds, on a [`Device`](crate::Device).
//!
//! **Limits of surfaces.** Away from the control points exact surfaces converge as rounds go on. At
//! a control point they have a pole, that of the Laplacian's Green's function: each round adds ln 2
//! / 2π of the force (Ep₀) there. Sparse rules of 5 points or more add a little less every round:
//! by 1.7 % at support 7, 0.4 % at 9, 0.1 % at 11, 0.01 % at 5. Neither kind of rule interpolates.
//! Support 3 is bilinear interpolation.
//!
//! **Accuracy.** The exact rule loses nothing to the condition of E. Its equations hold to some ε
//! times the largest value, on grids of millions of points too. Sparse rules sum at most 36
//! products. A GPU is held to 2e-6 of the grid's size in f32 and 1e-12 in f64.

mod dirichlet;
mod exact;
mod gpu;
mod refine;
mod rule;
mod sparse;
mod stencil;
mod subdivide;
#[doc(hidden)]
pub mod unknowns;

pub(crate) use gpu::laplacian_kernels;

pub use crate::grids::Grids;
pub use dirichlet::{energy, residual};
pub use rule::{Reproduces, SparseRule};
pub use subdivide::{GridReport, Rule, Subdivide, Subdivided};
