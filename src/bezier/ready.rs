//! [`Ready`]: the completion of a pattern in floating point.

use super::energy::Energy;
use super::exact::{Matrix, to_f64};
use super::operator::Operator;
use super::pattern::{Completion, MOST_DERIVATIVE, Pattern};
use super::refusal::Refusal;
use super::{MOST_DEGREE, directions::Speeds};
use crate::status::CurveStatus;

/// The status of a completed curve, or why it was refused.
pub(super) type Outcome = Result<CurveStatus, Refusal>;

/// The largest number of data of a curve.
pub(super) const MOST_DATA: usize = MOST_DEGREE + 1 + 2 * MOST_DERIVATIVE;

/// The energy for a degree: a whole-numbered multiple of M, and F.
pub(super) struct Form {
    matrix: Matrix,
    factor: Vec<f64>,
}

impl Form {
    pub fn new(energy: &Energy, degree: usize) -> Self {
        Form { matrix: energy.matrix(degree).whole(), factor: energy.factor(degree) }
    }
}

/// The completion of a pattern, with the energy of the completed curve.
///
/// The operator has the rows of W for the unknown points, then the rows of F W, whose squares sum
/// to the energy. It is applied to the data relative to the first known point o: U = W (G − o) + o
/// W 1. This keeps the digits of coordinates far from 0. Constants have no energy.
#[derive(Clone, Debug)]
pub(super) struct Ready {
    pub pattern: Pattern,
    pub known: Vec<u8>,
    pub unknown: Vec<u8>,
    pub operator: Operator<f64>,
    /// W 1, summed over the known points.
    pub sums: Vec<f64>,
    pub is_unique: bool,
    /// The search for speeds, if first derivatives are given.
    pub speeds: Option<Speeds>,
}

impl Ready {
    /// `None` if the data are contradictory or redundant.
    pub fn new(pattern: Pattern, Form { matrix, factor }: &Form) -> Option<Self> {
        let completion = Completion::of_matrix(pattern, matrix)?;
        let width = pattern.degree() + 1;
        let weights = completion.raw_weights();
        let (unknown, columns) = (weights.rows(), pattern.data());
        let known: Vec<u8> = pattern.known().map(|i| i as u8).collect();
        let rounded = weights.to_f64();
        let weight = |i: usize, j: usize| rounded[i * columns + j];
        let places: Vec<usize> = pattern.unknown().collect();
        let energy_rows = factor.len() / width;
        let of_energy = |k: usize, j: usize| {
            let row = &factor[k * width..(k + 1) * width];
            let of_known = known.get(j).map_or(0.0, |&place| row[usize::from(place)]);
            of_known + places.iter().enumerate().map(|(i, &place)| row[place] * weight(i, j)).sum::<f64>()
        };
        let operator = Operator::from_fn(unknown + energy_rows, columns, |i, j| match i < unknown {
            true => weight(i, j),
            false => of_energy(i - unknown, j),
        });
        // A unique solution translates with the data. The smallest of many does not.
        let sum = |i: usize| match completion.is_unique() && !known.is_empty() {
            true => 1.0,
            false => to_f64(&(0..known.len()).map(|j| weights.at(i, j)).sum()),
        };
        let sums = (0..unknown).map(sum).collect();
        let speeds = Speeds::new(&pattern, &operator, unknown);
        let unknown = pattern.unknown().map(|i| i as u8).collect();
        Some(Ready { pattern, known, unknown, operator, sums, is_unique: completion.is_unique(), speeds })
    }

    /// Completes a curve from `data` relative to `origin`.
    ///
    /// Passes each unknown point with its index to `put`. Returns the energy.
    #[inline(always)]
    pub fn complete<const D: usize>(
        &self,
        data: &[[f64; D]],
        origin: &[f64; D],
        mut put: impl FnMut(usize, [f64; D]),
    ) -> f64 {
        let mut energy = 0.0;
        self.operator.apply(data, |row, point| match self.unknown.get(row) {
            Some(&place) => put(place.into(), std::array::from_fn(|c| point[c] + self.sums[row] * origin[c])),
            None => energy += point.iter().map(|x| x * x).sum::<f64>(),
        });
        energy
    }

    /// The status of a completed curve, or why it is refused.
    #[inline(always)]
    pub fn status(&self, coords: &[f64], energy: f64) -> Outcome {
        match (coords.iter().all(|x| x.is_finite()) && energy.is_finite(), self.is_unique) {
            (false, _) => Err(Refusal::Overflow),
            (true, true) => Ok(CurveStatus::Converged),
            (true, false) => Ok(CurveStatus::NotUnique),
        }
    }
}
