//! Linear systems with two unknowns per vertex, in the coordinates of tangent planes.

// Loops over coordinates by index match the formulas.
#![allow(clippy::needless_range_loop)]

use super::block::Block;
use crate::linalg::Scalar;
use crate::linalg::banded::Banded;
use crate::linalg::scalar::{Vector, dot};

/// Two orthonormal vectors orthogonal to the normal.
pub(super) type Basis<S, const D: usize> = [Vector<S, D>; 2];

/// A system with two unknowns per vertex.
pub(super) type TangentSystem<S> = Banded<S, 5>;

/// Bᵀ x
#[inline(always)]
pub(super) fn onto<S: Scalar, const D: usize>(basis: &Basis<S, D>, x: Vector<S, D>) -> Vector<S, 2> {
    [dot(basis[0], x), dot(basis[1], x)]
}

/// B₀ᵀ B₁
#[inline(always)]
pub(super) fn between<S: Scalar, const D: usize>(bases: [&Basis<S, D>; 2]) -> Block<S, 2> {
    [onto(bases[1], bases[0][0]), onto(bases[1], bases[0][1])]
}

/// Adds a symmetric block of a vertex. Only the lower triangle is read.
#[inline(always)]
pub(super) fn add_own<S: Scalar>(system: &mut TangentSystem<S>, vertex: usize, block: &Block<S, 2>) {
    system.add_diagonal(2 * vertex, block[0][0]);
    system.add_diagonal(2 * vertex + 1, block[1][1]);
    system.add_entry(2 * vertex + 1, 2 * vertex, block[1][0]);
}

/// Adds a block that couples a vertex (rows) and a later vertex (columns).
#[inline(always)]
pub(super) fn add_pair<S: Scalar>(system: &mut TangentSystem<S>, vertex: usize, later: usize, block: &Block<S, 2>) {
    for a in 0..2 {
        for b in 0..2 {
            system.add_entry(2 * later + b, 2 * vertex + a, block[a][b]);
        }
    }
}
