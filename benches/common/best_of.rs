//! The best time of a benchmark.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId};

/// Times `run`, which says how long it took, and returns the best; infinite where the bench is not
/// asked for.
pub fn best_of(group: &mut BenchmarkGroup<WallTime>, id: BenchmarkId, mut run: impl FnMut() -> Duration) -> f64 {
    let mut best = f64::INFINITY;
    group.bench_function(id, |bencher| {
        bencher.iter_custom(|iterations| {
            let mut total = Duration::ZERO;
            for _ in 0..iterations {
                let time = run();
                best = best.min(time.as_secs_f64());
                total += time;
            }
            total
        });
    });
    best
}

pub fn timed<T>(run: impl FnOnce() -> T) -> Duration {
    let start = Instant::now();
    black_box(run());
    start.elapsed()
}
