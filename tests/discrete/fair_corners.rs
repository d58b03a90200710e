//! Corners of the data are corners of the curve, and nothing but corners.

use std::f64::consts::{FRAC_PI_3, PI};

use faircurve::discrete::{Fair, Pins, Segments, bending, length};
use faircurve::{CurveBatch, CurveStatus, Fit, Sampling};

use crate::common::*;

const SEGMENTS: usize = 8;

fn cornered() -> Fair {
    let energy = bending(2.0) + 0.1 * length();
    Fair { energy, corners: Some(FRAC_PI_3), segments: Segments::PerSpan(SEGMENTS), ..Fair::default() }
}

fn samples(fit: &Fit) -> Vec<Planar> {
    vertices(fit, 0, SEGMENTS)
}

/// A wave along x, a right angle at (4, 0), and a wave along y; its corner is point 4.
const ELBOW: [Planar; 8] =
    [[0.0, 0.0], [1.0, 0.3], [2.0, -0.2], [3.0, 0.2], [4.0, 0.0], [3.8, 1.0], [4.2, 2.0], [4.0, 3.0]];

#[test]
fn a_square_keeps_its_corners_and_its_sides_are_straight() {
    // Corners are every second point, and every start is as good as another.
    let square = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0], [0.0, 2.0], [0.0, 1.0]];
    let fair = Fair { energy: bending(2.0), ..cornered() };
    for start in 0..8 {
        let mut points = square;
        points.rotate_left(start);
        let fit = fit(&fair, &one(&points, true));
        let report = &fit.reports()[0];
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        assert!(report.energy <= 1e-20 && report.max_deviation == 0.0, "{report:?}");
        let found = samples(&fit);
        assert_eq!(found.len(), 8 * SEGMENTS);
        (0..8).for_each(|k| assert_eq!(found[k * SEGMENTS], points[k], "start {start}, point {k}"));
        let curve = fit.curve(0);
        assert!(curve.is_closed() && curve.max_curvature() <= 1e-9 && (curve.length() - 8.0).abs() <= 1e-9);
        assert!(found.iter().all(|[x, y]| [x * (x - 2.0), y * (y - 2.0)].iter().any(|z| z.abs() <= 1e-12)));
    }
}

#[test]
fn a_closed_curve_with_one_corner_is_smooth_everywhere_else() {
    // A drop: a circle with a tip at point 0, or at any other.
    let mut drop: Vec<Planar> = (1..8).map(|k| 0.25 * PI * f64::from(k)).map(|t| [t.cos(), t.sin()]).collect();
    drop.insert(0, [2.0, 0.3]);
    let count = drop.len();
    let fair = Fair { corners: Some(1.4), ..cornered() };
    let mut lengths = Vec::new();
    for start in 0..count {
        let mut points = drop.clone();
        points.rotate_left(start);
        let tip = (count - start) % count;
        let fit = fit(&fair, &one(&points, true));
        assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports()[0]);
        let found = samples(&fit);
        assert_eq!(found.len(), count * SEGMENTS);
        (0..count).for_each(|k| assert_eq!(found[k * SEGMENTS], points[k], "start {start}, point {k}"));
        let turn = |row: usize| {
            let all = found.len();
            let edge = |row: usize| unit(minus(found[(row + 1) % all], found[row % all]));
            dot(edge(row + all - 1), edge(row)).clamp(-1.0, 1.0).acos()
        };
        let turns: Vec<f64> = (0..found.len()).map(turn).collect();
        let others = turns.iter().enumerate().filter(|(row, _)| *row != tip * SEGMENTS).map(|(_, turn)| *turn);
        assert!(turns[tip * SEGMENTS] > 0.8 && others.fold(0.0, f64::max) < 0.4, "start {start}: {turns:?}");
        // What the curve turns at its tip is in no curvature.
        let curve = fit.curve(0);
        assert!(curve.max_curvature() < 3.0, "{}", curve.max_curvature());
        let (before, after) = (curve.jet((tip + count - 1) % count, 1.0), curve.jet(tip, 0.0));
        assert!((before.point - after.point).length() <= 1e-15);
        assert!(before.first.normalize().dot(after.first.normalize()) < 0.7);
        lengths.push(curve.length());
    }
    assert!(lengths.iter().all(|length| (length - lengths[0]).abs() <= 1e-6), "{lengths:?}");
}

#[test]
fn pieces_are_curves_of_their_own_and_their_reports_are_joined() {
    let whole = fit(&cornered(), &one(&ELBOW, false));
    let plain = Fair { corners: None, ..cornered() };
    let parts = CurveBatch::from_slices(&[&ELBOW[..5], &ELBOW[4..]]).unwrap();
    let parts = fit(&plain, &parts);
    let (joined, of_parts) = (&whole.reports()[0], parts.reports());
    assert_eq!(joined.status, CurveStatus::Converged);
    assert_eq!(joined.energy, of_parts[0].energy + of_parts[1].energy);
    assert_eq!(joined.iterations, of_parts[0].iterations + of_parts[1].iterations);
    assert_eq!(joined.gradient_norm, of_parts[0].gradient_norm.max(of_parts[1].gradient_norm));
    let found = samples(&whole);
    let mut wanted = vertices::<2>(&parts, 0, SEGMENTS);
    wanted.extend(&vertices::<2>(&parts, 1, SEGMENTS)[1..]);
    assert_eq!(found, wanted);
    let largest = whole.curve(0).max_curvature();
    assert_eq!(largest, parts.curve(0).max_curvature().max(parts.curve(1).max_curvature()));
    let (_, uncut) = fitted::<2>(&plain, &one(&ELBOW, false), SEGMENTS);
    assert!(joined.energy < uncut.energy, "{joined:?} {uncut:?}");
}

