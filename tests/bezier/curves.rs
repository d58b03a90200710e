//! What elevating, reducing, dividing and evaluating Bézier curves promises, and completing those
//! of a batch.

use faircurve::bezier::{Complete, EndTangents, Polygons, elevate, evaluate, reduce, split};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Sampling};
use proptest::prelude::*;

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn elevation_reduction_and_division_leave_the_curve_where_it_is(
        points in prop::collection::vec((-1.0f64..1.0, -1.0f64..1.0), 2..=20),
        by in 0usize..=10,
        at in 0.0f64..=1.0,
    ) {
        let coords: Vec<f64> = points.iter().flat_map(|&(x, y)| [x, y]).collect();
        let offsets = [0, points.len()];
        let polygons = Polygons { dimension: 2, coords: &coords, offsets: &offsets };
        let device = Device::cpu();
        let parameters: Vec<f64> = (0..=32).map(|k| f64::from(k) / 32.0).collect();
        let curve = evaluate(&polygons, &parameters, &device).unwrap();
        let raised = elevate(&polygons, by, &device).unwrap();
        prop_assert!(worst(&evaluate(&raised.polygons(), &parameters, &device).unwrap().coords, &curve.coords) < 1e-14);
        // End points keep their bits.
        let last = coords.len() - 2;
        prop_assert_eq!(&raised.coords[..2], &coords[..2]);
        prop_assert_eq!(&raised.coords[raised.coords.len() - 2..], &coords[last..]);
        if by > 0 && points.len() > 1 {
            let (again, bounds) = reduce(&raised.polygons(), by, &device).unwrap();
            // Polynomials of degree 19 amplify roundings of degree 29.
            prop_assert!(worst(&evaluate(&again.polygons(), &parameters, &device).unwrap().coords, &curve.coords) < 1e-10);
            prop_assert!(bounds[0] < 1e-9);
        }
        let [first, second] = split(&polygons, at, &device).unwrap();
        let (before, after): (Vec<f64>, Vec<f64>) = parameters.iter().map(|t| (at * t, at + (1.0 - at) * t)).unzip();
        prop_assert!(worst(&evaluate(&first.polygons(), &parameters, &device).unwrap().coords, &evaluate(&polygons, &before, &device).unwrap().coords) < 1e-14);
        prop_assert!(worst(&evaluate(&second.polygons(), &parameters, &device).unwrap().coords, &evaluate(&polygons, &after, &device).unwrap().coords) < 1e-14);
    }

    #[test]
    fn reduction_is_the_nearest_curve_with_the_same_ends_and_its_bound_holds(
        points in prop::collection::vec(-1.0f64..1.0, 4..=12),
        nudge in prop::collection::vec(-0.1f64..0.1, 12),
        by in 1usize..=2,
    ) {
        let offsets = [0, points.len()];
        let polygons = Polygons { dimension: 1, coords: &points, offsets: &offsets };
        let device = Device::cpu();
        let (reduced, bounds) = reduce(&polygons, by, &device).unwrap();
        prop_assert_eq!(reduced.coords[0], points[0]);
        prop_assert_eq!(reduced.coords[reduced.coords.len() - 1], points[points.len() - 1]);
        let parameters: Vec<f64> = (0..=400).map(|k| f64::from(k) / 400.0).collect();
        let curve = evaluate(&polygons, &parameters, &device).unwrap().coords;
        let distances = |coords: &[f64]| {
            let polygons = Polygons { dimension: 1, coords, offsets: &[0, coords.len()] };
            let other = evaluate(&polygons, &parameters, &device).unwrap().coords;
            let squares: f64 = curve.iter().zip(&other).map(|(a, b)| (a - b).powi(2)).sum();
            (worst(&curve, &other), squares)
        };
        let (largest, squares) = distances(&reduced.coords);
        prop_assert!(largest <= bounds[0] + 1e-14);
        let mut other = reduced.coords.clone();
        let last = other.len() - 1;
        (1..last).for_each(|i| other[i] += nudge[i]);
        // Sums over 401 parameters instead of the integral.
        prop_assert!(squares <= distances(&other).1 * 1.05 + 1e-12);
    }
}

fn curves() -> CurveBatch {
    let points: Vec<[f64; 2]> =
        vec![[0.0, 0.0], [1.0, 2.0], [f64::NAN; 2], [3.0, 0.0], [5.0, 1.0], [6.0, -1.0], [7.0, 3.0]];
    let known = Some([true, true, false, true, true, true, true].to_vec());
    CurveBatch::from_slices(&[&points[..4], &points[4..]])
        .unwrap()
        .with_constraints(Constraints { known, ..Constraints::default() })
        .unwrap()
}

