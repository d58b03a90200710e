//! What does a report cost beside the fit it is of? Lengths and largest curvatures of all curves,
//! against fitting and sampling them at 16 a span.
//!
//! The target is a fifth of a fit, whatever the method and the number of points a curve.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use faircurve::discrete::Fair;
use faircurve::scf::Smooth;
use faircurve::spline::{Natural, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, Device, Fit, Result, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

#[path = "common/best_of.rs"]
mod best_of;

use best_of::{best_of, timed};

/// Points a curve.
const SIZES: [usize; 4] = [10, 1_000, 100_000, 1_000_000];

/// Points of all curves of a batch, at least; fewer where every point is 16 vertices that are
/// iterated.
const POINTS: usize = 200_000;

/// Points of all fair curves of a batch.
const FAIR_POINTS: usize = 20_000;

/// How the program fits and samples.
const SAMPLING: Sampling = Sampling::PerSpan(16);

type FitSampled = fn(&CurveBatch, &Device) -> Result<(Fit, CurveBatch)>;

/// Points on circles, where every span may hold the largest curvature, or at unit steps with
/// heights from −¼ to ¼, which every method can fit.
fn points(data: &str, total: usize, count: usize) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(1);
    let curves = total.div_ceil(count);
    let circle = |k: usize| (k as f64 / count as f64 * 6.0).sin_cos().into();
    let point = |k: usize| [(k % count) as f64, rng.random_range(-0.25..0.25)];
    let points: Vec<[f64; 2]> = match data {
        "circles" => (0..curves * count).map(|k| circle(k % count)).collect(),
        _ => (0..curves * count).map(point).collect(),
    };
    CurveBatch::from_ragged(2, points.into_flattened(), (0..=curves).map(|i| count * i).collect()).unwrap()
}

/// What the report of a batch measures.
fn measure(fit: &Fit) -> f64 {
    let one = |i: usize| {
        let curve = fit.curve(i);
        curve.length() + curve.max_curvature()
    };
    (0..fit.len()).into_par_iter().map(one).sum()
}

fn reports(criterion: &mut Criterion) {
    // Tests of benches run everything once, on little.
    let small = std::env::args().any(|argument| argument == "--test");
    let methods: [(&str, &str, FitSampled); 5] = [
        ("natural", "heights", |batch, device| Natural::default().fit_sampled(batch, SAMPLING, device)),
        ("natural", "circles", |batch, device| Natural::default().fit_sampled(batch, SAMPLING, device)),
        ("smoothing", "heights", |batch, device| smoothing().fit_sampled(batch, SAMPLING, device)),
        ("fair", "heights", |batch, device| sampled(Fair::default().fit(batch, device)?)),
        ("scf", "heights", |batch, device| sampled(Smooth::default().fit(batch, device)?)),
    ];
    let device = Device::cpu();
    for (method, data, fit_sampled) in methods {
        let mut group = criterion.benchmark_group(format!("{method}, {data}"));
        group.sample_size(10).warm_up_time(Duration::from_millis(100)).measurement_time(Duration::from_secs(1));
        for count in SIZES {
            let total = if method == "fair" { FAIR_POINTS } else { POINTS };
            if small && count > 1_000 || method == "fair" && count > 100_000 {
                continue;
            }
            let batch = points(data, if small { 1_000 } else { total }, count);
            let name = |what: &str| BenchmarkId::new(what, count);
            group.throughput(Throughput::Elements(batch.total_points() as u64));
            let mut fitted = None;
            let fit = best_of(&mut group, name("fit"), || {
                let start = Instant::now();
                let (fit, samples) = fit_sampled(&batch, &device).unwrap();
                let time = start.elapsed();
                drop(black_box(samples));
                fitted = Some(fit);
                time
            });
            let Some(fitted) = fitted else { continue };
            let report = best_of(&mut group, name("report"), || timed(|| measure(&fitted)));
            let a_point = 1e9 / batch.total_points() as f64;
            println!(
                "{method}, {data}, {count} points a curve: fit and samples {:.1} ns a point, report {:.1} ns: {:.2} of it",
                fit * a_point,
                report * a_point,
                report / fit
            );
        }
        group.finish();
    }
}

/// The cheapest smoothing: one solve a curve.
fn smoothing() -> Smoothing {
    Smoothing { target: SmoothingTarget::Lambda(0.1), ..Smoothing::default() }
}

fn sampled(fit: Fit) -> Result<(Fit, CurveBatch)> {
    let samples = fit.polylines(SAMPLING);
    Ok((fit, samples))
}

criterion_group!(benches, reports);
criterion_main!(benches);
