//! Cubic splines against reference values, exact cubics, and what every spline must be.

use faircurve::spline::{Ends, Natural, Parametrisation};
use faircurve::{Constraints, CurveBatch, CurveSet, CurveStatus, Device, Fit, Sampling};
use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

fn oracle() -> Value {
    serde_json::from_str(include_str!("../data/natural_cubic.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(array) => array.iter().flat_map(numbers).collect(),
        None => vec![value.as_f64().unwrap()],
    }
}

pub fn fit(batch: &CurveBatch) -> Fit {
    Natural::default().fit(batch, &Device::cpu()).unwrap()
}

/// The largest magnitude.
fn largest(numbers: &[f64]) -> f64 {
    numbers.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Every component within 1e-12 of the largest, or of `floor` where that is more.
fn assert_close(found: &[f64], wanted: &[f64], floor: f64, what: &str) {
    assert_eq!(found.len(), wanted.len(), "{what}");
    let scale = largest(wanted).max(floor);
    for (k, (found, wanted)) in found.iter().zip(wanted).enumerate() {
        assert!((found - wanted).abs() <= 1e-12 * scale, "{what}, entry {k}: {found} for {wanted}");
    }
}

/// A batch of wiggly curves, 2-D or 3-D, open and closed, of 2 … 40 points.
pub fn random(dimension: usize, curves: usize, seed: u64) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(seed);
    let (mut coords, mut offsets) = (vec![], vec![0]);
    for _ in 0..curves {
        let n = rng.random_range(2..=40);
        coords.extend((0..n * dimension).map(|_| rng.random_range(-1.0..1.0)));
        offsets.push(coords.len() / dimension);
    }
    let closed = (0..curves).map(|i| i % 3 == 1).collect();
    CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed_each(closed).unwrap()
}

#[test]
fn own_knots_agree_with_the_reference() {
    for (i, case) in oracle()["own_knots"].as_array().unwrap().iter().enumerate() {
        let (mut x, mut y) = (numbers(&case["x"]), numbers(&case["y"]));
        let d = y.len() / x.len();
        let periodic = case["kind"] == "periodic";
        let end = x[x.len() - 1];
        // Second derivatives of a straight line are rounding in the reference: of values over
        // squared lengths.
        let floor = largest(&y) / (end - x[0]).powi(2);
        let all = x.len();
        if periodic {
            x.pop();
            y.truncate(x.len() * d);
        }
        let n = x.len();
        let mut batch = CurveBatch::from_ragged(d, y, vec![0, n]).unwrap().with_parameters(x.clone()).unwrap();
        if periodic {
            batch = batch.with_closing_spans(vec![end - x[n - 1]]).unwrap().closed(true);
        }
        let (splines, reports) = Natural::default().fit_splines(&batch, &Device::cpu()).unwrap();
        assert_eq!(reports[0].status, CurveStatus::Converged);
        let second = splines.second_derivatives(0);
        assert_eq!(second.len(), all * d);
        assert_close(
            second,
            &numbers(&case["second_derivative_at_knots"]),
            floor,
            &format!("second derivatives, case {i}"),
        );
        let curve = splines.curve(0);
        let points: Vec<f64> =
            numbers(&case["t"]).iter().flat_map(|&t| curve.point(t).to_array()[..d].to_vec()).collect();
        assert_close(&points, &numbers(&case["value"]), 0.0, &format!("points, case {i}"));
    }
}

#[test]
fn uniform_knots_agree_with_the_reference_and_so_does_the_energy() {
    for (i, case) in oracle()["uniform"].as_array().unwrap().iter().enumerate() {
        let values = numbers(&case["values"]);
        let n = case["values"].as_array().unwrap().len();
        let d = values.len() / n;
        let batch = CurveBatch::from_ragged(d, values, vec![0, n]).unwrap();
        let uniform = Natural { parametrisation: Parametrisation::Uniform, ..Natural::default() };
        let fit = uniform.fit(&batch, &Device::cpu()).unwrap();
        let energy = case["exact_energy"].as_f64().unwrap();
        let found = fit.reports()[0].energy;
        assert!((found - energy).abs() <= 1e-12 * energy, "case {i}: {found} for {energy}");
        let halves = fit.polylines(Sampling::PerSpan(2));
        let found: Vec<f64> = (0..n - 1).flat_map(|k| halves.points(0)[(2 * k + 1) * d..][..d].to_vec()).collect();
        assert_close(&found, &numbers(&case["samples_at_half_integers"]), 0.0, &format!("half integers, case {i}"));
    }
}

/// The spline from its definition: four coefficients a span, found by dense elimination from all
/// conditions at once.
fn by_definition(t: &[f64], y: &[f64], periodic: bool) -> impl Fn(usize, f64) -> f64 {
    let spans = t.len() - 1;
    // Row of the derivative of order k of (1, s, s², s³) at s = v·h, in units of the span:
    // coefficients times h^power.
    let basis = |order: usize, v: f64| -> [f64; 4] {
        match order {
            0 => [1.0, v, v * v, v * v * v],
            1 => [0.0, 1.0, 2.0 * v, 3.0 * v * v],
            _ => [0.0, 0.0, 2.0, 6.0 * v],
        }
    };
    let (mut a, mut b) = (DMatrix::zeros(4 * spans, 4 * spans), DVector::zeros(4 * spans));
    let mut row = 0;
    let mut add = |terms: &[(usize, usize, f64, f64)], value: f64| {
        for &(span, order, v, sign) in terms {
            let h: f64 = t[span + 1] - t[span];
            for (c, x) in basis(order, v).into_iter().enumerate() {
                a[(row, 4 * span + c)] += sign * x / h.powi(order as i32);
            }
        }
        b[row] = value;
        row += 1;
    };
    for k in 0..spans {
        add(&[(k, 0, 0.0, 1.0)], y[k]);
        add(&[(k, 0, 1.0, 1.0)], y[k + 1]);
        if k + 1 < spans || periodic {
            let next = (k + 1) % spans;
            add(&[(k, 1, 1.0, 1.0), (next, 1, 0.0, -1.0)], 0.0);
            add(&[(k, 2, 1.0, 1.0), (next, 2, 0.0, -1.0)], 0.0);
        }
    }
    if !periodic {
        add(&[(0, 2, 0.0, 1.0)], 0.0);
        add(&[(spans - 1, 2, 1.0, 1.0)], 0.0);
    }
    let coefficients = a.lu().solve(&b).unwrap();
    move |span, u| basis(0, u).iter().enumerate().map(|(c, x)| x * coefficients[4 * span + c]).sum()
}

#[test]
fn random_curves_satisfy_the_definition_of_a_spline() {
    let mut rng = StdRng::seed_from_u64(5);
    let mut batch_coords = vec![];
    let (mut offsets, mut t, mut spans, mut closed) = (vec![0], vec![], vec![], vec![]);
    for i in 0..300 {
        let n = rng.random_range(2..=12);
        let mut at = rng.random_range(-1.0..1.0);
        for _ in 0..n {
            t.push(at);
            at += 10_f64.powf(rng.random_range(-1.0..1.0));
            batch_coords.extend([rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)]);
        }
        offsets.push(t.len());
        spans.push(at - t[t.len() - 1]);
        closed.push(i % 2 == 1);
    }
    let batch = CurveBatch::from_ragged(2, batch_coords, offsets).unwrap().with_parameters(t).unwrap();
    let batch = batch.with_closing_spans(spans).unwrap().closed_each(closed).unwrap();
    let fit = fit(&batch);
    for i in 0..300 {
        let curve = fit.curve(i);
        let knots = curve.knots();
        for c in 0..2 {
            let mut y: Vec<f64> = batch.points(i).iter().skip(c).step_by(2).copied().collect();
            if batch.is_closed(i) {
                y.push(y[0]);
            }
            let exact = by_definition(knots, &y, batch.is_closed(i));
            for (span, u) in (0..curve.spans()).flat_map(|span| [0.2, 0.5, 0.9].map(|u| (span, u))) {
                let (found, wanted) = (curve.jet(span, u).point[c], exact(span, u));
                // The dense matrix has a condition of some thousands.
                let bound = 1e-11 * largest(&y).max(wanted.abs());
                assert!((found - wanted).abs() <= bound, "curve {i}, span {span}: {found} for {wanted}");
            }
        }
    }
}

