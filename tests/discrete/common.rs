//! What the tests of fair curves share.

use faircurve::discrete::{Energy, Evaluate, Fair};
use faircurve::{CurveBatch, CurveReport, Device, Fit, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

pub use crate::points::{Planar, constrained, one};

pub type Spatial = [f64; 3];

pub fn fit(fair: &Fair, batch: &CurveBatch) -> Fit {
    fair.fit(batch, &Device::cpu()).unwrap()
}

/// Vertices of one curve fitted with `n` segments a span, and its report.
pub fn fitted<const D: usize>(fair: &Fair, batch: &CurveBatch, n: usize) -> (Vec<[f64; D]>, CurveReport) {
    let fit = fit(fair, batch);
    (vertices(&fit, 0, n), fit.reports()[0].clone())
}

/// Vertices of curve `i`.
pub fn vertices<const D: usize>(fit: &Fit, i: usize, n: usize) -> Vec<[f64; D]> {
    fit.polylines(Sampling::PerSpan(n)).points(i).as_chunks::<D>().0.to_vec()
}

/// The energy of given vertices.
pub fn energy_of<const D: usize>(energy: &Energy, vertices: &[[f64; D]], closed: bool) -> f64 {
    let found = energy.evaluate(&one(vertices, closed), Evaluate::default(), &Device::cpu()).unwrap();
    assert_eq!(found[0].problem, None);
    found[0].value
}

pub fn minus<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] - b[c])
}

pub fn dot<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|c| a[c] * b[c]).sum()
}

pub fn norm<const D: usize>(a: [f64; D]) -> f64 {
    dot(a, a).sqrt()
}

pub fn unit<const D: usize>(a: [f64; D]) -> [f64; D] {
    a.map(|x| x / norm(a))
}

/// Length of the polygon.
pub fn length_of<const D: usize>(vertices: &[[f64; D]], closed: bool) -> f64 {
    let count = vertices.len();
    (0..count - usize::from(!closed)).map(|j| norm(minus(vertices[(j + 1) % count], vertices[j]))).sum()
}

/// Largest distance between two curves' vertices, one by one.
pub fn apart<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(&a, &b)| norm(minus(a, b))).fold(0.0, f64::max)
}

/// Gentle waves of size 1: `points` points a curve.
pub fn gentle(curves: usize, points: usize, height: f64, seed: u64) -> CurveBatch {
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let coords = (0..curves * points)
        .flat_map(|k| [(k % points) as f64 / (points - 1) as f64, rng.random_range(-height..height)])
        .collect();
    CurveBatch::from_ragged(2, coords, (0..=curves).map(|i| i * points).collect()).unwrap()
}
