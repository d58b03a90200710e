//! How long do an energy with its gradient and a whole fit of discrete fair curves take on the CPU?
//!
//! The bound of both is the traffic of a pass over the vertices, 2 · 2 numbers of 8 bytes
//! each, at the copy bandwidth of as many threads.

use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use faircurve::discrete::{Evaluate, Fair, Segments, bending, length};
use faircurve::spline::Natural;
use faircurve::{CurveBatch, CurveStatus, Device, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::ThreadPool;

#[path = "common/bandwidth.rs"]
mod bandwidth;
#[path = "common/best_of.rs"]
mod best_of;

use bandwidth::copy_bandwidth;
use best_of::{best_of, timed};

/// Edges of all curves of a batch: 10,000 curves of 64.
const EDGES: usize = 640_000;

/// Data points of a curve.
const POINTS: usize = 5;

/// Edges of a curve.
const SIZES: [usize; 4] = [8, 64, 512, 4096];

/// Bytes that a pass over the vertices moves for each.
const BYTES: f64 = 32.0;

/// Data points of gentle curves: at unit steps, heights normal with σ = 0.2.
fn points(curves: usize) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(1);
    let mut normal = || {
        let (u, v): (f64, f64) = (rng.random_range(f64::MIN_POSITIVE..1.0), rng.random_range(0.0..1.0));
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    let coords = (0..curves * POINTS).flat_map(|k| [(k % POINTS) as f64, 0.2 * normal()]).collect();
    CurveBatch::from_ragged(2, coords, (0..=curves).map(|i| POINTS * i).collect()).unwrap()
}

/// Runs in a pool of so many threads, with the copy bandwidth of these.
fn pools() -> Vec<(usize, ThreadPool, f64)> {
    [1, 2]
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let bandwidth = pool.install(copy_bandwidth);
            (threads, pool, bandwidth)
        })
        .into()
}

/// One line: the rate of vertices, its share of the bound, and a curve's time.
fn say(what: &str, seconds: f64, vertices: usize, curves: usize, bandwidth: f64) {
    if seconds.is_finite() {
        let rate = vertices as f64 / seconds;
        println!(
            "{what}: best {:.1} M vertices/s, {:.1} % of the bound ({:.1} GB/s), {:.3} us a curve, {:.0} curves/s",
            rate / 1e6,
            100.0 * rate * BYTES / bandwidth,
            bandwidth / 1e9,
            seconds * 1e6 / curves as f64,
            curves as f64 / seconds
        );
    }
}

fn energies(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("bending, energy + gradient");
    for (threads, pool, bandwidth) in pools() {
        for edges in SIZES {
            let curves = EDGES / edges;
            let sampling = Sampling::PerSpan(edges / (POINTS - 1));
            let (_, batch) = Natural::default().fit_sampled(&points(curves), sampling, &Device::cpu()).unwrap();
            let (energy, vertices) = (bending(2.0), batch.total_points());
            group.throughput(Throughput::Elements(vertices as u64));
            let run =
                || timed(|| pool.install(|| energy.evaluate(&batch, Evaluate::default(), &Device::cpu()).unwrap()));
            let best = best_of(&mut group, BenchmarkId::new(format!("{threads} threads"), edges), run);
            say(&format!("energy + gradient, {edges} edges, {threads} threads"), best, vertices, curves, bandwidth);
        }
    }
    group.finish();
}

fn fair(edges: usize) -> Fair {
    Fair { energy: bending(2.0) + 0.1 * length(), segments: Segments::PerSpan(edges / (POINTS - 1)), ..Fair::default() }
}

fn fits(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("bending + 0.1 length, whole fits");
    for (threads, pool, bandwidth) in pools() {
        for edges in SIZES {
            let curves = EDGES / edges;
            let (batch, fair) = (points(curves), fair(edges));
            group.throughput(Throughput::Elements(curves as u64));
            let mut reports = vec![];
            let run = || {
                let start = Instant::now();
                let fit = pool.install(|| fair.fit(&batch, &Device::cpu()).unwrap());
                let time = start.elapsed();
                reports = fit.reports().to_vec();
                time
            };
            let best = best_of(&mut group, BenchmarkId::new(format!("{threads} threads"), edges), run);
            say(&format!("whole fit, {edges} edges, {threads} threads"), best, curves * (edges + 1), curves, bandwidth);
            if best.is_finite() {
                let converged = reports.iter().filter(|report| report.status == CurveStatus::Converged).count();
                let mut iterations: Vec<u32> = reports.iter().map(|report| report.iterations).collect();
                iterations.sort_unstable();
                println!(
                    "  {converged} of {curves} converged, in {} iterations (median), {} at most",
                    iterations[curves / 2],
                    iterations[curves - 1]
                );
            }
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    targets = energies, fits
}
criterion_main!(benches);
