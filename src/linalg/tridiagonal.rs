//! [`solve_tridiagonal_batch`]: tridiagonal systems by the thousand.

use super::lanes::{Part, Scratch};
use super::real::Real;
use super::ring::{self, RingKernel};
use super::tasks::{take, tasks};
use crate::device::Device;
use crate::error::{Error, Result};
use crate::parallel;
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

/// Solves every system of a batch for `columns` right-hand sides each: entry
/// `rhs[row · columns + c]` is column c.
///
/// Time grows linearly with the number of rows. The bits of a solution depend on its own system
/// only: not on the other systems, nor on their order, nor, on the CPU, on the number of threads or
/// the processor.
///
/// The CPU computes in the type given. A GPU computes in the precision of the [`Device`]; with
/// [`Precision::Auto`](crate::Precision::Auto) f32 for arrays of f32, and for arrays of f64 f64
/// where the adapter has it. Systems that are singular, or that leave the range of its floats, are
/// solved by the CPU.
///
/// ```
/// use faircurve::{Device, linalg::{Cyclic, Matrix, TridiagonalBatch, solve_tridiagonal_batch}};
/// // −x″ = 1 on three and on two interior points, zero at both ends: an edge of weight 1 between neighbours,
/// // and an excess of 1 where the missing neighbour is a fixed zero.
/// let systems = TridiagonalBatch {
///     matrix: Matrix::Network { excess: &[1.0, 0.0, 1.0, 1.0, 1.0], weights: &[0.0, 1.0, 1.0, 0.0, 1.0] },
///     offsets: &[0, 3, 5],
///     cyclic: Cyclic::None,
/// };
/// let solutions = solve_tridiagonal_batch(&systems, &[1.0; 5], 1, &Device::cpu())?;
/// assert_eq!(solutions.x, [1.5, 2.0, 1.5, 1.0, 1.0]);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// Arrays whose lengths do not fit together; on a GPU also f64 where the adapter has none
/// ([`Error::NoGpu`]), a system larger than its largest array ([`Error::Limit`]), and what becomes
/// of submissions.
pub fn solve_tridiagonal_batch<T: Real>(
    systems: &TridiagonalBatch<T>,
    rhs: &[T],
    columns: usize,
    device: &Device,
) -> Result<Solutions<T>> {
    check(systems, rhs, columns)?;
    match device.as_gpu() {
        None => Ok(solve_on_cpu(systems, rhs, columns)),
        Some(gpu) => {
            // Nothing is known of the condition of a system given in f64: it keeps f64 where the
            // adapter has it.
            let precision = device.kernel_precision(gpu, size_of::<T>() == size_of::<f32>())?;
            ring::solve_on_gpu(gpu, precision, RingKernel::Auto, systems, rhs, columns)
        }
    }
}

fn check<T>(systems: &TridiagonalBatch<T>, rhs: &[T], columns: usize) -> Result<()> {
    let offsets = systems.offsets;
    if offsets.first() != Some(&0) {
        return Err(Error::Batch("offsets must start with 0 and hold one entry more than there are systems".into()));
    }
    if let Some(i) = offsets.windows(2).position(|pair| pair[1] < pair[0]) {
        let (from, to) = (offsets[i], offsets[i + 1]);
        return Err(Error::Batch(format!("offsets decrease at system {i}: {from} is followed by {to}")));
    }
    if columns == 0 {
        return Err(Error::Batch("0 columns: a solve needs at least one right-hand side".into()));
    }
    let rows = offsets[offsets.len() - 1];
    let expect = |what: &str, found: usize, wanted: usize| match found == wanted {
        true => Ok(()),
        false => Err(Error::Batch(format!("{found} {what} where the offsets ask for {wanted}: make the two agree"))),
    };
    match systems.matrix {
        Matrix::Bands { lower, diagonal, upper } => {
            expect("entries of the lower band", lower.len(), rows)?;
            expect("entries of the diagonal", diagonal.len(), rows)?;
            expect("entries of the upper band", upper.len(), rows)?;
        }
        Matrix::Network { excess, weights } => {
            expect("excesses", excess.len(), rows)?;
            expect("weights", weights.len(), rows)?;
        }
    }
    if let Cyclic::Each(flags) = systems.cyclic {
        expect("cyclic flags", flags.len(), offsets.len() - 1)?;
    }
    expect("entries of the right-hand sides", rhs.len(), rows.saturating_mul(columns))
}

/// All threads of the CPU, a run of systems each at a time.
pub(super) fn solve_on_cpu<T: Real>(systems: &TridiagonalBatch<T>, rhs: &[T], columns: usize) -> Solutions<T> {
    let offsets = systems.offsets;
    let mut x = vec![T::ZERO; rhs.len()];
    let mut status = vec![CurveStatus::Converged; offsets.len() - 1];
    let (mut x_rest, mut status_rest) = (&mut x[..], &mut status[..]);
    let work: Vec<_> = tasks(offsets)
        .into_iter()
        .map(|range| {
            let rows = offsets[range.end] - offsets[range.start];
            let (x, status) = (take(&mut x_rest, rows * columns), take(&mut status_rest, range.len()));
            (Part { systems, range, rhs, columns }, x, status)
        })
        .collect();
    parallel::of(work, |(part, x, status)| T::solve_part(&part, x, status, &mut Scratch::default()));
    Solutions { x, status }
}
