//! [`Stencils`]: the old points and weights of each new point, by a sparse rule.
//!
//! Rows of new points are classified into *lines*. Each row whose window meets a border is a line,
//! counted from that border. Between the borders even and odd lines alternate. On short axes every
//! row is a line. The same holds for columns. A pair of lines has one stencil.

use super::SparseRule;
use crate::linalg::Real;

/// The stencils of all pairs of lines.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stencils<S> {
    radius: usize,
    pub axes: [Axis; 2],
    /// The weights, pair by pair: squares of radius + 1 rows and columns with the window's weights,
    /// row by row, padded with zeros.
    weights: Vec<S>,
}

/// The lines across one axis of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Axis {
    /// This number of intervals. Every row is a line.
    Short(usize),
    /// This number of lines meet the border at each end. Two lines alternate between.
    Long(usize),
}

impl Axis {
    /// The lines of an axis, under a rule with border masks from `least` intervals on.
    pub fn of(intervals: usize, least: usize) -> Self {
        if intervals < least { Axis::Short(intervals) } else { Axis::Long(least) }
    }

    /// Number of lines.
    pub fn lines(self) -> usize {
        match self {
            Axis::Short(intervals) => 2 * intervals + 1,
            Axis::Long(border) => 2 * border + 2,
        }
    }

    /// The line of a new row, or column, among 2 · `intervals` + 1 of them.
    #[inline(always)]
    pub fn line(self, row: usize, intervals: usize) -> usize {
        match self {
            Axis::Short(_) => row,
            Axis::Long(border) if row < border => row,
            Axis::Long(border) if row + border > 2 * intervals => 2 * border + 1 - (2 * intervals - row),
            Axis::Long(border) => border + row % 2,
        }
    }

    /// A grid's intervals, and the row of every line in it.
    fn sample(self) -> (usize, Vec<usize>) {
        match self {
            Axis::Short(intervals) => (intervals, (0..=2 * intervals).collect()),
            Axis::Long(border) => {
                let intervals = border + 2;
                let between = border + border % 2;
                let rows = (0..border).chain([between, between + 1]).chain(2 * intervals + 1 - border..=2 * intervals);
                (intervals, rows.collect())
            }
        }
    }
}

/// The window of old rows (columns) of a new one: the first, and the number.
#[inline(always)]
pub(super) fn window(row: usize, radius: usize, intervals: usize) -> (usize, usize) {
    let first = row.saturating_sub(radius).div_ceil(2);
    let last = ((row + radius) / 2).min(intervals);
    (first, last + 1 - first)
}

impl<S: Real> Stencils<S> {
    /// The stencils of a rule for grids whose axes have these lines.
    pub fn new(rule: &SparseRule, axes: [Axis; 2]) -> Self {
        let radius = rule.radius();
        let [(n, rows), (m, columns)] = axes.map(Axis::sample);
        let mut weights = Vec::with_capacity(rows.len() * columns.len() * (radius + 1) * (radius + 1));
        for &row in &rows {
            let (top, high) = window(row, radius, n);
            for &column in &columns {
                let (left, wide) = window(column, radius, m);
                let start = weights.len();
                for a in top..top + high {
                    for b in left..left + wide {
                        weights.push(S::from_f64(rule.weight([row, column], [a, b], [n, m])));
                    }
                }
                weights.resize(start + (radius + 1) * (radius + 1), S::ZERO);
            }
        }
        Stencils { radius, axes, weights }
    }

    pub fn radius(&self) -> usize {
        self.radius
    }

    /// All weights, as the device holds them.
    pub fn weights(&self) -> &[S] {
        &self.weights
    }

    /// The weights for a pair of lines, in the order of the window's rows.
    #[inline(always)]
    pub fn weights_of(&self, lines: [usize; 2]) -> &[S] {
        let size = (self.radius + 1) * (self.radius + 1);
        &self.weights[(lines[0] * self.axes[1].lines() + lines[1]) * size..][..size]
    }
}
