//! How long do a fit and its samples take a curve, on the CPU?

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use faircurve::spline::{Natural, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, CurveSet, Device, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// 20,000 planar curves through 10 points each, every one with its own knots.
fn own_knots() -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(1);
    let coords = (0..400_000).map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut t = vec![];
    for _ in 0..20_000 {
        let mut at = 0.0;
        for _ in 0..10 {
            at += rng.random_range(0.1..1.0);
            t.push(at);
        }
    }
    let offsets = (0..=20_000).map(|i| 10 * i).collect();
    CurveBatch::from_ragged(2, coords, offsets).unwrap().with_parameters(t).unwrap()
}

/// As many curves as the strokes of a font of Chinese characters: 112,617 of 2 to 38 points, 5.6 on
/// average.
fn strokes() -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(2);
    let mut offsets = vec![0];
    for _ in 0..112_617 {
        // Geometric, cut off at 38.
        let extra = (rng.random_range(0.0..1.0_f64).ln() / 0.78_f64.ln()) as usize;
        offsets.push(offsets[offsets.len() - 1] + 2 + extra.min(36));
    }
    let coords = (0..2 * offsets[112_617]).map(|_| rng.random_range(0.0..1000.0)).collect();
    CurveBatch::from_ragged(2, coords, offsets).unwrap()
}

fn splines(criterion: &mut Criterion) {
    for (name, batch, sampling) in [
        ("20,000 curves, 10 points, own knots, 80 samples", own_knots(), Sampling::Count(80)),
        ("112,617 ragged curves, chord length, 8 a span", strokes(), Sampling::PerSpan(8)),
    ] {
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(batch.len() as u64));
        let device = Device::cpu();
        let (mut fit, mut both) = (f64::INFINITY, f64::INFINITY);
        group.bench_function("fit + sample", |bencher| {
            bencher.iter(|| {
                let start = Instant::now();
                let (splines, reports) = Natural::default().fit_splines(&batch, &device).unwrap();
                fit = fit.min(start.elapsed().as_secs_f64());
                let out = splines.polylines(sampling);
                both = both.min(start.elapsed().as_secs_f64());
                black_box((out, reports));
            });
        });
        println!(
            "{name}: best {:.2} ms, of which the fit {:.2} ms; {:.3} us a curve",
            both * 1e3,
            fit * 1e3,
            both * 1e6 / batch.len() as f64
        );
        group.finish();
    }
}

/// GPS-like tracks: waves of so many points with noise of 0.25, every hundredth point 2.5 off.
fn tracks(curves: usize, points: usize) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(3);
    let mut coords = Vec::new();
    for k in 0..curves * points {
        let x = (k % points) as f64 / 3.0;
        let off = if k % 100 == 50 { 2.5 } else { 0.0 };
        let noise = [0, 1].map(|_| 0.25 * (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>());
        coords.extend([x + noise[0], 6.0 * (0.24 * x).sin() + 2.0 * (0.63 * x).sin() + noise[1] + off]);
    }
    let t = (0..curves * points).map(|k| (k % points) as f64).collect();
    let offsets = (0..=curves).map(|i| i * points).collect();
    CurveBatch::from_ragged(2, coords, offsets).unwrap().with_parameters(t).unwrap()
}

/// What the least curve within a distance costs beside the best of one λ.
fn within_a_distance(criterion: &mut Criterion) {
    for (curves, points) in [(200, 121), (1, 1_000), (1, 10_000), (1, 100_000)] {
        let batch = tracks(curves, points);
        let mut group = criterion.benchmark_group(format!("{curves} tracks of {points} points within 1"));
        group.throughput(Throughput::Elements((curves * points) as u64)).sample_size(10);
        let mut energies = Vec::new();
        for (name, target) in
            [("one λ", SmoothingTarget::Deviation(1.0.into())), ("tube", SmoothingTarget::Tube(1.0.into()))]
        {
            let smoothing = Smoothing { target, ..Smoothing::default() };
            let mut energy = 0.0;
            group.bench_function(name, |bencher| {
                bencher.iter(|| {
                    let (splines, reports) = smoothing.fit_splines(&batch, &Device::cpu()).unwrap();
                    energy = reports.iter().map(|report| report.energy).sum();
                    black_box(splines);
                });
            });
            energies.push(energy);
        }
        println!("energies: one λ {:.4}, tube {:.4}: {:.2} times", energies[0], energies[1], energies[0] / energies[1]);
        group.finish();
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    targets = splines, within_a_distance
}
criterion_main!(benches);
