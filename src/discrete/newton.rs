//! [`Newton`]: the linear systems (H + λL) p = −g, one curve per lane.
//!
//! H is the Hessian of the energies and the regularisation, λ ≥ 0 is the damping, and L is the
//! inner product w Σ D_k g · D_k h Δs of the energy's order k, plus the stiffness of anchors. With
//! L the number of steps does not depend on the number of vertices. λ = 0 is Newton's method.
//! Sobolev gradients have λ = 0 and their [metric](super::sobolev) in place of H.
//!
//! Source: R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006), sections 2 and 3.

// Loops over coordinates and lanes by index match the formulas.
#![allow(clippy::needless_range_loop)]

use super::block::{Block, times};
use super::edges::Edges;
use super::energy::{Functional, MOST_EDGES};
use super::hessian::{BlockHessian, COUPLED};
use super::plan::{Plan, Solver};
use super::sobolev::scaled;
use super::stretches::Stretches;
use super::tangent_planes::{Basis, TangentSystem, add_own, add_pair, between};
use crate::linalg::banded::Banded;
use crate::linalg::scalar::{Vector, add, dot, scale};
use crate::linalg::{Scalar, operation};

/// The weights of an inner product.
#[derive(Clone, Debug)]
pub(crate) struct Weights<S> {
    /// The weight of the highest derivative, whose order is the product's.
    pub highest: S,
    /// The weight of |g|² at each vertex.
    ///
    /// It is 0 where no point is attached.
    pub vertices: Vec<S>,
    /// Whether any vertex is attached.
    pub attached: bool,
}

/// The linear systems, one per lane, with interleaved coordinates.
pub(crate) struct Newton<S, const D: usize> {
    /// Its order is the number of vertices on either side that a vertex is coupled with.
    plan: Plan,
    hessian: BlockHessian<S, D>,
    /// λ
    lambda: S,
    /// L with respect to vertices v and v + k, if any λ is not 0.
    ///
    /// It is the same for all coordinates.
    damping: Vec<[S; COUPLED + 1]>,
    matrix: Matrix<S>,
    movable: Vec<S>,
    unknowns: Vec<Vector<S, 1>>,
    /// For curves in surfaces, a basis of the tangent plane at every vertex, in which the unknowns
    /// are coordinates; else empty.
    ///
    /// Closed lanes repeat their first bases after their last.
    bases: Vec<Basis<S, D>>,
}

/// The banded matrix, by order and dimension.
///
/// Its half-bandwidth is (order + 1)·D − 1.
enum Matrix<S> {
    /// Metrics of order 1, also for closed curves of two vertices.
    FirstPlanar(Box<Banded<S, 3>>),
    FirstSpatial(Box<Banded<S, 5>>),
    SecondPlanar(Box<Banded<S, 5>>),
    SecondSpatial(Box<Banded<S, 8>>),
    WidestPlanar(Box<Banded<S, { widest(2) }>>),
    WidestSpatial(Box<Banded<S, { widest(3) }>>),
    /// Curves in surfaces, with the bandwidth of planar curves.
    SecondTangent(Box<TangentSystem<S>>),
}

/// The half-bandwidth of the highest order in a dimension.
const fn widest(dimension: usize) -> usize {
    (MOST_EDGES + 1) * dimension - 1
}

/// Evaluates an expression for a matrix of any width.
///
/// The compiler removes matrices of the other dimension.
macro_rules! each {
    ($matrix:expr, $banded:ident => $body:expr) => {
        match $matrix {
            Matrix::FirstPlanar($banded) if D == 2 => $body,
            Matrix::FirstSpatial($banded) if D == 3 => $body,
            Matrix::SecondPlanar($banded) if D == 2 => $body,
            Matrix::SecondSpatial($banded) if D == 3 => $body,
            Matrix::SecondTangent($banded) if D == 3 => $body,
            Matrix::WidestPlanar($banded) if D == 2 => $body,
            Matrix::WidestSpatial($banded) if D == 3 => $body,
            _ => unreachable!("a matrix of D coordinates a vertex"),
        }
    };
}

