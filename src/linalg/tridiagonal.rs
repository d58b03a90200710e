//! [`solve_tridiagonal_batch`]: tridiagonal systems by the thousand.

use super::lanes::solve_on_cpu;
use super::ring::{self, RingKernel};
use super::scalar::Real;
use super::systems::{Cyclic, Matrix, Solutions, TridiagonalBatch};
use crate::device::Device;
use crate::error::{Error, Result};

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
