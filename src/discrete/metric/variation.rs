//! The inner product of order 3, 2 w Σ D₃g·D₃h Δs, as one banded matrix with interleaved
//! coordinates.
//!
//! D₃ on an edge is the difference of D₂ at its two vertices over its length. At a pin only the
//! part of D₂ normal to the curve counts. At the vertices next to the ends of an open curve the
//! tangential part over the end edge counts too, as in the gauge. Where an open curve has fewer than
//! three pins all of D₂ counts there, because a parabola through two pins has no D₃.
//!
//! The matrix has condition h⁻⁶, so this is for f64 only.

use super::{Pins, Weights, tangent_at};
use crate::discrete::edges::Edges;
use crate::linalg::Scalar;
use crate::linalg::banded::Banded;
use crate::linalg::scalar::Vector;

#[derive(Clone, Debug)]
pub(crate) enum Third<S, const D: usize> {
    /// The matrix in the plane, where four vertices of two coordinates each couple.
    Planar(Banded<S, 7>, Vec<Vector<S, 1>>, Vec<S>),
    /// The matrix in space, where four vertices of three coordinates each couple.
    Spatial(Banded<S, 11>, Vec<Vector<S, 1>>, Vec<S>),
}

impl<S: Scalar, const D: usize> Third<S, D> {
    pub fn new(edges: &Edges<S, D>) -> Self {
        let counts: Vec<usize> = edges.vertices().iter().map(|n| n * D).collect();
        let rows = counts.iter().copied().max().unwrap_or(0);
        let (unknowns, movable) = (vec![[S::ZERO]; rows], vec![S::ZERO; rows]);
        match D {
            2 => Third::Planar(Banded::new(edges.is_closed(), &counts), unknowns, movable),
            _ => Third::Spatial(Banded::new(edges.is_closed(), &counts), unknowns, movable),
        }
    }

    #[inline(never)]
    pub fn freeze(&mut self, edges: &Edges<S, D>, pins: &Pins<S>, weights: &Weights<S>) -> S {
        match self {
            Third::Planar(matrix, _, movable) if D == 2 => freeze::<S, D, 7, 8>(matrix, movable, edges, pins, weights),
            Third::Spatial(matrix, _, movable) if D == 3 => {
                freeze::<S, D, 11, 12>(matrix, movable, edges, pins, weights)
            }
            _ => unreachable!("a matrix of D coordinates a vertex"),
        }
    }

    #[inline(never)]
    pub fn solve(&mut self, z: &mut [Vector<S, D>]) {
        match self {
            Third::Planar(matrix, unknowns, _) if D == 2 => solve(matrix, unknowns, z),
            Third::Spatial(matrix, unknowns, _) if D == 3 => solve(matrix, unknowns, z),
            _ => unreachable!("a matrix of D coordinates a vertex"),
        }
    }
}

fn solve<S: Scalar, const D: usize, const B: usize>(
    matrix: &Banded<S, B>,
    unknowns: &mut [Vector<S, 1>],
    z: &mut [Vector<S, D>],
) {
    for (unknowns, z) in unknowns.chunks_exact_mut(D).zip(&*z) {
        (0..D).for_each(|c| unknowns[c] = [z[c]]);
    }
    matrix.solve(unknowns);
    for (unknowns, z) in unknowns.chunks_exact(D).zip(z) {
        (0..D).for_each(|c| z[c] = unknowns[c][0]);
    }
}

/// The coefficients of D₂ between the edges j and j + 1, at the vertices j, j + 1, j + 2.
fn second<S: Scalar, const D: usize>(edges: &Edges<S, D>, j: usize) -> [S; 3] {
    let (r0, r1) = (edges.inverse[j], edges.inverse[j + 1]);
    let share = S::of(2.0) / (edges.length[j] + edges.length[j + 1]);
    [share * r0, -(share * (r0 + r1)), share * r1]
}

