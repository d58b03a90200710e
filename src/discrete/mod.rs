//! Discrete fair curves: polygons with many vertices and the least energy, by Newton's method in a
//! Sobolev metric.
//!
//! The polygons pass through their data points, or are attached to them.
//!
//! ```text
//! CurveBatch ─ setup ─► Problem ─ descent ─► displacements ─► FairCurves + reports
//!              spline             CPU lanes │ GPU kernel
//! ```
//!
//! - [`Fair`] is the method. It has an [`Energy`], a number of edges per span, and points that are
//!   pinned. [`Energy::evaluate`] gives values, gradients and Hessians of given curves.
//! - An energy is a sum of terms over the tangents and lengths of one, two or three consecutive
//!   edges. [Custom energies](Energy::custom) work in the same way, on a GPU too.
//! - A `Problem` is one curve at size 1: base edges, pins and weights.
//! - Curves descend by Newton's method, (H + λL) p = −g. The regularisation makes edges between
//!   data points equally long, and does not change the shape. With it the Hessian H is regular at a
//!   minimum, and three steps suffice. L is the Sobolev inner product of the energy's order.
//!   λ grows from 0 where H is indefinite or a step fails. A descent converges when the decrement
//!   √(−g·p) is small.
//! - Sobolev gradients L⁻¹g are the other way to descend ([`Solver`]). An ordinary gradient has two
//!   derivatives fewer than the curve for every order of the energy, so steps along it are of the
//!   size of the finest edge. In the inner product of the energy's order the number of steps does
//!   not depend on the number of vertices.
//! - The strategy for one curve is an `async fn`, which sends descents to the queue and awaits
//!   their outcomes. Only the queue handles many curves at once.
//! - With [`Fair::deviation`] curves pass near their points, and are as fair as the largest
//!   deviation allows.
//! - With [`Fair::limits`] curves satisfy limits on the curvature, its sign, the direction, the
//!   position or the length.
//! - With [`Fair::surface`] curves lie in a surface. There [`geodesic_bending`] gives elastic
//!   curves and geodesics.
//! - With [`Fair::corners`] curves are cut where their points turn sharply.
//!
//! | file | holds |
//! |---|---|
//! | `fair`, `limits` | options |
//! | `division`, `setup`, `constrain` | from data points to problems |
//! | `near`, `starts` | starts other than the natural spline |
//! | `corners`, `flat` | curves cut at corners, planar curves in space |
//! | `edges`, `energy`, `enclosed` | energies and their gradients |
//! | `hessian`, `newton`, `sobolev`, `within` | Hessians and linear systems |
//! | `lane`, `damped`, `descent` | descents in lanes |
//! | `problem`, `descent_gpu` | descents of many problems, on the CPU and on a GPU |
//! | `queue` | the descents that curves wait for |
//! | `continuation`, `fallback`, `minimise` | how one curve reaches a minimum |
//! | `self_intersections`, `restarts` | minima without self-intersections, the best of several |
//! | `multipliers`, `limit_multipliers`, `region_constraints`, `disc` | constraints at vertices |
//! | `stretch`, `area` | constraints on whole curves |
//! | `limited`, `deviation`, `separation` | curves within limits, near their points, not crossing |
//! | `pieces`, `fit` | a batch, from its options to its reports |
//!
//! The start comes from the spline module: the natural spline through the points or, with a
//! deviation, the smoothing spline that keeps it.
//!
//! Sources:
//!
//! - R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006)
//! - R. J. Renka, *Algorithm 828: DNSPLIN1*, ACM TOMS 29 (2003)
//! - R. J. Renka, *Constructing fair curves and surfaces with a Sobolev gradient method*, CAGD 21
//!   (2004)
//! - R. J. Renka, *A Sobolev gradient method for construction of elastic curves in regular
//!   surfaces*, Nonlinear Analysis 63 (2005)
//! - A. Linnér and R. J. Renka, *Discrete periodic geodesics in a surface*, Experimental
//!   Mathematics 14 (2005)

mod area;
mod block;
mod check;
mod compose;
mod constrain;
mod continuation;
mod corners;
mod curve_limits;
mod curves;
mod damped;
mod descent;
mod descent_gpu;
mod deviation;
mod disc;
mod division;
mod edges;
mod enclosed;
mod energy;
mod evaluate;
mod evaluate_gpu;
mod evaluation;
mod fair;
mod fallback;
mod fit;
mod flat;
mod groups;
mod hessian;
mod lane;
mod limit_multipliers;
mod limited;
mod limits;
mod limits_result;
mod minimise;
mod multipliers;
mod near;
mod newton;
mod onto;
mod pieces;
mod plan;
mod problem;
mod queue;
mod region_constraints;
mod resident;
mod restarts;
mod self_intersections;
mod separation;
mod setup;
mod shortest;
mod sobolev;
mod starts;
mod stretch;
mod stretches;
mod tally;
mod tangent_angles;
mod tangent_planes;
#[cfg(test)]
mod tests;
mod verdict;
mod within;

pub(crate) use descent_gpu::descent_kernels;
pub use energy::*;
pub(crate) use evaluate_gpu::evaluate_kernels;
#[doc(hidden)]
pub use evaluation::SpacingRegularisation;
pub use evaluation::{Evaluate, Evaluation, Want};
pub use fair::{Fair, Pins, Segments};
pub use limits::{Limits, Obstacle, Region};
pub use plan::Solver;
pub(crate) use resident::resident_kernels;
