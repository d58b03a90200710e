//! Chains of Béziers as dense least squares problems with constraints: the reference of `bezier::Chain`.

// Every test file uses its part.
#![allow(dead_code)]

use faircurve::bezier::{Chain, Joints, PieceLengths, energy_matrix};
use faircurve::{Constraints, CurveBatch};
use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand::rngs::StdRng;

/// Orders of continuity.
pub const QS: [(usize, Joints); 3] = [(0, Joints::Free), (1, Joints::C1), (2, Joints::C2)];

/// Control points, known ones true and others anything.
#[derive(Debug)]
pub struct Case {
    pub dimension: usize,
    pub closed: bool,
    pub points: Vec<f64>,
    pub known: Vec<bool>,
    pub lengths: Vec<f64>,
}

/// What unknown points are about before.
const ANYTHING: f64 = -77.0;

impl Case {
    /// A chain whose joints are as asked for, of which joints and other points are known with these probabilities.
    pub fn random(
        chain: &Chain,
        dimension: usize,
        pieces: usize,
        closed: bool,
        known: [f64; 2],
        rng: &mut StdRng,
    ) -> Self {
        let q = QS.iter().find(|(_, joints)| *joints == chain.joints).map_or(1, |(q, _)| *q);
        let (degree, joints) = (chain.degree, pieces + usize::from(!closed));
        let count = degree * pieces + usize::from(!closed);
        let known: Vec<bool> =
            (0..count).map(|k| rng.random_range(0.0..1.0) < known[usize::from(k % degree != 0)]).collect();
        let mut jets = vec![[[0.0_f64; 3]; 3]; joints];
        jets.iter_mut().flatten().flatten().for_each(|x| *x = rng.random_range(-1.0..1.0));
        let chord = |k: usize| {
            let ends = [jets[k][0], jets[(k + 1) % joints][0]];
            (0..dimension).map(|c| (ends[1][c] - ends[0][c]).powi(2)).sum::<f64>().sqrt()
        };
        let all_joints = (0..joints).all(|k| known[k * degree]) && joints > 1;
        let lengths: Vec<f64> = match chain.lengths {
            PieceLengths::Chords if all_joints => (0..pieces).map(chord).collect(),
            _ => vec![1.0; pieces],
        };
        let mut points = vec![0.0; count * dimension];
        for k in 0..pieces {
            let (h, d) = (lengths[k], degree as f64);
            for j in 0..=degree {
                let at = (k * degree + j) % count * dimension;
                for c in 0..dimension {
                    let of = |jet: &[[f64; 3]; 3], h: f64, i: usize| {
                        let i = i as f64;
                        let second = if i > 1.0 { i * (i - 1.0) / 2.0 * h * h / (d * (d - 1.0)) } else { 0.0 };
                        jet[0][c] + i * h / d * jet[1][c] + second * jet[2][c]
                    };
                    points[at + c] = match j {
                        j if j <= q => of(&jets[k], h, j),
                        j if j + q >= degree => of(&jets[(k + 1) % joints], -h, degree - j),
                        _ => rng.random_range(-1.0..1.0),
                    };
                }
            }
        }
        for (k, is_known) in known.iter().enumerate() {
            if !is_known {
                points[k * dimension..(k + 1) * dimension].fill(ANYTHING - k as f64);
            }
        }
        Case { dimension, closed, points, known, lengths }
    }

    pub fn batch(&self) -> CurveBatch {
        let known = Some(self.known.clone());
        CurveBatch::from_ragged(self.dimension, self.points.clone(), vec![0, self.known.len()])
            .and_then(|batch| batch.closed_each(vec![self.closed]))
            .and_then(|batch| batch.with_constraints(Constraints { known, ..Constraints::default() }))
            .unwrap()
    }

    /// The largest coordinate that is known; 1 at least.
    pub fn size(&self) -> f64 {
        let of = |k: usize| self.points[k * self.dimension..(k + 1) * self.dimension].iter();
        let known = (0..self.known.len()).filter(|&k| self.known[k]);
        known.flat_map(of).fold(1.0, |size: f64, x| size.max(x.abs()))
    }
}

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

/// The form of the whole chain.
pub fn form_of(chain: &Chain, case: &Case) -> DMatrix<f64> {
    let (degree, count) = (chain.degree, case.known.len());
    let mut form = DMatrix::zeros(count, count);
    for (k, h) in case.lengths.iter().enumerate() {
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
        let pieces = case.lengths.len();
        for before in 0..if case.closed { pieces } else { pieces - 1 } {
            let after = (before + 1) % pieces;
            let (left, right) = (case.lengths[before], case.lengths[after]);
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
        let largest = form.amax() * case.size().powi(2);
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

/// The smallest solution of a symmetric system whose eigenvalues up to `nothing` count as 0, refined.
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

/// The largest difference.
pub fn spread(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()))
}
