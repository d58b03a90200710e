//! [`Edges`]: the edges of discrete curves, one curve per lane.
//!
//! Energies are summed over the edges. The chain rule turns partial derivatives with respect to
//! tangents and lengths into the gradient at the vertices.
//!
//! Edge j of an open curve of m edges leads from vertex j to vertex j + 1. A closed curve has as
//! many vertices as edges, and its last edge leads back to vertex 0.
//!
//! Vertices are stored as displacements u from a base. An edge is the edge of the base plus a
//! difference of displacements, so small changes of a curve far from the origin keep all their
//! digits.

// Loops over coordinates and lanes by index match the formulas.
#![allow(clippy::needless_range_loop)]

use super::energy::curvatures::{CurvatureDistance, SHORT_EDGE};
use super::energy::regularisation::{DifferenceRegularisation, RatioRegularisation, SmoothRegularisation};
use super::energy::{Functional, LIMIT_KINDS, MOST_EDGES, Partials, Penalty, TORSION_CURVATURE, Term, Visitor, Window};
use crate::linalg::scalar::{Vector, add, dot, number, scale, subtract};
use crate::linalg::{Scalar, operation};

/// No edge changes by more than this fraction of its length in a step.
///
/// It is less than 1, so that no edge reverses or vanishes.
// Not in the kernel: it is in descent.wgsl, because kernels include sweeps several times.
const MOST_OF_AN_EDGE: f64 = 0.5;

/// The edges of one curve, or of one curve per lane.
///
/// Lanes with fewer edges than others are padded with unit edges that do not count.
#[derive(Clone, Debug)]
pub(crate) struct Edges<S, const D: usize> {
    closed: bool,
    /// The number of edges of each lane's curve.
    counts: Vec<usize>,
    most: usize,
    segments: S,
    torsion_curvature: S,
    /// Edges of the base, unit edges where a lane has none.
    base: Vec<Vector<S, D>>,
    /// 1 where a lane has the edge, else 0.
    exists: Vec<S>,
    /// The factor c of the regularisation at the vertex between this edge and the next; 0 at a data
    /// point.
    free: Vec<S>,
    /// 1/w², where w is the width of the edge's span: 1, or the value from [`Self::set_taut`].
    taut: Vec<S>,
    /// The weight of the turn between this edge and the next, if terms cover
    /// [the ends](Term::AT_ENDS) too; else empty.
    turns: Vec<S>,
    /// The penalties of every kind at the vertex between this edge and the next.
    ///
    /// Empty without limits.
    penalties: [Vec<Penalty<S>>; LIMIT_KINDS],
    pub tangent: Vec<Vector<S, D>>,
    pub length: Vec<S>,
    pub inverse: Vec<S>,
    by_tangent: Vec<Vector<S, D>>,
    by_length: Vec<S>,
}

impl<S: Scalar, const D: usize> Edges<S, D> {
    /// The edges of curves that are all open or all closed.
    ///
    /// Lane l has the edges `bases[l]`, at least 3 for closed curves. `free(l, j)` is the factor c
    /// of the regularisation at vertex j, 0 at data points.
    pub fn new(closed: bool, bases: &[&[Vector<f64, D>]], free: impl Fn(usize, usize) -> f64) -> Self {
        let counts: Vec<usize> = bases.iter().map(|base| base.len()).collect();
        let most = counts.iter().copied().max().unwrap_or(0);
        // Closed curves repeat their first MOST_EDGES − 1 edges. Open curves have as many spare
        // rows, so that short curves need no special case.
        let rows = most + MOST_EDGES - 1;
        let mut unit = [S::ZERO; D];
        unit[0] = S::ONE;
        let mut edges = Edges {
            closed,
            most,
            segments: S::ONE,
            torsion_curvature: S::of(TORSION_CURVATURE),
            base: vec![unit; rows],
            exists: vec![S::ZERO; rows],
            free: vec![S::ZERO; rows],
            taut: vec![S::ONE; rows],
            turns: Vec::new(),
            penalties: Default::default(),
            tangent: vec![unit; rows],
            length: vec![S::ONE; rows],
            inverse: vec![S::ONE; rows],
            by_tangent: vec![[S::ZERO; D]; rows],
            by_length: vec![S::ZERO; rows],
            counts,
        };
        for (lane, base) in bases.iter().enumerate() {
            edges.segments.set_lane(lane, number::<S>(base.len() as f64));
            edges.exists[..base.len()].iter_mut().for_each(|exists| exists.set_lane(lane, number::<S>(1.0)));
            edges.lay(lane, base, |j| free(lane, j));
        }
        edges
    }

