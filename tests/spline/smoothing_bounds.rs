//! Smoothing keeps what it was told to keep: deviations, ends, neighbours; and says what it cannot
//! do.

use faircurve::spline::{LAMBDA_CAP, Parametrisation, Smoothing, SmoothingTarget};
use faircurve::{Constraints, CurveBatch, CurveReport, CurveStatus, Deviation, Device, Fit};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

fn options(target: SmoothingTarget) -> Smoothing {
    Smoothing { target, ..Smoothing::default() }
}

fn fit(batch: &CurveBatch, options: Smoothing) -> Fit {
    options.fit(batch, &Device::cpu()).unwrap()
}

/// Random walks of 2 … 400 points with noise.
fn walks(seed: u64) -> CurveBatch {
    let mut random = StdRng::seed_from_u64(seed);
    let (mut coords, mut offsets) = (Vec::new(), vec![0]);
    for n in (2..40).chain([100, 400]) {
        let (mut x, mut y) = (0.0, 0.0);
        for _ in 0..n {
            x += random.random_range(0.0..1.0);
            y += random.random_range(-0.5..0.5);
            coords.extend([x + random.random_range(-0.1..0.1), y]);
        }
        offsets.push(coords.len() / 2);
    }
    CurveBatch::from_ragged(2, coords, offsets).unwrap()
}

/// Atlantic hurricane tracks (NOAA, public domain): hours as parameters, which repeat now and then,
/// wind as weight.
fn storms() -> CurveBatch {
    let (mut coords, mut offsets, mut hours, mut wind) = (Vec::new(), vec![0], Vec::new(), Vec::new());
    let mut storm = "";
    for line in include_str!("../data/storms_excerpt.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |k: usize| fields[k].parse::<f64>().unwrap();
        if fields[0] != storm && !storm.is_empty() {
            offsets.push(hours.len());
        }
        storm = fields[0];
        hours.push(number(1));
        coords.extend([number(2), number(3)]);
        wind.push(number(4));
    }
    offsets.push(hours.len());
    let batch = CurveBatch::from_ragged(2, coords, offsets).unwrap();
    batch.with_parameters(hours).unwrap().with_weights(wind).unwrap()
}

/// Largest distance from a data point to the curve's point of its parameter, for parameters given
/// by the batch.
fn deviation(batch: &CurveBatch, fit: &Fit, i: usize) -> f64 {
    let curve = fit.curve(i);
    let points = batch.points(i).chunks(2).zip(batch.parameters(i).unwrap());
    points.map(|(y, &t)| (curve.point(t).x - y[0]).hypot(curve.point(t).y - y[1])).fold(0.0, f64::max)
}

/// Whether a report says that the curve is the regression line of its data.
fn is_line(report: &CurveReport) -> bool {
    report.energy == 0.0 && report.iterations == 1
}

#[test]
fn the_deviation_is_kept_and_used_up() {
    for (name, batch) in [("walks", walks(1)), ("rings", walks(2).closed(true)), ("storms", storms())] {
        let pins: &[bool] = if name == "rings" { &[false] } else { &[false, true] };
        for (&pin_ends, allowed) in pins.iter().flat_map(|pin| [0.06, 0.2, 1.0, 20.0].map(|d| (pin, d))) {
            let fitted = fit(&batch, Smoothing { pin_ends, ..options(SmoothingTarget::Deviation(allowed.into())) });
            let mut tight = 0;
            for (i, report) in fitted.reports().iter().enumerate() {
                if report.status == CurveStatus::NotConverged {
                    assert!(name == "storms" && allowed < 0.1, "{report:?}");
                    continue;
                }
                assert_eq!(report.status, CurveStatus::Converged);
                assert!(report.max_deviation <= allowed, "{report:?}");
                if batch.parameters(i).is_some() {
                    let found = deviation(&batch, &fitted, i);
                    assert!(found <= allowed && (found - report.max_deviation).abs() < 1e-12, "{found} {report:?}");
                }
                // Closed curves are not smoothed down to a point.
                assert!(report.message.is_none() || name == "rings", "{report:?}");
                if is_line(report) || report.message.is_some() {
                    continue;
                }
                tight += 1;
                let more = Smoothing { pin_ends, ..options(SmoothingTarget::Lambda(report.smoothing.unwrap() * 1.01)) };
                let more = fit(&batch.select(&[i]), more).reports()[0].clone();
                let (more, stopped) = (more.max_deviation, more.message.is_some());
                assert!(more > allowed || stopped, "{name}, {allowed}: a λ 1 % larger than {report:?} gives {more}");
            }
            assert!(tight > 0 || allowed == 20.0, "{name}, {allowed}");
        }
    }
}