impl<S: Scalar, const D: usize> Newton<S, D> {
    /// Storage for the systems of a plan.
    ///
    /// `movable` is 1 where a vertex may move, else 0. Closed curves have more vertices than the
    /// order. Curves in surfaces have order 2 at most.
    pub fn new(plan: Plan, in_surfaces: bool, edges: &Edges<S, D>, movable: &[S]) -> Self {
        let none = &[0; 0];
        let mut newton = Newton {
            plan,
            hessian: BlockHessian::new(edges),
            lambda: S::ZERO,
            damping: Vec::new(),
            matrix: match (plan.order, D) {
                (..3, 3) if in_surfaces => Matrix::SecondTangent(Box::new(Banded::new(false, none))),
                (1, 2) if plan.solver == Solver::Sobolev => Matrix::FirstPlanar(Box::new(Banded::new(false, none))),
                (1, 3) if plan.solver == Solver::Sobolev => Matrix::FirstSpatial(Box::new(Banded::new(false, none))),
                (..3, 2) => Matrix::SecondPlanar(Box::new(Banded::new(false, none))),
                (..3, _) => Matrix::SecondSpatial(Box::new(Banded::new(false, none))),
                (_, 2) => Matrix::WidestPlanar(Box::new(Banded::new(false, none))),
                _ => Matrix::WidestSpatial(Box::new(Banded::new(false, none))),
            },
            movable: Vec::new(),
            unknowns: Vec::new(),
            bases: Vec::new(),
        };
        newton.renew(edges, movable);
        newton
    }

    /// Whether the storage fits curves with this plan.
    pub fn is_for(&self, plan: Plan, in_surfaces: bool) -> bool {
        (self.plan.order, self.plan.solver) == (plan.order, plan.solver) && self.is_in_surfaces() == in_surfaces
    }

    fn is_in_surfaces(&self) -> bool {
        matches!(self.matrix, Matrix::SecondTangent(_))
    }

    /// The number of unknowns per vertex.
    fn unknowns_each(&self) -> usize {
        if self.is_in_surfaces() { 2 } else { D }
    }

    /// Reuses the storage for the systems of other curves, for energies of the same order.
    pub fn renew(&mut self, edges: &Edges<S, D>, movable: &[S]) {
        let each = self.unknowns_each();
        let counts: Vec<usize> = edges.vertices().map(|count| count * each).collect();
        let rows = edges.vertices().max().unwrap_or(0);
        self.hessian.renew(edges);
        self.damping.resize(rows + COUPLED, [S::ZERO; COUPLED + 1]);
        each!(&mut self.matrix, matrix => matrix.renew(edges.is_closed(), &counts));
        self.movable.clear();
        movable[..rows].iter().for_each(|&movable| self.movable.extend_from_slice(&[movable; D][..each]));
        self.unknowns.resize(rows * each, [S::ZERO]);
        self.bases.resize(if self.is_in_surfaces() { edges.rows() + COUPLED } else { 0 }, [[S::ZERO; D]; 2]);
    }

    /// Assembles H + λL at the curves where the edges were placed.
    pub fn assemble(
        &mut self,
        edges: &Edges<S, D>,
        terms: &[(S, &Functional)],
        regularisation: Option<(usize, S)>,
        weights: &Weights<S>,
        lambda: S,
    ) {
        self.lambda = lambda;
        if const { D == 3 }
            && let Matrix::SecondTangent(matrix) = &mut self.matrix
        {
            matrix.clear();
        }
        match self.plan.solver {
            Solver::Sobolev => self.hessian.assemble_metric(self.plan.order, edges, weights.highest),
            Solver::Newton if self.is_in_surfaces() => self.hessian.assemble_by_tangents(edges, terms, regularisation),
            Solver::Newton => self.hessian.assemble(edges, terms, regularisation),
        }
        if self.is_damped() {
            S::run(Damp { newton: self, edges, weight: weights.highest });
        }
    }

    /// Whether any λ is not 0.
    #[inline(always)]
    fn is_damped(&self) -> bool {
        (0..S::LANES).any(|l| self.lambda.lane(l) != S::ZERO.lane(0))
    }

    /// Adds an anchor or a penalty of a vertex: its Hessian to H, and its stiffness to L.
    #[inline(always)]
    pub fn add_at_vertex(&mut self, row: usize, hessian: Block<S, D>, stiffness: S) {
        match self.plan.solver {
            Solver::Newton => self.hessian.add_block(row, hessian),
            Solver::Sobolev => self.hessian.add_block(row, scaled(stiffness)),
        }
        self.damping[row][0] += stiffness;
    }

    /// Adds second derivatives with respect to a vertex and the next.
    #[inline(always)]
    pub fn couple(&mut self, row: usize, hessian: Block<S, D>) {
        if self.plan.solver == Solver::Newton {
            self.hessian.add_pair(row, &hessian);
        }
    }

    /// The system of curves in surfaces, the bases of the tangent planes, and the second
    /// derivatives of energies of lengths, which the caller adds.
    #[inline(always)]
    pub fn in_tangent_planes(&mut self) -> (&mut TangentSystem<S>, &[Basis<S, D>], &Stretches<S>) {
        let Matrix::SecondTangent(matrix) = &mut self.matrix else { unreachable!("a system of curves in surfaces") };
        (matrix, &self.bases, self.hessian.stretches())
    }

    /// Sets the basis of the tangent plane at a vertex.
    #[inline(always)]
    pub fn set_basis(&mut self, row: usize, basis: Basis<S, D>) {
        self.bases[row] = basis;
    }