    /// Replaces a lane's curve by one with the same number of edges. `free(j)` is the factor c of
    /// the regularisation at vertex j.
    pub fn lay(&mut self, lane: usize, base: &[Vector<f64, D>], free: impl Fn(usize) -> f64) {
        for (j, edge) in base.iter().enumerate() {
            (0..D).for_each(|c| self.base[j][c].set_lane(lane, number::<S>(edge[c])));
            let next = if self.closed { (j + 1) % base.len() } else { j + 1 };
            self.free[j].set_lane(lane, number::<S>(free(next)));
        }
        self.close_free(lane);
    }

    /// Sets ε of torsion in a lane, a curvature.
    ///
    /// The default is for a curve of size 1.
    pub fn set_torsion_curvature(&mut self, lane: usize, curvature: f64) {
        self.torsion_curvature.set_lane(lane, number::<S>(curvature));
    }

    /// Sets 1/w² of a lane's edges, where w is the width of the edge's span.
    pub fn set_taut(&mut self, lane: usize, taut: &[f64]) {
        taut.iter().enumerate().for_each(|(j, x)| self.taut[j].set_lane(lane, number::<S>(*x)));
    }

    /// Makes terms cover [free ends](Term::AT_ENDS) too.
    pub fn stand_for_ends(&mut self) {
        if self.closed {
            return;
        }
        self.turns = (0..self.windows::<2>()).map(|j| self.starts::<2>(j) + S::of(0.5) * self.free_ends(j)).collect();
    }

    /// The number of free ends of an open lane that the window of two edges from edge j touches. An
    /// end is not free if a [short edge](super::constrain) gives its tangent.
    fn free_ends(&self, j: usize) -> S {
        let length = |edge: &Vector<S, D>| dot(*edge, *edge).sqrt();
        let (s, t) = (length(&self.base[j]), length(&self.base[j + 1]));
        let shorter = -((-s).max(-t));
        (shorter - S::of(SHORT_EDGE) * (s + t)).if_positive(self.ends(j), S::ZERO)
    }

    /// Sets the penalties of every kind at each vertex of a lane. Kinds without penalties are
    /// empty.
    pub fn set_penalties(&mut self, lane: usize, penalties: &[Vec<Penalty<f64>>; LIMIT_KINDS]) {
        let rows = self.free.len();
        for (own, penalties) in self.penalties.iter_mut().zip(penalties).filter(|(_, penalties)| !penalties.is_empty())
        {
            own.resize(rows, Penalty::NONE);
            for j in 0..self.counts[lane] {
                let penalty = penalties[(j + 1) % penalties.len()];
                own[j].slope.set_lane(lane, number::<S>(penalty.slope));
                own[j].reach.set_lane(lane, number::<S>(penalty.reach));
                own[j].stiffness.set_lane(lane, number::<S>(penalty.stiffness));
            }
        }
    }

    /// The penalty of a kind at the vertex between the edges j and j + 1.
    #[inline(always)]
    pub fn penalty(&self, kind: usize, j: usize) -> Penalty<S> {
        if self.penalties[kind].is_empty() { Penalty::NONE } else { self.penalties[kind][j] }
    }

    /// Copies the factors c of a closed lane's first edges to the edges that repeat them.
    fn close_free(&mut self, lane: usize) {
        let count = self.counts[lane];
        for k in 0..if self.closed { MOST_EDGES - 1 } else { 0 } {
            let first = self.free[k].lane(lane);
            self.free[count + k].set_lane(lane, first);
        }
    }

    /// The number of displacements: the largest number of vertices in a lane.
    ///
    /// Closed curves have one more, which repeats vertex 0.
    pub fn rows(&self) -> usize {
        self.most + 1
    }

    /// The number of edges of each lane's curve.
    pub fn counts(&self) -> &[usize] {
        &self.counts
    }

