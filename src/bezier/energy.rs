//! ∫|X⁽ʳ⁾|² dt of a Bézier curve as a quadratic form of its control points.
//!
//! Δʳ are the differences of the control points. X⁽ʳ⁾ is the Bézier curve of degree n = d − r with
//! the control points d!/(d−r)! ΔʳP. Its products have the integrals ∫ Bᵢ Bⱼ dt = C(n,i) C(n,j) /
//! ((2n+1) C(2n,i+j)).

use num_rational::BigRational;
use num_traits::Zero;

use super::exact::{Matrix, binomial, falling, ratio, to_f64};
use crate::error::{Error, Result};

/// The energy that a completed curve minimises: Σ weights\[r−1\] ∫₀¹ |X⁽ʳ⁾|² dt, r = 1, 2, 3.
///
/// ```
/// use faircurve::bezier::Energy;
/// assert_eq!(Energy::default(), Energy::bending());
/// assert_eq!(Energy { weights: [0.1, 1.0, 0.0] }.order(), Some(1));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// Weights of ∫|X′|², ∫|X″|² and ∫|X‴|²: 0 or more, at least one positive.
    pub weights: [f64; 3],
}

impl Default for Energy {
    fn default() -> Self {
        Energy::bending()
    }
}

impl Energy {
    /// ∫|X″|² dt alone.
    pub const fn bending() -> Self {
        Energy { weights: [0.0, 1.0, 0.0] }
    }

    /// ∫|X⁽ʳ⁾|² dt alone, r = 1, 2 or 3.
    ///
    /// # Panics
    /// With another order.
    pub fn of_order(r: usize) -> Self {
        assert!((1..=3).contains(&r), "the order is {r}; 1, 2 and 3 are possible");
        Energy { weights: std::array::from_fn(|k| f64::from(u8::from(k + 1 == r))) }
    }

    /// The least order with a weight. At least this many known points determine a curve.
    pub fn order(&self) -> Option<usize> {
        self.weights.iter().position(|&weight| weight > 0.0).map(|k| k + 1)
    }

    pub(super) fn check(&self) -> Result<()> {
        if let Some(weight) = self.weights.iter().find(|weight| !(**weight >= 0.0 && weight.is_finite())) {
            return Err(Error::argument(format!(
                "a weight of the energy is {weight}; weights are finite and 0 or more"
            )));
        }
        match self.order() {
            Some(_) => Ok(()),
            None => {
                Err(Error::argument("all weights of the energy are 0: give one that is positive, such as bending=1"))
            }
        }
    }

    /// The orders with a weight, and their weights.
    fn terms(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0).map(|(k, &weight)| (k + 1, weight))
    }

    #[doc(hidden)]
    /// M of the whole energy, exact for the f64 weights. The energy of a coordinate is Pᵀ M P.
    pub fn matrix(&self, degree: usize) -> Matrix {
        let zero = Matrix::from_fn(degree + 1, degree + 1, |_, _| BigRational::zero());
        self.terms().fold(zero, |sum, (order, weight)| {
            let weight = BigRational::from_float(weight).expect("weights are finite");
            sum.plus(&weight, &energy_matrix(degree, order))
        })
    }

    /// F with M = FᵀF, row by row (columns: control points).
    ///
    /// The rows are the coefficients of √weight X⁽ʳ⁾ in orthonormal Legendre polynomials. The
    /// energy
    /// |F P|² keeps its relative accuracy near 0.
    pub(super) fn factor(&self, degree: usize) -> Vec<f64> {
        let rows = |(order, weight): (usize, f64)| {
            let legendre = legendre_matrix(degree, order);
            let scale = move |k: usize| (weight * (2 * k + 1) as f64).sqrt();
            (0..legendre.rows())
                .flat_map(|k| (0..=degree).map(move |i| (k, i)))
                .map(|(k, i)| scale(k) * to_f64(legendre.at(k, i)))
                .collect::<Vec<f64>>()
        };
        self.terms().flat_map(rows).collect()
    }
}

/// M of ∫₀¹ |X⁽ʳ⁾|² dt = Pᵀ M P for curves of degree d, by the closed form.
///
/// The matrix is exact and has (d+1) × (d+1) entries. It is zero for r > d.
///
/// ```
/// use faircurve::bezier::energy_matrix;
/// assert_eq!(energy_matrix(2, 2).to_f64(), [4.0, -8.0, 4.0, -8.0, 16.0, -8.0, 4.0, -8.0, 4.0]);
/// ```
pub fn energy_matrix(degree: usize, order: usize) -> Matrix {
    if order > degree {
        return Matrix::from_fn(degree + 1, degree + 1, |_, _| BigRational::zero());
    }
    let n = degree - order;
    let gram = Matrix::from_fn(n + 1, n + 1, |i, j| {
        ratio(binomial(n, i) * binomial(n, j), binomial(2 * n, i + j) * (2 * n + 1))
    });
    let derivative = derivative_matrix(degree, order);
    derivative.transposed().times(&gram.times(&derivative))
}

