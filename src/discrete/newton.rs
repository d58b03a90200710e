//! [`Newton`]: the direction −H⁻¹g of one curve, from the exact Hessian of its energy.

use super::edges::Edges;
use super::energy::Functional;
use super::hessian::{Block, BlockHessian, COUPLED};
use crate::linalg::banded::Banded;
use crate::linalg::scalar::{Vector, dot};

/// Newton's systems of one open curve, coordinates interleaved.
pub(super) struct Newton<const D: usize> {
    hessian: BlockHessian<f64, D>,
    matrix: Matrix,
    movable: Vec<f64>,
    unknowns: Vec<Vector<f64, 1>>,
}

/// Wide enough for every energy: a vertex is coupled with three on either side.
enum Matrix {
    Planar(Box<Banded<f64, 7>>),
    Spatial(Box<Banded<f64, 11>>),
}

impl<const D: usize> Newton<D> {
    /// Room for the systems of a curve; `movable` is 1 where a vertex may move, else 0.
    pub fn new(edges: &Edges<f64, D>, movable: &[f64]) -> Self {
        let counts = [edges.rows() * D];
        Newton {
            hessian: BlockHessian::new(edges),
            matrix: match D {
                2 => Matrix::Planar(Box::new(Banded::new(false, &counts))),
                _ => Matrix::Spatial(Box::new(Banded::new(false, &counts))),
            },
            movable: movable.iter().flat_map(|&movable| [movable; D]).collect(),
            unknowns: vec![[0.0]; counts[0]],
        }
    }

    /// p = −H⁻¹g at the curve where the edges are placed, and gᵀH⁻¹g. None where H is singular or indefinite.
    ///
    /// H = L D Lᵀ counts as singular where a pivot is not above n ε a: n unknowns, ε the rounding of f64, a the largest
    /// entry on the diagonal of H. Pivots of a semidefinite matrix are at most a, and rounding perturbs them by no more than
    /// n ε a to first order: below that nothing tells a pivot from 0, and a solution would be made of rounding errors alone.
    pub fn direction(
        &mut self,
        edges: &Edges<f64, D>,
        terms: &[(f64, &Functional)],
        g: &[Vector<f64, D>],
        p: &mut [Vector<f64, D>],
    ) -> Option<f64> {
        self.hessian.assemble(edges, terms.iter().copied(), None);
        let largest = self.largest();
        let blocks = self.hessian.blocks();
        let smallest = match &mut self.matrix {
            Matrix::Planar(matrix) => factor(matrix, blocks, &self.movable),
            Matrix::Spatial(matrix) => factor(matrix, blocks, &self.movable),
        };
        let threshold = self.movable.len() as f64 * f64::EPSILON * largest;
        if smallest.is_nan() || smallest <= threshold {
            return None;
        }
        for (unknowns, g) in self.unknowns.chunks_exact_mut(D).zip(g) {
            (0..D).for_each(|c| unknowns[c] = [-g[c]]);
        }
        match &self.matrix {
            Matrix::Planar(matrix) => matrix.solve(&mut self.unknowns),
            Matrix::Spatial(matrix) => matrix.solve(&mut self.unknowns),
        }
        let mut decrement = 0.0;
        for ((p, unknowns), g) in p.iter_mut().zip(self.unknowns.chunks_exact(D)).zip(g) {
            (0..D).for_each(|c| p[c] = unknowns[c][0]);
            decrement -= dot(*p, *g);
        }
        Some(decrement)
    }

    /// The largest entry on the diagonal of what may move.
    fn largest(&self) -> f64 {
        let diagonal = self.hessian.blocks().iter().flat_map(|blocks| (0..D).map(|c| blocks[0][c][c]));
        self.movable.iter().zip(diagonal).map(|(movable, x)| movable * x.abs()).fold(0.0, f64::max)
    }
}

/// Fills and factors a matrix; its smallest pivot.
fn factor<const D: usize, const B: usize>(
    matrix: &mut Banded<f64, B>,
    blocks: &[[Block<f64, D>; COUPLED + 1]],
    movable: &[f64],
) -> f64 {
    matrix.clear();
    let vertices = movable.len() / D;
    for (v, blocks) in blocks.iter().enumerate().take(vertices) {
        for (a, row) in blocks[0].iter().enumerate() {
            matrix.add_diagonal(v * D + a, row[a]);
            (0..a).for_each(|b| matrix.add_entry(v * D + a, v * D + b, row[b]));
        }
        for (k, block) in blocks.iter().enumerate().skip(1).take(vertices - 1 - v) {
            for (a, row) in block.iter().enumerate() {
                (0..D).for_each(|b| matrix.add_entry((v + k) * D + b, v * D + a, row[b]));
            }
        }
    }
    matrix.factor(movable)
}
