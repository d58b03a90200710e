//! Smoothing a closed curve keeps it a curve.

use std::f64::consts::TAU;

use faircurve::spline::{LEAST_SHARE, LEAST_SHARE_OF_LAMBDA, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, CurveStatus, Deviation, Device, Sampling};
use nalgebra::DMatrix;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Rough islands of 4 to 60 points and radii from 0.01 to 3, with weights over a decade where asked.
fn islands(dimension: usize, weighted: bool) -> CurveBatch {
    let mut random = StdRng::seed_from_u64(11);
    let (mut coords, mut offsets, mut weights) = (Vec::new(), vec![0], Vec::new());
    for n in 4..=60 {
        let radius = 10_f64.powf(random.random_range(-2.0..0.5));
        for k in 0..n {
            let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
            let rough = radius * random.random_range(0.7..1.3);
            coords.extend_from_slice(&[7.0 + rough * cos, rough * sin, radius * sin * cos + 0.1 * rough][..dimension]);
            weights.push(if weighted { 10_f64.powf(random.random_range(-0.5..0.5)) } else { 1.0 });
        }
        offsets.push(coords.len() / dimension);
    }
    CurveBatch::from_ragged(dimension, coords, offsets).unwrap().with_weights(weights).unwrap().closed(true)
}

/// The least share of the data's spread that a curve keeps in any direction, both given by their
/// points at the knots.
fn share(curve: &[f64], data: &[f64], weights: &[f64], dimension: usize) -> f64 {
    let total: f64 = weights.iter().sum();
    let spread = |points: &[f64]| {
        let mean =
            |a: usize| weights.iter().enumerate().map(|(k, w)| w * points[k * dimension + a]).sum::<f64>() / total;
        let mean: Vec<f64> = (0..dimension).map(mean).collect();
        let off = |k: usize, a: usize| points[k * dimension + a] - mean[a];
        DMatrix::from_fn(dimension, dimension, |a, b| {
            weights.iter().enumerate().map(|(k, w)| w * off(k, a) * off(k, b)).sum::<f64>()
        })
    };
    let root = spread(data).cholesky().unwrap().l().try_inverse().unwrap();
    (&root * spread(curve) * root.transpose()).symmetric_eigenvalues().min().sqrt()
}

#[test]
fn closed_curves_keep_their_share_of_their_size_whatever_is_asked() {
    let distances = [0.02, 0.2, 1.0, 50.0].map(Deviation::Units);
    let targets = distances.map(SmoothingTarget::Deviation).into_iter();
    let targets = targets.chain([1e-3, 1.0, 1e6, 1e300].map(SmoothingTarget::Lambda));
    let targets = targets.chain(distances.map(SmoothingTarget::Tube));
    for (target, dimension) in targets.flat_map(|target| [(target, 2), (target, 3)]) {
        let batch = islands(dimension, true);
        let smoothing = Smoothing { target, ..Smoothing::default() };
        let (fit, knots) = smoothing.fit_sampled(&batch, Sampling::PerSpan(1), &Device::cpu()).unwrap();
        let least = if matches!(target, SmoothingTarget::Lambda(_)) { LEAST_SHARE_OF_LAMBDA } else { LEAST_SHARE };
        let mut stopped = 0;
        for (i, report) in fit.reports().iter().enumerate() {
            assert_eq!(report.status, CurveStatus::Converged, "{target:?}: {report:?}");
            let weights = batch.weights(i).unwrap();
            let share = share(knots.points(i), batch.points(i), weights, dimension);
            assert!(share >= least * (1.0 - 1e-10), "{target:?}, curve {i}: {share}");
            let deviation = match target {
                SmoothingTarget::Deviation(allowed) | SmoothingTarget::Tube(allowed) => allowed.of(&batch, i),
                _ => f64::INFINITY,
            };
            assert!(report.max_deviation <= deviation, "{target:?}, curve {i}: {}", report.max_deviation);
            if report.message.is_some() {
                stopped += 1;
                // Steps of λ are 0.14 % apart. Splines instead of a tube may stop at the deviation.
                let stops = report.max_deviation > 0.99 * deviation;
                assert!(share <= least * 1.002 || stops, "{target:?}, curve {i}: {share}");
            }
        }
        let notes = smoothing.notes(fit.reports());
        assert_eq!(notes.len(), usize::from(stopped > 0));
        let (all, none) = match target {
            SmoothingTarget::Lambda(lambda) => (lambda > 1e100, lambda < 1e3),
            SmoothingTarget::Deviation(allowed) | SmoothingTarget::Tube(allowed) => {
                (allowed.of(&batch, 0) > 10.0, false)
            }
            _ => unreachable!(),
        };
        assert!(!all || stopped == batch.len(), "{target:?}: {stopped} of {}", batch.len());
        assert!(none || stopped > 0, "{target:?}");
        if let Some(note) = notes.first() {
            assert!(note.starts_with(&stopped.to_string()) && note.contains("of their size"), "{note}");
        }
    }
}

