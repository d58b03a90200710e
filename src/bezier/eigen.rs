//! [`Eigenstructure`]: which control polygons bend most, which not at all.

use nalgebra::DMatrix;

use super::energy::Energy;
use crate::error::Result;

/// M = Σ λₖ vₖ vₖᵀ: with Qₖ = vₖᵀ P the energy is Σ λₖ |Qₖ|² (Eberly, section 3).
///
/// Eigenvalues of 0, as many as the order of the energy (or d + 1, if that is less), have control polygons that are polynomials in the number of the
/// control point: curves of lower degree, elevated.
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
    /// Unit eigenvectors in the same order, orthogonal to each other; the first entry that is not 0 is positive.
    pub vectors: Vec<Vec<f64>>,
}

impl Eigenstructure {
    /// From the singular values of F, M = FᵀF: an eigenvalue λ is good to some ε √(λ λ₀), λ₀ the largest.
    ///
    /// # Errors
    /// An energy that weighs nothing.
    pub fn new(degree: usize, energy: &Energy) -> Result<Self> {
        energy.check()?;
        let count = degree + 1;
        let order = energy.order().unwrap_or(count).min(count);
        let factor = energy.factor(degree);
        // Square: rows of zeros give all the right singular vectors.
        let rows = (factor.len() / count).max(count);
        let padded = DMatrix::from_fn(rows, count, |i, j| factor.get(i * count + j).copied().unwrap_or(0.0));
        let svd = padded.svd(false, true);
        let right = svd.v_t.expect("asked for");
        let mut pairs: Vec<(f64, Vec<f64>)> =
            (0..count).map(|k| (svd.singular_values[k], right.row(k).iter().copied().collect())).collect();
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        pairs.truncate(count - order);
        let (mut values, mut vectors): (Vec<f64>, Vec<Vec<f64>>) =
            pairs.into_iter().map(|(sigma, vector)| (sigma * sigma, vector)).unzip();
        for power in 0..order {
            let monomial = (0..count).map(|i| (i as f64 - 0.5 * degree as f64).powi(power as i32)).collect();
            values.push(0.0);
            let vector = orthonormal(monomial, &vectors);
            vectors.push(vector);
        }
        vectors.iter_mut().for_each(orient);
        Ok(Eigenstructure { values, vectors })
    }
}

/// A unit vector in the direction of this one's part that is orthogonal to all others; twice is enough (Kahan, Parlett).
fn orthonormal(mut vector: Vec<f64>, others: &[Vec<f64>]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for other in others.iter().chain(others) {
        let along = dot(&vector, other);
        vector.iter_mut().zip(other).for_each(|(x, y)| *x -= along * y);
    }
    let length = dot(&vector, &vector).sqrt();
    vector.iter_mut().for_each(|x| *x /= length);
    vector
}

/// What is this small beside a unit vector is 0 but for rounding.
const NOTHING: f64 = 1e-12;

fn orient(vector: &mut Vec<f64>) {
    if vector.iter().find(|x| x.abs() > NOTHING).is_some_and(|&x| x < 0.0) {
        vector.iter_mut().for_each(|x| *x = -*x);
    }
}
