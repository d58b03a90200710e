//! Sobolev gradients, and the inner products ⟨g, h⟩ = Σ w |D_j g · D_j h| Δs frozen at the current
//! curve.
//!
//! The Sobolev gradient z of an energy E solves P L P z = ∇E. L is the matrix of an inner product
//! in derivatives with respect to arc length. P is the projection onto what the constraints leave
//! free.
//!
//! The order of the derivative is that of the energy. Then √⟨z, L z⟩ measures how far a curve is
//! from its minimum, however finely it is divided. Descent takes as many steps for 1,000 vertices
//! as for 10.
//!
//! | order | inner product | solved by |
//! |---|---|---|
//! | 0 | Σ g·h: ordinary gradients | |
//! | 1 | Σ Δg·Δh/Δs, exactly the L_f of the paper, plus attached points | one tridiagonal solve, see [`path`] |
//! | 2 | 2 w Σ D₂g·D₂h Δa | two tridiagonal solves and a small system of the pinned vertices, see [`hats`] |
//! | 3 | 2 w Σ D₃g·D₃h Δs | one banded solve, see [`variation`] |
//!
//! At a pinned vertex the curve may still turn, so D₂ there holds only for the part of g normal to
//! the curve. Along the curve neither an energy nor the gauge resists. An inner product that did
//! would call soft directions stiff.
//!
//! Source: Renka (2006), sections 2 and 3. The normal part at pins and the solve by hat functions
//! are faircurve's own.

// Loops over coordinates and lanes by index match the formulas.
#![allow(clippy::needless_range_loop)]

pub(super) mod hats;
mod path;
pub(super) mod variation;

use super::edges::Edges;
use crate::linalg::banded::Banded;
use crate::linalg::scalar::{Vector, add, dot, scale};
use crate::linalg::{Scalar, operation};
use hats::Hats;
use path::Path;
use variation::Third;

/// The vertices that are pinned, in every lane.
#[derive(Clone, Debug)]
pub(crate) struct Pins<S> {
    /// 1 where a vertex may move.
    ///
    /// 0 where it may not, or where a lane has no vertex. One entry a row.
    pub movable: Vec<S>,
    /// The rows of pinned vertices.
    ///
    /// They are the same in all lanes, up to the lane's end.
    pub rows: Vec<usize>,
}

/// The weights of an inner product.
#[derive(Clone, Debug)]
pub(crate) struct Weights<S> {
    /// The weight of the derivative of the metric's own order.
    pub highest: S,
    /// The weight of |g|² at each vertex.
    ///
    /// 0 where no point is attached.
    pub vertices: Vec<S>,
    /// Whether any vertex is attached.
    pub attached: bool,
}

/// An inner product of some order, and its solve.
#[derive(Clone, Debug)]
pub(crate) enum Metric<S, const D: usize> {
    Euclidean,
    /// Open curves.
    First(Path<S>),
    /// Closed curves.
    FirstClosed(Banded<S, 1>),
    Second(Box<Hats<S, D>>),
    Third(Box<Third<S, D>>),
}

impl<S: Scalar, const D: usize> Metric<S, D> {
    /// The inner product of an order, for the curves of these edges.
    pub fn new(order: usize, edges: &Edges<S, D>, pins: &Pins<S>) -> Self {
        match order {
            0 => Metric::Euclidean,
            1 if edges.is_closed() => Metric::FirstClosed(Banded::new(true, &edges.vertices())),
            1 => Metric::First(Path::new(edges.rows())),
            2 => Metric::Second(Box::new(Hats::new(edges, pins))),
            _ => Metric::Third(Box::new(Third::new(edges))),
        }
    }

    /// Freezes the inner product at the curve where the edges are placed.
    ///
    /// Returns the smallest pivot of each lane. It is not positive where the matrix is not positive
    /// definite.
    pub fn freeze(&mut self, edges: &Edges<S, D>, pins: &Pins<S>, weights: &Weights<S>) -> S {
        S::run(Freeze { metric: self, edges, pins, weights })
    }