#[test]
fn a_batch_of_curves_is_completed_and_its_curves_are_sampled_and_measured() {
    let device = Device::cpu();
    let completed = Complete::default().fit(&curves(), &device).unwrap();
    assert_eq!(completed.control_points().points(0), [0.0, 0.0, 1.0, 2.0, 2.0, 1.0, 3.0, 0.0]);
    assert_eq!((completed.degree(0), completed.degree(1)), (Some(3), Some(2)));
    assert!(completed.reports().iter().all(|report| report.status == CurveStatus::Converged));
    let raised = completed.clone().elevate(4, &device).unwrap();
    assert_eq!((raised.degree(0), raised.degree(1)), (Some(7), Some(6)));
    let lowered = raised.clone().reduce(4, &device).unwrap();
    assert!(worst(lowered.control_points().coords(), completed.control_points().coords()) < 1e-13);
    let (fit, raised) = (completed.into_fit(), raised.into_fit());
    assert_eq!(fit.polylines(Sampling::PerSpan(8)).count(0), 9);
    for i in 0..2 {
        let (a, b) = (fit.curve(i), raised.curve(i));
        for k in 0..=10 {
            let t = f64::from(k) / 10.0;
            for order in 0..=3 {
                let difference = (a.derivative(t, order) - b.derivative(t, order)).length();
                assert!(difference < 1e-12, "derivative {order} at {t}: {difference:e}");
            }
        }
        // The same in kurbo, which measures arc lengths of cubics to a tolerance.
        let cubic = fit.curve(i).beziers(1e-9);
        assert_eq!(cubic.len(), 1);
        let [p0, p1, p2, p3] = cubic[0].map(|p| kurbo::Point::new(p.x, p.y));
        let wanted = kurbo::ParamCurveArclen::arclen(&kurbo::CubicBez { p0, p1, p2, p3 }, 1e-10);
        assert!((b.length() - wanted).abs() < 1e-8 * wanted, "{} {wanted}", b.length());
        let pieces = raised.curve(i).beziers(1e-9);
        assert!(pieces.iter().flatten().all(|p| p.is_finite()) && !pieces.is_empty());
    }
}

#[test]
fn curves_that_are_far_larger_inside_than_at_their_ends_become_cubics_in_no_time() {
    for inside in [1e12, 1e81, 1e148, 1e292] {
        let points: Vec<[f64; 2]> =
            (0..12).map(|k| [[inside, 0.5, -inside][k % 3], [10.25, 1e-160, -4.0][k % 3]]).collect();
        let mut points = points;
        points[0] = [11.625, 10.25];
        points[11] = [0.0, 0.0];
        let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
        let fit = Complete::default().fit(&batch, &Device::cpu()).unwrap().into_fit();
        for tolerance in [1e-2, 1e-6] {
            let pieces = fit.curve(0).beziers(tolerance);
            assert!(pieces.len() <= 500, "{inside} {tolerance}: {}", pieces.len());
            assert_eq!((pieces[0][0].x, pieces[pieces.len() - 1][3].x), (11.625, 0.0));
        }
    }
}

#[test]
fn a_short_rest_that_is_too_much_for_one_piece_is_divided_again() {
    // All but one point are the same: the curve leaves it, and comes back with a cusp.
    let mut points = [[4.625; 3]; 7];
    points[1][2] = 5.625;
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().closed(true);
    let fit = Complete::default().fit(&batch, &Device::cpu()).unwrap().into_fit();
    for k in 0..200 {
        let tolerance = 1e-2 * 0.95f64.powi(k);
        let pieces = fit.curve(0).beziers(tolerance).len();
        assert!((1..=40).contains(&pieces), "{tolerance:e}: {pieces}");
    }
}

#[test]
fn derivatives_at_the_ends_come_from_the_tangents_of_a_batch() {
    let points = [[0.0, 0.0], [f64::NAN; 2], [f64::NAN; 2], [1.0, 0.0]];
    let tangents = Some(vec![0.0, 3.0, f64::NAN, f64::NAN, f64::NAN, f64::NAN, 0.0, -3.0]);
    let known = Some(vec![true, false, false, true]);
    let batch = CurveBatch::from_slices(&[&points[..]])
        .unwrap()
        .with_constraints(Constraints { tangents, known, ..Constraints::default() })
        .unwrap();
    let completed = Complete::default().fit(&batch, &Device::cpu()).unwrap();
    assert!(worst(completed.control_points().points(0), &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0]) < 1e-15);
    let directions = Complete { tangents: EndTangents::Directions, ..Complete::default() };
    // Perpendicular ends: the energy falls with both speeds.
    let completed = directions.fit(&batch, &Device::cpu()).unwrap();
    assert_eq!(completed.reports()[0].status, CurveStatus::NoMinimiser);
    assert!(completed.reports()[0].message.as_ref().unwrap().contains("turn the direction"));
}

#[test]
fn closed_polygons_return_to_their_first_point() {
    let leaf = [[0.0, 0.0], [2.0, 1.0], [2.0, 3.0], [-1.0, 2.0]];
    let batch = CurveBatch::from_slices(&[&leaf[..]]).unwrap().closed(true);
    let completed = Complete::default().fit(&batch, &Device::cpu()).unwrap();
    assert_eq!(completed.degree(0), Some(4));
    assert_eq!(completed.control_points().count(0), 4);
    let raised = completed.elevate(3, &Device::cpu()).unwrap();
    assert_eq!((raised.control_points().count(0), raised.control_points().is_closed(0)), (7, true));
    let curve = raised.into_fit();
    assert_eq!(curve.curve(0).point(0.0), curve.curve(0).point(1.0));
}

#[test]
fn curves_of_any_degree_are_evaluated_and_no_parameters_give_no_points() {
    let device = Device::cpu();
    let coords: Vec<f64> = (0..=60).map(f64::from).collect();
    let polygons = Polygons { dimension: 1, coords: &coords, offsets: &[0, 0, 61] };
    let points = evaluate(&polygons, &[0.0, 0.25, 1.0], &device).unwrap();
    assert_eq!(points.offsets, [0, 0, 3]);
    assert!(worst(&points.coords, &[0.0, 15.0, 60.0]) < 1e-12);
    assert_eq!(evaluate(&polygons, &[], &device).unwrap().offsets, [0, 0, 0]);
}
