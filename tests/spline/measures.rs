//! Lengths and largest curvatures of curves, against dense sampling and quadrature that share
//! nothing with the library's.

use std::time::Instant;

use faircurve::discrete::{Fair, bending, length};
use faircurve::scf::Smooth;
use faircurve::spline::{Natural, Parametrisation, Smoothing, SmoothingTarget};
use faircurve::{Curve, CurveBatch, Device, Fit, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Uniform random points, `most` a curve at most; every third curve closed. Their splines come near
/// cusps often.
fn random(dimension: usize, curves: usize, most: usize, seed: u64) -> CurveBatch {
    println!("seed {seed}, {dimension}-D");
    let mut rng = StdRng::seed_from_u64(seed);
    let (mut coords, mut offsets) = (Vec::new(), vec![0]);
    for _ in 0..curves {
        let count = rng.random_range(4..=most);
        coords.extend((0..count * dimension).map(|_| rng.random_range(0.0..1.0)));
        offsets.push(coords.len() / dimension);
    }
    let closed = (0..curves).map(|i| i % 3 == 2).collect();
    CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed_each(closed).unwrap()
}

fn natural(batch: &CurveBatch) -> Fit {
    Natural::default().fit(batch, &Device::cpu()).unwrap()
}

fn fits(batch: &CurveBatch) -> Vec<(&'static str, Fit)> {
    let cpu = Device::cpu();
    let smoothing = Smoothing { target: SmoothingTarget::Lambda(1e-3), ..Smoothing::default() };
    let fair = Fair { energy: bending(2.0) + 0.1 * length(), ..Fair::default() };
    let mut all = vec![
        ("natural", natural(batch)),
        ("smoothing", smoothing.fit(batch, &cpu).unwrap()),
        ("fair", fair.fit(batch, &cpu).unwrap()),
    ];
    if batch.dimension() == 2 {
        all.push(("scf", Smooth::default().fit(batch, &cpu).unwrap()));
    }
    all
}

/// Fractions of a span at which |p′| is least nearby: p′ · p″ changes from minus to plus.
fn slowest(curve: &dyn Curve, span: usize) -> Vec<f64> {
    const PLACES: usize = 2000;
    let slope = |u: f64| {
        let jet = curve.jet(span, u);
        jet.first.dot(jet.second)
    };
    let slopes: Vec<f64> = (0..=PLACES).map(|k| slope(k as f64 / PLACES as f64)).collect();
    let mut found = Vec::new();
    for k in (0..PLACES).filter(|&k| slopes[k] < 0.0 && slopes[k + 1] >= 0.0) {
        let (mut low, mut high) = (k as f64 / PLACES as f64, (k + 1) as f64 / PLACES as f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if slope(middle) < 0.0 { low = middle } else { high = middle }
        }
        found.push(0.5 * (low + high));
    }
    found
}

/// Steps from a fraction to another that halve towards the first.
fn graded(from: f64, to: f64) -> Vec<f64> {
    let mut steps = vec![from];
    steps.extend((0..=45).rev().map(|k| from + (to - from) * 0.5f64.powi(k)));
    steps
}

/// Arc length of a span of a cubic: the 5-point rule on 4 parts of every step of a mesh that is
/// graded towards each least speed.
fn length_of(curve: &dyn Curve, span: usize) -> f64 {
    const RULE: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let mut cuts = vec![0.0];
    cuts.extend(slowest(curve, span));
    cuts.push(1.0);
    let mut total = 0.0;
    for pair in cuts.windows(2) {
        let middle = 0.5 * (pair[0] + pair[1]);
        for mesh in [graded(pair[0], middle), graded(pair[1], middle)] {
            for step in mesh.windows(2) {
                for part in 0..4 {
                    let half = (step[1] - step[0]) / 8.0;
                    let centre = step[0] + (2 * part + 1) as f64 * half;
                    let speed = |node: f64| curve.jet(span, centre + node * half).first.length();
                    total += RULE.iter().map(|(node, weight)| weight * speed(*node)).sum::<f64>() * half.abs();
                }
            }
        }
    }
    total * (curve.knots()[span + 1] - curve.knots()[span])
}

#[test]
fn lengths_keep_nine_digits_at_and_near_cusps() {
    for (dimension, seed) in [(2, 11), (3, 12)] {
        let fit = natural(&random(dimension, 3000, 8, seed));
        let mut worst = 0.0f64;
        for i in 0..fit.len() {
            let curve = fit.curve(i);
            let wanted: f64 = (0..curve.spans()).map(|span| length_of(&*curve, span)).sum();
            let error = (curve.length() / wanted - 1.0).abs();
            worst = worst.max(error);
            assert!(error <= 1e-9, "{dimension}-D, curve {i}: {} {wanted}", curve.length());
        }
        println!("{dimension}-D: {worst:.1e}");
    }
}

/// A zigzag that is pressed ever flatter turns back at cusps.
#[test]
fn lengths_keep_nine_digits_however_near_a_cusp_is() {
    for exponent in -16..=0 {
        let height = 10f64.powi(exponent);
        let points = [[0.0, 0.0], [2.0, height], [0.2, 0.5 * height], [2.1, 2.0 * height]];
        let fit = natural(&CurveBatch::from_slices(&[&points[..]]).unwrap());
        let curve = fit.curve(0);
        let wanted: f64 = (0..curve.spans()).map(|span| length_of(&*curve, span)).sum();
        assert!((curve.length() / wanted - 1.0).abs() <= 1e-9, "{height}: {} {wanted}", curve.length());
    }
}

#[test]
fn sites_at_equal_arc_length_keep_nine_digits_near_cusps() {
    let fit = natural(&random(2, 100, 8, 13));
    for i in 0..fit.len() {
        let curve = fit.curve(i);
        let lengths: Vec<f64> = (0..curve.spans()).map(|span| length_of(&*curve, span)).collect();
        let total: f64 = lengths.iter().sum();
        let sites = curve.sites(Sampling::Spacing(total / 7.0));
        assert_eq!(sites.len(), if curve.is_closed() { 7 } else { 8 });
        for (k, (span, u)) in sites.into_iter().enumerate() {
            // The length before a site: of the curve from there on, the spans before, and the part
            // by the same rule.
            let before: f64 = lengths[..span].iter().sum::<f64>() + part_length(&*curve, span, u);
            assert!((before / total - k as f64 / 7.0).abs() <= 1e-9, "curve {i}, site {k}: {before} of {total}");
        }
    }
}

/// The length of a span up to a fraction: that of the curve cut there.
fn part_length(curve: &dyn Curve, span: usize, to: f64) -> f64 {
    struct Cut<'a>(&'a dyn Curve, usize, f64, [f64; 2]);
    impl Curve for Cut<'_> {
        fn dimension(&self) -> usize {
            self.0.dimension()
        }
        fn is_closed(&self) -> bool {
            false
        }
        fn knots(&self) -> &[f64] {
            &self.3
        }
        fn jet(&self, _: usize, u: f64) -> faircurve::Jet {
            self.0.jet(self.1, u * self.2)
        }
    }
    let width = (curve.knots()[span + 1] - curve.knots()[span]) * to;
    length_of(&Cut(curve, span, to, [0.0, width]), 0)
}

