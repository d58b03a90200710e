//! Bézier curves of least bending energy, after Eberly, "A relationship between minimum bending
//! energy and degree elevation for Bézier curves" (2010).
//!
//! A Bézier curve X(t) = Σ Bᵢᵈ(t) Pᵢ, t from 0 to 1, has the bending energy ∫|X″|² dt = Pᵀ M P a
//! coordinate. M is rational and known in closed form ([`energy_matrix`]).
//!
//! Some control points of a curve are known. The others are those of least energy: A U = −B K,
//! where (A B; Bᵀ C) is M with the unknown ones first. This system depends on degree and pattern
//! alone. It is solved in exact rationals, once ([`Completion`]). What remains for each curve is a
//! product with a small matrix, for millions of curves at once, on the CPU or on a GPU.
//!
//! ```text
//! Energy ─► energy_matrix ─► Completion of a Pattern ─┐
//!                 elevation, reduction, division ─────┴► an operator a pattern ─► applied to every curve
//! ```
//!
//! * [`complete()`] works on slices, in 1 to 4 dimensions. [`Complete`] works on a
//!   [`CurveBatch`](crate::CurveBatch), each curve one Bézier.
//! * [`Chain`] completes composite Béziers: chains of pieces with free, C1, C2 or G1 joints. Every
//!   curve of a batch is one chain.
//! * [`Simplify`] lays chains of fewer cubics, within a tolerance.
//! * [`elevate()`], [`reduce()`], [`split`], [`evaluate`] and [`lengths`] are batched the same way.
//! * [`Completed`] has the control points, a report each, and the curves behind the trait
//!   [`Curve`](crate::Curve).
//!
//! [`Energy`] has other orders (∫|X′|², ∫|X‴|²) and mixtures of them. [`Given`] has derivatives or
//! directions at the ends. Degrees go up to [`MOST_DEGREE`].
//!
//! **Accuracy.** Operators are exact but for one rounding. On the CPU a completed point is within
//! some 1e-15 of the largest Σ|W||G| that makes it up, whatever the degree. Known points keep their
//! bits. A GPU in f64 gives the CPU's numbers but for rounding. In f32 points are good to 2e-6 of
//! half the curve's largest extent.

mod chain;
mod complete;
mod completed;
mod curves;
mod directions;
mod eigen;
mod energy;
mod exact;
mod gpu;
mod handles;
mod length;
mod linear;
mod operator;
mod pattern;
mod polygons;
mod ready;
mod refusal;
mod simplify;
mod single;

pub use crate::curve::convert::LEAST_TOLERANCE;
pub use chain::{Chain, Joints, PieceLengths};
pub use complete::{Solved, complete};
pub use completed::Completed;
pub use eigen::Eigenstructure;
pub use energy::{Energy, energy_matrix, energy_matrix_by_beta};
pub use exact::Matrix;
pub(crate) use gpu::bezier_kernels;
pub use length::lengths;
pub use linear::{elevate, evaluate, reduce, split};
pub use num_rational::BigRational;
pub use pattern::{Completion, MOST_DERIVATIVE, Pattern};
pub use polygons::{Controls, Given, Polygons};
pub use refusal::Refusal;
pub use simplify::Simplify;
pub use single::{Complete, EndTangents};

/// The highest degree.
///
/// To solve for its 29 inner points exactly takes about a tenth of a second, once a pattern.
pub const MOST_DEGREE: usize = 30;
