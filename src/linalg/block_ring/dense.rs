//! Twin of `shaders/linalg/block_ring/dense.wgsl`: small blocks, factored as C Cᵀ without pivoting.

// Loops by number read as the formulas do.
#![allow(clippy::needless_range_loop)]

use crate::linalg::Scalar;
use crate::linalg::scalar::Vector;

/// A D × D matrix, row after row.
pub type Block<S, const D: usize> = [Vector<S, D>; D];

/// 0
pub(super) fn zero<S: Scalar, const D: usize>() -> Block<S, D> {
    [[S::ZERO; D]; D]
}

/// I
pub(super) fn unit<S: Scalar, const D: usize>() -> Block<S, D> {
    std::array::from_fn(|a| std::array::from_fn(|b| if a == b { S::ONE } else { S::ZERO }))
}

/// aᵀ
pub(super) fn transpose<S: Scalar, const D: usize>(a: &Block<S, D>) -> Block<S, D> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// to + a
pub(super) fn sum<S: Scalar, const D: usize>(to: &Block<S, D>, a: &Block<S, D>) -> Block<S, D> {
    std::array::from_fn(|i| std::array::from_fn(|j| to[i][j] + a[i][j]))
}

/// to −= aᵀ b
pub(super) fn subtract_product<S: Scalar, const D: usize>(to: &mut Block<S, D>, a: &Block<S, D>, b: &Block<S, D>) {
    for i in 0..D {
        for j in 0..D {
            let mut sum = a[0][i] * b[0][j];
            for r in 1..D {
                sum += a[r][i] * b[r][j];
            }
            to[i][j] -= sum;
        }
    }
}

/// to −= aᵀ x
pub(super) fn subtract_transposed<S: Scalar, const D: usize>(to: &mut Vector<S, D>, a: &Block<S, D>, x: &Vector<S, D>) {
    for i in 0..D {
        let mut sum = a[0][i] * x[0];
        for r in 1..D {
            sum += a[r][i] * x[r];
        }
        to[i] -= sum;
    }
}

/// to −= a x
pub(super) fn subtract_applied<S: Scalar, const D: usize>(to: &mut Vector<S, D>, a: &Block<S, D>, x: &Vector<S, D>) {
    for i in 0..D {
        to[i] -= crate::linalg::scalar::dot(a[i], *x);
    }
}

/// The lower triangle C with C Cᵀ = a, of which the lower triangle is read, with 1/c on the
/// diagonal; `smallest` is lowered to the smallest pivot. A pivot that is not positive is reported
/// and counts as infinite, which holds its unknown at 0 and keeps the factors from growing; one
/// that is not a finite number is reported as 0.
pub(super) fn cholesky<S: Scalar, const D: usize>(a: &Block<S, D>, smallest: &mut S) -> Block<S, D> {
    let mut c = zero();
    for i in 0..D {
        for j in 0..i {
            let mut x = a[i][j];
            for k in 0..j {
                x -= c[i][k] * c[j][k];
            }
            c[i][j] = x * c[j][j];
        }
        let mut pivot = a[i][i];
        for k in 0..i {
            pivot -= c[i][k] * c[i][k];
        }
        // 1 if it is finite, else NaN.
        let number = pivot * S::ZERO + S::ONE;
        let pivot = number.if_positive(pivot, S::ZERO);
        *smallest = (*smallest - pivot).if_positive(pivot, *smallest);
        c[i][i] = pivot.if_positive(S::ONE / pivot.if_positive(pivot, S::ONE).sqrt(), S::ZERO);
    }
    c
}

/// C⁻¹ b
pub(super) fn under<S: Scalar, const D: usize>(c: &Block<S, D>, b: &Block<S, D>) -> Block<S, D> {
    let mut y = *b;
    for i in 0..D {
        for j in 0..D {
            for k in 0..i {
                let x = c[i][k] * y[k][j];
                y[i][j] -= x;
            }
            y[i][j] *= c[i][i];
        }
    }
    y
}

/// C⁻¹ x
pub(super) fn under_vector<S: Scalar, const D: usize>(c: &Block<S, D>, x: &Vector<S, D>) -> Vector<S, D> {
    let mut y = *x;
    for i in 0..D {
        for k in 0..i {
            let x = c[i][k] * y[k];
            y[i] -= x;
        }
        y[i] *= c[i][i];
    }
    y
}

/// C⁻ᵀ x, by columns of Cᵀ.
pub(super) fn over_vector<S: Scalar, const D: usize>(c: &Block<S, D>, x: &Vector<S, D>) -> Vector<S, D> {
    let mut y = *x;
    for i in (0..D).rev() {
        y[i] *= c[i][i];
        for k in 0..i {
            let x = c[i][k] * y[i];
            y[k] -= x;
        }
    }
    y
}