/// The largest |κ| among `places` even places a span, and 4,000 that crowd around each least speed.
fn sampled_curvature(curve: &dyn Curve, places: usize) -> f64 {
    let at = |span: usize, u: f64| curve.jet(span, u).curvature(curve.dimension()).abs();
    let mut largest = 0.0f64;
    for span in 0..curve.spans() {
        for k in 0..=places {
            largest = largest.max(at(span, k as f64 / places as f64));
        }
        for slow in slowest(curve, span) {
            for k in 0..=2000 {
                // From 1e-12 on, by a factor of e^(27.6/2000) a step.
                let away = 1e-12 * (f64::from(k) / 2000.0 * 27.6).exp();
                for u in [slow - away, slow + away].into_iter().filter(|u| (0.0..=1.0).contains(u)) {
                    largest = largest.max(at(span, u));
                }
            }
        }
    }
    largest
}

#[test]
fn the_largest_curvature_is_that_of_the_curve_not_of_some_samples() {
    let points = [[0.0, 0.0], [2.0, 0.3], [0.2, 0.55], [2.1, 0.9]];
    let by_chords = Natural { parametrisation: Parametrisation::ChordLength, ..Natural::default() };
    let fit = by_chords.fit(&CurveBatch::from_slices(&[&points[..]]).unwrap(), &Device::cpu()).unwrap();
    let found = fit.curve(0).max_curvature();
    assert!((found - 94.1).abs() < 0.05, "{found}");
}

