//! Blocks of a Hessian: D × D matrices for two edges or two vertices.

// Loops over coordinates by index match the formulas, and stay within code for wide registers.
#![allow(clippy::needless_range_loop)]

use super::energy::{Partials, SecondPartials};
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, dot, scale};

/// A D × D matrix, row by row.
pub(crate) type Block<S, const D: usize> = [Vector<S, D>; D];

/// The block of the edges j and k, from second derivatives with respect to tangents and lengths.
#[inline(always)]
pub(super) fn pair<S: Scalar, const D: usize, const W: usize>(
    tangent: &[Vector<S, D>; W],
    inverse: &[S; W],
    second: &SecondPartials<S, D, W>,
    j: usize,
    k: usize,
) -> Block<S, D> {
    let (t, u) = (tangent[j], tangent[k]);
    let tangents = &second.tangents[j][k];
    // P M P = M − T (Tᵀ M) − (M T) Tᵀ + (Tᵀ M T) T Tᵀ
    let (mut from_left, mut from_right) = ([S::ZERO; D], [S::ZERO; D]);
    for a in 0..D {
        from_right[a] = dot(tangents[a], u);
        for b in 0..D {
            from_left[b] += t[a] * tangents[a][b];
        }
    }
    let both = dot(t, from_right);
    let (left, right) = (across(second.mixed[j][k], t), across(second.mixed[k][j], u));
    let across = inverse[j] * inverse[k];
    let mut block = [[S::ZERO; D]; D];
    for a in 0..D {
        for b in 0..D {
            let projected = tangents[a][b] - t[a] * from_left[b] - from_right[a] * u[b] + both * t[a] * u[b];
            block[a][b] = across * projected
                + inverse[j] * left[a] * u[b]
                + inverse[k] * t[a] * right[b]
                + second.lengths[j][k] * t[a] * u[b];
        }
    }
    block
}

/// x t uᵀ
#[inline(always)]
pub(super) fn outer<S: Scalar, const D: usize>(x: S, t: Vector<S, D>, u: Vector<S, D>) -> Block<S, D> {
    let mut block = [[S::ZERO; D]; D];
    for a in 0..D {
        for b in 0..D {
            block[a][b] = x * t[a] * u[b];
        }
    }
    block
}

/// Adds `isotropic` (I − T Tᵀ), the contribution of a first derivative with respect to the length
/// of an edge.
#[inline(always)]
pub(super) fn add_curvature_of_length<S: Scalar, const D: usize>(
    block: &mut Block<S, D>,
    t: Vector<S, D>,
    isotropic: S,
) {
    for a in 0..D {
        for b in 0..D {
            let unit = if a == b { S::ONE } else { S::ZERO };
            block[a][b] += isotropic * (unit - t[a] * t[b]);
        }
    }
}

/// Adds the contribution of the second derivatives of tangent and length with respect to the edge
/// j.
#[inline(always)]
pub(super) fn add_curvature_of_edge<S: Scalar, const D: usize, const W: usize>(
    block: &mut Block<S, D>,
    t: Vector<S, D>,
    inverse: S,
    first: &Partials<S, D, W>,
    j: usize,
) {
    let bent = across(first.tangent[j], t);
    let along = dot(first.tangent[j], t);
    let squared = inverse * inverse;
    let isotropic = inverse * first.length[j] - squared * along;
    for a in 0..D {
        for b in 0..D {
            let unit = if a == b { S::ONE } else { S::ZERO };
            block[a][b] += isotropic * (unit - t[a] * t[b]) - squared * (t[a] * bent[b] + bent[a] * t[b]);
        }
    }
}

/// M x
#[inline(always)]
pub(super) fn times<S: Scalar, const D: usize>(matrix: &Block<S, D>, x: Vector<S, D>) -> Vector<S, D> {
    let mut product = x;
    for a in 0..D {
        product[a] = dot(matrix[a], x);
    }
    product
}

/// (I − T Tᵀ) x
#[inline(always)]
fn across<S: Scalar, const D: usize>(x: Vector<S, D>, t: Vector<S, D>) -> Vector<S, D> {
    crate::linalg::scalar::subtract(x, scale(dot(x, t), t))
}

#[inline(always)]
pub(super) fn add_scaled<S: Scalar, const D: usize>(to: &mut Block<S, D>, x: S, block: &Block<S, D>) {
    for a in 0..D {
        for b in 0..D {
            to[a][b] += x * block[a][b];
        }
    }
}

#[inline(always)]
pub(super) fn add_block<S: Scalar, const D: usize>(to: &mut Block<S, D>, block: &Block<S, D>) {
    for a in 0..D {
        for b in 0..D {
            to[a][b] += block[a][b];
        }
    }
}

#[inline(always)]
pub(super) fn subtract_block<S: Scalar, const D: usize>(to: &mut Block<S, D>, block: &Block<S, D>) {
    for a in 0..D {
        for b in 0..D {
            to[a][b] -= block[a][b];
        }
    }
}

#[inline(always)]
pub(super) fn transpose<S: Scalar, const D: usize>(block: &Block<S, D>) -> Block<S, D> {
    let mut transposed = [[S::ZERO; D]; D];
    for a in 0..D {
        for b in 0..D {
            transposed[a][b] = block[b][a];
        }
    }
    transposed
}
