//! [`Enclosing`]: the energy term that keeps the area enclosed by a planar curve.
//!
//! The term is y(A − A*) + ½ ρ(A − A*)², for the required area A*. An open curve is closed by the
//! chord between its ends. For edges e with the first vertex at 0, the area is A = ½ Σ x_j × e_j
//! with x_j = Σ_{i<j} e_i. Its derivative by e_j is ½ J(X − 2x_j − e_j), where X = Σ e_i and J(x,
//! y) = (y, −x). Its second derivative by the vertices j (rows) and j + 1 is ½ (0 1; −1 0). The
//! Hessian's part ρ ∇A∇Aᵀ is dense. It enters Newton's step by the Sherman–Morrison formula.

use super::block::Block;
use super::edges::Edges;
use crate::linalg::scalar::{Vector, number};
use crate::linalg::{Scalar, operation};

/// The tolerance is relative to the area, or to this fraction of the area of a disc with the
/// perimeter of the data polygon if that is larger.
const LEAST: f64 = 1e-2;

/// The required area of a curve, at size 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Enclosed {
    pub area: f64,
    /// The area to which the tolerance is relative.
    pub unit: f64,
}

impl Enclosed {
    /// The area of a polygon of size 1, whose last point is joined to the first.
    pub fn by<const D: usize>(points: &[Vector<f64, D>]) -> Self {
        let edge = |j: usize| -> Vector<f64, D> {
            let (from, to) = (points[j], points[(j + 1) % points.len()]);
            std::array::from_fn(|c| to[c] - from[c])
        };
        let edges: Vec<Vector<f64, D>> = (0..points.len()).map(edge).collect();
        let around: f64 = edges.iter().map(|e| e[0].hypot(e[1])).sum();
        let area = area_of(&edges);
        Enclosed { area, unit: area.abs().max(LEAST * around * around / (4.0 * std::f64::consts::PI)) }
    }

    /// The excess of an area over the required one, relative to `unit`.
    pub fn excess(&self, area: f64) -> f64 {
        (area - self.area) / self.unit
    }
}

/// ½ Σ x_j × e_j
pub(super) fn area_of<const D: usize>(edges: &[Vector<f64, D>]) -> f64 {
    let (mut x, mut y, mut twice) = (0.0, 0.0, 0.0);
    for e in edges {
        twice += x * e[1] - y * e[0];
        (x, y) = (x + e[0], y + e[1]);
    }
    0.5 * twice
}

/// y(A − A*) + ½ ρ(A − A*)²
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Enclosing<S> {
    /// A*
    pub area: S,
    /// y
    pub multiplier: S,
    /// ρ, 0 without the constraint.
    pub stiffness: S,
}

impl<S: Scalar> Enclosing<S> {
    /// Sets the constraint of a lane.
    pub fn set_lane(&mut self, lane: usize, enclosing: &Enclosing<f64>) {
        self.area.set_lane(lane, number::<S>(enclosing.area));
        self.multiplier.set_lane(lane, number::<S>(enclosing.multiplier));
        self.stiffness.set_lane(lane, number::<S>(enclosing.stiffness));
    }
}

operation! {
    /// [`Edges::enclose`]
    Enclose<'e, S: Scalar; D> { edges: &'e mut Edges<S, D>, enclosing: Enclosing<S> }
        -> S { edges.enclose_inlined(enclosing) }
}

impl<S: Scalar, const D: usize> Edges<S, D> {
    /// Adds the term to the derivatives by edges, and returns its value.
    pub(super) fn enclose(&mut self, enclosing: Enclosing<S>) -> S {
        S::run(Enclose { edges: self, enclosing })
    }

    #[inline(always)]
    fn enclose_inlined(&mut self, Enclosing { area, multiplier, stiffness }: Enclosing<S>) -> S {
        let (own, all) = self.enclosed();
        let excess = own - area;
        self.add_area(multiplier + stiffness * excess, all);
        multiplier * excess + S::of(0.5) * stiffness * excess * excess
    }

    /// The first two components of an edge; 0 in lanes without this edge.
    #[inline(always)]
    fn planar(&self, j: usize) -> [S; 2] {
        let length = self.starts::<1>(j) * self.length[j];
        [length * self.tangent[j][0], length * self.tangent[j][1]]
    }

    /// A and Σ e.
    #[inline(always)]
    pub(super) fn enclosed(&self) -> (S, [S; 2]) {
        let (mut at, mut twice) = ([S::ZERO; 2], S::ZERO);
        for j in 0..self.windows::<1>() {
            let e = self.planar(j);
            twice += at[0] * e[1] - at[1] * e[0];
            at = [at[0] + e[0], at[1] + e[1]];
        }
        (S::of(0.5) * twice, at)
    }

    /// The second derivatives of the term by a vertex and the next, without the part ρ ∇A∇Aᵀ.
    pub(super) fn enclosing_block(&self, Enclosing { area, multiplier, stiffness }: Enclosing<S>) -> Block<S, D> {
        let half = S::of(0.5) * (multiplier + stiffness * (self.enclosed().0 - area));
        let mut block = [[S::ZERO; D]; D];
        (block[0][1], block[1][0]) = (half, -half);
        block
    }

    /// Adds the derivatives of the area times a weight, from Σ e.
    #[inline(always)]
    pub(super) fn add_area(&mut self, weight: S, all: [S; 2]) {
        let (two, half) = (S::of(2.0), S::of(0.5) * weight);
        let mut at = [S::ZERO; 2];
        for j in 0..self.windows::<1>() {
            let e = self.planar(j);
            let [x, y] = [0, 1].map(|c| half * (all[c] - two * at[c] - e[c]));
            let mut by_edge = [S::ZERO; D];
            (by_edge[0], by_edge[1]) = (y, -x);
            self.add_by_edge(j, by_edge);
            at = [at[0] + e[0], at[1] + e[1]];
        }
    }
}
