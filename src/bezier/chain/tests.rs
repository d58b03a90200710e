//! Pieces against exact completions, joints against what is known of them, and long chains.

use glam::DVec3;

use super::joint::{Condition, Joint};
use super::piece::Piece;
use super::*;
use crate::constraint::Constraints;
use crate::report::CurveReport;
use crate::status::CurveStatus;

#[test]
fn mixed_energies_of_any_length_are_those_of_the_exact_completion() {
    for (degree, smoothness, known, tolerance) in
        [(2, 0, 0, 1e-13), (5, 1, 0b100, 1e-13), (8, 2, 0, 1e-13), (12, 1, 0b100100, 1e-12), (20, 2, 0, 1e-11)]
    {
        let energy = Energy { weights: [0.7, 1.0, 0.3] };
        // Exact completions of high degree take seconds.
        for h in [0.02, 3.0, 60.0_f64].into_iter().take(if degree > 8 { 1 } else { 3 }) {
            let scaled: [f64; 3] = std::array::from_fn(|k| energy.weights[k] * h.powi(-1 - 2 * k as i32));
            let (mixed, exact) = (
                Piece::new(degree, smoothness, known, &energy),
                Piece::new(degree, smoothness, known, &Energy { weights: scaled }),
            );
            let (ours, theirs) = (mixed.sized(h), exact.sized(1.0));
            let diagonal = |i: usize| theirs.gram[i * mixed.columns() + i].sqrt();
            for (i, j) in (0..2 * smoothness + 2).flat_map(|i| (0..2 * smoothness + 2).map(move |j| (i, j))) {
                let [a, b] = [&ours.gram, &theirs.gram].map(|gram| gram[i * mixed.columns() + j]);
                let off = (a - b).abs() / (diagonal(i) * diagonal(j));
                assert!(off <= tolerance, "degree {degree}, length {h}, {i}, {j}: {a}, {b}");
            }
            let data: Vec<DVec3> =
                (0..mixed.columns()).map(|k| DVec3::new((k as f64).sin(), (3.0 * k as f64).cos(), 1.0)).collect();
            let made = |piece: &Piece, sized| {
                let mut points = Vec::new();
                let energy = piece.make(sized, &data, DVec3::ZERO, |_, point| points.push(point.to_array()));
                (points, energy)
            };
            let ((ours, energy), (theirs, exact)) = (made(&mixed, &ours), made(&exact, &theirs));
            assert!((energy - exact).abs() <= tolerance * exact, "degree {degree}, length {h}: {energy}, {exact}");
            for (a, b) in ours.iter().flatten().zip(theirs.iter().flatten()) {
                // The energy hardly changes where points are not well determined.
                assert!((a - b).abs() <= 1e3 * tolerance, "degree {degree}, length {h}: {a}, {b}");
            }
        }
    }
}

fn condition(coefficients: [f64; 3], x: f64, point: usize) -> Condition {
    Condition { coefficients: coefficients.into(), value: DVec3::new(x, 0.0, 0.0), point }
}

