//! How long does it take to complete, and to elevate, Bézier curves of many degrees and patterns,
//! on the CPU?
//!
//! The bound is memory: a planar control point is read and written once, 32 bytes, beside some 60
//! operations for its curve's energy.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use faircurve::Device;
use faircurve::bezier::{Energy, Given, Polygons, complete, elevate};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::ThreadPool;

#[path = "common/best_of.rs"]
mod best_of;

use best_of::{best_of, timed};

/// Curves of a call: the degrees go round from 3 to 10.
const CURVES: usize = 1_000_000;

struct Batch {
    coords: Vec<f64>,
    offsets: Vec<usize>,
    known: Vec<bool>,
}

impl Batch {
    /// Two points at each end known (of cubics all but the third), or the ends and any others.
    fn new(random: bool) -> Self {
        let mut rng = StdRng::seed_from_u64(1);
        let (mut offsets, mut known) = (vec![0], Vec::new());
        for i in 0..CURVES {
            let degree = 3 + i % 8;
            known.extend((0..=degree).map(|k| match random {
                true => k == 0 || k == degree || rng.random_bool(0.5),
                false => k < 2 || k == degree || (k + 1 == degree && degree > 3),
            }));
            offsets.push(known.len());
        }
        let coords = (0..2 * known.len()).map(|_| rng.random_range(-1.0..1.0)).collect();
        Batch { coords, offsets, known }
    }

    fn polygons(&self) -> Polygons<'_> {
        Polygons { dimension: 2, coords: &self.coords, offsets: &self.offsets }
    }
}

fn pools() -> [(usize, ThreadPool); 2] {
    [1, 2].map(|threads| (threads, rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()))
}

fn completions(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("completed Béziers");
    for (name, random) in [("8 patterns", false), ("any pattern", true)] {
        let batch = Batch::new(random);
        let given = Given { known: Some(&batch.known), ..Given::default() };
        group.sample_size(10).throughput(Throughput::Elements(batch.known.len() as u64));
        for (threads, pool) in pools() {
            let run =
                || pool.install(|| complete(&batch.polygons(), &given, &Energy::bending(), &Device::cpu()).unwrap());
            let best = best_of(&mut group, BenchmarkId::new(format!("{threads} threads"), name), || timed(run));
            if best.is_finite() {
                let rate = 1e-6 * batch.known.len() as f64 / best;
                println!("a million cubics to decics, {name}, {threads} threads: best {rate:.1} M control points/s");
            }
        }
    }
    group.finish();
}

fn elevations(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("elevated Béziers");
    let batch = Batch::new(false);
    group.sample_size(10).throughput(Throughput::Elements(batch.known.len() as u64));
    for (threads, pool) in pools() {
        let run = || pool.install(|| elevate(&batch.polygons(), 2, &Device::cpu()).unwrap());
        let best = best_of(&mut group, BenchmarkId::new(format!("{threads} threads"), "by 2"), || timed(run));
        if best.is_finite() {
            let rate = 1e-6 * batch.known.len() as f64 / best;
            println!("a million cubics to decics elevated by 2, {threads} threads: best {rate:.1} M control points/s");
        }
    }
    group.finish();
}

criterion_group!(benches, completions, elevations);
criterion_main!(benches);