    /// Repeats the first bases of closed curves after their last.
    #[inline(always)]
    pub fn close_bases(&mut self, edges: &Edges<S, D>) {
        for (lane, &count) in edges.counts().iter().enumerate() {
            for k in 0..if edges.is_closed() { COUPLED } else { 0 } {
                for (a, c) in [(0, 0), (0, 1), (0, D - 1), (1, 0), (1, 1), (1, D - 1)] {
                    let first = self.bases[k % count][a][c].lane(lane);
                    self.bases[count + k][a][c].set_lane(lane, first);
                }
            }
        }
    }

    /// Computes L at the curves where the edges were placed.
    #[inline(always)]
    fn damp_by(&mut self, edges: &Edges<S, D>, weight: S) {
        self.damping.fill([S::ZERO; COUPLED + 1]);
        match self.plan.order {
            ..2 => self.damp_first(edges, weight),
            2 => self.damp_second(edges, weight),
            _ => self.damp_third(edges, weight),
        }
    }

    /// w Σ Δp·Δp/Δs
    #[inline(always)]
    fn damp_first(&mut self, edges: &Edges<S, D>, weight: S) {
        for j in 0..edges.windows::<1>() {
            self.damp(j, weight * edges.starts::<1>(j) * edges.inverse[j], [-S::ONE, S::ONE]);
        }
    }

    /// w Σ D₂p·D₂p Δa
    #[inline(always)]
    fn damp_second(&mut self, edges: &Edges<S, D>, weight: S) {
        for j in 0..edges.windows::<2>() {
            let weight = weight * edges.starts::<2>(j);
            let (r0, r1) = (edges.inverse[j], edges.inverse[j + 1]);
            let measure = S::of(2.0) / (edges.length[j] + edges.length[j + 1]);
            self.damp(j, weight * measure, [r0, -(r0 + r1), r1]);
        }
    }

    /// w Σ D₃p·D₃p Δs
    #[inline(always)]
    fn damp_third(&mut self, edges: &Edges<S, D>, weight: S) {
        let two = S::of(2.0);
        for j in 0..edges.windows::<3>() {
            let weight = weight * edges.starts::<3>(j) * edges.curvature_distance(j).inverse;
            let [r0, r1, r2] = [0, 1, 2].map(|k| edges.inverse[j + k]);
            let before = two / (edges.length[j] + edges.length[j + 1]);
            let after = two / (edges.length[j + 1] + edges.length[j + 2]);
            let row = [-(before * r0), before * (r0 + r1) + after * r1, -(before * r1 + after * (r1 + r2)), after * r2];
            self.damp(j, weight, row);
        }
    }

    /// Adds weight · v vᵀ at the vertices from `start` on.
    ///
    /// Closed lanes continue in the rows after their last vertex. [`factor`](Self::factor) accounts
    /// for them.
    #[inline(always)]
    fn damp<const N: usize>(&mut self, start: usize, weight: S, v: [S; N]) {
        for j in 0..N {
            for k in j..N {
                self.damping[start + j][k - j] += weight * v[j] * v[k];
            }
        }
    }

    /// Factors the assembled matrices, and returns the smallest pivot of each lane.
    ///
    /// If it is not positive, the matrix is not positive definite, and the result of
    /// [`solve`](Self::solve) is meaningless.
    pub fn factor(&mut self) -> S {
        let (is_damped, movable) = (self.is_damped(), &self.movable[..]);
        let damping = if is_damped { &self.damping[..] } else { &[] };
        let filling = Filling { blocks: self.hessian.blocks(), damping, bases: &self.bases, lambda: self.lambda };
        if const { D == 3 }
            && let Matrix::SecondTangent(matrix) = &mut self.matrix
        {
            S::run(FillTangent { filling: &filling, system: matrix });
            return matrix.factor(movable);
        }
        each!(&mut self.matrix, matrix => {
            S::run(Fill { filling: &filling, matrix });
            matrix.factor(movable)
        })
    }

    /// Computes x ← (H + λL)⁻¹ x, which is 0 at pinned vertices.
    pub fn solve(&mut self, x: &mut [Vector<S, D>]) {
        S::run(Solve { newton: self, x });
    }

