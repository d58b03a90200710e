//! Does this driver compute what it should? Small batches through every kernel, against the CPU.

use super::{RingKernel, solve_on_gpu};
use crate::gpu::Gpu;
use crate::linalg::lanes::solve_on_cpu;
use crate::linalg::{Cyclic, Matrix, TridiagonalBatch};
use crate::precision::Precision;
use crate::ragged;

/// The outcome of one kernel in one precision.
#[derive(Clone, Debug)]
pub struct SelfTest {
    /// Which kernel, which precision.
    pub what: String,
    /// The largest difference to the CPU's f64, relative to the largest solution, or an error.
    pub outcome: Result<f64, String>,
    /// The largest difference allowed: 64 ε. For these systems, of condition 5, a correct kernel is
    /// far below it, and a wrong one far above.
    pub bound: f64,
}

impl SelfTest {
    /// Whether the difference is there and within the bound.
    pub fn passed(&self) -> bool {
        self.outcome.as_ref().is_ok_and(|difference| *difference <= self.bound)
    }
}

/// Runs every kernel the adapter has, in every precision it has.
pub fn self_test(gpu: &Gpu) -> Vec<SelfTest> {
    let sizes = [1, 2, 3, 5, 8, 13, 64, 100, 257, 1000, 5000];
    let offsets = ragged::offsets(sizes);
    let rows = offsets[sizes.len()];
    // Any numbers without a pattern will do: the fractional parts of multiples of the golden ratio.
    let number = |k: usize| (k as f64 * 0.618_033_988_749_894_9).fract();
    let lower: Vec<f64> = (0..rows).map(|k| number(k) - 0.5).collect();
    let upper: Vec<f64> = (0..rows).map(|k| number(7 * k + 3) - 0.5).collect();
    let diagonal: Vec<f64> = (0..rows).map(|k| 1.5 + number(5 * k + 1)).collect();
    let rhs: Vec<f64> = (0..2 * rows).map(|k| number(3 * k + 2) - 0.5).collect();
    let cyclic: Vec<bool> = (0..sizes.len()).map(|i| i % 2 == 0).collect();
    let matrix = Matrix::Bands { lower: &lower, diagonal: &diagonal, upper: &upper };
    let systems = TridiagonalBatch { matrix, offsets: &offsets, cyclic: Cyclic::Each(&cyclic) };
    let truth = solve_on_cpu(&systems, &rhs, 2).x;
    let largest = truth.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));

    let mut kernels = vec![RingKernel::Workgroup, RingKernel::Thread, RingKernel::Long];
    if gpu.summary().has_subgroups {
        kernels.insert(0, RingKernel::Subgroup);
    }
    let mut precisions = vec![(Precision::F32, f64::from(f32::EPSILON))];
    if gpu.summary().has_f64 {
        precisions.push((Precision::F64, f64::EPSILON));
    }
    let mut tests = Vec::new();
    for (precision, epsilon) in precisions {
        for &kernel in &kernels {
            let solved = solve_on_gpu(gpu, precision, kernel, &systems, &rhs, 2);
            let difference = |x: &[f64]| x.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest;
            tests.push(SelfTest {
                what: format!("tridiagonal, {kernel:?} kernel, {}", precision.word()),
                outcome: solved.map(|solutions| difference(&solutions.x)).map_err(|error| error.to_string()),
                bound: 64.0 * epsilon,
            });
        }
    }
    tests
}