#[test]
fn a_fit_by_deviation_is_the_fit_by_its_lambda() {
    let batch = storms();
    let by_deviation = fit(&batch, options(SmoothingTarget::Deviation(0.3.into())));
    for i in 0..batch.len() {
        let report = &by_deviation.reports()[i];
        let by_lambda = fit(&batch.select(&[i]), options(SmoothingTarget::Lambda(report.smoothing.unwrap())));
        let (a, b) = (by_deviation.curve(i), by_lambda.curve(0));
        let (from, to) = a.domain();
        for k in 0..=50 {
            let t = from + (to - from) * k as f64 / 50.0;
            assert!((a.point(t) - b.point(t)).length() < 1e-9);
        }
        let (energy, again) = (report.energy, by_lambda.reports()[0].energy);
        assert!((energy - again).abs() <= 1e-9 * energy.max(1e-12), "{energy} {again}");
    }
}

#[test]
fn a_line_that_keeps_the_deviation_is_returned_with_the_cap() {
    let batch = walks(3);
    let fitted = fit(&batch, options(SmoothingTarget::Deviation(1e6.into())));
    for (i, report) in fitted.reports().iter().enumerate() {
        assert!(is_line(report), "{report:?}");
        let (from, to) = fitted.curve(i).domain();
        let cap = LAMBDA_CAP * (to - from).powi(3);
        assert!((report.smoothing.unwrap() / cap - 1.0).abs() < 1e-12);
        assert!(fitted.curve(i).derivative(0.3 * from + 0.7 * to, 2).length() == 0.0);
    }
}

#[test]
fn pinned_ends_are_the_data_points_bit_for_bit() {
    let batch = storms();
    let walk = walks(4);
    for batch in [&batch, &walk] {
        for target in [1e-9, 1.0, 1e9, 1e30, 1e300]
            .map(SmoothingTarget::Lambda)
            .into_iter()
            .chain([SmoothingTarget::Deviation(0.7.into())])
        {
            let fitted = fit(batch, Smoothing { pin_ends: true, ..options(target) });
            assert_eq!(fitted.usable(), batch.len());
            for i in 0..batch.len() {
                let curve = fitted.curve(i);
                let (from, to) = curve.domain();
                let ends = [curve.point(from), curve.point(to)].map(|p| [p.x, p.y]);
                let points = batch.points(i);
                assert_eq!(ends, [[points[0], points[1]], [points[points.len() - 2], points[points.len() - 1]]]);
            }
        }
    }
}

#[test]
fn pinning_is_the_limit_of_heavy_ends() {
    let batch = walks(5);
    let mut weights = vec![1.0; batch.total_points()];
    for i in 0..batch.len() {
        (weights[batch.offsets()[i]], weights[batch.offsets()[i + 1] - 1]) = (1e9, 1e9);
    }
    let pinned = fit(&batch, Smoothing { pin_ends: true, ..options(SmoothingTarget::Lambda(0.1)) });
    let heavy = fit(&batch.clone().with_weights(weights).unwrap(), options(SmoothingTarget::Lambda(0.1)));
    for i in 0..batch.len() {
        let (a, b) = (pinned.curve(i), heavy.curve(i));
        let (from, to) = a.domain();
        for k in 0..=40 {
            let t = from + (to - from) * k as f64 / 40.0;
            assert!((a.point(t) - b.point(t)).length() < 1e-7, "{} points", batch.count(i));
        }
    }
}