    /// The number of edges of the longest curve.
    pub fn most(&self) -> usize {
        self.most
    }

    /// The number of vertices of each lane's curve.
    pub fn vertices(&self) -> impl Iterator<Item = usize> {
        self.counts.iter().map(|count| count + usize::from(!self.closed))
    }

    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Copies the displacement of vertex 0 of a closed lane to the entry that repeats it.
    #[inline(always)]
    pub fn close(&self, u: &mut [Vector<S, D>]) {
        if self.closed {
            for (lane, &count) in self.counts.iter().enumerate() {
                for c in 0..D {
                    let first = u[0][c].lane(lane);
                    u[count][c].set_lane(lane, first);
                }
            }
        }
    }

    /// Computes tangents and lengths of the curve with displacements u.
    pub fn place(&mut self, u: &[Vector<S, D>]) {
        S::run(Place { edges: self, u });
    }

    #[inline(always)]
    fn place_inlined(&mut self, u: &[Vector<S, D>]) {
        for j in 0..self.most {
            let mut edge = add(self.base[j], subtract(u[j + 1], u[j]));
            for c in 0..D {
                edge[c] = self.exists[j].if_positive(edge[c], self.base[j][c]);
            }
            let length = dot(edge, edge).sqrt();
            let inverse = S::ONE / length;
            self.length[j] = length;
            self.inverse[j] = inverse;
            self.tangent[j] = scale(inverse, edge);
        }
        if self.closed {
            for (lane, &count) in self.counts.iter().enumerate() {
                for k in 0..MOST_EDGES - 1 {
                    let (length, inverse) = (self.length[k].lane(lane), self.inverse[k].lane(lane));
                    self.length[count + k].set_lane(lane, length);
                    self.inverse[count + k].set_lane(lane, inverse);
                    for c in 0..D {
                        let component = self.tangent[k][c].lane(lane);
                        self.tangent[count + k][c].set_lane(lane, component);
                    }
                }
            }
        }
    }

    /// The length of each curve.
    #[inline(always)]
    pub fn total_length(&self) -> S {
        let mut length = S::ZERO;
        for j in 0..self.most {
            length += self.exists[j] * self.length[j];
        }
        length
    }

    /// The largest step along p that changes no edge by more than [`MOST_OF_AN_EDGE`] of its
    /// length.
    pub fn most_step(&self, p: &[Vector<S, D>]) -> S {
        S::run(MostStep { edges: self, p })
    }

    #[inline(always)]
    fn most_step_inlined(&self, p: &[Vector<S, D>]) -> S {
        let mut largest = S::ZERO;
        for j in 0..self.most {
            let change = subtract(p[j + 1], p[j]);
            largest = largest.max(dot(change, change) * self.exists[j] * self.inverse[j] * self.inverse[j]);
        }
        S::of(MOST_OF_AN_EDGE) / largest.sqrt().max(S::of(1e-30))
    }

