//! Discrete fair curves by Sobolev gradients: polygons of many vertices with the least energy.
//!
//! The polygons pass through their data points, or are attached to them.
//!
//! ```text
//! CurveBatch ─ setup ─► Problem: base edges, pins, weights at size 1 ─ descent ─► displacements ─► FairCurves + reports
//!              spline      one a curve                   CPU lanes │ GPU kernel
//! ```
//!
//! - [`Fair`] is the method. It has an [`Energy`], a number of edges a span, and points that are
//!   pinned. [`Energy::evaluate`] gives values, gradients and Hessians of given curves.
//! - An energy is a sum of terms over the tangents and lengths of one, two or three consecutive
//!   edges. [Energies of your own](Energy::custom) take part in the same way, on a GPU too.
//! - Curves descend by Newton's method, (H + λL) p = −g. The regularisation keeps edges between data points
//!   equal, and does not change the shape. With it the Hessian H is regular at a minimum, and three
//!   steps suffice. L is the Sobolev inner product of the energy's order. λ grows from 0 where H is
//!   indefinite or a step fails. The decrement √(−g·p) says when it is enough.
//! - A strategy is an `async fn` for one curve: it asks the queue for a descent and goes on with the outcome. Only the
//!   queue knows that there are many curves.
//! - Sobolev gradients L⁻¹g are the other way to descend ([`Solver`]). An ordinary gradient has two
//!   derivatives fewer than the curve for every order of the energy, so steps along it are of the
//!   size of the finest edge. In the inner product of the energy's order the number of steps does
//!   not depend on the number of vertices.
//! - With [`Fair::deviation`] curves pass near their points. They are as fair as the largest
//!   deviation allows.
//! - With [`Fair::limits`] curves keep a largest curvature, turn only to the side to which their points turn, go on in a
//!   direction, stay within a corridor and other regions, or are no longer than a bound.
//! - With [`Fair::surface`] curves lie in a surface. There [`geodesic_bending`] makes elastic curves and geodesics.
//! - With [`Fair::corners`] curves are cut where their points turn sharply.
//!
//! | file | holds |
//! |---|---|
//! | `fair`, `limits` | options |
//! | `division`, `setup`, `constrain`, `corners`, `flat`, `near`, `starts` | from data points to problems |
//! | `edges`, `energy`, `enclosed`, `hessian`, `newton`, `sobolev`, `within` | an energy, its derivatives and the systems of a step |
//! | `lane`, `damped`, `descent` | descents side by side |
//! | `problem`, `descent_gpu` | descents of many problems, on the CPU and on a GPU |
//! | `queue` | what curves ask for |
//! | `continuation`, `fallback`, `minimise` | the way of a curve to a minimum |
//! | `self_intersections`, `restarts` | minima that do not cross themselves, and the cheapest of several |
//! | `multipliers`, `limit_multipliers`, `region_constraints`, `stretch`, `area`, `disc` | constraints |
//! | `limited`, `deviation`, `separation` | curves within limits, near their points, apart from each other |
//! | `pieces`, `fit` | a batch from its options to its reports |
//!
//! The start comes from the spline module. It is the natural spline through the points. For a
//! deviation the λ of the smoothing spline is the first guess of a weight.
//!
//! Sources:
//!
//! - R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006)
//! - R. J. Renka, *Algorithm 828: DNSPLIN1*, ACM TOMS 29 (2003)
//! - R. J. Renka, *Constructing fair curves and surfaces with a Sobolev gradient method*, CAGD 21
//!   (2004)
//! - R. J. Renka, *A Sobolev gradient method for construction of elastic curves in regular surfaces*, Nonlinear Analysis 63
//!   (2005)
//! - A. Linnér and R. J. Renka, *Discrete periodic geodesics in a surface*, Experimental Mathematics 14 (2005)

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
pub use limits::{Limits, Region};
pub use plan::Solver;
