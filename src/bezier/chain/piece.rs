//! [`Piece`]: the energy of a piece of a chain.
//!
//! It is a quadratic form of the jets at both ends and of the known points between. Unknown points
//! between are eliminated by the exact operator of [`Completion`].
//!
//! With u = t/h derivatives of order r are hʳ p⁽ʳ⁾, and ∫|p⁽ʳ⁾|² dt = h^(1−2r) ∫₀¹|∂ʳp/∂uʳ|² du.
//! For a single order h scales the form. For mixed orders the points between depend on h, and least
//! squares correct the exact solution for h = 1.

use glam::DVec3;

use super::super::energy::{Energy, energy_matrix};
use super::super::exact::{Matrix, to_f64};
use super::super::pattern::{Completion, Pattern};

/// Rounding of a datum's share in the rows of the energy, relative to the largest entry.
const NOTHING: f64 = 1e-12;

/// Pieces of one degree and one pattern of known points between the ends.
///
/// Columns are data: the jet at the start (orders 0 to q with respect to u), the jet at the end,
/// then known points between.
pub(super) struct Piece {
    /// q
    smoothness: usize,
    /// The known control points that are data.
    pub inner: Vec<usize>,
    /// The computed control points: all but the first, the last and the known ones between.
    pub made: Vec<usize>,
    columns: usize,
    /// One row per computed point.
    weights: Vec<f64>,
    /// The sum of each row over points.
    sums: Vec<f64>,
    terms: Vec<Term>,
    /// For mixed orders, the computed points that no jet determines.
    loose: Vec<usize>,
    /// Whether the energy determines the computed points.
    pub is_unique: bool,
}

/// The energy of one order, with its weight.
struct Term {
    order: usize,
    /// Energy = dataᵀ gram data.
    gram: Vec<f64>,
    /// Energy = |rows data|².
    rows: Vec<f64>,
    /// Columns of the loose points: the rows of the energy are rows · data + of_loose · shift of
    /// these points.
    of_loose: Vec<f64>,
}

/// A piece of some length.
pub(super) struct Sized {
    /// The form's rows for the jets.
    pub gram: Vec<f64>,
    /// The shift of the loose points, row by row.
    shift: Vec<f64>,
    /// h
    length: f64,
}

impl Piece {
    /// Bit i of `known` says whether control point i is known, q < i < degree − q.
    pub fn new(degree: usize, smoothness: usize, known: u32, energy: &Energy) -> Self {
        let ends = [0, degree];
        let flags: Vec<bool> = (0..=degree).map(|i| ends.contains(&i) || known >> i & 1 == 1).collect();
        let mut pattern = Pattern::new(&flags);
        for (end, r) in (0..2).flat_map(|end| (1..=smoothness).map(move |r| (end, r))) {
            pattern = pattern.with_derivative(end, r);
        }
        let completion = Completion::new(pattern, energy).expect("jets and points between them are independent");
        let inner: Vec<usize> = (1..degree).filter(|&i| flags[i]).collect();
        let made: Vec<usize> = (1..degree).filter(|&i| !flags[i]).collect();
        let points = inner.len() + 2;
        let end_jet = |r: usize, end: usize| points + end * smoothness + r - 1;
        let order: Vec<usize> = std::iter::once(0)
            .chain((1..=smoothness).map(|r| end_jet(r, 0)))
            .chain([points - 1])
            .chain((1..=smoothness).map(|r| end_jet(r, 1)))
            .chain(1..points - 1)
            .collect();
        let columns = order.len();
        let exact = completion.all();
        let all = Matrix::from_fn(degree + 1, columns, |i, j| exact.at(i, order[j]).clone());
        let is_point = |column: usize| column == 0 || column == smoothness + 1 || column > 2 * smoothness + 1;
        let sum = |&i: &usize| to_f64(&(0..columns).filter(|&j| is_point(j)).map(|j| all.at(i, j)).sum());
        let sums = made.iter().map(sum).collect();
        let weights = made.iter().flat_map(|&i| (0..columns).map(move |j| (i, j))).map(|(i, j)| all.f64_at(i, j));
        let weights = weights.collect();
        let orders: Vec<usize> = (1..=3).filter(|r| energy.weights[r - 1] > 0.0).collect();
        let loose: Vec<usize> = match orders.len() {
            1 => Vec::new(),
            _ => (0..made.len()).filter(|&k| made[k] > smoothness && made[k] < degree - smoothness).collect(),
        };
        let term = |&order: &usize| {
            let weight = energy.weights[order - 1];
            let gram = all.transposed().times(&energy_matrix(degree, order).times(&all));
            let mut weights = [0.0; 3];
            weights[order - 1] = weight;
            let factor = Energy { weights }.factor(degree);
            let (factor, all, made, loose, width) = (&factor, &all, &made, &loose, degree + 1);
            let count = factor.len() / width;
            let entry = |k: usize, j: usize| (0..width).map(|i| factor[k * width + i] * all.f64_at(i, j)).sum();
            Term {
                order,
                gram: gram.to_f64().into_iter().map(|x| weight * x).collect(),
                rows: (0..count).flat_map(|k| (0..columns).map(move |j| entry(k, j))).collect(),
                of_loose: (0..count).flat_map(|k| loose.iter().map(move |&i| factor[k * width + made[i]])).collect(),
            }
        };
        let terms = orders.iter().map(term).collect();
        let is_unique = completion.is_unique();
        Piece { smoothness, inner, made, columns, weights, sums, terms, loose, is_unique }
    }

    /// Number of data of a jet.
    fn jet(&self) -> usize {
        self.smoothness + 1
    }