#[test]
fn no_sample_of_any_curve_is_more_curved_than_the_largest_curvature_says() {
    let started = Instant::now();
    for (dimension, seed) in [(2, 21), (3, 22)] {
        for (method, fit) in fits(&random(dimension, 2, 5, seed)) {
            for i in 0..fit.len() {
                let curve = fit.curve(i);
                if !curve.is_fitted() {
                    continue;
                }
                let (found, sampled) = (curve.max_curvature(), sampled_curvature(&*curve, 100_000));
                // Sampling misses the top by the square of its step; next to cusps both are rounded.
                assert!(sampled <= found * (1.0 + 1e-9), "{method}, {dimension}-D, curve {i}: {sampled} {found}");
                assert!(found <= sampled * (1.0 + 1e-6), "{method}, {dimension}-D, curve {i}: {sampled} {found}");
            }
        }
    }
    println!("{:?}", started.elapsed());
}

#[test]
fn the_largest_curvature_holds_on_many_curves_that_come_near_cusps() {
    for (dimension, seed) in [(2, 23), (3, 24)] {
        let fit = natural(&random(dimension, 600, 8, seed));
        for i in 0..fit.len() {
            let curve = fit.curve(i);
            let (found, sampled) = (curve.max_curvature(), sampled_curvature(&*curve, 2_000));
            assert!(sampled <= found * (1.0 + 1e-9), "{dimension}-D, curve {i}: {sampled} {found}");
            assert!(found <= sampled * (1.0 + 1e-4), "{dimension}-D, curve {i}: {sampled} {found}");
        }
    }
}

#[test]
fn largest_curvatures_keep_their_digits_at_any_size() {
    let points = [[0.0, 0.0], [2.0, 0.3], [0.2, 0.55], [2.1, 0.9]];
    let of = |scale: f64| {
        let scaled = points.map(|p| p.map(|x| x * scale));
        let fit = natural(&CurveBatch::from_slices(&[&scaled[..]]).unwrap());
        let curve = fit.curve(0);
        (curve.max_curvature() * scale, curve.length() / scale)
    };
    let wanted = of(1.0);
    for exponent in [-300, -200, -60, -10, 10, 60, 200, 300] {
        let found = of(10f64.powi(exponent));
        assert!((found.0 / wanted.0 - 1.0).abs() <= 1e-9, "1e{exponent}: {found:?} {wanted:?}");
        assert!((found.1 / wanted.1 - 1.0).abs() <= 1e-9, "1e{exponent}: {found:?} {wanted:?}");
    }
}

#[test]
fn straight_curves_have_no_curvature_though_their_points_are_rounded() {
    let mut rng = StdRng::seed_from_u64(25);
    for _ in 0..200 {
        let along = [rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)];
        let points: Vec<[f64; 3]> =
            (0..6).map(|k| along.map(|x: f64| x * (k as f64 + 0.1 * (k % 2) as f64) / 3.0)).collect();
        let fit = natural(&CurveBatch::from_slices(&[&points[..]]).unwrap());
        assert!(fit.curve(0).max_curvature() <= 1e-12, "{}", fit.curve(0).max_curvature());
    }
}
