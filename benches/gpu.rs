//! How many rows a second do the ring kernels take, and how many samples the spline kernels, by the
//! device's own clock?
//!
//! A table, not a sampling harness: kernel times come from timestamps on the device. Each rate also
//! as a fraction of its bound, the bytes that an on-chip solve must move over the bandwidth that the
//! device reads and writes 512 MiB with, or `FAIRCURVE_BANDWIDTH` in GB/s. `FAIRCURVE_ADAPTER`
//! chooses the adapter. `benches/peers/tridiagonal.py` has the same systems.

use faircurve::gpu::Gpu;
use faircurve::linalg::ring::{RingKernel, solve_on_gpu};
use faircurve::linalg::{Cyclic, Matrix, TridiagonalBatch, solve_tridiagonal_batch};
use faircurve::spline::Natural;
use faircurve::{Costs, CurveBatch, Device, Precision, Sampling};

/// Runs of each case; the median counts.
const RUNS: usize = 7;

fn main() {
    let measure = std::env::args().any(|argument| argument == "--bench");
    let adapter = std::env::var("FAIRCURVE_ADAPTER").ok().and_then(|number| number.parse().ok()).unwrap_or(0);
    let gpu = match Gpu::open(adapter) {
        Ok(gpu) => gpu,
        Err(error) => return println!("no GPU to measure: {error}"),
    };
    let given = std::env::var("FAIRCURVE_BANDWIDTH").ok().and_then(|text| text.parse::<f64>().ok());
    let measured = || Costs::bandwidth(&gpu).expect("every device adds");
    let bandwidth = given.map_or_else(measured, |gigabytes| gigabytes * 1e9);
    let summary = gpu.summary();
    println!("{} ({}), {}; bound by {:.1} GB/s", summary.name, summary.driver, summary.kind, bandwidth / 1e9);
    tridiagonal(&gpu, bandwidth, if measure { 1 << 20 } else { 1 << 12 });
    splines(gpu, bandwidth, if measure { 20_000 } else { 50 });
}

/// Median kernel seconds of a run.
fn kernel_seconds(gpu: &Gpu, mut run: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..=RUNS)
        .map(|_| {
            gpu.take_kernel_seconds();
            run();
            gpu.take_kernel_seconds()
        })
        .skip(1)
        .collect();
    times.sort_by(f64::total_cmp);
    times[RUNS / 2]
}

fn tridiagonal(gpu: &Gpu, bandwidth: f64, rows: usize) {
    println!("\ntridiagonal, bands, open: million rows a second by kernel time (and share of the bound)");
    println!(
        "{:>10} {:>4} {:>6} {:>8} {:>4} {:>16} {:>8}",
        "kernel", "type", "n", "systems", "rhs", "M rows/s", "error"
    );
    // Those of natural splines with uneven knots, in numbers that f32 has.
    let part = |k: usize, ratio: f64| f64::from((ratio * k as f64).fract() as f32);
    let lower: Vec<f64> = (0..rows).map(|k| part(k, 0.618_033_988_749_894_9)).collect();
    let upper: Vec<f64> = lower.iter().map(|lower| f64::from((1.0 - lower) as f32)).collect();
    let diagonal = vec![2.0; rows];
    let matrix = Matrix::Bands { lower: &lower, diagonal: &diagonal, upper: &upper };
    for precision in [Precision::F32, Precision::F64] {
        if precision == Precision::F64 && !gpu.summary().has_f64 {
            continue;
        }
        let bytes = if precision == Precision::F64 { 8.0 } else { 4.0 };
        for kernel in [RingKernel::Subgroup, RingKernel::Workgroup, RingKernel::Thread, RingKernel::Long] {
            if kernel == RingKernel::Subgroup && !gpu.summary().has_subgroups {
                continue;
            }
            for n in [16, 64, 256, 1024] {
                if kernel == RingKernel::Subgroup && n > 256 {
                    continue;
                }
                let offsets: Vec<usize> = (0..=rows / n).map(|i| i * n).collect();
                let systems = TridiagonalBatch { matrix, offsets: &offsets, cyclic: Cyclic::None };
                for columns in [1, 3] {
                    let rhs: Vec<f64> =
                        (0..rows * columns).map(|k| part(k / columns, 0.754_877_666_246_692_8)).collect();
                    let run =
                        || solve_on_gpu(gpu, precision, kernel, &systems, &rhs, columns).expect("a right problem");
                    let seconds = kernel_seconds(gpu, || {
                        run();
                    });
                    let exact = solve_tridiagonal_batch(&systems, &rhs, columns, &Device::cpu());
                    let error = worst_error(&run().x, &exact.expect("a right problem").x);
                    let rate = rows as f64 / seconds;
                    // gpu.md's bound counts two matrix words a row, those of the network; bands are
                    // three.
                    let bound = bandwidth / (bytes * (3 + 2 * columns) as f64);
                    let (name, word) = (format!("{kernel:?}"), precision.word());
                    let share = 100.0 * rate / bound;
                    println!(
                        "{name:>10} {word:>4} {n:>6} {:>8} {columns:>4} {:>8.1} ({share:.1} %) {error:>8.1e}",
                        rows / n,
                        rate / 1e6
                    );
                }
            }
        }
    }
}

/// The largest error of all numbers over the largest number.
fn worst_error(found: &[f64], exact: &[f64]) -> f64 {
    let largest = exact.iter().fold(0.0_f64, |most, number| most.max(number.abs()));
    found.iter().zip(exact).fold(0.0_f64, |most, (found, exact)| most.max((found - exact).abs())) / largest
}

fn splines(gpu: Gpu, bandwidth: f64, curves: usize) {
    println!("\nnatural splines, {curves} curves of 10 points, 2-D, own knots, fitted and sampled in one submission");
    println!("{:>4} {:>12} {:>14} {:>20}", "type", "samples", "kernel, ms", "M samples/s");
    // Any numbers without a pattern will do: the fractional parts of multiples of the golden ratio.
    let coords = (0..20 * curves).map(|k| (k as f64 * 0.618_033_988_749_894_9).fract()).collect();
    let t = (0..10 * curves).map(|k| (k % 10) as f64 + 0.8 * (k as f64 * 0.754_877_666_246_692_8).fract()).collect();
    let batch = CurveBatch::from_ragged(2, coords, (0..=curves).map(|i| 10 * i).collect()).expect("they fit together");
    let batch = batch.with_parameters(t).expect("one a point");
    let mut device = Device::from_gpu(gpu);
    for precision in [Precision::F32, Precision::F64] {
        device = device.with_precision(precision);
        let gpu = device.as_gpu().expect("it is one");
        if precision == Precision::F64 && !gpu.summary().has_f64 {
            continue;
        }
        let bytes = if precision == Precision::F64 { 8.0 } else { 4.0 };
        for (name, sampling, samples) in
            [("16 a span", Sampling::PerSpan(16), 145), ("80 a curve", Sampling::Count(80), 80)]
        {
            let seconds = kernel_seconds(gpu, || {
                Natural::default().fit_sampled(&batch, sampling, &device).expect("a right problem");
            });
            let rate = (samples * curves) as f64 / seconds;
            // Each sample is written once; what it is made of is small beside it.
            let share = 100.0 * rate * 2.0 * bytes / bandwidth;
            let word = precision.word();
            println!("{word:>4} {name:>12} {:>14.2} {:>12.1} ({share:.1} %)", 1e3 * seconds, rate / 1e6);
        }
    }
}