    /// Sets the partial derivatives to 0.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.by_tangent.fill([S::ZERO; D]);
        self.by_length.fill(S::ZERO);
    }

    /// Adds weight · functional to the partial derivatives, and returns its value.
    pub fn add(&mut self, weight: S, functional: &Functional) -> S {
        functional.visit(Adding { edges: self, weight }).unwrap_or(S::ZERO)
    }

    /// The value of the functional, without its derivatives.
    pub fn value(&self, functional: &Functional) -> S {
        functional.visit(Summing { edges: self }).unwrap_or(S::ZERO)
    }

    /// Adds weight · the regularisation of a [kind](super::plan::Plan::regularisation) to the
    /// partial derivatives, and returns its value.
    pub fn add_regularisation(&mut self, kind: usize, weight: S) -> S {
        match kind {
            0 | 1 => return S::run(Sweep { edges: self, weight, term: &DifferenceRegularisation }),
            2 => return S::run(Sweep { edges: self, weight, term: &RatioRegularisation }),
            _ => {}
        }
        let mut value = S::run(Sweep { edges: self, weight, term: &SmoothRegularisation });
        if !self.closed {
            for j in 0..self.windows::<2>() {
                let at_ends = weight * self.ends(j);
                value += self.scatter::<DifferenceRegularisation, 2>(
                    j,
                    at_ends,
                    &DifferenceRegularisation.gradient(&self.window(&DifferenceRegularisation, j)),
                );
            }
        }
        value
    }

    /// The distance between the curvatures at both ends of edge j + 1.
    #[inline(always)]
    pub fn curvature_distance(&self, j: usize) -> CurvatureDistance<S> {
        CurvatureDistance::of([0, 1, 2].map(|k| self.length[j + k]))
    }

    /// The window of W edges that starts at edge j, with what this term needs.
    #[inline(always)]
    pub fn window<T: Term<W>, const W: usize>(&self, term: &T, j: usize) -> Window<S, D, W> {
        let (mut tangent, mut length) = ([[S::ZERO; D]; W], [S::ZERO; W]);
        for k in 0..W {
            (tangent[k], length[k]) = (self.tangent[j + k], self.length[j + k]);
        }
        Window {
            tangent,
            length,
            segments: self.segments,
            torsion_curvature: self.torsion_curvature,
            taut: self.taut[j],
            free: self.free[j],
            free_after: if W > 2 { self.free[j + 1] } else { S::ZERO },
            penalty: term
                .penalty()
                .map_or(Penalty::NONE, |kind| self.penalties[kind].get(j).copied().unwrap_or(Penalty::NONE)),
        }
    }

    /// The number of windows of W edges in the longest lane.
    #[inline(always)]
    pub fn windows<const W: usize>(&self) -> usize {
        if self.closed { self.most } else { (self.most + 1).saturating_sub(W) }
    }

    /// 1 where a window of W edges starts at edge j, else 0.
    #[inline(always)]
    pub fn starts<const W: usize>(&self, j: usize) -> S {
        if self.closed { self.exists[j] } else { self.exists[j + W - 1] }
    }

    /// The factor c of the regularisation at the vertex between the edges j and j + 1: 0 at a data
    /// point.
    #[inline(always)]
    pub fn free(&self, j: usize) -> S {
        self.free[j]
    }

    /// 1 where a lane has at least three data points, else 0. The two ends of an open lane count.
    pub fn has_three_data_points(&self) -> S {
        let mut has = S::ZERO;
        for (lane, &count) in self.counts.iter().enumerate() {
            let inner = count - usize::from(!self.closed);
            let data = (0..inner).filter(|&j| self.free[j].lane(lane) == S::ZERO.lane(0)).count();
            has.set_lane(lane, number::<S>(if data + 2 * usize::from(!self.closed) >= 3 { 1.0 } else { 0.0 }));
        }
        has
    }

    /// The number of ends of an open lane (0, 1 or 2) that the window of two edges from edge j
    /// touches.
    #[inline(always)]
    pub fn ends(&self, j: usize) -> S {
        let mut ends = S::ZERO;
        for (lane, &count) in self.counts.iter().enumerate() {
            let touched = if j + 2 <= count { u8::from(j == 0) + u8::from(j + 2 == count) } else { 0 };
            ends.set_lane(lane, number::<S>(f64::from(touched)));
        }
        ends
    }

    /// The weight of the window of W edges from edge j: 0 where none starts.
    #[inline(always)]
    pub fn share<T: Term<W>, const W: usize>(&self, j: usize) -> S {
        if T::AT_ENDS && !self.turns.is_empty() { self.turns[j] } else { self.starts::<W>(j) }
    }

    #[inline(always)]
    fn sweep<T: Term<W>, const W: usize>(&mut self, weight: S, term: &T) -> S {
        let mut value = S::ZERO;
        for j in 0..self.windows::<W>() {
            let partials = term.gradient(&self.window(term, j));
            value += self.scatter::<T, W>(j, weight * self.share::<T, W>(j), &partials);
        }
        value
    }

    /// Adds weight · the derivatives with respect to the edges j and j + 1, and returns
    /// weight · the value.
    #[inline(always)]
    pub fn scatter_both(&mut self, j: usize, weight: S, partials: &Partials<S, D, 2>) -> S {
        for k in 0..2 {
            self.by_tangent[j + k] = add(self.by_tangent[j + k], scale(weight, partials.tangent[k]));
            self.by_length[j + k] += weight * partials.length[k];
        }
        weight * partials.value
    }

    #[inline(always)]
    fn scatter<T: Term<W>, const W: usize>(&mut self, j: usize, weight: S, partials: &Partials<S, D, W>) -> S {
        for k in 0..W {
            if T::BY_TANGENT {
                self.by_tangent[j + k] = add(self.by_tangent[j + k], scale(weight, partials.tangent[k]));
            }
            self.by_length[j + k] += weight * partials.length[k];
        }
        weight * partials.value
    }

    /// Adds a derivative with respect to the edge e = Δs T.
    #[inline(always)]
    pub fn add_by_edge(&mut self, j: usize, by_edge: Vector<S, D>) {
        self.by_tangent[j] = add(self.by_tangent[j], scale(self.length[j], by_edge));
        self.by_length[j] += dot(self.tangent[j], by_edge);
    }

    /// Computes the gradient at every vertex.
    ///
    /// It is 0 where `movable` is 0.
    #[inline(always)]
    pub fn gradient(&mut self, movable: &[S], g: &mut [Vector<S, D>]) {
        let mut last = [S::ZERO; D];
        if self.closed {
            for (lane, &count) in self.counts.iter().enumerate() {
                // Backwards, because the edges of a triangle may be repeated several times.
                for k in (0..MOST_EDGES - 1).rev() {
                    let sum = self.by_length[k].lane(lane) + self.by_length[count + k].lane(lane);
                    self.by_length[k].set_lane(lane, sum);
                    for c in 0..D {
                        let sum = self.by_tangent[k][c].lane(lane) + self.by_tangent[count + k][c].lane(lane);
                        self.by_tangent[k][c].set_lane(lane, sum);
                    }
                }
                for c in 0..D {
                    let component = self.edge_gradient(count - 1)[c].lane(lane);
                    last[c].set_lane(lane, component);
                }
            }
        }
        for j in 0..self.most {
            let by_edge = scale(self.exists[j], self.edge_gradient(j));
            g[j] = scale(movable[j], subtract(last, by_edge));
            last = by_edge;
        }
        g[self.most] = scale(movable[self.most], last);
    }

    /// The gradient with respect to the edge e = Δs T: (I − T Tᵀ) ∂/∂T / Δs + T ∂/∂Δs.
    #[inline(always)]
    fn edge_gradient(&self, j: usize) -> Vector<S, D> {
        let (t, by_tangent) = (self.tangent[j], self.by_tangent[j]);
        let across = subtract(by_tangent, scale(dot(t, by_tangent), t));
        add(scale(self.inverse[j], across), scale(self.by_length[j], t))
    }
}

