//! The public solver on the GPU, with one submission per chunk.

use std::ops::Range;

use super::{FLAG_CYCLIC, GIVEN, ROWS_NETWORK, RingKernel, RowSource, STATUS_SINGULAR, STATUS_SOLVED, Solve, System};
use crate::CurveStatus;
use crate::error::Result;
use crate::gpu::{Buffer, Gpu, Pending, Recording, kept, once, pipeline, plan, unwritten};
use crate::linalg::lanes::solve_on_cpu;
use crate::linalg::{Cyclic, Matrix, Real, Solutions, TridiagonalBatch};
use crate::precision::Precision;

/// Solves a batch on a GPU with the given kernel, in f32 or f64. Converts the arrays if necessary.
///
/// If the device is lost, unsolved systems have the status [`CurveStatus::NotConverged`] and NaN.
///
/// # Errors
/// Errors of compiling the kernel and of submissions. [`Error::Limit`](crate::Error::Limit) if a
/// single system exceeds the device's largest array.
pub fn solve_on_gpu<T: Real>(
    gpu: &Gpu,
    precision: Precision,
    kernel: RingKernel,
    systems: &TridiagonalBatch<'_, T>,
    rhs: &[T],
    columns: usize,
) -> Result<Solutions<T>> {
    let count = systems.offsets.len() - 1;
    let mut solutions = Solutions { x: vec![T::ZERO; rhs.len()], status: vec![CurveStatus::Converged; count] };
    let real = precision.bytes();
    let rows = systems.offsets.windows(2).map(|pair| pair[1] - pair[0]);
    // Three bands, right-hand sides and solution with its copy for reading, and two numbers of
    // scratch.
    let chunks = plan::chunks(rows, real * columns.max(2) as u64, real * (5 + 3 * columns as u64), gpu.limits())?;
    let batch = RingBatch { kernel, systems, rhs, columns };
    let done = pipeline(
        chunks,
        |chunk| batch.record(gpu.record(precision), chunk)?.submit(),
        once(Pending::wait),
        |chunk, results| batch.unpack(chunk, &results[0].reals(), results[1].as_slice(), &mut solutions),
    );
    if let Some(lost) = kept(done)? {
        solutions.x[systems.offsets[lost.finished] * columns..].fill(T::NAN);
        solutions.status[lost.finished..].fill(CurveStatus::NotConverged);
    }
    Ok(solutions)
}

struct RingBatch<'a, T> {
    kernel: RingKernel,
    systems: &'a TridiagonalBatch<'a, T>,
    rhs: &'a [T],
    columns: usize,
}

