//! The ring kernels against the CPU: every kernel, every size, open and cyclic, both precisions.

mod common;

use common::{gpu, seeded};
use faircurve::Precision;
use faircurve::linalg::ring::{RingKernel, solve_on_gpu};
use faircurve::linalg::{Cyclic, Matrix, TridiagonalBatch, solve_tridiagonal_batch};
use rand::RngExt;

/// A ragged batch of dominant bands, every other system cyclic.
struct Batch {
    lower: Vec<f64>,
    diagonal: Vec<f64>,
    upper: Vec<f64>,
    rhs: Vec<f64>,
    offsets: Vec<usize>,
    cyclic: Vec<bool>,
}

fn batch(sizes: &[usize], columns: usize, seed: u64) -> Batch {
    let mut rng = seeded(seed);
    let rows: usize = sizes.iter().sum();
    let mut numbers = |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
    let (lower, upper, rhs) = (numbers(rows), numbers(rows), numbers(rows * columns));
    let slack = numbers(rows);
    let diagonal = (0..rows).map(|i| lower[i].abs() + upper[i].abs() + 0.3 + slack[i].abs()).collect();
    let mut offsets = vec![0];
    sizes.iter().for_each(|n| offsets.push(offsets[offsets.len() - 1] + n));
    Batch { lower, diagonal, upper, rhs, offsets, cyclic: (0..sizes.len()).map(|i| i % 2 == 1).collect() }
}

fn worst_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs() / (1.0 + b.abs()))
        .fold(0.0, |worst, d| if d > worst || d.is_nan() { d } else { worst })
}

fn sizes() -> Vec<usize> {
    (1..=130).chain(255..=257).chain([1000, 1024, 1025]).flat_map(|n| [n, n]).collect()
}

#[test]
fn every_kernel_solves_every_size_open_and_cyclic_in_both_precisions() {
    let gpu = gpu();
    for kernel in [RingKernel::Auto, RingKernel::Workgroup, RingKernel::Thread, RingKernel::Long] {
        for columns in 1..=5 {
            let Batch { lower, diagonal, upper, rhs, offsets, cyclic } = batch(&sizes(), columns, columns as u64);
            let matrix = Matrix::Bands { lower: &lower, diagonal: &diagonal, upper: &upper };
            let systems = TridiagonalBatch { matrix, offsets: &offsets, cyclic: Cyclic::Each(&cyclic) };
            let truth = solve_tridiagonal_batch(&systems, &rhs, columns, &faircurve::Device::cpu()).unwrap();
            for (precision, tolerance) in [(Precision::F32, 4e-6), (Precision::F64, 1e-14)] {
                let found = solve_on_gpu(&gpu, precision, kernel, &systems, &rhs, columns).unwrap();
                let worst = worst_difference(&found.x, &truth.x);
                println!("{kernel:?} {precision:?}, {columns} columns: {worst:.1e}");
                assert!(worst <= tolerance, "{kernel:?} {precision:?}, {columns} columns: {worst:e} > {tolerance:e}");
                assert_eq!(found.status, truth.status);
            }
        }
    }
}
