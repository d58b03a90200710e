//! Chains of Béziers as dense least squares problems with constraints: the reference of
//! `bezier::Chain`.

use faircurve::bezier::{Chain, PieceLengths, energy_matrix};
use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand::rngs::StdRng;

use crate::chains::{Case, QS};

/// A chain by dense matrices.
pub struct Reference {
    dimension: usize,
    /// Energy = Pᵀ form P a coordinate.
    form: DMatrix<f64>,
    /// Rows of joints and known points.
    constraints: DMatrix<f64>,
    values: DMatrix<f64>,
    /// Directions that keep the constraints.
    free: DMatrix<f64>,
    pub points: Vec<f64>,
    pub is_unique: bool,
    /// Of the reduced form.
    pub condition: f64,
    pub least: f64,
    /// The largest term of the energy.
    pub largest: f64,
}

/// The number of pieces of a chain.
pub fn pieces(case: &Case, degree: usize) -> usize {
    (case.known.len() - usize::from(!case.closed)) / degree
}

/// The length of each piece's parameter interval.
fn lengths(chain: &Chain, case: &Case) -> Vec<f64> {
    let (degree, count, d) = (chain.degree, case.known.len(), case.dimension);
    let pieces = pieces(case, degree);
    let joints = pieces + usize::from(!case.closed);
    let all_joints = (0..joints).all(|k| case.known[k * degree]) && joints > 1;
    if !(all_joints && matches!(chain.lengths, PieceLengths::Chords)) {
        return vec![1.0; pieces];
    }
    let joint = |k: usize| &case.points[(k * degree) % count * d..][..d];
    let chord = |k: usize| joint(k).iter().zip(joint(k + 1)).map(|(a, b)| (b - a).powi(2)).sum::<f64>().sqrt();
    (0..pieces).map(chord).collect()
}

/// The largest known coordinate, and at least 1.
pub fn size(case: &Case) -> f64 {
    let of = |k: usize| case.points[k * case.dimension..(k + 1) * case.dimension].iter();
    let known = (0..case.known.len()).filter(|&k| case.known[k]);
    known.flat_map(of).fold(1.0, |size: f64, x| size.max(x.abs()))
}

/// The form of the whole chain.
pub fn form_of(chain: &Chain, case: &Case) -> DMatrix<f64> {
    let (degree, count) = (chain.degree, case.known.len());
    let mut form = DMatrix::zeros(count, count);
    for (k, h) in lengths(chain, case).into_iter().enumerate() {
        for r in 1..=3 {
            let matrix = energy_matrix(degree, r);
            let weight = chain.energy.weights[r - 1] * h.powi(1 - 2 * r as i32);
            for (i, j) in (0..=degree).flat_map(|i| (0..=degree).map(move |j| (i, j))) {
                form[((k * degree + i) % count, (k * degree + j) % count)] += weight * matrix.f64_at(i, j);
            }
        }
    }
    form
}

impl Reference {
    pub fn of(chain: &Chain, case: &Case) -> Self {
        let (degree, count, d) = (chain.degree, case.known.len(), case.dimension);
        let q = QS.iter().find(|(_, joints)| *joints == chain.joints).unwrap().0;
        let form = form_of(chain, case);
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        for k in (0..count).filter(|&k| case.known[k]) {
            let mut row = vec![0.0; count];
            row[k] = 1.0;
            rows.push(row);
            values.push(case.points[k * d..(k + 1) * d].to_vec());
        }
        let lengths = lengths(chain, case);
        let pieces = lengths.len();
        for before in 0..if case.closed { pieces } else { pieces - 1 } {
            let after = (before + 1) % pieces;
            let (left, right) = (lengths[before], lengths[after]);
            let small = left.min(right);
            for r in 1..=q {
                let stencil: &[f64] = if r == 1 { &[-1.0, 1.0] } else { &[1.0, -2.0, 1.0] };
                let mut row = vec![0.0; count];
                for (j, x) in stencil.iter().enumerate() {
                    row[(before * degree + degree - r + j) % count] += x * (small / left).powi(r as i32);
                    row[(after * degree + j) % count] -= x * (small / right).powi(r as i32);
                }
                rows.push(row);
                values.push(vec![0.0; d]);
            }
        }
        let constraints = DMatrix::from_fn(rows.len(), count, |i, j| rows[i][j]);
        let values = DMatrix::from_fn(rows.len(), d, |i, j| values[i][j]);
        let normal = constraints.transpose() * &constraints;
        let eigen = normal.clone().symmetric_eigen();
        let null: Vec<usize> = (0..count).filter(|&i| eigen.eigenvalues[i] < 1e-11).collect();
        let free = DMatrix::from_fn(count, null.len(), |i, j| eigen.eigenvectors[(i, null[j])]);
        let particular = solve(&normal, &(constraints.transpose() * &values), 1e-11);
        let reduced = free.transpose() * &form * &free;
        let (mut condition, mut is_unique, mut points) = (1.0, true, particular.clone());
        if !null.is_empty() {
            let eigenvalues = reduced.symmetric_eigenvalues();
            condition = eigenvalues.max() / eigenvalues.min();
            is_unique = eigenvalues.min() > 1e-9 * form.amax();
            points += &free * solve(&reduced, &(-(free.transpose() * &form * &particular)), 1e-10 * form.amax());
        }
        let flat = points.row_iter().flat_map(|row| row.iter().copied().collect::<Vec<f64>>()).collect();
        let largest = form.amax() * size(case).powi(2);
        let mut reference = Reference {
            dimension: d,
            form,
            constraints,
            values,
            free,
            points: flat,
            is_unique,
            condition,
            least: 0.0,
            largest,
        };
        reference.least = reference.energy(&reference.points);
        reference
    }

    fn matrix(&self, points: &[f64]) -> DMatrix<f64> {
        DMatrix::from_row_slice(points.len() / self.dimension, self.dimension, points)
    }

    pub fn energy(&self, points: &[f64]) -> f64 {
        let points = self.matrix(points);
        (points.transpose() * &self.form * points).trace()
    }

    /// By how much joints and known points are missed.
    pub fn off(&self, points: &[f64]) -> f64 {
        (&self.constraints * self.matrix(points) - &self.values).amax()
    }

    /// A random step of this size that keeps joints and known points.
    pub fn feasible_step(&self, rng: &mut StdRng, size: f64) -> Vec<f64> {
        let columns: Vec<DVector<f64>> = (0..self.dimension)
            .map(|_| &self.free * DVector::from_fn(self.free.ncols(), |_, _| rng.random_range(-size..size)))
            .collect();
        (0..self.form.nrows()).flat_map(|k| columns.iter().map(move |column| column[k])).collect()
    }
}

/// The smallest solution of a symmetric system whose eigenvalues up to `nothing` count as 0,
/// refined.
fn solve(matrix: &DMatrix<f64>, rhs: &DMatrix<f64>, nothing: f64) -> DMatrix<f64> {
    let eigen = matrix.clone().symmetric_eigen();
    let inverse = eigen.eigenvalues.map(|x| if x > nothing { 1.0 / x } else { 0.0 });
    let apply = |rhs: &DMatrix<f64>| {
        let mut parts = eigen.eigenvectors.transpose() * rhs;
        parts.row_iter_mut().zip(inverse.iter()).for_each(|(mut row, x)| row *= *x);
        &eigen.eigenvectors * parts
    };
    let mut x = apply(rhs);
    for _ in 0..2 {
        x += apply(&(rhs - matrix * &x));
    }
    x
}
