//! How fast are grids subdivided on the CPU, by sparse rules and by the exact one?
//!
//! The bound is memory: of a new value 8 bytes are written and 2 read of the old ones, beside some
//! 6 multiplications (support 5); the processor reads what it is to write, too. A copy of as many
//! values, into memory as fresh as that of the new grid, is measured in the same run.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use faircurve::Device;
use faircurve::laplacian::{Grids, Reproduces, Rule, SparseRule, Subdivide};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::ThreadPool;
use rayon::prelude::*;

#[path = "common/best_of.rs"]
mod best_of;

use best_of::{best_of, timed};

fn pools() -> [(usize, ThreadPool); 2] {
    [1, 2].map(|threads| (threads, rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()))
}

fn random_grids(count: usize, side: usize) -> Grids {
    let mut rng = StdRng::seed_from_u64(1);
    let values = (0..count * side * side).map(|_| rng.random_range(-1.0..1.0)).collect();
    Grids::uniform(1, [side, side], values).unwrap()
}

/// Copies into memory that was not touched before, as new grids are written.
fn copied(source: &[f64]) -> Vec<f64> {
    let mut target = vec![0.0; source.len()];
    target.par_chunks_mut(1 << 15).zip(source.par_chunks(1 << 15)).for_each(|(to, from)| to.copy_from_slice(from));
    target
}

fn subdivisions(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("subdivided grids");
    let sparse = |support| Rule::Sparse(SparseRule::of_support(support, Reproduces::Constants).unwrap());
    let rules = [
        ("sparse 3x3", sparse(3)),
        ("sparse 5x5", sparse(5)),
        ("sparse 7x7", sparse(7)),
        ("sparse 9x9", sparse(9)),
        ("sparse 11x11", sparse(11)),
        ("exact", Rule::Exact),
    ];
    for (what, count, side, rounds) in [("one of 1025 x 1025", 1, 1025, 1), ("10,000 of 9 x 9, 3 rounds", 10_000, 9, 3)]
    {
        let grids = random_grids(count, side);
        let fine = count * (((side - 1) << rounds) + 1usize).pow(2);
        group.sample_size(10).throughput(Throughput::Elements(fine as u64));
        let source = vec![1.0; fine];
        for (threads, pool) in pools() {
            let copy = || timed(|| pool.install(|| copied(&source)));
            let copy = best_of(&mut group, BenchmarkId::new(format!("copy, {threads} threads"), what), copy);
            for (name, rule) in &rules {
                let method = Subdivide { rule: rule.clone(), rounds };
                let run = || timed(|| pool.install(|| method.fit(&grids, &Device::cpu()).unwrap()));
                let best = best_of(&mut group, BenchmarkId::new(format!("{name}, {threads} threads"), what), run);
                if best.is_finite() {
                    let (rate, share) = (1e-6 * fine as f64 / best, 100.0 * copy / best);
                    println!("{what}, {name}, {threads} threads: best {rate:.0} M values/s, {share:.0} % of a copy");
                }
            }
        }
    }
    group.finish();
}

criterion_group!(benches, subdivisions);
criterion_main!(benches);