#[test]
fn the_unit_of_length_does_not_matter() {
    let plain = random(3, 20, 23);
    let reference = fit(&plain).polylines(Sampling::PerSpan(4));
    for scale in [1e-290, 1e-150, 1e150, 1e290] {
        let coords = plain.coords().iter().map(|x| x * scale).collect();
        let closed = (0..20).map(|i| plain.is_closed(i)).collect();
        let batch = CurveBatch::from_ragged(3, coords, plain.offsets().to_vec()).unwrap().closed_each(closed).unwrap();
        let fit = fit(&batch);
        assert_eq!(fit.usable(), 20, "{:?}", fit.reports().iter().find_map(|report| report.message.clone()));
        assert!(fit.reports().iter().all(|report| report.energy.is_finite()));
        let out = fit.polylines(Sampling::PerSpan(4));
        let back: Vec<f64> = out.coords().iter().map(|x| x / scale).collect();
        assert_close(&back, reference.coords(), 0.0, "scaled");
    }
}

#[test]
fn a_cubic_with_its_end_derivatives_is_reproduced() {
    let mut rng = StdRng::seed_from_u64(7);
    for n in [2, 3, 4, 9, 40] {
        let a: Vec<[f64; 4]> = (0..3).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
        let value = |t: f64, c: usize| ((a[c][3] * t + a[c][2]) * t + a[c][1]) * t + a[c][0];
        let slope = |t: f64, c: usize| (3.0 * a[c][3] * t + 2.0 * a[c][2]) * t + a[c][1];
        let mut t: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        t.sort_by(f64::total_cmp);
        let coords = t.iter().flat_map(|&t| (0..3).map(move |c| (t, c))).map(|(t, c)| value(t, c)).collect();
        let mut tangents = vec![f64::NAN; 3 * n];
        for c in 0..3 {
            tangents[c] = slope(t[0], c);
            tangents[3 * (n - 1) + c] = slope(t[n - 1], c);
        }
        let batch = CurveBatch::from_ragged(3, coords, vec![0, n]).unwrap().with_parameters(t.clone()).unwrap();
        let batch = batch.with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() }).unwrap();
        for ends in [Ends::Auto, Ends::Clamped] {
            let fit = Natural { ends, ..Natural::default() }.fit(&batch, &Device::cpu()).unwrap();
            assert_eq!(fit.reports()[0].message, None);
            let out = fit.polylines(Sampling::Count(50));
            for (point, &t) in out.points(0).chunks(3).zip(out.parameters(0).unwrap()) {
                for (c, x) in point.iter().enumerate() {
                    assert!((x - value(t, c)).abs() < 1e-13, "n = {n}, t = {t}: {x} for {}", value(t, c));
                }
            }
        }
    }
}