#[test]
fn joints_keep_what_is_known_of_them_and_leave_the_rest_free() {
    // Second handles at both sides: two numbers of three.
    let conditions = [condition([1.0, 2.0, 1.5], 3.0, 7), condition([1.0, -2.0, 1.5], 1.0, 8)];
    let joint = Joint::new(2, 1.0, &conditions, 3.0).unwrap();
    assert_eq!(joint.free, 1);
    let value = |row: DVec3, y: f64| {
        let jet = joint.jet(|_| DVec3::new(y, 0.0, 0.0), 1.0);
        (0..3).map(|r| row[r] * jet[r][0]).sum::<f64>()
    };
    for (own, y) in conditions.iter().zip([-2.0, 5.0]) {
        assert!((value(own.coefficients, y) - own.value[0]).abs() < 1e-14);
    }
    assert!((joint.basis[0].length_squared() - 1.0).abs() < 1e-15);
    // The difference of these handles is a derivative: a tangent says it again, or something else.
    let with = |tangent: f64| {
        [
            condition([1.0, 2.0, 1.5], 3.0, 7),
            condition([1.0, -2.0, 1.5], 1.0, 8),
            condition([0.0, 1.0, 0.0], tangent, 6),
        ]
    };
    assert_eq!(Joint::new(2, 1.0, &with(0.5), 3.0).unwrap().free, 1);
    assert_eq!(Joint::new(2, 1.0, &with(0.5 + 1e-10), 3.0).unwrap().free, 1);
    let (point, off) = Joint::new(2, 1.0, &with(0.6), 3.0).unwrap_err();
    assert!(point == 6 && off > 0.01, "{point}, {off}");
    assert_eq!(Joint::new(1, 1.0, &[], 0.0).unwrap().free, 2);
}

/// A chain on a wavy line or ring whose joints are known where `known` says so.
fn report(chain: &Chain, pieces: usize, closed: bool, known: impl Fn(usize) -> bool) -> CurveReport {
    let count = chain.degree * pieces + usize::from(!closed);
    let point = |k: usize| [(k as f64).cos(), (k as f64 * 0.7).sin()];
    let points: Vec<[f64; 2]> = (0..count).map(point).collect();
    let flags = (0..count).map(|k| k % chain.degree == 0 && known(k / chain.degree)).collect();
    let batch = CurveBatch::from_slices(&[&points[..]])
        .and_then(|batch| batch.closed_each(vec![closed]))
        .and_then(|batch| batch.with_constraints(Constraints { known: Some(flags), ..Constraints::default() }))
        .unwrap();
    chain.fit(&batch, &Device::cpu()).unwrap().reports()[0].clone()
}

#[test]
fn chains_of_parabolas_are_undetermined_but_for_odd_rings() {
    // ∫|p‴|² is 0 for C1 chains of parabolas, of which there is one a slope at the start, or one in
    // all round an odd ring.
    let chain = Chain { energy: Energy::of_order(3), lengths: PieceLengths::Equal, ..Chain::default() };
    for (pieces, closed, status) in [
        (1, false, CurveStatus::Degenerate),
        (40, false, CurveStatus::Degenerate),
        (40, true, CurveStatus::Degenerate),
        (41, true, CurveStatus::Converged),
        (301, true, CurveStatus::Converged),
        (300, true, CurveStatus::Degenerate),
    ] {
        let report = report(&chain, pieces, closed, |_| true);
        assert_eq!(report.status, status, "{pieces}, {closed}: {report:?}");
    }
}

#[test]
fn long_rows_of_unknown_joints_are_determined_by_what_is_known_far_away() {
    for (degree, joints) in [(3, Joints::C1), (5, Joints::C2)] {
        let chain = Chain { degree, joints, ..Chain::default() };
        for far in [10, 100, 200] {
            let report = report(&chain, 2 * far, false, |joint| joint % far == 0);
            assert_eq!(report.status, CurveStatus::Converged, "{joints:?}, {far}: {report:?}");
            // Pieces of length 1: a spline through three points, far apart.
            let point = |k: usize| [((k * degree) as f64).cos(), ((k * degree) as f64 * 0.7).sin()];
            let [a, b, c] = [0, far, 2 * far].map(point);
            let second: f64 = (0..2).map(|x| (a[x] - 2.0 * b[x] + c[x]).powi(2)).sum();
            let wanted = 1.5 * second / (far as f64).powi(3);
            assert!((report.energy - wanted).abs() <= 1e-6 * wanted, "{joints:?}, {far}: {}, {wanted}", report.energy);
        }
        let report = report(&chain, 100, false, |joint| joint == 50);
        assert_eq!(report.status, CurveStatus::Degenerate, "{joints:?}: {report:?}");
    }
}
