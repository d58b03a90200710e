//! Natural splines that keep the shape of their points: signs of curvature at dense samples.

use faircurve::spline::Natural;
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Fit, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::sides;

/// Curvature times the mean chord beyond which a curve turns to a side: rounding stays below, whatever the side.
const TURNS: f64 = 1e-9;

type Point = [f64; 2];

fn breaks(fit: &Fit, i: usize, points: &[Point], closed: bool) -> usize {
    sides::breaks(fit, i, points, closed, TURNS)
}

/// Points at unit steps with normally distributed heights.
fn rough(random: &mut StdRng, deviation: f64) -> Vec<Point> {
    let n = random.random_range(5..=10);
    let normal = |random: &mut StdRng| {
        let (a, b): (f64, f64) = (random.random_range(f64::EPSILON..1.0), random.random_range(0.0..1.0));
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    };
    (0..n).map(|k| [f64::from(k), deviation * normal(random)]).collect()
}

fn batch_of(curves: &[Vec<Point>]) -> CurveBatch {
    let slices: Vec<&[Point]> = curves.iter().map(Vec::as_slice).collect();
    CurveBatch::from_slices(&slices).unwrap()
}

fn kept() -> Natural {
    Natural { shape: true, ..Natural::default() }
}

/// The curves that break the shape of their points.
fn broken(fit: &Fit, curves: &[Vec<Point>], closed: bool) -> Vec<usize> {
    (0..curves.len()).filter(|&i| breaks(fit, i, &curves[i], closed) > 0).collect()
}

#[test]
fn rough_curves_open_and_closed_keep_their_shape() {
    let seed = 7;
    println!("seed {seed}");
    let mut random = StdRng::seed_from_u64(seed);
    for deviation in [0.2, 0.6, 1.2] {
        let curves: Vec<Vec<Point>> = (0..1000).map(|_| rough(&mut random, deviation)).collect();
        for closed in [false, true] {
            let batch = batch_of(&curves).closed(closed);
            let free = Natural::default().fit(&batch, &Device::cpu()).unwrap();
            let fit = kept().fit(&batch, &Device::cpu()).unwrap();
            let (before, after) = (broken(&free, &curves, closed), broken(&fit, &curves, closed));
            println!("σ {deviation}, closed {closed}: {} break it without, {} with", before.len(), after.len());
            assert!(before.len() > 150, "{} of 1000 break it without", before.len());
            assert!(after.is_empty(), "curves {after:?}");
            for (i, report) in fit.reports().iter().enumerate() {
                let limits = report.limits.unwrap();
                assert_eq!((report.status, limits.violation), (CurveStatus::Converged, 0.0), "curve {i}");
                assert_eq!(limits.cost > 0.0, before.contains(&i), "curve {i} costs {}", limits.cost);
                // As long a curve as this would have loops.
                assert!(limits.stretch < 1.6, "curve {i} is {} times as long as its polygon", limits.stretch);
            }
        }
    }
}

#[test]
fn a_spline_that_keeps_its_shape_stays_in_every_bit_whatever_its_neighbours() {
    let mut random = StdRng::seed_from_u64(11);
    let curves: Vec<Vec<Point>> = (0..200).map(|_| rough(&mut random, 0.6)).collect();
    let batch = batch_of(&curves);
    let free = Natural::default().fit(&batch, &Device::cpu()).unwrap();
    let fit = kept().fit(&batch, &Device::cpu()).unwrap();
    let before = broken(&free, &curves, false);
    let sampling = Sampling::PerSpan(7);
    let [all, without] = [&fit, &free].map(|fit| fit.polylines(sampling));
    for (i, curve) in curves.iter().enumerate() {
        let alone = kept().fit(&batch_of(std::slice::from_ref(curve)), &Device::cpu()).unwrap();
        assert_eq!(alone.polylines(sampling).points(0), all.points(i), "curve {i}");
        assert_eq!(without.points(i) == all.points(i), !before.contains(&i), "curve {i}");
    }
}

