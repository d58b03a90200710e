//! How long do segments with their derivatives, and whole fits of smooth connection functions take,
//! on the CPU?
//!
//! The bound of segments is arithmetic: Newton's method takes 4 to 5 evaluations of the universal
//! curve, each some 200 operations and two powers.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use faircurve::scf::{Query, Smooth, evaluate_segments};
use faircurve::{CurveBatch, CurveStatus, Device};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::ThreadPool;

#[path = "common/best_of.rs"]
mod best_of;

use best_of::{best_of, timed};

/// Segments of a call.
const SEGMENTS: usize = 200_000;

/// Dots of all curves of a batch: 10,000 curves of 10.
const DOTS: usize = 100_000;

/// Dots of a curve.
const SIZES: [usize; 5] = [10, 100, 1_000, 10_000, 100_000];

/// End angles that any ν has a minimiser for, as between dots of gentle curves.
fn queries(exponent: f64) -> Vec<Query> {
    let mut rng = StdRng::seed_from_u64(1);
    let mut angle = || rng.random_range(-1.0..1.0);
    (0..SEGMENTS).map(|_| Query { chord: 1.0, angles: [angle(), angle()], exponent }).collect()
}

/// Dots at unit steps, heights from −¼ to ¼: curves that have minimisers, however many dots they
/// have.
fn dots(curves: usize, count: usize) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(2);
    let coords = (0..curves * count).flat_map(|k| [(k % count) as f64, rng.random_range(-0.25..0.25)]).collect();
    CurveBatch::from_ragged(2, coords, (0..=curves).map(|i| count * i).collect()).unwrap()
}

fn pools() -> [(usize, ThreadPool); 2] {
    [1, 2].map(|threads| (threads, rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()))
}

fn segments(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("segments with derivatives");
    group.throughput(Throughput::Elements(SEGMENTS as u64));
    for (threads, pool) in pools() {
        for exponent in [1.5, 2.0, 3.0, 20.0] {
            let queries = queries(exponent);
            let run = || timed(|| pool.install(|| evaluate_segments(&queries, &Device::cpu()).unwrap()));
            let best = best_of(&mut group, BenchmarkId::new(format!("{threads} threads"), exponent), run);
            if best.is_finite() {
                let rate = 1e-6 * SEGMENTS as f64 / best;
                println!("segments, ν = {exponent}, {threads} threads: best {rate:.2} M segments/s");
            }
        }
    }
    group.finish();
}

fn fits(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("smooth connection functions");
    group.sample_size(10).throughput(Throughput::Elements(DOTS as u64));
    for (threads, pool) in pools() {
        for (exponent, sizes) in [(2.0, &SIZES[..]), (4.0, &SIZES[..1]), (20.0, &SIZES[..1])] {
            for &count in sizes {
                let (curves, smooth) = (DOTS / count, Smooth { exponent, ..Smooth::default() });
                let batch = dots(curves, count);
                let fit = || pool.install(|| smooth.fit(&batch, &Device::cpu()).unwrap());
                let id = BenchmarkId::new(format!("ν = {exponent}, {threads} threads"), count);
                let best = best_of(&mut group, id, || timed(fit));
                if best.is_finite() {
                    let fit = fit();
                    let converged =
                        fit.reports().iter().filter(|report| report.status == CurveStatus::Converged).count();
                    let most = fit.reports().iter().map(|report| report.iterations).max().unwrap_or(0);
                    let (micro, a_dot) = (1e6 * best / curves as f64, 1e9 * best / DOTS as f64);
                    println!(
                        "ν = {exponent}, {count} dots, {threads} threads: best {micro:.1} us a curve, {a_dot:.0} ns a dot; {converged} of \
                         {curves} converged, {most} iterations at most"
                    );
                }
            }
        }
    }
    group.finish();
}

criterion_group!(benches, segments, fits);
criterion_main!(benches);