#[test]
fn pieces_join_with_two_derivatives_also_around_closed_curves() {
    for dimension in [2, 3] {
        let batch = random(dimension, 60, 11);
        for (i, (curve, report)) in fit(&batch).iter().enumerate() {
            assert_eq!(report.status, CurveStatus::Converged);
            let spans = curve.spans();
            let joints = (1..spans).map(|k| (k - 1, k)).chain(batch.is_closed(i).then_some((spans - 1, 0)));
            for (left, right) in joints {
                let (left, right) = (curve.jet(left, 1.0), curve.jet(right, 0.0));
                assert_eq!(left.point, right.point);
                assert!((left.first - right.first).length() <= 1e-11 * left.first.length().max(1.0), "curve {i}");
                assert_eq!(left.second, right.second);
            }
            if !batch.is_closed(i) {
                assert_eq!(curve.jet(0, 0.0).second.length(), 0.0);
                assert_eq!(curve.jet(spans - 1, 1.0).second.length(), 0.0);
            }
        }
    }
}

#[test]
fn repeated_points_change_nothing_but_the_number_of_samples() {
    let plain = [[0.0, 0.0], [1.0, 2.0], [3.0, 1.0], [4.0, 4.0]];
    let repeated = [plain[0], plain[0], plain[1], plain[2], plain[2], plain[2], plain[3], plain[3]];
    for closed in [false, true] {
        let batch = CurveBatch::from_slices(&[&plain[..], &repeated[..]]).unwrap().closed(closed);
        let fit = fit(&batch);
        assert_eq!(fit.usable(), 2);
        assert_eq!(fit.reports()[0].energy, fit.reports()[1].energy);
        let (a, b) = (fit.curve(0), fit.curve(1));
        for k in 0..=40 {
            let t = a.domain().1 * k as f64 / 40.0;
            assert_eq!(a.point(t), b.point(t));
        }
        let out = fit.polylines(Sampling::PerSpan(3));
        assert_eq!((out.count(0), out.count(1)), if closed { (12, 24) } else { (10, 22) });
        assert_eq!(out.points(1)[..8], [0.0; 8]);
        assert_eq!(b.length(), a.length());
    }
}

