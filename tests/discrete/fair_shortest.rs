//! Curves of least length alone with a largest curvature are Dubins' paths.

use faircurve::discrete::{Fair, Limits, Region, Segments, bending, length, tension};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device};

use crate::common::*;

const SEGMENTS: usize = 64;

/// Curves of least length with a radius of 1 at least.
fn shortest() -> Fair {
    Fair {
        energy: length(),
        segments: Segments::PerSpan(SEGMENTS),
        limits: Limits { curvature: Some(1.0), ..Limits::default() },
        ..Fair::default()
    }
}

/// Rows of numbers below a header.
fn rows(text: &str) -> Vec<Vec<f64>> {
    let numbers = |line: &str| line.split(',').map(|x| x.parse().unwrap()).collect();
    text.lines().skip(1).map(numbers).collect()
}

/// Curvatures at the vertices of an open curve between its ends.
fn curvatures(vertices: &[Planar]) -> Vec<f64> {
    let of = |w: &[Planar]| {
        let [a, b] = [minus(w[1], w[0]), minus(w[2], w[1])];
        2.0 * norm(minus(unit(b), unit(a))) / (norm(a) + norm(b))
    };
    vertices.windows(3).map(of).collect()
}

#[test]
fn curves_of_least_length_between_two_poses_are_dubins_paths() {
    let poses = rows(include_str!("../data/dubins.csv"));
    assert_eq!(poses.len(), 1000);
    let ends: Vec<[Planar; 2]> = poses.iter().map(|pose| [[0.0; 2], [pose[0], pose[1]]]).collect();
    let curves: Vec<&[Planar]> = ends.iter().map(|ends| &ends[..]).collect();
    let tangents = poses.iter().flat_map(|pose| [pose[2].cos(), pose[2].sin(), pose[3].cos(), pose[3].sin()]).collect();
    let batch = CurveBatch::from_slices(&curves).unwrap();
    let batch = batch.with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() }).unwrap();
    let fit = fit(&shortest(), &batch);
    for (i, pose) in poses.iter().enumerate() {
        let (report, exact) = (&fit.reports()[i], pose[4]);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        // Their library's own rounding.
        assert!((report.energy - exact).abs() < 1e-8 * exact, "{i}: {} for {exact}", report.energy);
        let (vertices, h) = (vertices::<2>(&fit, i, SEGMENTS), exact / SEGMENTS as f64);
        // Between vertices it is measured on the cubic through them.
        let curvature = fit.curve(i).max_curvature();
        assert!(curvature < 1.0 + 0.01 * h * h, "{i}: {curvature}, edges of {h}");
        assert!((length_of(&vertices, false) - exact).abs() < h * h * exact, "{i}");
        assert!(curvatures(&vertices).iter().all(|curvature| *curvature < 1.0 + 1e-6), "{i}");
        // The path reaches the last point in its direction: the last edge is as long as others, and turns by half an
        // edge from there.
        for (edge, angle) in [([0, 1], pose[2]), ([SEGMENTS - 1, SEGMENTS], pose[3])] {
            let edge = minus(vertices[edge[1]], vertices[edge[0]]);
            assert!(norm(edge) < h * (1.0 + 1e-9) && norm(edge) > h * (1.0 - h * h), "{i}");
            let sine = unit(edge)[0] * angle.sin() - unit(edge)[1] * angle.cos();
            assert!(sine.abs() < 0.5 * h + 1e-9 && dot(edge, [angle.cos(), angle.sin()]) > 0.0, "{i}: {sine}");
        }
    }
}

#[test]
fn curves_of_least_length_through_points_are_no_longer_than_any_of_1440_directions_a_point() {
    let all = rows(include_str!("../data/dubins_through.csv"));
    for own in all.chunk_by(|a, b| a[0] == b[0]) {
        let points: Vec<Planar> = own.iter().map(|row| [row[1], row[2]]).collect();
        let (report, best) = (fitted::<2>(&shortest(), &one(&points, false), SEGMENTS).1, own[0][3]);
        println!("curve {}: {} for {best}, {} rounds", own[0][0], report.energy, report.iterations);
        assert_eq!(report.status, CurveStatus::Converged);
        // Along jumps half a step of 0.25° a point, at a radius of 1, is a length of first order.
        let steps = points.len() as f64 * 0.125f64.to_radians();
        assert!(report.energy < best + 1e-9 && report.energy > best - steps, "{} for {best}", report.energy);
    }
}

#[test]
fn a_closed_curve_of_least_length_does_not_depend_on_where_it_begins() {
    let ring: Vec<Planar> = vec![[0.0, 0.0], [4.0, -0.5], [3.5, 1.0], [5.0, 4.0], [1.0, 3.0]];
    let lengths: Vec<f64> = (0..ring.len())
        .map(|k| {
            let turned: Vec<Planar> = (0..ring.len()).map(|n| ring[(n + k) % ring.len()]).collect();
            let (vertices, report) = fitted::<2>(&shortest(), &one(&turned, true), SEGMENTS);
            assert_eq!(vertices.len(), ring.len() * SEGMENTS);
            assert!((length_of(&vertices, true) / report.energy - 1.0).abs() < 1e-3);
            report.energy
        })
        .collect();
    assert!(lengths.iter().all(|length| (length - lengths[0]).abs() < 1e-9), "{lengths:?}");
    // A circle through its points is as long as itself.
    let circle: Vec<Planar> = (0..6).map(|k| (f64::from(k) * std::f64::consts::TAU / 6.0).sin_cos().into()).collect();
    let report = fitted::<2>(&shortest(), &one(&circle, true), SEGMENTS).1;
    assert!((report.energy - std::f64::consts::TAU).abs() < 1e-9, "{report:?}");
}