/// M by Eberly's recursion for the Beta function (section 5 of the paper).
///
/// It integrates the terms of X⁽ʳ⁾ one by one, and serves as a check of [`energy_matrix`].
pub fn energy_matrix_by_beta(degree: usize, order: usize) -> Matrix {
    let beta = beta_table(2 * degree);
    // X⁽ʳ⁾ by Leibniz' rule: coefficients of tᵖ (1−t)^(d−r−p), p = i − k.
    let term = |i: usize, k: usize| {
        let rest = degree - i;
        let size = binomial(degree, i) * binomial(order, k) * falling(i, k) * falling(rest, order - k);
        if (order - k).is_multiple_of(2) { size } else { -size }
    };
    Matrix::from_fn(degree + 1, degree + 1, |i, j| {
        let mut sum = BigRational::zero();
        for k in 0..=order {
            for l in 0..=order {
                let product = term(i, k) * term(j, l);
                if !product.is_zero() {
                    let t = i + j - k - l;
                    sum += &beta[t][2 * (degree - order) - t] * BigRational::from_integer(product);
                }
            }
        }
        sum
    })
}

/// ∫ tᵖ (1−t)ⁿ dt = B(p+1, n+1) for p + n ≤ most.
///
/// The recursions are B(p+1, n+1) = p/(p+n+1) B(p, n+1) and n/(p+n+1) B(p+1, n).
fn beta_table(most: usize) -> Vec<Vec<BigRational>> {
    let mut table: Vec<Vec<BigRational>> = Vec::with_capacity(most + 1);
    for p in 0..=most {
        let mut row: Vec<BigRational> = Vec::with_capacity(most - p + 1);
        for n in 0..=most - p {
            row.push(match (p, n) {
                (0, 0) => ratio(1, 1),
                (0, _) => ratio(n, n + 1) * &row[n - 1],
                _ => ratio(p, p + n + 1) * &table[p - 1][n],
            });
        }
        table.push(row);
    }
    table
}

/// Control points of X⁽ʳ⁾, degree d − r, from those of X: d!/(d−r)! Δʳ.
pub(super) fn derivative_matrix(degree: usize, order: usize) -> Matrix {
    Matrix::from_fn(degree + 1 - order, degree + 1, |i, j| {
        if j < i {
            return BigRational::zero();
        }
        let size = falling(degree, order) * binomial(order, j - i);
        ratio(if (order + j - i).is_multiple_of(2) { size } else { -size }, 1)
    })
}

/// ∫ X⁽ʳ⁾ Lₖ dt from control points, k = 0 … d − r.
///
/// Lₖ = Σⱼ (−1)^(k+j) C(k,j) Bⱼᵏ is the Legendre polynomial on [0, 1], with ∫ Lₖ² = 1/(2k+1).
fn legendre_matrix(degree: usize, order: usize) -> Matrix {
    if order > degree {
        return Matrix::from_fn(0, degree + 1, |_, _| BigRational::zero());
    }
    let n = degree - order;
    let integrals = Matrix::from_fn(n + 1, n + 1, |k, i| {
        (0..=k)
            .map(|j| {
                let size =
                    ratio(binomial(k, j) * binomial(k, j) * binomial(n, i), binomial(n + k, i + j) * (n + k + 1));
                if (k + j).is_multiple_of(2) { size } else { -size }
            })
            .sum()
    });
    integrals.times(&derivative_matrix(degree, order))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bezier::MOST_DEGREE;

    #[test]
    fn the_closed_form_and_the_beta_recursion_agree_exactly_up_to_degree_30() {
        for degree in (0..=12).chain([17, 23, MOST_DEGREE]) {
            for order in 1..=3.min(degree) {
                assert_eq!(energy_matrix(degree, order), energy_matrix_by_beta(degree, order), "{degree}, {order}");
            }
        }
    }

    #[test]
    fn the_factor_is_one_of_the_matrix() {
        for degree in [0, 1, 2, 3, 10, MOST_DEGREE] {
            let energy = Energy { weights: [0.5, 2.0, 0.25] };
            let (factor, matrix) = (energy.factor(degree), energy.matrix(degree));
            let width = degree + 1;
            let largest = matrix.to_f64().iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
            for i in 0..width {
                for j in 0..width {
                    let product: f64 = factor.chunks_exact(width).map(|row| row[i] * row[j]).sum();
                    assert!((product - matrix.f64_at(i, j)).abs() <= 1e-14 * largest, "{degree}: {i}, {j}");
                }
            }
        }
    }

    #[test]
    fn energies_that_weigh_nothing_or_less_are_refused() {
        assert!(Energy::default().check().is_ok());
        let text = |weights| Energy { weights }.check().unwrap_err().to_string();
        assert!(text([0.0; 3]).starts_with("all weights of the energy are 0"));
        assert!(text([1.0, -1.0, 0.0]).contains("is -1; weights are finite"));
        assert!(text([1.0, f64::NAN, 0.0]).contains("is NaN"));
    }
}