#[test]
fn the_energy_is_that_of_the_curve_and_no_other_derivative_at_a_free_knot_lowers_it() {
    let mut random = StdRng::seed_from_u64(12);
    let curves: Vec<Vec<Point>> = (0..100).map(|_| rough(&mut random, 0.6)).collect();
    let fit = kept().fit(&batch_of(&curves), &Device::cpu()).unwrap();
    let mut mended = 0;
    for (i, report) in fit.reports().iter().enumerate() {
        let curve = fit.curve(i);
        let spans = curve.spans();
        // p″ is linear: Simpson's rule is exact.
        let bending = |span: usize| {
            let h = curve.knots()[span + 1] - curve.knots()[span];
            let squares = [0.0, 0.5, 1.0].map(|u| curve.jet(span, u).second.length_squared());
            h / 6.0 * (squares[0] + 4.0 * squares[1] + squares[2])
        };
        let energy: f64 = (0..spans).map(bending).sum();
        assert!((energy / report.energy - 1.0).abs() < 1e-10, "curve {i}: {energy} and {}", report.energy);
        let limits = report.limits.unwrap();
        mended += usize::from(limits.cost > 0.0);
        let mut jumps = 0;
        for knot in 1..spans {
            let [before, after] = [curve.jet(knot - 1, 1.0), curve.jet(knot, 0.0)];
            let slope = before.first.length();
            assert!((before.first - after.first).length() < 1e-11 * slope.max(1.0), "curve {i}: p′ jumps at {knot}");
            let largest = (0..spans).map(|k| curve.jet(k, 0.0).second.length()).fold(0.0, f64::max);
            jumps += usize::from((before.second - after.second).length() > 1e-5 * largest);
        }
        // Least bending has a continuous p″ wherever no side holds the knot.
        assert!(jumps <= limits.active, "curve {i}: p″ jumps at {jumps} knots, and {} are held", limits.active);
    }
    assert!(mended > 10, "{mended} of 100 mended");
}

#[test]
fn given_tangents_are_kept_and_those_that_leave_no_curve_are_infeasible() {
    let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 1.2], [3.0, 1.0]];
    let with = |start: Point, end: Point| {
        let none = [f64::NAN; 2];
        let tangents = Some([start, none, none, end].concat());
        let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
        let batch = batch.with_constraints(Constraints { tangents, ..Constraints::default() }).unwrap();
        kept().fit(&batch, &Device::cpu()).unwrap()
    };
    let fit = with([0.2, 1.7], [0.4, -0.5]);
    assert_eq!(fit.reports()[0].status, CurveStatus::Converged);
    assert!(fit.reports()[0].limits.unwrap().active > 0);
    assert_eq!(breaks(&fit, 0, &points, false), 0);
    let (start, end) = (fit.curve(0).jet(0, 0.0).first, fit.curve(0).jet(2, 1.0).first);
    assert!((start.x - 0.2).abs() + (start.y - 1.7).abs() < 1e-12, "{start}");
    assert!((end.x - 0.4).abs() + (end.y + 0.5).abs() < 1e-12, "{end}");
    let says = |fit: Fit, what: &str| {
        let report = &fit.reports()[0];
        assert_eq!(report.status, CurveStatus::Infeasible, "{report:?}");
        let message = report.message.as_ref().unwrap();
        assert!(message.contains(what), "{message}");
        assert!(report.limits.unwrap().violation > 0.0);
    };
    says(
        with([1.0, 0.5], [0.4, -0.5]),
        "curve 0, point 0: no spline with its tangent keeps its shape: the curve turns right from here",
    );
    says(with([1.0, 1.0], [0.4, -0.5]), "must set out to the left of the next point");
    says(
        with([0.2, 1.7], [0.4, 0.5]),
        "curve 0, point 3: no spline with its tangent keeps its shape: the curve turns right up to here",
    );
    // A leg of a third of the tangent, times the length of the span, beyond the line through the next two points.
    says(with([0.5, 30.0], [0.4, -0.5]), "divide it by more than");
}