#[test]
fn points_in_a_line_are_joined_by_it() {
    let line: Vec<Planar> = vec![[0.0, 0.0], [1.0, 0.5], [1.0, 0.5], [4.0, 2.0]];
    let (vertices, report) = fitted::<2>(&shortest(), &one(&line, false), SEGMENTS);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    assert!((report.energy - 20f64.sqrt()).abs() < 1e-12);
    assert!(vertices.iter().all(|[x, y]| (x - 2.0 * y).abs() < 1e-12));
    let limits = report.limits.unwrap();
    assert!(limits.cost.abs() < 1e-12 && limits.violation == 0.0 && limits.active == 0, "{limits:?}");
}

#[test]
fn spans_of_the_shortest_curve_have_bounds_of_their_own() {
    let points: Vec<Planar> = vec![[0.0, 0.0], [3.0, 2.0], [6.0, 0.0], [9.0, 2.0]];
    let bounds = Some(vec![2.0, f64::NAN, 0.5, f64::NAN]);
    let batch =
        one(&points, false).with_constraints(Constraints { largest_curvatures: bounds, ..Constraints::default() });
    let fair = Fair { limits: Limits::default(), ..shortest() };
    let (vertices, report) = fitted::<2>(&fair, &batch.unwrap(), SEGMENTS);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    for (span, bound) in [2.0, 0.0, 0.5].into_iter().enumerate() {
        let own = curvatures(&vertices[span * SEGMENTS..=(span + 1) * SEGMENTS]);
        let largest = own.into_iter().fold(0.0, f64::max);
        assert!(largest < bound * (1.0 + 1e-6) + 1e-9, "{largest} for {bound}");
    }
    // The middle span is its chord, and the others leave it as they like.
    assert!((length_of(&vertices[SEGMENTS..=2 * SEGMENTS], false) - 13f64.sqrt()).abs() < 1e-12);
}

#[test]
fn a_stretch_that_no_curve_of_bounded_curvature_has_is_infeasible() {
    let points: Vec<Planar> = vec![[0.0, 0.0], [1.0, 0.0], [0.5, 0.5]];
    let least = fitted::<2>(&shortest(), &one(&points, false), SEGMENTS).1.limits.unwrap().stretch;
    let within = |stretch: f64| {
        let limits = Limits { stretch: Some(stretch), ..shortest().limits };
        fitted::<2>(&Fair { limits, ..shortest() }, &one(&points, false), SEGMENTS).1
    };
    assert_eq!(within(least * 1.001).status, CurveStatus::Converged);
    let report = within(least * 0.99);
    assert_eq!(report.status, CurveStatus::Infeasible);
    let message = report.message.unwrap();
    assert!(message.contains("the shortest curve of bounded curvature through its points is"), "{message}");
    assert!(message.contains(&format!("{least:.6}")), "{message}");
}

#[test]
fn a_curve_that_cannot_be_fitted_does_not_change_the_shortest_ones_beside_it() {
    let good: Vec<Planar> = vec![[0.0, 0.0], [1.0, 0.3], [0.2, 1.0]];
    let alone = fit(&shortest(), &one(&good, false));
    let bad: Vec<Planar> = vec![[1.0, 1.0]; 3];
    let both = fit(&shortest(), &CurveBatch::from_slices(&[&bad[..], &good[..]]).unwrap());
    assert_eq!(both.reports()[0].status, CurveStatus::Degenerate);
    assert_eq!(vertices::<2>(&both, 1, SEGMENTS), vertices::<2>(&alone, 0, SEGMENTS));
    assert_eq!(both.reports()[1], alone.reports()[0]);
}

#[test]
fn what_shortest_curves_cannot_keep_is_said() {
    let plane = one(&[[0.0, 0.0], [1.0, 0.3], [0.2, 1.0]], false);
    let space = one(&[[0.0, 0.0, 0.0], [1.0, 0.3, 1.0], [0.2, 1.0, 0.0]], false);
    let region = Region::HalfSpace { normal: [0.0, 1.0, 0.0], offset: 2.0 };
    let of = |energy, limits| Fair { energy, limits, ..shortest() };
    let cases = [
        (of(tension(), shortest().limits), &plane, "are polygons, which have corners"),
        (of(length() + tension(), shortest().limits), &plane, "are polygons, which have corners"),
        (shortest(), &space, "are known in the plane alone"),
        (of(length(), Limits { regions: vec![region], ..shortest().limits }), &plane, "and no other limit"),
        (of(length(), Limits { shape: true, ..Limits::default() }), &plane, "and no other limit"),
    ];
    for (fair, batch, what) in cases {
        let error = fair.fit(batch, &Device::cpu()).unwrap_err().to_string();
        assert!(error.contains(what) && error.contains("ask for an energy that holds bending"), "{error}");
    }
    // With a little bending they are kept.
    let fair = of(bending(2.0) + 10.0 * length(), shortest().limits);
    assert_eq!(fit(&fair, &plane).reports().len(), 1);
}

#[test]
fn circles_too_large_for_the_numbers_are_a_sentence() {
    let points: Vec<Planar> = vec![[0.0, 0.0], [1.0, 0.3], [0.2, 1.0]];
    let of = |curvature: f64| {
        let limits = Limits { curvature: Some(curvature), ..Limits::default() };
        fitted::<2>(&Fair { limits, ..shortest() }, &one(&points, false), SEGMENTS).1
    };
    for curvature in [1e-300, 1e-12] {
        let report = of(curvature);
        assert_eq!(report.status, CurveStatus::Invalid, "{report:?}");
        assert!(report.message.unwrap().contains("its circles are too large for its points"));
    }
    for curvature in [1e-4, 1.0, 1e300] {
        assert_eq!(of(curvature).status, CurveStatus::Converged, "{curvature:e}");
    }
}