impl<T: Real> RingBatch<'_, T> {
    fn rows(&self, chunk: &Range<usize>) -> Range<usize> {
        self.systems.offsets[chunk.start]..self.systems.offsets[chunk.end]
    }

    fn table(&self, chunk: &Range<usize>) -> Vec<System> {
        let offsets = self.systems.offsets;
        let first = offsets[chunk.start];
        chunk
            .clone()
            .filter(|&i| offsets[i + 1] > offsets[i])
            .map(|i| System {
                start: (offsets[i] - first) as u32,
                rows: (offsets[i + 1] - offsets[i]) as u32,
                flags: if self.systems.cyclic.contains(i) { FLAG_CYCLIC } else { 0 },
                index: (i - chunk.start) as u32,
            })
            .collect()
    }

    fn record<'g>(&self, mut recording: Recording<'g>, chunk: &Range<usize>) -> Result<Recording<'g>> {
        let rows = self.rows(chunk);
        let mut up = |array: &[T]| recording.upload_reals(&array.iter().map(|x| x.to_f64()).collect::<Vec<f64>>());
        let (kind, arrays): (u32, Vec<Buffer>) = match self.systems.matrix {
            Matrix::Bands { lower, diagonal, upper } => {
                (0, vec![up(&diagonal[rows.clone()]), up(&lower[rows.clone()]), up(&upper[rows.clone()])])
            }
            Matrix::Network { excess, weights } => {
                (ROWS_NETWORK, vec![up(&excess[rows.clone()]), up(&weights[rows.clone()])])
            }
        };
        let columns = self.columns;
        let rhs = up(&self.rhs[rows.start * columns..rows.end * columns]);
        // The weights of a network are both bands.
        let upper = &arrays[arrays.len() - 1];
        let buffers =
            vec![("diagonal", &arrays[0]), ("lower", &arrays[1]), ("upper", upper), ("right_hand_sides", &rhs)];
        let source = RowSource { path: GIVEN, kind, buffers };
        let solution = recording.storage_reals(rows.len() * columns);
        let status = recording.storage(4 * chunk.len() as u64);
        let table = self.table(chunk);
        let solve = Solve { systems: &table, columns: columns as u32, kernel: self.kernel };
        solve.record(&mut recording, &source, &solution, &status)?;
        recording.download(&solution);
        recording.download(&status);
        Ok(recording)
    }

    fn unpack(&self, chunk: &Range<usize>, x: &[f64], status: &[u32], out: &mut Solutions<T>) -> Result<()> {
        let offsets = self.systems.offsets;
        let first = offsets[chunk.start] * self.columns;
        for i in chunk.clone() {
            let range = offsets[i] * self.columns..offsets[i + 1] * self.columns;
            let part = &x[range.start - first..range.end - first];
            let solution = &mut out.x[range];
            solution.iter_mut().zip(part).for_each(|(to, &from)| *to = T::from_f64(from));
            match status[i - chunk.start] {
                _ if solution.is_empty() => {}
                STATUS_SOLVED if solution.iter().all(|x| x.is_finite()) => {}
                STATUS_SOLVED | STATUS_SINGULAR => out.status[i] = self.solve_again(i, solution),
                word => return Err(unwritten("linalg/ring", format_args!("system {i}"), word)),
            }
        }
        Ok(())
    }

    /// Solves a system again on the CPU, for systems that are singular or whose solution is not finite.
    fn solve_again(&self, i: usize, solution: &mut [T]) -> CurveStatus {
        let rows = self.systems.offsets[i]..self.systems.offsets[i + 1];
        let matrix = match self.systems.matrix {
            Matrix::Bands { lower, diagonal, upper } => Matrix::Bands {
                lower: &lower[rows.clone()],
                diagonal: &diagonal[rows.clone()],
                upper: &upper[rows.clone()],
            },
            Matrix::Network { excess, weights } => {
                Matrix::Network { excess: &excess[rows.clone()], weights: &weights[rows.clone()] }
            }
        };
        let cyclic = if self.systems.cyclic.contains(i) { Cyclic::All } else { Cyclic::None };
        let single = TridiagonalBatch { matrix, offsets: &[0, rows.len()], cyclic };
        let rhs = &self.rhs[rows.start * self.columns..rows.end * self.columns];
        let again = solve_on_cpu(&single, rhs, self.columns);
        solution.copy_from_slice(&again.x);
        again.status[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_that_no_kernel_wrote_is_an_error_that_names_the_system() {
        let matrix = Matrix::Network { excess: &[1.0; 3], weights: &[1.0; 3] };
        let systems = TridiagonalBatch { matrix, offsets: &[0, 2, 3], cyclic: Cyclic::None };
        let batch = RingBatch { kernel: RingKernel::Auto, systems: &systems, rhs: &[1.0; 3], columns: 1 };
        let unpack = |status: [u32; 2]| {
            let mut out = Solutions { x: vec![0.0; 3], status: vec![CurveStatus::Converged; 2] };
            batch.unpack(&(0..2), &[1.0_f64; 3], &status, &mut out)
        };
        assert!(unpack([STATUS_SOLVED; 2]).is_ok());
        for word in [0, 3, u32::MAX] {
            let error = unpack([STATUS_SOLVED, word]).unwrap_err().to_string();
            let wanted = format!("system 1 has the status word {word}: no kernel wrote it");
            assert_eq!(error, format!("kernel linalg/ring was refused: {wanted}"));
        }
    }
}