#[test]
fn the_factor_that_a_long_tangent_is_to_be_divided_by_is_the_least() {
    let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 1.2], [3.0, 1.0]];
    let status = |by: f64| {
        let tangents = Some([0.5 / by, 30.0 / by].into_iter().chain([f64::NAN; 6]).collect());
        let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
        let batch = batch.with_constraints(Constraints { tangents, ..Constraints::default() }).unwrap();
        let report = kept().fit(&batch, &Device::cpu()).unwrap().reports()[0].clone();
        (report.status, report.message)
    };
    let (_, message) = status(1.0);
    let message = message.unwrap();
    let factor: f64 = message.split("more than ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
    assert_eq!(status(0.995 * factor).0, CurveStatus::Infeasible);
    assert_eq!(status(1.005 * factor).0, CurveStatus::Converged, "{factor}");
}

#[test]
fn degenerate_points_end_with_a_status_and_never_with_no_number() {
    let curves: [&[Point]; 9] = [
        &[[0.0, 0.0], [1.0, 1.0]],
        &[[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]],
        &[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0], [2.0, 0.0]],
        &[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.9, 3.0], [0.9, 3.0]],
        &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 1.0], [5.0, 0.0], [6.0, 0.0]],
        &[[0.0, 0.0], [1.0, 1e-7], [2.0, 0.0], [3.0, 1.0], [4.0, 0.0]],
        &[[0.0, 0.0], [1.0, 0.0], [1e-6, 1e-6], [2.0, 1.0]],
        &[[0.0, 0.0]],
        &[[1.0, 1.0], [1.0, 1.0], [1.0, 1.0]],
    ];
    for scale in [1e-150, 1.0, 1e150] {
        for closed in [false, true] {
            let scaled: Vec<Vec<Point>> =
                curves.iter().map(|c| c.iter().map(|p| p.map(|x| scale * x)).collect()).collect();
            let fit = kept().fit(&batch_of(&scaled).closed(closed), &Device::cpu()).unwrap();
            for (i, report) in fit.reports().iter().enumerate() {
                let expected = if i < 7 { CurveStatus::Converged } else { CurveStatus::Degenerate };
                assert_eq!(report.status, expected, "curve {i} at {scale:e}, closed {closed}: {:?}", report.message);
            }
            for sampling in [Sampling::PerSpan(9), Sampling::Count(17)] {
                assert!(fit.polylines(sampling).coords().iter().all(|x| x.is_finite()), "{scale:e}, closed {closed}");
            }
        }
    }
}

#[test]
fn jets_samples_and_beziers_of_a_mended_curve_are_one_curve() {
    let points = [[-0.3, 1.2], [0.0, 0.0], [1.5, 0.0], [3.0, 0.15], [3.2, 1.4]];
    let (fit, samples) =
        kept().fit_sampled(&batch_of(&[points.to_vec()]), Sampling::PerSpan(8), &Device::cpu()).unwrap();
    assert!(fit.reports()[0].limits.unwrap().active > 0);
    let curve = fit.curve(0);
    for (k, sample) in samples.points(0).chunks_exact(2).enumerate() {
        let (span, u) = if k == 32 { (3, 1.0) } else { (k / 8, (k % 8) as f64 / 8.0) };
        let point = curve.jet(span, u).point;
        assert!((point.x - sample[0]).hypot(point.y - sample[1]) < 1e-14, "sample {k}");
    }
    for (span, [p, a, b, q]) in curve.beziers(1e-9).into_iter().enumerate() {
        for u in [0.0, 0.3, 1.0] {
            let v = 1.0 - u;
            let bezier = v * v * v * p + 3.0 * v * v * u * a + 3.0 * v * u * u * b + u * u * u * q;
            assert!((bezier - curve.jet(span, u).point).length() < 1e-14, "span {span}");
        }
    }
}

#[test]
fn points_in_space_are_refused() {
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [2.0, 1.0, 0.0]][..]]).unwrap();
    let error = kept().fit(&batch, &Device::cpu()).unwrap_err().to_string();
    assert!(error.contains("the points have three coordinates: leave z out, or choose `discrete::Fair`"), "{error}");
}
