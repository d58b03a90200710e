//! Discrete and exact bending energies of uniform cubic splines, on slices: the arithmetic of the
//! CPU and of the kernels.
//!
//! With d_i = p_{i−1} − 2p_i + p_{i+1} at the interior points of an open curve (at all points of a
//! closed one) the matrix E_0 of the book is DᵀD, so pᵀE_0 q = Σ d_i·e_i. Interpolation on the
//! integers commutes with these differences when the differences at the ends are taken as 0, hence
//! E_0 N = Dᵀ M D with the tridiagonal matrix M of rows 1/6 2/3 1/6: the exact inner product ∫p″·q″
//! of two piecewise linear second derivatives. In this form nothing cancels but the differences
//! themselves, and the product is symmetric to the last bit.

use crate::linalg::Real;

/// Second difference at point `i`, coordinate `axis`; 0 at the ends of an open curve, as the
/// natural ends have it.
fn second_difference<T: Real>(p: &[T], count: usize, dimension: usize, closed: bool, i: usize, axis: usize) -> T {
    if !closed && (i == 0 || i + 1 == count) {
        return T::ZERO;
    }
    let previous = if i == 0 { count - 1 } else { i - 1 };
    let next = if i + 1 == count { 0 } else { i + 1 };
    let here = p[i * dimension + axis];
    (p[next * dimension + axis] - here) - (here - p[previous * dimension + axis])
}

/// pᵀE_0 p, summed over the coordinates: Σ |d_i|². Times 8^k it is the discrete energy of round k.
pub(crate) fn discrete_energy<T: Real>(p: &[T], dimension: usize, closed: bool) -> T {
    let count = p.len() / dimension;
    let mut sum = T::ZERO;
    for i in 0..count {
        for axis in 0..dimension {
            let d = second_difference(p, count, dimension, closed, i, axis);
            sum += d * d;
        }
    }
    sum
}

/// pᵀE_0 N q, summed over the coordinates: Σ (4 d_i·e_i + d_i·e_{i+1} + d_{i+1}·e_i) / 6.
pub(crate) fn exact_product<T: Real>(p: &[T], q: &[T], dimension: usize, closed: bool) -> T {
    let count = p.len() / dimension;
    let mut sum = T::ZERO;
    for i in 0..count {
        let next = if i + 1 == count { 0 } else { i + 1 };
        for axis in 0..dimension {
            let d = second_difference(p, count, dimension, closed, i, axis);
            let e = second_difference(q, count, dimension, closed, i, axis);
            let d_next = second_difference(p, count, dimension, closed, next, axis);
            let e_next = second_difference(q, count, dimension, closed, next, axis);
            sum += T::from_f64(4.0) * (d * e) + (d * e_next + d_next * e);
        }
    }
    sum / T::from_f64(6.0)
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// E_0 as printed: the stencil 1 −4 6 −4 1, at the ends rows 1 −2 1 and −2 5 −4 1; cyclic for
    /// closed curves.
    pub(crate) fn energy_matrix(count: usize, closed: bool) -> DMatrix<f64> {
        if !closed && count < 3 {
            return DMatrix::zeros(count, count);
        }
        let mut e = DMatrix::zeros(count, count);
        let n = count as isize;
        for i in 0..n {
            for (offset, x) in [(-2, 1.0), (-1, -4.0), (0, 6.0), (1, -4.0), (2, 1.0)] {
                let k = i + offset;
                if closed {
                    e[(i as usize, k.rem_euclid(n) as usize)] += x;
                } else if (0..n).contains(&k) {
                    e[(i as usize, k as usize)] = x;
                }
            }
        }
        if !closed {
            for (end, second) in [(0, 1), (count - 1, count - 2)] {
                e[(end, end)] = 1.0;
                e[(end, second)] = -2.0;
                e[(second, end)] = -2.0;
                e[(second, second)] = if count == 3 { 4.0 } else { 5.0 };
            }
        }
        e
    }

    /// N as printed: rows 1/6 2/3 1/6, unit rows at the ends of an open curve.
    pub(crate) fn interpolation_matrix(count: usize, closed: bool) -> DMatrix<f64> {
        let mut n = DMatrix::zeros(count, count);
        for i in 0..count {
            if !closed && (i == 0 || i + 1 == count) {
                n[(i, i)] = 1.0;
            } else {
                n[(i, i)] += 2.0 / 3.0;
                n[(i, (i + 1) % count)] += 1.0 / 6.0;
                n[(i, (i + count - 1) % count)] += 1.0 / 6.0;
            }
        }
        n
    }

    fn vector(count: usize, seed: f64) -> Vec<f64> {
        (0..count).map(|k| ((k * k) as f64 * 0.37 + seed).sin()).collect()
    }

    #[test]
    fn the_sums_are_the_matrix_products_of_the_book() {
        for closed in [false, true] {
            for count in 1..=20 {
                let (p, q) = (vector(count, 0.3), vector(count, 2.1));
                let (e, n) = (energy_matrix(count, closed), interpolation_matrix(count, closed));
                let (column_p, column_q) = (DVector::from_vec(p.clone()), DVector::from_vec(q.clone()));
                let discrete = column_p.dot(&(&e * &column_p));
                let exact = column_p.dot(&(&e * (&n * &column_q)));
                assert!((discrete_energy(&p, 1, closed) - discrete).abs() < 1e-12, "{count} {closed}");
                assert!((exact_product(&p, &q, 1, closed) - exact).abs() < 1e-12, "{count} {closed}");
            }
        }
    }

    #[test]
    fn the_inner_product_is_symmetric_to_the_last_bit_and_sums_over_coordinates() {
        for closed in [false, true] {
            let (p, q) = (vector(24, 0.1), vector(24, 5.0));
            assert_eq!(exact_product(&p, &q, 3, closed), exact_product(&q, &p, 3, closed));
            let axis = |p: &[f64], axis: usize| -> Vec<f64> { p.iter().skip(axis).step_by(3).copied().collect() };
            let sum: f64 = (0..3).map(|k| exact_product(&axis(&p, k), &axis(&q, k), 1, closed)).sum();
            assert!((exact_product(&p, &q, 3, closed) - sum).abs() < 1e-12 * sum.abs());
        }
    }
}