    #[inline(always)]
    fn freeze_inlined(&mut self, edges: &Edges<S, D>, pins: &Pins<S>, weights: &Weights<S>) -> S {
        match self {
            Metric::Euclidean => S::ONE,
            Metric::First(path) => path.freeze(edges, pins, weights),
            Metric::FirstClosed(matrix) => {
                matrix.clear();
                for j in 0..edges.most() {
                    matrix.add(j, weights.highest * edges.exists(j) * edges.inverse[j], [S::ONE, -S::ONE]);
                }
                add_vertices(matrix, weights);
                matrix.factor(&pins.movable)
            }
            Metric::Second(hats) => hats.freeze(edges, pins, weights),
            Metric::Third(third) => third.freeze(edges, pins, weights),
        }
    }

    /// Turns a gradient into the Sobolev gradient, in place.
    pub fn solve(&mut self, pins: &Pins<S>, z: &mut [Vector<S, D>]) {
        S::run(Solve { metric: self, pins, z });
    }

    #[inline(always)]
    fn solve_inlined(&mut self, pins: &Pins<S>, z: &mut [Vector<S, D>]) {
        match self {
            Metric::Euclidean => {}
            Metric::First(path) => path.solve(z),
            Metric::FirstClosed(matrix) => matrix.solve(z),
            Metric::Second(hats) => hats.solve(pins, z),
            Metric::Third(third) => third.solve(z),
        }
    }
}

operation! {
    /// [`Metric::freeze`]
    Freeze<'a, S: Scalar; D> {
        metric: &'a mut Metric<S, D>,
        edges: &'a Edges<S, D>,
        pins: &'a Pins<S>,
        weights: &'a Weights<S>,
    } -> S { metric.freeze_inlined(edges, pins, weights) }
}

operation! {
    /// [`Metric::solve`]
    Solve<'a, S: Scalar; D> { metric: &'a mut Metric<S, D>, pins: &'a Pins<S>, z: &'a mut [Vector<S, D>] }
        -> () { metric.solve_inlined(pins, z) }
}

fn add_vertices<S: Scalar>(matrix: &mut Banded<S, 1>, weights: &Weights<S>) {
    if weights.attached {
        weights.vertices.iter().enumerate().for_each(|(row, &weight)| matrix.add_diagonal(row, weight));
    }
}

/// Half the lengths of the edges beside every vertex.
///
/// Vertex 0 of a closed curve counts its last edge.
#[inline(always)]
fn masses<S: Scalar, const D: usize>(edges: &Edges<S, D>, masses: &mut [S]) {
    let half = S::of(0.5);
    let mut before = S::ZERO;
    for j in 0..edges.most() {
        let length = half * edges.exists(j) * edges.length[j];
        masses[j] = before + length;
        before = length;
    }
    masses[edges.most()] = before;
    if edges.is_closed() {
        for (lane, &count) in edges.counts().iter().enumerate() {
            let wrapped = masses[0].lane(lane) + masses[count].lane(lane);
            masses[0].set_lane(lane, wrapped);
            masses[count].set_lane(lane, S::ZERO.lane(0));
        }
    }
}

/// The unit vector halfway between the tangents of the edges at a vertex.
#[inline(always)]
fn tangent_at<S: Scalar, const D: usize>(edges: &Edges<S, D>, row: usize) -> Vector<S, D> {
    let mut before = edges.tangent[row.saturating_sub(1)];
    if row == 0 && edges.is_closed() {
        for (lane, &count) in edges.counts().iter().enumerate() {
            for c in 0..D {
                let component = edges.tangent[count - 1][c].lane(lane);
                before[c].set_lane(lane, component);
            }
        }
    }
    let after = edges.tangent[row.min(edges.tangent.len() - 1)];
    let sum = add(before, after);
    // Edges that turn back have no direction in common, and any will do.
    let square = dot(sum, sum);
    let straight = square - S::of(1e-12);
    let length = straight.if_positive(square, S::ONE).sqrt();
    let mut tangent = after;
    for c in 0..D {
        tangent[c] = straight.if_positive(sum[c], after[c]);
    }
    scale(S::ONE / length, tangent)
}
