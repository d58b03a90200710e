//! Thomas elimination as textbooks print it (Golub & Van Loan, *Matrix Computations*, section 4.3):
//! the reference that the fast paths are compared with. One system at a time, no step shared with
//! them.

use super::scalar::Real;

/// Solves the open system with the given bands; `lower[0]` and `upper[n − 1]` are ignored.
///
/// Stable without pivoting for dominant, and for symmetric positive definite matrices. A pivot of 0
/// gives numbers that are not finite.
pub fn thomas<T: Real>(lower: &[T], diagonal: &[T], upper: &[T], rhs: &[T]) -> Vec<T> {
    let n = rhs.len();
    let mut c = vec![T::ZERO; n];
    let mut x = rhs.to_vec();
    for i in 0..n {
        if i == 0 {
            c[0] = upper[0] / diagonal[0];
            x[0] = rhs[0] / diagonal[0];
        } else {
            let pivot = diagonal[i] - lower[i] * c[i - 1];
            c[i] = upper[i] / pivot;
            x[i] = (rhs[i] - lower[i] * x[i - 1]) / pivot;
        }
    }
    for i in (0..n.saturating_sub(1)).rev() {
        x[i] = x[i] - c[i] * x[i + 1];
    }
    x
}

/// Solves the cyclic system, in which `lower[0]` couples row 0 with row n − 1 and `upper[n − 1]`
/// couples row n − 1 with row 0, by the Sherman–Morrison formula: the matrix is an open one plus
/// the rank-one matrix u·vᵀ with `u = (γ, 0 … 0, upper[n − 1])`, `v = (1, 0 … 0, lower[0]/γ)`,
/// `γ = −diagonal[0]`.
pub fn thomas_cyclic<T: Real>(lower: &[T], diagonal: &[T], upper: &[T], rhs: &[T]) -> Vec<T> {
    let n = rhs.len();
    match n {
        0 => return Vec::new(),
        // The row is its own neighbour on both sides.
        1 => return vec![rhs[0] / (diagonal[0] + lower[0] + upper[0])],
        // Both neighbours of a row are the other row.
        2 => return thomas(&[T::ZERO, lower[1] + upper[1]], diagonal, &[lower[0] + upper[0], T::ZERO], rhs),
        _ => {}
    }
    let gamma = -diagonal[0];
    let mut open = diagonal.to_vec();
    open[0] = diagonal[0] - gamma;
    open[n - 1] = diagonal[n - 1] - upper[n - 1] * lower[0] / gamma;
    let mut u = vec![T::ZERO; n];
    u[0] = gamma;
    u[n - 1] = upper[n - 1];
    let y = thomas(lower, &open, upper, rhs);
    let z = thomas(lower, &open, upper, &u);
    let ratio = lower[0] / gamma;
    let factor = (y[0] + ratio * y[n - 1]) / (T::ONE + z[0] + ratio * z[n - 1]);
    y.iter().zip(&z).map(|(&y, &z)| y - factor * z).collect()
}
