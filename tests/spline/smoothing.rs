//! Smoothing splines minimise what they promise to minimise.

use faircurve::spline::{Parametrisation, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, Device, Fit};
use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

fn lambda(lambda: f64) -> Smoothing {
    Smoothing {
        target: SmoothingTarget::Lambda(lambda),
        parametrisation: Parametrisation::Given,
        ..Smoothing::default()
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

/// Largest difference; lengths must agree.
fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn largest(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |largest, x| x.abs().max(largest))
}

/// Points and second derivatives of curve `i` at its knots, `dimension` numbers each; a closed
/// curve's first knot once.
fn at_knots(fit: &Fit, i: usize) -> (Vec<f64>, Vec<f64>) {
    let curve = fit.curve(i);
    let (d, spans) = (curve.dimension(), curve.spans());
    let sites = (0..spans).map(|span| (span, 0.0)).chain((!curve.is_closed()).then_some((spans - 1, 1.0)));
    let (mut points, mut second) = (Vec::new(), Vec::new());
    for (span, u) in sites {
        let jet = curve.jet(span, u);
        points.extend_from_slice(&jet.point.to_array()[..d]);
        second.extend_from_slice(&jet.second.to_array()[..d]);
    }
    (points, second)
}

/// A ragged batch: open and closed curves of 2 … 60 points at uneven parameters, weights over four
/// decades.
fn random_batch(dimension: usize, closed: bool, seed: u64) -> CurveBatch {
    let mut random = StdRng::seed_from_u64(seed);
    let (mut offsets, mut t, mut closing) = (vec![0], Vec::new(), Vec::new());
    for n in 2..=60 {
        let mut here = random.random_range(-5.0..5.0);
        for _ in 0..n {
            t.push(here);
            here += random.random_range(0.05..2.0);
        }
        closing.push(random.random_range(0.05..2.0));
        offsets.push(t.len());
    }
    let coords = (0..t.len() * dimension).map(|_| random.random_range(-1.0..1.0)).collect();
    let weights = t.iter().map(|_| 10_f64.powf(random.random_range(-2.0..2.0))).collect();
    let batch = CurveBatch::from_ragged(dimension, coords, offsets).unwrap().with_parameters(t).unwrap();
    batch.with_weights(weights).unwrap().with_closing_spans(closing).unwrap().closed(closed)
}

/// Spans of a curve of the batch, the closing one included.
fn spans(batch: &CurveBatch, i: usize) -> Vec<f64> {
    let steps = batch.parameters(i).unwrap().windows(2).map(|pair| pair[1] - pair[0]);
    steps.chain(batch.is_closed(i).then(|| batch.closing_span(i).unwrap())).collect()
}

/// Q and R of the spline system, dense.
fn system(h: &[f64], n: usize, closed: bool) -> (DMatrix<f64>, DMatrix<f64>) {
    let knots: Vec<usize> = if closed { (0..n).collect() } else { (1..n - 1).collect() };
    let (mut q, mut r) = (DMatrix::zeros(n, knots.len()), DMatrix::zeros(knots.len(), knots.len()));
    for (column, &k) in knots.iter().enumerate() {
        let (left, right) = (h[(k + h.len() - 1) % h.len()], h[k]);
        q[((k + n - 1) % n, column)] += 1.0 / left;
        q[(k, column)] -= 1.0 / left + 1.0 / right;
        q[((k + 1) % n, column)] += 1.0 / right;
        r[(column, column)] += (left + right) / 3.0;
        for (other, x) in [(k.wrapping_sub(1), left / 6.0), (k + 1, right / 6.0)] {
            if let Some(other) =
                knots.iter().position(|&knot| closed && knot == other.wrapping_add(n) % n || knot == other)
            {
                r[(column, other)] += x;
            }
        }
    }
    (q, r)
}

/// The minimiser for one coordinate as a dense linear least-squares problem, by QR: rows √w g = √w
/// y, √λ R^−½ Qᵀ g = 0.
fn dense_fit(h: &[f64], y: &[f64], w: &[f64], lambda: f64, closed: bool) -> Vec<f64> {
    let n = y.len();
    let (q, r) = system(h, n, closed);
    let bending = r.cholesky().unwrap().l().solve_lower_triangular(&q.transpose()).unwrap() * lambda.sqrt();
    let mut rows = DMatrix::zeros(n + bending.nrows(), n);
    let mut rhs = DVector::zeros(n + bending.nrows());
    for k in 0..n {
        rows[(k, k)] = w[k].sqrt();
        rhs[k] = w[k].sqrt() * y[k];
    }
    rows.rows_mut(n, bending.nrows()).copy_from(&bending);
    let qr = rows.qr();
    qr.r().solve_upper_triangular(&(qr.q().transpose() * rhs)).unwrap().iter().copied().collect()
}

#[test]
fn the_reference_values_are_met() {
    let oracle: Value = serde_json::from_str(include_str!("../data/smoothing.json")).unwrap();
    let cases = oracle["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 20);
    let (mut of_scipy, mut stopped) = (0, 0);
    for (number, case) in cases.iter().enumerate() {
        let (t, y) = (numbers(&case["t"]), numbers(&case["y"]));
        let n = t.len();
        let mut batch = CurveBatch::from_ragged(2, y, vec![0, n]).unwrap().with_parameters(t.clone()).unwrap();
        if !case["w"].is_null() {
            batch = batch.with_weights(numbers(&case["w"])).unwrap();
        }
        if let Some(period) = case["period"].as_f64() {
            batch = batch.with_closing_spans(vec![period - (t[n - 1] - t[0])]).unwrap().closed(true);
        }
        let factor = case["lambda"].as_f64().unwrap();
        let fit = lambda(factor).fit(&batch, &Device::cpu()).unwrap();
        // Closed curves are not smoothed down to a point.
        if fit.reports()[0].message.is_some() {
            assert!(case["period"].is_number() && fit.reports()[0].smoothing < Some(factor), "case {number}");
            stopped += 1;
            continue;
        }
        let (values, second) = at_knots(&fit, 0);
        let error = worst(&values, &numbers(&case["values"]));
        assert!(error < 1e-13, "case {number}: values differ by {error}");
        let wanted = numbers(&case["second_derivatives"]);
        // Bends of 1e-15 and less, on curves of length 25, are within the rounding of the values.
        let error = worst(&second, &wanted) / largest(&wanted).max(1e-15);
        assert!(error < 1e-11, "case {number}: second derivatives differ by {error}");
        // SciPy's own error, against the 60 digits above, is 7e-11 at λ = 1e6 and beyond use at
        // 1e30.
        if let (Value::Array(_), true) = (&case["scipy_values"], factor < 1e10) {
            assert!(worst(&values, &numbers(&case["scipy_values"])) < 1e-10, "case {number}");
            of_scipy += 1;
        }
    }
    assert_eq!((of_scipy, stopped), (6, 3));
}

#[test]
fn the_fit_solves_the_dense_least_squares_problem() {
    for (dimension, closed, seed) in [(2, false, 1), (3, false, 2), (2, true, 3), (3, true, 4)] {
        let batch = random_batch(dimension, closed, seed);
        for factor in [0.0, 1e-6, 1e-3, 0.3, 40.0, 1e4] {
            let fit = lambda(factor).fit(&batch, &Device::cpu()).unwrap();
            assert_eq!(fit.usable(), batch.len());
            for i in 0..batch.len() {
                let (values, _) = at_knots(&fit, i);
                // Closed curves are not smoothed down to a point, but to a λ that the report says.
                let used = fit.reports()[i].smoothing.unwrap();
                assert!(if closed { used <= factor } else { used == factor }, "{used} of {factor}");
                for axis in 0..dimension {
                    let column = |all: &[f64]| all.iter().skip(axis).step_by(dimension).copied().collect::<Vec<_>>();
                    let y = column(batch.points(i));
                    let wanted = dense_fit(&spans(&batch, i), &y, batch.weights(i).unwrap(), used, closed);
                    let error = worst(&column(&values), &wanted);
                    assert!(error < 1e-10, "{} points, closed {closed}, λ {factor}: {error}", batch.count(i));
                }
            }
        }
    }
}

#[test]
fn lambda_zero_interpolates_bit_for_bit() {
    for closed in [false, true] {
        let batch = random_batch(2, closed, 5);
        let fit = lambda(0.0).fit(&batch, &Device::cpu()).unwrap();
        for i in 0..batch.len() {
            let (values, second) = at_knots(&fit, i);
            assert_eq!(values, batch.points(i));
            assert_eq!(fit.reports()[i].max_deviation, 0.0);
            // Rγ = Qᵀy: the natural or periodic spline.
            let (q, r) = system(&spans(&batch, i), batch.count(i), closed);
            let scale = largest(&second);
            // Two points of an open curve leave nothing to solve for.
            for axis in (0..2).filter(|_| r.nrows() > 0) {
                let column = |all: &[f64]| all.iter().skip(axis).step_by(2).copied().collect::<Vec<_>>();
                let gamma = r.clone().lu().solve(&(q.transpose() * DVector::from_vec(column(&values)))).unwrap();
                let ours = column(&second);
                let inner = if closed { &ours[..] } else { &ours[1..ours.len() - 1] };
                assert!(worst(inner, gamma.as_slice()) <= 1e-13 * scale, "{} points", batch.count(i));
            }
        }
    }
}

/// Σ w |y − g|² + λ ∫|p″|² of the spline through `values`, its energy by interpolation.
fn objective(batch: &CurveBatch, i: usize, values: Vec<f64>, factor: f64) -> f64 {
    let d = batch.dimension();
    let (w, y) = (batch.weights(i).unwrap(), batch.points(i));
    let residual: f64 = y.iter().zip(&values).enumerate().map(|(at, (y, g))| w[at / d] * (y - g).powi(2)).sum();
    let one = CurveBatch::from_ragged(d, values, vec![0, w.len()]).unwrap();
    let one = one.with_parameters(batch.parameters(i).unwrap().to_vec()).unwrap();
    let one = one.with_closing_spans(vec![batch.closing_span(i).unwrap()]).unwrap().closed(batch.is_closed(i));
    residual + factor * lambda(0.0).fit(&one, &Device::cpu()).unwrap().reports()[0].energy
}

#[test]
fn every_perturbation_raises_the_objective_and_the_gradient_vanishes() {
    let mut random = StdRng::seed_from_u64(6);
    for closed in [false, true] {
        let batch = random_batch(2, closed, 7);
        for factor in [1e-3, 1.0] {
            let fit = lambda(factor).fit(&batch, &Device::cpu()).unwrap();
            for i in (1..batch.len()).step_by(7) {
                let (values, _) = at_knots(&fit, i);
                let factor = fit.reports()[i].smoothing.unwrap();
                let least = objective(&batch, i, values.clone(), factor);
                for size in [1e-3, 0.1] {
                    let step: Vec<f64> = values.iter().map(|_| random.random_range(-size..size)).collect();
                    let moved = |sign: f64| values.iter().zip(&step).map(|(x, s)| x + sign * s).collect();
                    let (up, down) =
                        (objective(&batch, i, moved(1.0), factor), objective(&batch, i, moved(-1.0), factor));
                    assert!(up > least && down > least, "{up} {down} {least}");
                    // Quadratic: without a gradient both directions cost the same.
                    let slope = (up - down).abs() / (up - least);
                    assert!(slope < 1e-11 * least / (up - least) + 1e-11, "{} points: {slope}", batch.count(i));
                }
            }
        }
    }
}

#[test]
fn larger_lambda_is_smoother_and_farther() {
    for closed in [false, true] {
        let batch = random_batch(2, closed, 8);
        let mut before: Option<Fit> = None;
        for power in -8..=8 {
            let fit = lambda(10_f64.powi(power)).fit(&batch, &Device::cpu()).unwrap();
            if let Some(before) = &before {
                for (less, more) in before.reports().iter().zip(fit.reports()) {
                    assert!(more.energy <= less.energy * (1.0 + 1e-12), "{} {}", more.energy, less.energy);
                }
            }
            before = Some(fit);
        }
    }
}

#[test]
fn huge_lambda_gives_the_weighted_regression_line() {
    let batch = random_batch(2, false, 9);
    for factor in [1e20, 1e30, 1e300] {
        let fit = lambda(factor).fit(&batch, &Device::cpu()).unwrap();
        for i in 0..batch.len() {
            let (t, w) = (batch.parameters(i).unwrap(), batch.weights(i).unwrap());
            let mean =
                |f: &dyn Fn(usize) -> f64| (0..t.len()).map(|k| w[k] * f(k)).sum::<f64>() / w.iter().sum::<f64>();
            let centre = mean(&|k| t[k]);
            let (values, _) = at_knots(&fit, i);
            for axis in 0..2 {
                let y = |k: usize| batch.points(i)[2 * k + axis];
                let level = mean(&y);
                let slope = mean(&|k| (t[k] - centre) * (y(k) - level)) / mean(&|k| (t[k] - centre).powi(2));
                for k in 0..t.len() {
                    let error = (values[2 * k + axis] - (level + slope * (t[k] - centre))).abs();
                    // n/λ′ with λ′ = λ/(ωT³) ≥ 1e12 here; this sum's own rounding, with weights up
                    // to 100, is the rest.
                    assert!(error < 1e-10, "{} points, λ {factor}: {error}", t.len());
                }
            }
            assert!(fit.reports()[i].energy < 1e-7, "{}", fit.reports()[i].energy);
            assert_eq!(fit.reports()[i].smoothing, Some(factor));
        }
    }
}

#[test]
fn units_of_parameters_coordinates_and_weights_do_not_matter() {
    // Powers of two are exact, so the results are the same to the last bit.
    let batch = random_batch(3, false, 10);
    let base = lambda(0.5).fit(&batch, &Device::cpu()).unwrap();
    for (time, size, weight) in [(2_f64.powi(70), 1.0, 1.0), (1.0, 2_f64.powi(-300), 1.0), (0.25, 8.0, 2_f64.powi(99))]
    {
        let scaled = |column: &[f64], factor: f64| column.iter().map(|x| x * factor).collect::<Vec<_>>();
        let t: Vec<f64> = (0..batch.len()).flat_map(|i| scaled(batch.parameters(i).unwrap(), time)).collect();
        let w: Vec<f64> = (0..batch.len()).flat_map(|i| scaled(batch.weights(i).unwrap(), weight)).collect();
        let other = CurveBatch::from_ragged(3, scaled(batch.coords(), size), batch.offsets().to_vec()).unwrap();
        let other = other.with_parameters(t).unwrap().with_weights(w).unwrap();
        let fit = lambda(0.5 * weight * time.powi(3)).fit(&other, &Device::cpu()).unwrap();
        for i in 0..batch.len() {
            let (values, second) = at_knots(&base, i);
            let (of_values, of_second) = at_knots(&fit, i);
            assert_eq!(of_values, scaled(&values, size), "{time} {size} {weight}");
            assert_eq!(of_second, scaled(&second, size / time / time));
            let ratio = fit.reports()[i].energy / base.reports()[i].energy;
            assert!(base.reports()[i].energy == 0.0 || size < 1e-80 || ratio == size * size / time.powi(3), "{ratio}");
        }
    }
}