#[test]
fn a_pinned_end_of_several_points_is_the_first_or_last_of_them() {
    let points = [[0.0, 0.0], [0.0, 1.0], [1.0, 3.0], [2.0, 1.0], [3.0, 7.0], [3.0, 5.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let batch = batch.with_parameters(vec![0.0, 0.0, 1.0, 2.0, 3.0, 3.0]).unwrap();
    let fitted = fit(&batch, Smoothing { pin_ends: true, ..options(SmoothingTarget::Lambda(1.0)) });
    let curve = fitted.curve(0);
    assert_eq!([curve.point(0.0).y, curve.point(3.0).y], [0.0, 5.0]);
    assert!(fitted.reports()[0].max_deviation >= 2.0);
}

#[test]
fn points_at_one_parameter_count_as_their_mean_but_deviate_as_themselves() {
    let points = [[0.0, 0.0], [1.0, 2.0], [1.0, 5.0], [2.0, 0.0], [3.0, 1.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let batch = batch.with_parameters(vec![0.0, 1.0, 1.0, 2.0, 3.0]).unwrap();
    let batch = batch.with_weights(vec![1.0, 2.0, 1.0, 1.0, 1.0]).unwrap();
    let merged = CurveBatch::from_slices(&[&[points[0], [1.0, 3.0], points[3], points[4]][..]]).unwrap();
    let merged = merged.with_parameters(vec![0.0, 1.0, 2.0, 3.0]).unwrap();
    let merged = merged.with_weights(vec![1.0, 3.0, 1.0, 1.0]).unwrap();
    let (a, b) =
        (fit(&batch, options(SmoothingTarget::Lambda(0.2))), fit(&merged, options(SmoothingTarget::Lambda(0.2))));
    for k in 0..=30 {
        assert_eq!(a.curve(0).point(k as f64 * 0.1), b.curve(0).point(k as f64 * 0.1));
    }
    let distance = deviation(&batch, &a, 0);
    assert!((a.reports()[0].max_deviation - distance).abs() < 1e-14 && distance > b.reports()[0].max_deviation);
    // The mean, (1, 3), is 2 away from one of the points.
    let impossible = fit(&batch, options(SmoothingTarget::Deviation(1.5.into())));
    let report = &impossible.reports()[0];
    assert_eq!((report.status, report.max_deviation, report.smoothing), (CurveStatus::NotConverged, 2.0, Some(0.0)));
    assert_eq!(
        report.message.as_deref(),
        Some(
            "curve 0, point 2: it lies 2 from the curve even without smoothing, since other points have the same \
             parameter; the deviation allowed is 1.5: give these points parameters of their own, or allow more"
        )
    );
    assert_eq!(impossible.curve(0).point(1.0).y, 3.0);
    assert_eq!(fit(&batch, options(SmoothingTarget::Deviation(2.5.into()))).usable(), 1);
}

#[test]
fn two_points_are_joined_by_their_segment() {
    let batch = CurveBatch::from_slices(&[&[[0.0, 1.0], [3.0, 5.0]][..]]).unwrap();
    for target in [
        SmoothingTarget::Lambda(0.0),
        SmoothingTarget::Lambda(7.0),
        SmoothingTarget::Lambda(1e40),
        SmoothingTarget::Deviation(0.1.into()),
    ] {
        for pin_ends in [false, true] {
            let fitted = fit(&batch, Smoothing { pin_ends, ..options(target) });
            let report = &fitted.reports()[0];
            assert_eq!((report.status, report.energy), (CurveStatus::Converged, 0.0));
            assert!(report.max_deviation < 1e-15);
            assert!((fitted.curve(0).point(2.5) - glam::DVec3::new(1.5, 3.0, 0.0)).length() < 1e-15);
        }
    }
}

#[test]
fn straight_data_stay_straight() {
    let line: Vec<[f64; 3]> = (0..50).map(|k| (k * k) as f64).map(|s| [3.0 + s, 2.0 - 0.5 * s, 7.0 * s]).collect();
    let batch = CurveBatch::from_slices(&[&line[..]]).unwrap();
    for target in [
        SmoothingTarget::Lambda(1e-3),
        SmoothingTarget::Lambda(1e5),
        SmoothingTarget::Lambda(1e25),
        SmoothingTarget::Deviation(1e-6.into()),
    ] {
        let report = fit(&batch, options(target)).reports()[0].clone();
        assert!(report.max_deviation < 1e-13 * 17000.0, "{report:?}");
    }
}

#[test]
fn deviations_at_rounding_give_the_data_back() {
    let batch = walks(6);
    let fitted = fit(&batch, options(SmoothingTarget::Deviation(1e-300.into())));
    for (i, report) in fitted.reports().iter().enumerate() {
        assert_eq!((report.status, report.max_deviation), (CurveStatus::Converged, 0.0), "{report:?}");
        let end = fitted.curve(i).domain().1;
        let last = batch.count(i) - 1;
        assert_eq!(fitted.curve(i).point(end).x, batch.points(i)[2 * last]);
    }
}

#[test]
fn one_bad_curve_leaves_its_neighbours_bits_alone() {
    let batch = walks(7);
    let mut coords = batch.coords().to_vec();
    coords[2 * batch.offsets()[12] + 5] = f64::NAN;
    let spoiled = CurveBatch::from_ragged(2, coords, batch.offsets().to_vec()).unwrap();
    let mut reversed: Vec<usize> = (0..batch.len()).collect();
    reversed.reverse();
    for target in [SmoothingTarget::Lambda(0.3), SmoothingTarget::Deviation(0.2.into())] {
        let (a, b) = (fit(&batch, options(target)), fit(&spoiled, options(target)));
        let c = fit(&batch.select(&reversed), options(target));
        assert_eq!(b.reports()[12].status, CurveStatus::Invalid);
        assert!(b.reports()[12].message.as_ref().unwrap().contains("curve 12, point 2: y is NaN"));
        assert!(!b.curve(12).is_fitted());
        for i in (0..batch.len()).filter(|&i| i != 12) {
            let last = batch.len() - 1 - i;
            assert_eq!(a.reports()[i], b.reports()[i]);
            assert_eq!(a.reports()[i], c.reports()[last]);
            for span in 0..a.curve(i).spans() {
                assert_eq!(a.curve(i).jet(span, 0.3), b.curve(i).jet(span, 0.3));
                assert_eq!(a.curve(i).jet(span, 0.3), c.curve(last).jet(span, 0.3));
            }
        }
    }
}

#[test]
fn curves_that_cannot_be_fitted_say_why() {
    let (one, same) = ([[1.0, 2.0]], [[4.0, 4.0]; 5]);
    let good = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&one[..], &good[..], &same[..], &[]]).unwrap();
    let fitted = fit(&batch, options(SmoothingTarget::Deviation(0.1.into())));
    let status: Vec<_> = fitted.reports().iter().map(|report| report.status).collect();
    use CurveStatus::{Converged, Degenerate};
    assert_eq!(status, [Degenerate, Converged, Degenerate, Degenerate]);
    assert!(fitted.reports()[2].message.as_ref().unwrap().contains("one and the same"));
}

#[test]
fn spans_too_uneven_for_the_arithmetic_are_a_status() {
    let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 2.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let batch = batch.with_parameters(vec![0.0, 1e-160, 1.0, 2.0]).unwrap();
    let report = fit(&batch, options(SmoothingTarget::Lambda(1.0))).reports()[0].clone();
    assert_eq!(report.status, CurveStatus::NotConverged);
    assert_eq!(
        report.message.as_deref(),
        Some(
            "curve 0, point 0: λ = 1 is too large for 4 knots as unevenly spaced or weighted as these, in 64 bits; \
             the curve has λ = 0: use a smaller λ or deviation, or fewer points"
        )
    );
    let report = fit(&batch, options(SmoothingTarget::Deviation(0.1.into()))).reports()[0].clone();
    assert_eq!((report.status, report.max_deviation), (CurveStatus::NotConverged, 0.0));
    // Steps whose inverse overflows.
    let batch = batch.with_parameters(vec![0.0, 1e-320, 1.0, 2.0]).unwrap();
    for target in [SmoothingTarget::Lambda(1.0), SmoothingTarget::Deviation(0.1.into())] {
        let fitted = fit(&batch, options(target));
        let report = &fitted.reports()[0];
        assert_eq!(report.status, CurveStatus::Invalid);
        assert!(report.message.as_ref().unwrap().contains("is too small beside the length of all, 2"), "{report:?}");
        assert!(fitted.curve(0).point(1.5).is_finite());
    }
}

#[test]
fn impossible_options_are_sentences() {
    let batch = walks(8);
    let says = |options: Smoothing, batch: &CurveBatch| options.fit(batch, &Device::cpu()).err().unwrap().to_string();
    assert_eq!(
        says(options(SmoothingTarget::Lambda(-1.0)), &batch),
        "the smoothing factor λ is -1; it must be finite and at least 0, where 0 interpolates: \
         give another, or a deviation"
    );
    assert!(says(options(SmoothingTarget::Lambda(f64::NAN)), &batch).contains("λ is NaN"));
    assert!(says(options(SmoothingTarget::Lambda(f64::INFINITY)), &batch).contains("λ is inf"));
    for wrong in [0.0, -2.0, f64::NAN, f64::INFINITY] {
        assert_eq!(
            says(options(SmoothingTarget::Deviation(wrong.into())), &batch),
            format!(
                "the largest deviation allowed is {wrong}; it must be positive and finite: \
                 to interpolate, give λ = 0 instead"
            )
        );
    }
    let given = Smoothing { parametrisation: Parametrisation::Given, ..Smoothing::default() };
    assert!(says(given, &batch).contains("add a column t"));
    let known = Some(vec![true; batch.total_points()]);
    let bound = batch.with_constraints(Constraints { known, ..Constraints::default() }).unwrap();
    assert!(
        says(Smoothing::default(), &bound).starts_with("smoothing splines know no known control points (column known)")
    );
}

#[test]
fn a_part_of_the_size_is_that_of_each_curve_and_points_have_none() {
    let batch = CurveBatch::from_slices(&[
        &[[1.0, 1.0]][..],
        &[[0.0, 0.0], [1.0, 0.4], [2.0, -0.3], [3.0, 0.5], [4.0, 0.0]],
        &[[0.0, 0.0], [10.0, 4.0], [20.0, -3.0], [30.0, 5.0], [40.0, 0.0]],
    ])
    .unwrap();
    for target in [SmoothingTarget::Deviation(Deviation::OfSize(0.02)), SmoothingTarget::Tube(Deviation::OfSize(0.02))]
    {
        let fitted = fit(&batch, options(target));
        assert_eq!(fitted.reports()[0].status, CurveStatus::Degenerate);
        let [small, large] = [1, 2].map(|i| fitted.reports()[i].max_deviation);
        let allowed = 0.02 * 4f64.hypot(0.8);
        assert!(small <= allowed && small > 0.98 * allowed, "{target:?}: {small}");
        assert!((large - 10.0 * small).abs() <= 1e-6 * large, "{target:?}: {large} {small}");
    }
}