operation! {
    /// [`Edges::place`]
    Place<'a, S: Scalar; D> { edges: &'a mut Edges<S, D>, u: &'a [Vector<S, D>] } -> () { edges.place_inlined(u) }
}

operation! {
    /// [`Edges::most_step`]
    MostStep<'a, S: Scalar; D> { edges: &'a Edges<S, D>, p: &'a [Vector<S, D>] } -> S { edges.most_step_inlined(p) }
}

/// [`Edges::add`] with one functional's term.
struct Adding<'a, S, const D: usize> {
    edges: &'a mut Edges<S, D>,
    weight: S,
}

impl<S: Scalar, const D: usize> Visitor for Adding<'_, S, D> {
    type Output = S;

    fn visit<T: Term<W>, const W: usize>(self, term: &T) -> S {
        S::run(Sweep { edges: self.edges, weight: self.weight, term })
    }
}

operation! {
    /// [`Edges::sweep`]
    Sweep<'a, S: Scalar, T: Term<W>; D, W> { edges: &'a mut Edges<S, D>, weight: S, term: &'a T }
        -> S { edges.sweep(weight, term) }
}

/// [`Edges::value`] with one functional's term.
struct Summing<'a, S, const D: usize> {
    edges: &'a Edges<S, D>,
}

impl<S: Scalar, const D: usize> Visitor for Summing<'_, S, D> {
    type Output = S;

    #[inline(never)]
    fn visit<T: Term<W>, const W: usize>(self, term: &T) -> S {
        let mut value = S::ZERO;
        for j in 0..self.edges.windows::<W>() {
            value += self.edges.share::<T, W>(j) * term.value(&self.edges.window(term, j));
        }
        value
    }
}
