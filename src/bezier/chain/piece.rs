//! [`Piece`]: the energy of a piece of a chain.
//!
//! It is a quadratic form of the jets at its ends and of what is known between.
//!
//! Some control points are unknown and not determined by either end. They are those of least energy
//! for these data, by the exact operator of [`Completion`]. What remains is the form of the ends.
//!
//! In the piece's own fraction u = t/h derivatives of order r are hʳ p⁽ʳ⁾, and ∫|p⁽ʳ⁾|² dt =
//! h^(1−2r) ∫₀¹|∂ʳp/∂uʳ|² du. For a single order h only scales the form. For mixed orders the
//! points between depend on h: least squares correct the exact solution for h = 1.

use super::super::energy::{Energy, energy_matrix};
use super::super::exact::{Matrix, to_f64};
use super::super::pattern::{Completion, Pattern};

/// A vector of up to three coordinates. The others are 0.
pub(super) type Vector = [f64; 3];

/// Rounding of a datum's share in the rows of the energy, relative to the largest entry.
const NOTHING: f64 = 1e-12;

/// to + factor · x
#[inline]
pub(super) fn plus(to: Vector, factor: f64, x: Vector) -> Vector {
    std::array::from_fn(|c| to[c] + factor * x[c])
}

/// Pieces of one degree and one pattern of known points between.
///
/// Columns are data: the jet at the start (orders 0 to q with respect to u), the jet at the end,
/// then known points between.
pub(super) struct Piece {
    /// q
    smoothness: usize,
    /// The known control points that are data.
    pub inner: Vec<usize>,
    /// The control points that are made: all but the first, the last and the known ones between.
    pub made: Vec<usize>,
    columns: usize,
    /// One row for each point made.
    weights: Vec<f64>,
    /// The sum of each row over points.
    sums: Vec<f64>,
    terms: Vec<Term>,
    /// For mixed orders, rows of the points that no datum determines.
    loose: Vec<usize>,
    /// Whether the energy determines the points made.
    pub is_unique: bool,
}

/// The energy of one order, with its weight.
struct Term {
    order: usize,
    /// Energy = dataᵀ gram data.
    gram: Vec<f64>,
    /// Energy = |rows data|².
    rows: Vec<f64>,
    /// Columns of the points that no datum determines.
    ///
    /// The rows of the energy are rows · data + of_loose · what is added to these points.
    of_loose: Vec<f64>,
}

/// A piece of some length.
pub(super) struct Sized {
    /// Rows of the form that belong to jets.
    pub gram: Vec<f64>,
    /// What is added to the loose points, row after row.
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
                gram.iter_mut().zip(&term.gram).for_each(|(to, x)| *to += scale * x);
            }
            return Sized { gram, shift: Vec::new(), length };
        }
        let shift = self.shift(length);
        self.energy_rows(&shift, length, |row| {
            for (i, to) in gram.chunks_exact_mut(self.columns).enumerate() {
                to.iter_mut().zip(row).for_each(|(to, x)| *to += row[i] * x);
            }
        });
        // What is rounding alone becomes 0, as it is in exact rationals.
        let of_term = |term: &Term| {
            let largest = term.of_loose.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
            largest * length.powi(1 - 2 * term.order as i32).sqrt()
        };
        let nothing = (NOTHING * self.terms.iter().map(of_term).fold(0.0, f64::max)).powi(2);
        for i in (0..rows).filter(|i| gram[i * self.columns + i] <= nothing).collect::<Vec<_>>() {
            (0..self.columns).for_each(|j| gram[i * self.columns + j] = 0.0);
            (0..rows).for_each(|j| gram[j * self.columns + i] = 0.0);
        }
        Sized { gram, shift, length }
    }

    /// The difference of the loose points from those for h = 1.
    ///
    /// Least squares find it, by orthonormal columns (Gram and Schmidt, each twice).
    fn shift(&self, length: f64) -> Vec<f64> {
        let (n, columns) = (self.loose.len(), self.columns);
        let mut basis: Vec<Vec<f64>> = vec![Vec::new(); n];
        let mut data: Vec<Vec<f64>> = vec![Vec::new(); columns];
        for term in &self.terms {
            let scale = length.powi(1 - 2 * term.order as i32).sqrt();
            for row in term.of_loose.chunks_exact(n) {
                row.iter().zip(&mut basis).for_each(|(x, to)| to.push(scale * x));
            }
            for row in term.rows.chunks_exact(columns) {
                row.iter().zip(&mut data).for_each(|(x, to)| to.push(scale * x));
            }
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut upper = vec![0.0; n * n];
        for j in 0..n {
            let (before, rest) = basis.split_at_mut(j);
            let own = &mut rest[0];
            for (i, other) in before.iter().enumerate().chain(before.iter().enumerate()) {
                let part = dot(other, own);
                upper[i * n + j] += part;
                own.iter_mut().zip(other).for_each(|(x, y)| *x -= part * y);
            }
            let norm = dot(own, own).sqrt();
            upper[j * n + j] = norm;
            own.iter_mut().for_each(|x| *x /= norm);
        }
        let mut shift = vec![0.0; n * columns];
        for (k, mut column) in data.into_iter().enumerate() {
            let mut parts = vec![0.0; n];
            for (part, own) in parts.iter_mut().zip(&basis) {
                *part = -dot(own, &column);
                column.iter_mut().zip(own).for_each(|(x, y)| *x += *part * y);
            }
            for i in (0..n).rev() {
                let known: f64 = (i + 1..n).map(|j| upper[i * n + j] * shift[j * columns + k]).sum();
                shift[i * columns + k] = (parts[i] - known) / upper[i * n + i];
            }
        }
        shift
    }

    /// Hands out rows whose squares are the energy.
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
    pub fn data(&self, jets: [&[Vector]; 2], inner: impl Fn(usize) -> Vector, origin: Vector) -> Vec<Vector> {
        let relative = |(r, &x): (usize, &Vector)| if r == 0 { plus(x, -1.0, origin) } else { x };
        let ends = jets.into_iter().flat_map(|jet| jet.iter().enumerate().map(relative));
        ends.chain(self.inner.iter().map(|&i| plus(inner(i), -1.0, origin))).collect()
    }

    /// Hands out the points made, from data relative to `origin`. Returns the energy.
    pub fn make(&self, sized: &Sized, data: &[Vector], origin: Vector, mut put: impl FnMut(usize, Vector)) -> f64 {
        let apply = |row: &[f64]| row.iter().zip(data).fold([0.0; 3], |sum, (&x, &datum)| plus(sum, x, datum));
        for (k, row) in self.weights.chunks_exact(self.columns).enumerate() {
            let mut point = plus(apply(row), self.sums[k], origin);
            if !sized.shift.is_empty()
                && let Some(i) = self.loose.iter().position(|&own| own == k)
            {
                point = plus(point, 1.0, apply(&sized.shift[i * self.columns..][..self.columns]));
            }
            put(self.made[k], point);
        }
        let mut energy = 0.0;
        self.energy_rows(&sized.shift, sized.length, |row| {
            energy += apply(row).iter().map(|x| x * x).sum::<f64>();
        });
        energy
    }

    /// Number of data.
    pub fn columns(&self) -> usize {
        self.columns
    }
}