#[test]
fn a_curve_that_is_stopped_says_so_and_has_the_largest_lambda_that_leaves_its_share() {
    let batch = islands(2, false).select(&[20]);
    let report = |target| {
        let smoothing = Smoothing { target, ..Smoothing::default() };
        let fit = smoothing.fit(&batch, &Device::cpu()).unwrap();
        (fit.reports()[0].clone(), smoothing.notes(fit.reports()))
    };
    let (by_deviation, notes) = report(SmoothingTarget::Deviation(20.0.into()));
    assert_eq!(notes, ["1 closed curve is small for a deviation of 20: smoothed no further than to 0.7 of its size"]);
    let lambda = by_deviation.smoothing.unwrap();
    let said = by_deviation.message.clone().unwrap();
    assert_eq!(
        said,
        format!(
            "curve 20, point 0: the deviation of 20 would shrink it to less than 0.7 of its size: it is smoothed no \
             further than that, with λ = {lambda}; to see more of it, smooth less"
        )
    );
    // A little more is smaller, and asked for as it is, down to a dot.
    let (more, notes) = report(SmoothingTarget::Lambda(lambda * 1.0015));
    assert_eq!((more.message, more.smoothing, notes.len()), (None, Some(lambda * 1.0015), 0));
    assert!(more.energy < by_deviation.energy);
    let (dot, notes) = report(SmoothingTarget::Lambda(1e9));
    assert_eq!(notes, ["1 closed curve is small for λ = 1000000000: smoothed no further than to 0.01 of its size"]);
    assert!(dot.message.unwrap().contains("λ = 1000000000 would shrink it to less than 0.01 of its size"));
    assert!(dot.smoothing.unwrap() > lambda && dot.energy > 0.0);
}

#[test]
fn curves_larger_than_the_deviation_are_as_they_were() {
    // A circle of radius 1 and noise of 0.01 at a deviation of 0.1: its radius may shrink by that,
    // and it says nothing.
    let mut random = StdRng::seed_from_u64(3);
    let circle: Vec<[f64; 2]> = (0..40)
        .map(|k| {
            let (sin, cos) = (TAU * f64::from(k) / 40.0).sin_cos();
            [cos, sin].map(|x| x + random.random_range(-0.01..0.01))
        })
        .collect();
    let batch = CurveBatch::from_slices(&[&circle[..]]).unwrap().closed(true);
    let smoothing = Smoothing { target: SmoothingTarget::Deviation(0.1.into()), ..Smoothing::default() };
    let fit = smoothing.fit(&batch, &Device::cpu()).unwrap();
    let report = &fit.reports()[0];
    assert_eq!((report.message.clone(), smoothing.notes(fit.reports())), (None, vec![]));
    assert!(report.max_deviation > 0.0999, "{report:?}");
    assert!((fit.curve(0).length() / TAU - 0.9).abs() < 0.02, "{}", fit.curve(0).length());
}

#[test]
fn open_curves_still_become_lines() {
    let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 0.5]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    for target in
        [SmoothingTarget::Deviation(5.0.into()), SmoothingTarget::Lambda(1e300), SmoothingTarget::Tube(5.0.into())]
    {
        let fit = Smoothing { target, ..Smoothing::default() }.fit(&batch, &Device::cpu()).unwrap();
        assert_eq!((fit.reports()[0].energy, fit.reports()[0].message.clone()), (0.0, None));
    }
}