    #[inline(always)]
    fn solve_inlined(&mut self, x: &mut [Vector<S, D>]) {
        if const { D == 3 }
            && let Matrix::SecondTangent(matrix) = &self.matrix
        {
            for (k, unknown) in self.unknowns.iter_mut().enumerate() {
                unknown[0] = self.movable[k] * dot(self.bases[k / 2][k % 2], x[k / 2]);
            }
            matrix.solve(&mut self.unknowns);
            for (row, unknowns) in self.unknowns.chunks_exact(2).enumerate() {
                let [first, second] = self.bases[row];
                x[row] = add(scale(unknowns[0][0], first), scale(unknowns[1][0], second));
            }
            return;
        }
        for (unknowns, x) in self.unknowns.chunks_exact_mut(D).zip(&*x) {
            for c in 0..D {
                unknowns[c] = [x[c]];
            }
        }
        for (unknown, movable) in self.unknowns.iter_mut().zip(&self.movable) {
            unknown[0] *= *movable;
        }
        let unknowns = &mut self.unknowns[..];
        each!(&self.matrix, matrix => matrix.solve(unknowns));
        for (unknowns, x) in self.unknowns.chunks_exact(D).zip(x) {
            for c in 0..D {
                x[c] = unknowns[c][0];
            }
        }
    }
}

/// H, L and λ of curves. L is empty if every λ is 0.
struct Filling<'a, S, const D: usize> {
    blocks: &'a [[Block<S, D>; COUPLED + 1]],
    damping: &'a [[S; COUPLED + 1]],
    bases: &'a [Basis<S, D>],
    lambda: S,
}

impl<S: Scalar, const D: usize> Filling<'_, S, D> {
    /// Fills a matrix with H + λL.
    #[inline(always)]
    fn fill<const B: usize>(&self, matrix: &mut Banded<S, B>) {
        matrix.clear();
        // B is at least (order + 1)·D − 1. On closed lanes H has been moved to existing rows, while
        // L continues beyond them.
        let reach = (B + 1) / D;
        let none = [[[S::ZERO; D]; D]; COUPLED + 1];
        for v in 0..self.damping.len().max(self.blocks.len()) {
            let blocks = self.blocks.get(v).unwrap_or(&none);
            for k in 0..reach {
                let damped = self.damping.get(v).map_or(S::ZERO, |damping| self.lambda * damping[k]);
                for a in 0..D {
                    for b in if k == 0 { a } else { 0 }..D {
                        let (row, column) = ((v + k) * D + b, v * D + a);
                        if row >= matrix.rows() {
                            continue;
                        }
                        let x = if a == b { blocks[k][a][b] + damped } else { blocks[k][a][b] };
                        if row == column {
                            matrix.add_diagonal(row, x);
                        } else {
                            matrix.add_entry(row, column, x);
                        }
                    }
                }
            }
        }
    }

    /// Adds Bᵀ(H + λL)B to the system in the tangent planes of a surface.
    #[inline(always)]
    fn fill_tangent(&self, system: &mut TangentSystem<S>) {
        let vertices = system.rows() / 2;
        self.damp_tangent(system, vertices);
        for (v, blocks) in self.blocks.iter().enumerate().take(vertices) {
            for k in 0..3.min(vertices - v) {
                let (own, other) = (self.bases[v], self.bases[v + k]);
                let mut pair = [[S::ZERO; 2]; 2];
                for b in 0..2 {
                    let product = times(&blocks[k], other[b]);
                    for a in 0..2 {
                        pair[a][b] = dot(own[a], product);
                    }
                }
                if k == 0 {
                    add_own(system, v, &pair);
                } else {
                    add_pair(system, v, v + k, &pair);
                }
            }
        }
    }

    /// Adds λ BᵀL B.
    #[inline(always)]
    fn damp_tangent(&self, system: &mut TangentSystem<S>, vertices: usize) {
        for (v, damping) in self.damping.iter().enumerate().take(vertices) {
            let own = self.lambda * damping[0];
            add_own(system, v, &[[own, S::ZERO], [S::ZERO, own]]);
            for k in 1..3.min(vertices - v) {
                let mut pair = between([&self.bases[v], &self.bases[v + k]]);
                for a in 0..2 {
                    pair[a] = scale(self.lambda * damping[k], pair[a]);
                }
                add_pair(system, v, v + k, &pair);
            }
        }
    }
}

operation! {
    /// [`Newton::damp_by`]
    Damp<'a, S: Scalar; D> { newton: &'a mut Newton<S, D>, edges: &'a Edges<S, D>, weight: S }
        -> () { newton.damp_by(edges, weight) }
}

operation! {
    /// [`Filling::fill`]
    Fill<'a, S: Scalar; D, B> { filling: &'a Filling<'a, S, D>, matrix: &'a mut Banded<S, B> } -> () { filling.fill(matrix) }
}

operation! {
    /// [`Filling::fill_tangent`]
    FillTangent<'a, S: Scalar; D> { filling: &'a Filling<'a, S, D>, system: &'a mut TangentSystem<S> }
        -> () { filling.fill_tangent(system) }
}

operation! {
    /// [`Newton::solve`]
    Solve<'a, S: Scalar; D> { newton: &'a mut Newton<S, D>, x: &'a mut [Vector<S, D>] } -> () { newton.solve_inlined(x) }
}