/// The part of D₂ that counts at a vertex: I, or at a pin I − T Tᵀ.
///
/// Rows beyond a closed lane's last are its first.
fn counted<S: Scalar, const D: usize>(edges: &Edges<S, D>, pins: &Pins<S>, row: usize) -> [[S; D]; D] {
    let mut tangent = tangent_at(edges, row.min(edges.most()));
    let mut pinned = if row < pins.movable.len() { S::ONE - pins.movable[row] } else { S::ONE };
    if edges.is_closed() {
        for (lane, &count) in edges.counts().iter().enumerate().filter(|(_, count)| row >= **count) {
            let own = (row - count).min(count - 1);
            let first = tangent_at(edges, own);
            pinned.set_lane(lane, S::ONE.lane(0) - pins.movable[own].lane(lane));
            (0..D).for_each(|c| tangent[c].set_lane(lane, first[c].lane(lane)));
        }
    }
    let mut counted = [[S::ZERO; D]; D];
    for c in 0..D {
        counted[c][c] = S::ONE;
        for d in 0..D {
            counted[c][d] -= pinned * tangent[c] * tangent[d];
        }
    }
    counted
}

fn freeze<S: Scalar, const D: usize, const B: usize, const N: usize>(
    matrix: &mut Banded<S, B>,
    movable: &mut [S],
    edges: &Edges<S, D>,
    pins: &Pins<S>,
    weights: &Weights<S>,
) -> S {
    matrix.clear();
    for (row, movable) in movable.iter_mut().enumerate() {
        *movable = pins.movable[row / D];
    }
    for j in 0..edges.windows::<3>() {
        let weight = weights.highest * edges.starts::<3>(j) * edges.way(j).inverse;
        let (before, after) = (second(edges, j), second(edges, j + 1));
        let (p, q) = (counted(edges, pins, j + 1), counted(edges, pins, j + 2));
        for c in 0..D {
            let mut row = [S::ZERO; N];
            for d in 0..D {
                for v in 0..3 {
                    row[v * D + d] -= p[c][d] * before[v];
                    row[(v + 1) * D + d] += q[c][d] * after[v];
                }
            }
            matrix.add(j * D, weight, row);
        }
    }
    if !edges.is_closed() {
        add_ends(matrix, edges, pins, weights);
    }
    if weights.attached {
        for (row, &weight) in weights.vertices.iter().enumerate().take(movable.len() / D) {
            (0..D).for_each(|c| matrix.add_diagonal(row * D + c, weight));
        }
    }
    matrix.factor(movable)
}

/// Adds the tangential part of D₂ at the vertices next to the ends, or all of it where pins are few.
fn add_ends<S: Scalar, const D: usize, const B: usize>(
    matrix: &mut Banded<S, B>,
    edges: &Edges<S, D>,
    pins: &Pins<S>,
    weights: &Weights<S>,
) {
    let mut few = S::ZERO;
    for (lane, &vertices) in edges.vertices().iter().enumerate() {
        let count = pins.rows.iter().filter(|&&row| row < vertices).count();
        few.set_lane(lane, if count < 3 { S::ONE.lane(0) } else { S::ZERO.lane(0) });
    }
    for j in 0..edges.windows::<2>() {
        let at = edges.ends(j);
        let tangent = tangent_at(edges, j + 1);
        let coefficients = second(edges, j);
        let weight = weights.highest * at * S::of(2.0) / (edges.length[j] + edges.length[j + 1]);
        let mut add = |weight: S, direction: Vector<S, D>| {
            let component = |k: usize| coefficients[k / D] * direction[k % D];
            match D {
                2 => matrix.add(j * D, weight, std::array::from_fn::<S, 6, _>(component)),
                _ => matrix.add(j * D, weight, std::array::from_fn::<S, 9, _>(component)),
            }
        };
        add(weight * (S::ONE - few), tangent);
        for c in 0..D {
            add(weight * few, std::array::from_fn(|d| if c == d { S::ONE } else { S::ZERO }));
        }
    }
}
