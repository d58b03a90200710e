//! [`TridiagonalBatch`]: tridiagonal systems, and their [`Solutions`].

use std::ops::Range;

use crate::status::CurveStatus;

/// The matrices of a batch, one entry a row, the rows of all systems after each other.
#[derive(Clone, Copy, Debug)]
pub enum Matrix<'a, T> {
    /// The three bands: row i reads lower_i·x_{i−1} + diagonal_i·x_i + upper_i·x_{i+1}.
    ///
    /// Solved by Thomas elimination without pivoting: for matrices that are diagonally dominant or
    /// symmetric positive definite. The first entry of `lower` and the last of `upper` of an open
    /// system are ignored; of a cyclic system they couple its first row with its last.
    Bands {
        /// Coefficient of the row before.
        lower: &'a [T],
        /// Coefficient of the row itself.
        diagonal: &'a [T],
        /// Coefficient of the next row.
        upper: &'a [T],
    },
    /// A resistor network, the form of symmetric M-matrices: row i reads excess_i·x_i + w_i·(x_i −
    /// x_{i−1}) + w_{i+1}·(x_i − x_{i+1}) with excess and weights ≥ 0 (not checked).
    ///
    /// Eliminated without any subtraction, so that every component of the solution is accurate to a
    /// few units of rounding of A⁻¹|rhs|, however ill-conditioned the matrix is, and a right-hand
    /// side ≥ 0 gives a solution ≥ 0.
    Network {
        /// What the diagonal exceeds the sum of the row's weights by.
        excess: &'a [T],
        /// Weight of the edge between row i − 1 and row i. The first one of a cyclic system joins
        /// its last row to its first; of an open system it is ignored.
        weights: &'a [T],
    },
}

/// Which systems of a batch are cyclic.
#[derive(Clone, Copy, Debug)]
pub enum Cyclic<'a> {
    /// None.
    None,
    /// All.
    All,
    /// Those whose flag is set.
    Each(&'a [bool]),
}

impl Cyclic<'_> {
    /// Whether system `i` is cyclic.
    pub fn contains(&self, i: usize) -> bool {
        match self {
            Cyclic::None => false,
            Cyclic::All => true,
            Cyclic::Each(flags) => flags[i],
        }
    }
}

/// A ragged batch of tridiagonal matrices: system `i` owns the rows `offsets[i] .. offsets[i + 1]`.
#[derive(Clone, Copy, Debug)]
pub struct TridiagonalBatch<'a, T> {
    /// The entries.
    pub matrix: Matrix<'a, T>,
    /// First row of every system, and the number of all rows at the end.
    pub offsets: &'a [usize],
    /// Which systems are cyclic.
    pub cyclic: Cyclic<'a>,
}

/// Solutions of a batch, one status a system.
#[derive(Clone, Debug, PartialEq)]
pub struct Solutions<T> {
    /// As the right-hand sides: row after row, `columns` numbers each.
    pub x: Vec<T>,
    /// [`Converged`](CurveStatus::Converged): solved. [`NotUnique`](CurveStatus::NotUnique): a
    /// network without any excess (or with a component without any, where weights are 0) whose
    /// right-hand side sums to 0; x is the solution whose mean over the component is 0.
    /// [`Invalid`](CurveStatus::Invalid): entries that are not finite, a pivot of 0, or no
    /// solution; x is NaN in all columns of the system.
    pub status: Vec<CurveStatus>,
}

/// A run of consecutive systems of a batch.
pub(crate) struct Part<'a, T> {
    /// The whole batch.
    pub systems: &'a TridiagonalBatch<'a, T>,
    /// The systems to solve.
    pub range: Range<usize>,
    /// The right-hand sides of the whole batch, row after row.
    pub rhs: &'a [T],
    /// Right-hand sides a row.
    pub columns: usize,
}

/// What a thread keeps between parts, so that nothing is allocated for a system.
#[derive(Default)]
pub(crate) struct Scratch<T> {
    pub(super) order: Vec<u64>,
    pub(super) eliminated: Vec<T>,
}