#[test]
fn parameters_are_centripetal_by_default_and_chord_lengths_where_tangents_count_in_them() {
    let plain = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 0.0], [1.0, 4.0]][..]]).unwrap();
    let knots = |batch: &CurveBatch, parametrisation| {
        let natural = Natural { parametrisation, ..Natural::default() };
        natural.fit(batch, &Device::cpu()).unwrap().curve(0).knots().to_vec()
    };
    // Steps of 1 and 2 for distances of 1 and 4, in all as long as the polygon.
    assert_eq!(knots(&plain, Parametrisation::Auto), [0.0, 5.0 * (1.0 / 3.0), 5.0]);
    assert_eq!(knots(&plain, Parametrisation::Auto), knots(&plain, Parametrisation::Centripetal));
    let chords = knots(&plain, Parametrisation::ChordLength);
    assert_eq!(chords, [0.0, 1.0, 5.0]);
    let tangents = Some(vec![1.0, 0.0, f64::NAN, f64::NAN, f64::NAN, f64::NAN]);
    let held = plain.clone().with_constraints(Constraints { tangents, ..Constraints::default() }).unwrap();
    assert_eq!(knots(&held, Parametrisation::Auto), chords);
    let timed = plain.with_parameters(vec![2.0, 3.0, 9.0]).unwrap();
    assert_eq!(knots(&timed, Parametrisation::Auto), [2.0, 3.0, 9.0]);
}

#[test]
fn two_points_make_a_straight_line() {
    let batch = CurveBatch::from_slices(&[&[[1.0, 2.0, 3.0], [4.0, -2.0, 3.0]][..]]).unwrap();
    let fit = fit(&batch);
    assert_eq!(fit.reports()[0].energy, 0.0);
    let out = fit.polylines(Sampling::PerSpan(4));
    assert_eq!(out.points(0)[3..6], [1.75, 1.0, 3.0]);
    assert_eq!(out.parameters(0).unwrap(), [0.0, 1.25, 2.5, 3.75, 5.0]);
}

#[test]
fn reversal_and_translation_move_the_curve_along() {
    let batch = random(2, 40, 17);
    let mut backwards = vec![];
    for i in 0..40 {
        batch.points(i).chunks(2).rev().for_each(|point| backwards.extend([point[0] + 100.0, point[1] - 50.0]));
    }
    let closed = (0..40).map(|i| batch.is_closed(i)).collect();
    let moved = CurveBatch::from_ragged(2, backwards, batch.offsets().to_vec()).unwrap().closed_each(closed).unwrap();
    let (fit, moved) = (fit(&batch), fit(&moved));
    for i in 0..40 {
        let (a, b) = (fit.curve(i), moved.curve(i));
        let spans = a.spans();
        for span in 0..spans {
            // A closed curve's points run n − 1 … 0, its closing span stays the last.
            let other = match batch.is_closed(i) {
                true if span == spans - 1 => span,
                true => spans - 2 - span,
                false => spans - 1 - span,
            };
            let (p, q) = (a.jet(span, 0.3).point, b.jet(other, 0.7).point);
            assert!((p.x + 100.0 - q.x).abs() < 1e-11 && (p.y - 50.0 - q.y).abs() < 1e-11, "curve {i}: {p} for {q}");
        }
    }
}

