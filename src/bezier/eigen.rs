//! [`Eigenstructure`]: the eigenvalues and eigenvectors of the energy matrix.

use super::energy::Energy;
use crate::error::Result;

/// The eigenvalues and eigenvectors of the energy matrix: M = Σ λₖ vₖ vₖᵀ.
///
/// With Qₖ = vₖᵀ P the energy is Σ λₖ |Qₖ|² (Eberly, section 3).
///
/// The energy's order is the number of zero eigenvalues (at most d + 1). Their control polygons are
/// polynomials in the index of the control point: elevated curves of lower degree.
///
/// ```
/// use faircurve::bezier::{Eigenstructure, Energy};
///
/// // 10, 6, 0, 0 in the paper's normalisation, E = 6 Pᵀ M P.
/// let cubic = Eigenstructure::new(3, &Energy::bending())?;
/// assert!((cubic.values[0] - 60.0).abs() < 1e-12 && (cubic.values[1] - 36.0).abs() < 1e-12);
/// assert_eq!(cubic.values[2..], [0.0, 0.0]);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Eigenstructure {
    /// d + 1 eigenvalues, the largest first.
    pub values: Vec<f64>,
    /// Unit eigenvectors in the same order, orthogonal to each other.
    ///
    /// The first entry of each that is not 0 is positive.
    pub vectors: Vec<Vec<f64>>,
}

impl Eigenstructure {
    /// Computes them from the singular values of F, with M = FᵀF.
    ///
    /// An eigenvalue λ is good to some ε √(λ λ₀), where λ₀ is the largest.
    ///
    /// # Errors
    /// An energy without a positive weight.
    pub fn new(degree: usize, energy: &Energy) -> Result<Self> {
        energy.check()?;
        let count = degree + 1;
        let order = energy.order().unwrap_or(count).min(count);
        let factor = energy.factor(degree);
        let columns = (0..count).map(|i| factor.iter().skip(i).step_by(count).copied().collect()).collect();
        let mut pairs = right_singular(columns);
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        pairs.truncate(count - order);
        let (mut values, mut vectors): (Vec<f64>, Vec<Vec<f64>>) = pairs.into_iter().unzip();
        for power in 0..order {
            let monomial = (0..count).map(|i| (i as f64 - 0.5 * degree as f64).powi(power as i32)).collect();
            values.push(0.0);
            let vector = orthonormal(monomial, &vectors);
            vectors.push(vector);
        }
        for vector in &mut vectors {
            orient(vector);
        }
        Ok(Eigenstructure { values, vectors })
    }
}

/// Squares of the singular values, and right singular vectors, of a matrix given by its columns.
///
/// Pairs of columns are rotated until all columns are orthogonal (Hestenes 1958), which gives small
/// values to high relative accuracy (Demmel and Veselić 1992). nalgebra's bidiagonalisation is
/// wrong in the eleventh digit at degree 5 and order 3.
fn right_singular(mut columns: Vec<Vec<f64>>) -> Vec<(f64, Vec<f64>)> {
    let count = columns.len();
    let mut vectors: Vec<Vec<f64>> =
        (0..count).map(|i| (0..count).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for _ in 0..MOST_SWEEPS {
        let mut turned = false;
        for i in 0..count {
            for j in i + 1..count {
                let (a, b, c) =
                    (dot(&columns[i], &columns[i]), dot(&columns[j], &columns[j]), dot(&columns[i], &columns[j]));
                if c.abs() <= f64::EPSILON * (a * b).sqrt() {
                    continue;
                }
                turned = true;
                let zeta = (b - a) / (2.0 * c);
                let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                let cosine = 1.0 / tangent.hypot(1.0);
                for set in [&mut columns, &mut vectors] {
                    let (head, tail) = set.split_at_mut(j);
                    for (x, y) in head[i].iter_mut().zip(&mut tail[0]) {
                        (*x, *y) = (cosine * (*x - tangent * *y), cosine * (*y + tangent * *x));
                    }
                }
            }
        }
        if !turned {
            break;
        }
    }
    columns.iter().map(|column| dot(column, column)).zip(vectors).collect()
}

/// Ten sweeps suffice for 31 columns. Columns of mere rounding would rotate forever.
const MOST_SWEEPS: usize = 30;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The unit vector along the part of `vector` that is orthogonal to all others.
///
/// Two passes are enough (Kahan, Parlett).
fn orthonormal(mut vector: Vec<f64>, others: &[Vec<f64>]) -> Vec<f64> {
    for other in others.iter().chain(others) {
        let along = dot(&vector, other);
        for (x, y) in vector.iter_mut().zip(other) {
            *x -= along * y;
        }
    }
    let length = dot(&vector, &vector).sqrt();
    for x in &mut vector {
        *x /= length;
    }
    vector
}

/// A component this small of a unit vector is rounding.
const NOTHING: f64 = 1e-12;

fn orient(vector: &mut [f64]) {
    if vector.iter().find(|x| x.abs() > NOTHING).is_some_and(|&x| x < 0.0) {
        for x in vector {
            *x = -*x;
        }
    }
}
