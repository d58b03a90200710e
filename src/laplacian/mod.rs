//! Laplacian splines on bounded rectangular grids, after Weimer and Warren, "Variational subdivision for Laplacian splines" (TR97-291, 1997).
//!
//! A grid p of (n+1) × (m+1) control points has the Dirichlet energy pᵀEp = Σ w |difference|² over its edges, w = 1, at the border ½
//! ([`energy`]). Subdivision S puts 2n+1 × 2m+1 points in its place, so that E₂ₙSp = UEₙp, where U puts zeros between: the energy of
//! each point stays what it was, new points have none, and the mean is kept.
//!
//! * [`Rule::Exact`] solves these equations. Its weights die away like the fourth power of the distance, so all points count.
//! * [`Rule::Sparse`] has weights in a window of 3 to 11 points, chosen by linear programming so that ‖E₂ₙS − UEₙ‖∞ is least: [`SparseRule`].
//!
//! [`Subdivide`] is the method: batches of grids of any sizes, of any number of values a point, any number of rounds, on a [`Device`](crate::Device).

mod dirichlet;
mod energies;
mod exact;
mod gpu;
mod grids;
mod programme;
mod refine;
mod rule;
mod sparse;
mod stencil;
mod subdivide;
mod unbounded;
mod unknowns;

pub(crate) use gpu::laplacian_kernels;

pub use dirichlet::{energy, residual};
pub use energies::Energy;
pub use grids::Grids;
pub use programme::{Affine, Class, Programme, Reproduces, StandardForm};
pub use rule::SparseRule;
pub use subdivide::{GridReport, Rule, Subdivide, Subdivided};
pub use unbounded::{Closed, UnboundedMask, potential, reflected, unbounded_weight};
pub use unknowns::Unknown;