    /// The form for pieces of length h.
    pub fn sized(&self, length: f64) -> Sized {
        let rows = 2 * self.jet();
        let mut gram = vec![0.0; rows * self.columns];
        if self.loose.is_empty() {
            for term in &self.terms {
                let scale = length.powi(1 - 2 * term.order as i32);
                for (to, x) in gram.iter_mut().zip(&term.gram) {
                    *to += scale * x;
                }
            }
            return Sized { gram, shift: Vec::new(), length };
        }
        let shift = self.shift(length);
        self.energy_rows(&shift, length, |row| {
            for (i, to) in gram.chunks_exact_mut(self.columns).enumerate() {
                for (to, x) in to.iter_mut().zip(row) {
                    *to += row[i] * x;
                }
            }
        });
        // Mere rounding becomes 0, as in exact rationals.
        let of_term = |term: &Term| {
            let largest = term.of_loose.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
            largest * length.powi(1 - 2 * term.order as i32).sqrt()
        };
        let nothing = (NOTHING * self.terms.iter().map(of_term).fold(0.0, f64::max)).powi(2);
        let vanishing: Vec<usize> = (0..rows).filter(|i| gram[i * self.columns + i] <= nothing).collect();
        for i in vanishing {
            gram[i * self.columns..][..self.columns].fill(0.0);
            for j in 0..rows {
                gram[j * self.columns + i] = 0.0;
            }
        }
        Sized { gram, shift, length }
    }

    /// The shift of the loose points from h = 1, by least squares (Gram–Schmidt, twice).
    fn shift(&self, length: f64) -> Vec<f64> {
        let (n, columns) = (self.loose.len(), self.columns);
        let mut basis: Vec<Vec<f64>> = vec![Vec::new(); n];
        let mut data: Vec<Vec<f64>> = vec![Vec::new(); columns];
        for term in &self.terms {
            let scale = length.powi(1 - 2 * term.order as i32).sqrt();
            for row in term.of_loose.chunks_exact(n) {
                for (x, to) in row.iter().zip(&mut basis) {
                    to.push(scale * x);
                }
            }
            for row in term.rows.chunks_exact(columns) {
                for (x, to) in row.iter().zip(&mut data) {
                    to.push(scale * x);
                }
            }
        }
        let mut upper = vec![0.0; n * n];
        for j in 0..n {
            let (before, rest) = basis.split_at_mut(j);
            let own = &mut rest[0];
            for (i, other) in before.iter().enumerate().chain(before.iter().enumerate()) {
                let part = dot(other, own);
                upper[i * n + j] += part;
                for (x, y) in own.iter_mut().zip(other) {
                    *x -= part * y;
                }
            }
            let norm = dot(own, own).sqrt();
            upper[j * n + j] = norm;
            for x in own.iter_mut() {
                *x /= norm;
            }
        }
        let mut shift = vec![0.0; n * columns];
        for (k, mut column) in data.into_iter().enumerate() {
            let mut parts = vec![0.0; n];
            for (part, own) in parts.iter_mut().zip(&basis) {
                *part = -dot(own, &column);
                for (x, y) in column.iter_mut().zip(own) {
                    *x += *part * y;
                }
            }
            for i in (0..n).rev() {
                let known: f64 = (i + 1..n).map(|j| upper[i * n + j] * shift[j * columns + k]).sum();
                shift[i * columns + k] = (parts[i] - known) / upper[i * n + i];
            }
        }
        shift
    }

    /// Passes rows to `put` whose squares sum to the energy.
    fn energy_rows(&self, shift: &[f64], length: f64, mut put: impl FnMut(&[f64])) {
        let (n, columns) = (self.loose.len(), self.columns);
        let mut own = vec![0.0; columns];
        for term in &self.terms {
            let scale = length.powi(1 - 2 * term.order as i32).sqrt();
            for (k, row) in term.rows.chunks_exact(columns).enumerate() {
                for (j, x) in own.iter_mut().enumerate() {
                    let more: f64 = (0..n).map(|i| term.of_loose[k * n + i] * shift[i * columns + j]).sum();
                    *x = scale * (row[j] + more);
                }
                put(&own);
            }
        }
    }

    /// The data of a piece from the jets at its ends and the points between.
    ///
    /// Derivatives are with respect to u. Points are relative to `origin`.
    pub fn data(&self, jets: [&[DVec3]; 2], inner: impl Fn(usize) -> DVec3, origin: DVec3) -> Vec<DVec3> {
        let mut data = Vec::with_capacity(self.columns);
        for jet in jets {
            data.push(jet[0] - origin);
            data.extend_from_slice(&jet[1..]);
        }
        data.extend(self.inner.iter().map(|&i| inner(i) - origin));
        data
    }

    /// Passes the computed points to `put`, from data relative to `origin`. Returns the energy.
    pub fn make(&self, sized: &Sized, data: &[DVec3], origin: DVec3, mut put: impl FnMut(usize, DVec3)) -> f64 {
        for (k, row) in self.weights.chunks_exact(self.columns).enumerate() {
            let mut point = combined(row, data) + self.sums[k] * origin;
            if !sized.shift.is_empty()
                && let Some(i) = self.loose.iter().position(|&own| own == k)
            {
                point += combined(&sized.shift[i * self.columns..][..self.columns], data);
            }
            put(self.made[k], point);
        }
        let mut energy = 0.0;
        self.energy_rows(&sized.shift, sized.length, |row| {
            energy += combined(row, data).length_squared();
        });
        energy
    }

    /// Number of data.
    pub fn columns(&self) -> usize {
        self.columns
    }
}

/// Σ weights · data
#[inline]
pub(super) fn combined(weights: &[f64], data: &[DVec3]) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for (&weight, &datum) in weights.iter().zip(data) {
        sum += weight * datum;
    }
    sum
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
