//! Directions at the ends: first derivatives whose length, the speed, is free.
//!
//! With X′(0) = α T₀ and X′(1) = β T₁ the least energy is a quadratic function of α and β > 0. Its
//! coefficients are inner products of columns of the energy's rows. If its minimum is at or below
//! 0, no curve attains it.

use super::operator::Operator;
use super::pattern::Pattern;

/// Inner products of the energy's columns that belong to first derivatives with all columns.
#[derive(Clone, Debug)]
pub(super) struct Speeds {
    /// The column of X′(0) and of X′(1), where given.
    pub columns: [Option<usize>; 2],
    products: [Vec<f64>; 2],
}

/// Changes of the energy below this, relative to the largest entry of its form, count as 0: the
/// rounding of some thirty terms.
const NOTHING: f64 = 1e-13;

/// The result of the search for speeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Found {
    /// The speeds at both ends, 1 without a direction.
    Speeds([f64; 2]),
    /// The energy does not depend on the speeds, and the vectors are kept.
    Any,
    /// The energy falls as the speed at this end goes to 0.
    Still(usize),
}

impl Speeds {
    /// `first` is the first row of the energy.
    pub fn new(pattern: &Pattern, operator: &Operator<f64>, first: usize) -> Option<Self> {
        let known = pattern.known().count();
        let column = |end| pattern.derivatives().position(|given| given == (end, 1)).map(|k| known + k);
        let columns = [column(0), column(1)];
        if columns == [None; 2] {
            return None;
        }
        let product = |i, j| (first..operator.rows()).map(|k| operator.at(k, i) * operator.at(k, j)).sum::<f64>();
        let products =
            columns.map(|own| own.map_or(Vec::new(), |own| (0..operator.columns()).map(|j| product(own, j)).collect()));
        Some(Speeds { columns, products })
    }

    /// The speeds of least energy, for data whose first derivatives are directions.
    pub fn find<const D: usize>(&self, data: &[[f64; D]]) -> Found {
        let ends: Vec<(usize, usize)> = (0..2).filter_map(|end| Some((end, self.columns[end]?))).collect();
        let dot = |i: usize, j: usize| (0..D).map(|c| data[i][c] * data[j][c]).sum::<f64>();
        let entry =
            |(end, own): (usize, usize), (_, other): (usize, usize)| self.products[end][other] * dot(own, other);
        let slope = |(end, own): (usize, usize)| {
            let others = (0..data.len()).filter(|&j| ends.iter().all(|&(_, column)| column != j));
            -others.map(|j| self.products[end][j] * dot(own, j)).sum::<f64>()
        };
        let flat = |end: (usize, usize)| {
            let largest = self.products[end.0].iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
            self.products[end.0][end.1] <= NOTHING * largest || largest == 0.0
        };
        if ends.iter().any(|&end| flat(end)) {
            return Found::Any;
        }
        let mut speeds = [1.0; 2];
        match ends[..] {
            [end] => speeds[end.0] = slope(end) / entry(end, end),
            [a, b] => {
                let (aa, ab, bb) = (entry(a, a), entry(a, b), entry(b, b));
                let determinant = aa * bb - ab * ab;
                if determinant <= NOTHING * aa * bb {
                    return Found::Any;
                }
                let (to_a, to_b) = (slope(a), slope(b));
                speeds = [(bb * to_a - ab * to_b) / determinant, (aa * to_b - ab * to_a) / determinant];
            }
            _ => {}
        }
        // With one speed held at 0 the other may change its sign. The minimum stays on the border.
        match ends.iter().find(|&&(end, _)| speeds[end].is_nan() || speeds[end] <= 0.0) {
            Some(&(end, _)) => Found::Still(end),
            None => Found::Speeds(speeds),
        }
    }
}