#[test]
fn a_bad_curve_gets_its_status_and_no_neighbour_notices() {
    let good = random(2, 30, 19);
    let alone = fit(&good).polylines(Sampling::PerSpan(5));
    let bad: [&[[f64; 2]]; 6] = [
        &[[1.0, 1.0]],
        &[[2.0, 2.0]; 4],
        &[[0.0, 0.0], [f64::NAN, 1.0], [2.0, 0.0]],
        &[[0.0, 0.0], [1.0, f64::INFINITY]],
        &[],
        &[[0.0, 0.0], [1e-300, 1e300], [1e300, 0.0], [1.7e308, 1.7e308]],
    ];
    let (mut coords, mut offsets, mut closed) = (vec![], vec![0], vec![]);
    for i in 0..30 {
        coords.extend_from_slice(good.points(i));
        offsets.push(coords.len() / 2);
        closed.push(good.is_closed(i));
        if i % 5 == 0 {
            coords.extend(bad[i / 5].as_flattened());
            offsets.push(coords.len() / 2);
            closed.push(false);
        }
    }
    let mixed = CurveBatch::from_ragged(2, coords, offsets).unwrap().closed_each(closed).unwrap();
    let fit = fit(&mixed);
    let out = fit.polylines(Sampling::PerSpan(5));
    let mut at = 0;
    for i in 0..30 {
        assert_eq!(out.points(at), alone.points(i));
        assert_eq!(out.parameters(at), alone.parameters(i));
        at += 1;
        if i % 5 == 0 {
            let report = &fit.reports()[at];
            use CurveStatus::{Degenerate, Invalid};
            assert_eq!(report.status, [Degenerate, Degenerate, Invalid, Invalid, Degenerate, Invalid][i / 5]);
            assert!(report.message.as_ref().unwrap().contains(&format!("curve {at}")), "{:?}", report.message);
            assert!(report.energy.is_nan());
            let (found, wanted) = (out.points(at), bad[i / 5].as_flattened());
            assert!(found.iter().zip(wanted).all(|(a, b)| a.to_bits() == b.to_bits()) && found.len() == wanted.len());
            assert!(!fit.curve(at).is_fitted());
            at += 1;
        }
    }
}

#[test]
fn decreasing_parameters_are_refused_with_their_values() {
    let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 1.0]];
    let batch = CurveBatch::from_slices(&[&points[..], &points[..]]).unwrap();
    let batch = batch.with_parameters(vec![0.0, 2.0, 1.0, 0.0, 1.0, 2.0]).unwrap();
    let fit = fit(&batch);
    assert_eq!(fit.reports()[0].status, CurveStatus::Invalid);
    assert!(fit.reports()[0].message.as_ref().unwrap().contains("decreases from 2 to 1"));
    assert_eq!(fit.usable(), 1);
}

#[test]
fn constraints_a_spline_cannot_meet_are_refused_in_words() {
    let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 1.0]];
    let batch = CurveBatch::from_slices(&[&points[..], &points[..]]).unwrap();
    let with = |at: &[usize]| {
        let mut tangents = vec![f64::NAN; 12];
        at.iter().for_each(|&k| tangents[2 * k..2 * k + 2].copy_from_slice(&[1.0, 0.5]));
        batch.clone().with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() }).unwrap()
    };
    let message = |ends, batch: &CurveBatch, i: usize| {
        let fit = Natural { ends, ..Natural::default() }.fit(batch, &Device::cpu()).unwrap();
        (fit.usable(), fit.reports()[i].message.clone().unwrap_or_default())
    };
    let says = |(usable, message): (usize, String), count: usize, what: &str| {
        assert!(usable == count && message.contains(what), "{usable}: {message}");
    };
    says(
        message(Ends::Auto, &with(&[1]), 0),
        1,
        "curve 0, point 1: a cubic spline meets tangents at its two ends only",
    );
    says(message(Ends::Natural, &with(&[0]), 0), 1, "natural ends leave no room for a tangent");
    says(message(Ends::Clamped, &with(&[0, 2, 3]), 1), 1, "curve 1, point 2: clamped ends need a tangent here");
    says(message(Ends::Auto, &with(&[0]).closed(true), 0), 1, "a closed spline is periodic");
    says(message(Ends::Auto, &with(&[0, 5]), 0), 2, "");
    let curvatures = Constraints { curvatures: Some(vec![1.0; 12]), ..Constraints::default() };
    let fit = Natural::default().fit(&batch.clone().with_constraints(curvatures).unwrap(), &Device::cpu()).unwrap();
    assert!(fit.reports()[0].message.as_ref().unwrap().contains("cannot meet a curvature vector"));
    let exponents = Constraints { exponents: Some(vec![2.0; 6]), ..Constraints::default() };
    let error = Natural::default().fit(&batch.with_constraints(exponents).unwrap(), &Device::cpu()).err().unwrap();
    assert!(error.to_string().contains("leave these columns out"), "{error}");
}
