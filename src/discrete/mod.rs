//! Discrete fair curves by Sobolev gradients: of all polygons of many vertices through (or attached
//! to) data points the one of least energy.
//!
//! ```text
//! CurveBatch ─ setup ─► Problem: base edges, pins, weights at size 1 ─ descent ─► displacements ─► FairCurves + reports
//!              spline      one a curve                   CPU lanes │ GPU kernel
//! ```
//!
//! * [`Fair`] is the method: an [`Energy`], how finely spans are divided, what is pinned.
//!   [`Energy::evaluate`] gives values, gradients and Hessians of curves as they are.
//! * An energy is a sum of terms over the tangents and lengths of one, two or three consecutive
//!   edges; [`Custom`] energies of your own take part alike, on a GPU too where they bring their
//!   WGSL.
//! * Curves go down by Newton's method, (H + λL) p = −g: with the gauge, which keeps edges between
//!   data points equal and takes nothing from the shape, the Hessian H is regular at a minimum, and
//!   three steps do. L is the Sobolev inner product of the energy's order; λ grows from 0 where H
//!   is indefinite or a step fails.
//! * Sobolev gradients L⁻¹g are the other way: ordinary gradients have two derivatives fewer than
//!   the curve for every order of the energy, and steps along them are of the size of the finest
//!   edge. In the inner product of the energy's order the number of steps does not depend on the
//!   number of vertices.
//! * [`papers::renka`](crate::papers::renka) runs any method of the paper on one curve, step by
//!   step; [`papers::toms828`](crate::papers::toms828) is Renka's own published program for graphs
//!   y(t).
//!
//! * With [`Fair::deviation`] curves lie near their points, as fair as a largest deviation lets
//!   them be; with [`Fair::corners`] they are cut where their points turn sharply.
//!
//! What is taken from another room is the start: the natural spline through the points, and for a
//! deviation the λ of the smoothing spline, as the first guess of a weight.
//!
//! Sources: R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006); *Algorithm 828:
//! DNSPLIN1*, ACM TOMS 29 (2003); *Constructing fair curves and surfaces with a Sobolev gradient
//! method*, CAGD 21 (2004).

mod compose;
mod constrain;
mod corners;
mod curves;
mod damped;
pub(crate) mod descent;
mod descent_gpu;
mod deviation;
mod edges;
pub(crate) mod energy;
mod evaluate;
mod evaluate_gpu;
mod fair;
mod hessian;
pub(crate) mod lane;
mod line_search;
mod metric;
mod near;
pub(crate) mod newton;
pub(crate) mod plan;
pub(crate) mod problem;
mod search;
mod setup;
mod stages;
mod tally;
#[cfg(test)]
mod tests;

pub(crate) use descent_gpu::descent_kernels;
pub use energy::*;
#[doc(hidden)]
pub use evaluate::Gauging;
pub use evaluate::{Evaluate, Evaluation, Want};
pub(crate) use evaluate_gpu::evaluate_kernels;
pub use fair::{Fair, Pins, Segments};
pub use plan::{Direction, Step};
