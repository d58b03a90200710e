//! [`GridReport`]: how the subdivision of a grid ended.

use super::Grids;
use crate::status::CurveStatus;

/// The report of one grid.
#[derive(Clone, Debug, PartialEq)]
pub struct GridReport {
    /// How the subdivision ended.
    ///
    /// - [`Converged`](CurveStatus::Converged): the grid is subdivided.
    /// - `Degenerate`: it has no points.
    /// - `Invalid`: a value is NaN or infinite, or a result overflows.
    pub status: CurveStatus,
    /// An explanation of the status: the grid, the place, the value and the remedy.
    pub message: Option<String>,
}

impl Grids {
    /// The beginning of sentences about grid `i`.
    pub(super) fn place(&self, i: usize) -> String {
        format!("{}grid {i}", self.file().map(|file| format!("{file}, ")).unwrap_or_default())
    }

    /// The report of grid `i` before it is subdivided.
    pub(super) fn report(&self, i: usize) -> GridReport {
        let place = self.place(i);
        if self.grid(i).is_empty() {
            let message = format!("{place} has no points: give it some, or leave it out");
            return GridReport { status: CurveStatus::Degenerate, message: Some(message) };
        }
        match self.grid(i).iter().position(|x| !x.is_finite()) {
            None => GridReport { status: CurveStatus::Converged, message: None },
            Some(at) => {
                let (point, value) = (at / self.dimension(), self.grid(i)[at]);
                let (row, column) = (point / self.shape(i)[1], point % self.shape(i)[1]);
                let message = format!(
                    "{place}: the value in row {row}, column {column} (counted from 0) is {value}; all must be finite: mend it, or \
                     leave the grid out"
                );
                GridReport { status: CurveStatus::Invalid, message: Some(message) }
            }
        }
    }
}
