//! How many rows a second does a batch of tridiagonal systems take, and how much of the memory
//! bandwidth is that?
//!
//! Rows a second count everything: reading bands and right-hand sides, writing solutions.

use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use faircurve::Device;
use faircurve::linalg::{Cyclic, Matrix, Real, TridiagonalBatch, solve_tridiagonal_batch};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

#[path = "common/bandwidth.rs"]
mod bandwidth;

use bandwidth::copy_bandwidth;

/// 20,000 systems of 64 rows.
const ROWS: usize = 1_280_000;

fn solves<T: Real>(criterion: &mut Criterion, name: &str, bandwidth: f64) {
    let mut rng = StdRng::seed_from_u64(1);
    let mut numbers = |low: f64, high: f64, count: usize| -> Vec<T> {
        (0..count).map(|_| T::from_f64(rng.random_range(low..high))).collect()
    };
    let (lower, diagonal, upper) = (numbers(0.0, 1.0, ROWS), numbers(2.1, 3.0, ROWS), numbers(0.0, 1.0, ROWS));
    let rhs = numbers(-1.0, 1.0, 3 * ROWS);
    let device = Device::cpu();
    for (form, matrix, arrays) in [
        ("bands", Matrix::Bands { lower: &lower, diagonal: &diagonal, upper: &upper }, 3),
        ("network", Matrix::Network { excess: &lower, weights: &upper }, 2),
    ] {
        for (kind, cyclic) in [("open", Cyclic::None), ("cyclic", Cyclic::All)] {
            let mut group = criterion.benchmark_group(format!("tridiagonal/{name}/{form}/{kind}"));
            group.throughput(Throughput::Elements(ROWS as u64));
            for n in [8, 64, 512, 4096] {
                let offsets: Vec<usize> = (0..=ROWS / n).map(|i| (i * n).min(ROWS)).collect();
                let rows = offsets[offsets.len() - 1];
                let matrix = match matrix {
                    Matrix::Bands { lower, diagonal, upper } => {
                        Matrix::Bands { lower: &lower[..rows], diagonal: &diagonal[..rows], upper: &upper[..rows] }
                    }
                    Matrix::Network { excess, weights } => {
                        Matrix::Network { excess: &excess[..rows], weights: &weights[..rows] }
                    }
                };
                let systems = TridiagonalBatch { matrix, offsets: &offsets, cyclic };
                for columns in [1, 3] {
                    let mut best = f64::INFINITY;
                    group.bench_function(BenchmarkId::new(format!("r{columns}"), n), |bencher| {
                        bencher.iter(|| {
                            let start = Instant::now();
                            let solutions =
                                solve_tridiagonal_batch(&systems, &rhs[..rows * columns], columns, &device).unwrap();
                            best = best.min(start.elapsed().as_secs_f64());
                            black_box(solutions)
                        });
                    });
                    if best.is_infinite() {
                        // Not among the benches asked for.
                        continue;
                    }
                    let bytes = (size_of::<T>() * (arrays + 2 * columns)) as f64;
                    let rate = rows as f64 / best;
                    println!(
                        "{name} {form} {kind} n {n} r {columns}: best {:.0} M rows/s, {:.0} % of the copy bandwidth ({:.1} GB/s)",
                        rate / 1e6,
                        100.0 * rate * bytes / bandwidth,
                        bandwidth / 1e9
                    );
                }
            }
            group.finish();
        }
    }
}

fn tridiagonal(criterion: &mut Criterion) {
    let bandwidth = copy_bandwidth();
    solves::<f64>(criterion, "f64", bandwidth);
    solves::<f32>(criterion, "f32", bandwidth);
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(std::time::Duration::from_millis(200)).measurement_time(std::time::Duration::from_secs(1));
    targets = tridiagonal
}
criterion_main!(benches);