#[test]
fn the_worst_piece_speaks_for_the_curve_and_names_the_point() {
    let lazy = Fair { max_iterations: 0, ..cornered() };
    // The first piece is a line, which needs no iteration.
    let batch = one(&ELBOW[3..], false).with_names(vec!["elbow".into()]).unwrap();
    let report = fit(&lazy, &batch).reports()[0].clone();
    assert_eq!(report.status, CurveStatus::NotConverged);
    let message = report.message.unwrap();
    assert!(message.starts_with("curve elbow, point 1: 0 iterations were not enough"), "{message}");
}

#[test]
fn only_turns_above_the_angle_are_corners() {
    // A hexagon turns by 60 degrees at every point.
    let hexagon: Vec<Planar> = (0..6).map(|k| FRAC_PI_3 * f64::from(k)).map(|t| [t.cos(), t.sin()]).collect();
    let energy = |angle: f64| {
        let fair = Fair { energy: bending(2.0), corners: Some(angle), ..cornered() };
        fitted::<2>(&fair, &one(&hexagon, true), SEGMENTS).1.energy
    };
    assert!(energy(FRAC_PI_3) > 6.0 && energy(1.05) > 6.0);
    assert!(energy(1.04) <= 1e-20);
    assert_eq!(energy(PI), energy(FRAC_PI_3));
}

#[test]
fn repeated_points_and_turning_back_are_corners_like_others() {
    let mut points = ELBOW.to_vec();
    points.insert(4, ELBOW[4]);
    let doubled = fit(&cornered(), &one(&points, false));
    assert_eq!(doubled.reports()[0].status, CurveStatus::Converged);
    let found = samples(&doubled);
    assert_eq!(found.len(), 8 * SEGMENTS + 1);
    let single = samples(&fit(&cornered(), &one(&ELBOW, false)));
    assert_eq!(found[..4 * SEGMENTS], single[..4 * SEGMENTS]);
    assert_eq!(found[5 * SEGMENTS..], single[4 * SEGMENTS..]);
    // There and back: without corners it is degenerate.
    let spike = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.0]];
    let report = fit(&cornered(), &one(&spike, false)).reports()[0].clone();
    assert_eq!((report.status, report.energy < 0.3001), (CurveStatus::Converged, true), "{report:?}");
    let uncut = fit(&Fair { corners: None, ..cornered() }, &one(&spike, false)).reports()[0].clone();
    assert_eq!(uncut.status, CurveStatus::Degenerate);
}

#[test]
fn corners_stay_where_everything_else_may_move() {
    let noisy: Vec<Planar> = (0..9).map(|k| [0.5 * f64::from(k), 0.1 * f64::from(k % 2)]).collect();
    let mut points = noisy.clone();
    points.extend((1..9).map(|k| [4.0 + 0.1 * f64::from(k % 2), 0.5 * f64::from(k)]));
    for pins in [Pins::All, Pins::None] {
        let fair = Fair { deviation: Some(0.04.into()), pins, ..cornered() };
        let fit = fit(&fair, &one(&points, false));
        let report = &fit.reports()[0];
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        assert!(report.max_deviation <= 0.04 && report.max_deviation >= 0.039, "{report:?}");
        let found = samples(&fit);
        assert_eq!(found.len(), 16 * SEGMENTS + 1);
        assert_eq!(found[8 * SEGMENTS], points[8]);
        assert_ne!(found[7 * SEGMENTS], points[7]);
        assert_eq!(found[0] == points[0], pins == Pins::All);
    }
}

#[test]
fn a_point_with_a_tangent_is_no_corner() {
    let held = constrained(&ELBOW, false, &[(4, [1.0, 1.0])], &[]);
    let fit = fit(&cornered(), &held);
    assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports()[0]);
    for (span, u) in [(3, 1.0), (4, 0.0)] {
        let tangent = fit.curve(0).jet(span, u).first.normalize();
        assert!((tangent.x - tangent.y).abs() <= 1e-14 && tangent.x > 0.0, "{tangent:?}");
    }
}

#[test]
fn bad_curves_and_whole_ones_are_as_they_were() {
    let bad = [[0.0, 0.0], [1.0, f64::NAN], [1.0, 1.0]];
    let gentle = [[0.0, 0.0], [1.0, 0.2], [2.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&bad[..], &gentle, &ELBOW, &bad[..1]]).unwrap();
    let cut = fit(&cornered(), &batch);
    let plain = fit(&Fair { corners: None, ..cornered() }, &batch);
    for i in [0, 1, 3] {
        let (a, b) = (&cut.reports()[i], &plain.reports()[i]);
        assert_eq!((a.status, &a.message), (b.status, &b.message));
        assert_eq!(a.energy.to_bits(), b.energy.to_bits());
        let [a, b] = [&cut, &plain].map(|fit| fit.polylines(Sampling::PerSpan(SEGMENTS)).points(i).to_vec());
        assert!(a.iter().zip(&b).all(|(a, b)| a.to_bits() == b.to_bits()) && a.len() == b.len());
    }
    assert_eq!(cut.reports()[2], fit(&cornered(), &one(&ELBOW, false)).reports()[0]);
}
