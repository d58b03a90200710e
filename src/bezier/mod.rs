//! Bézier curves of least energy, after Eberly, "A relationship between minimum bending energy and
//! degree elevation for Bézier curves" (2010).
//!
//! A Bézier curve X(t) = Σ Bᵢᵈ(t) Pᵢ, t from 0 to 1, has the bending energy ∫|X″|² dt = Pᵀ M P per
//! coordinate, with a rational matrix M. If some control points are known, the others that minimise
//! the energy solve A U = −B K, where (A B; Bᵀ C) is M with the unknown points first. The solution
//! is one small matrix per degree and pattern, computed in exact rationals and applied to millions
//! of curves.
//!
//! * [`complete()`] works on slices, in 1 to 4 dimensions. [`Complete`] works on a
//!   [`CurveBatch`](crate::CurveBatch), each curve one Bézier.
//! * [`Chain`] completes composite Béziers with free, C1, C2 or G1 joints, each curve one chain.
//! * [`Simplify`] approximates chains of cubics by fewer cubics.
//! * [`elevate()`], [`reduce()`], [`split`], [`evaluate`] and [`lengths`] work on slices of any
//!   degrees.
//! * [`Completed`] has the control points, a report per curve, and the curves behind the trait
//!   [`Curve`](crate::Curve).
//!
//! [`Energy`] mixes ∫|X′|², ∫|X″|² and ∫|X‴|². [`Given`] adds derivatives or directions at the
//! ends. Degrees go up to [`MOST_DEGREE`].
//!
//! **Accuracy.** On the CPU a completed point is within 1e-15 of the largest Σ|W||G| that makes it
//! up, whatever the degree. Known points keep their bits. A GPU in f64 differs by rounding. In f32
//! points are good to 2e-6 of half the curve's largest extent.

mod chain;
mod complete;
mod completed;
mod curves;
mod directions;
mod eigen;
mod energy;
mod exact;
mod gpu;
mod length;
mod linear;
mod operator;
mod pattern;
mod polygons;
mod prepared;
mod ready;
mod refusal;
mod simplify;
mod single;

pub use crate::curve::convert::LEAST_TOLERANCE;
pub use chain::{Chain, Joints, PieceLengths};
pub use complete::complete;
pub use completed::Completed;
#[doc(hidden)]
pub use eigen::Eigenstructure;
pub use energy::Energy;
#[doc(hidden)]
pub use energy::{energy_matrix, energy_matrix_by_beta};
#[doc(hidden)]
pub use exact::Matrix;
pub(crate) use gpu::bezier_kernels;
pub use length::lengths;
pub use linear::{elevate, evaluate, reduce, split};
#[doc(hidden)]
pub use num_rational::BigRational;
#[doc(hidden)]
pub use pattern::{Completion, MOST_DERIVATIVE, Pattern};
pub use polygons::{Controls, Given, Polygons, Solved};
pub use refusal::Refusal;
pub use simplify::Simplify;
pub use single::{Complete, EndTangents};

/// The highest degree.
///
/// The exact solution for its 29 inner points takes about a tenth of a second per pattern.
pub const MOST_DEGREE: usize = 30;
