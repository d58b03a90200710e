//! Corners of chains: parts between them are chains of their own.

use faircurve::bezier::{Chain, Completed, Joints};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device};

/// Joints of two half waves that meet in a peak, and handles that say so.
fn peak() -> Vec<[f64; 2]> {
    let wave = [[0.0, 0.0], [0.5, 0.6], [1.0, 0.7], [1.5, 0.7], [2.0, 0.7], [2.5, 1.0], [3.0, 2.0]];
    let down = wave.iter().rev().skip(1).map(|[x, y]| [6.0 - x, *y]);
    wave.iter().copied().chain(down).collect()
}

fn batch(points: &[[f64; 2]], closed: bool) -> CurveBatch {
    let known = (0..points.len()).map(|k| k % 3 == 0).collect();
    CurveBatch::from_slices(&[points])
        .and_then(|batch| batch.closed_each(vec![closed]))
        .and_then(|batch| batch.with_constraints(Constraints { known: Some(known), ..Constraints::default() }))
        .unwrap()
}

fn fit(batch: &CurveBatch, joints: Joints, corners: Option<f64>) -> Completed {
    Chain { joints, corners, ..Chain::default() }.fit(batch, &Device::cpu()).unwrap()
}

#[test]
fn the_parts_of_a_chain_between_corners_are_chains_of_their_own() {
    let points = peak();
    for joints in [Joints::C1, Joints::C2, Joints::G1] {
        let whole = fit(&batch(&points, false), joints, Some(0.5));
        let parts = [&points[..7], &points[6..]].map(|part| fit(&batch(part, false), joints, None));
        let [a, b] = parts.each_ref().map(|part| part.control_points().points(0));
        let found = whole.control_points().points(0).to_vec();
        assert_eq!(found, [a, &b[2..]].concat(), "{joints:?}");
        let sum: f64 = parts.iter().map(|part| part.reports()[0].energy).sum();
        assert_eq!(whole.reports()[0].energy, sum);
        let lengths = |completed: Completed| completed.into_fit().curve(0).domain().1;
        let [a, b] = parts.map(lengths);
        assert_eq!(lengths(whole), a + b);
        assert_ne!(fit(&batch(&points, false), joints, None).control_points().points(0), found);
    }
}

#[test]
fn closed_chains_begin_where_they_did_wherever_their_corners_are() {
    // A drop with its tip at the joints 0, 1 and 2.
    let drop = [
        [0.0, 0.0],
        [1.0, 1.0],
        [2.0, 2.0],
        [0.0, 3.0],
        [-1.5, 3.6],
        [-2.0, 1.4],
        [-1.6, 0.6],
        [-1.2, 0.2],
        [-0.6, 0.1],
    ];
    let mut all = Vec::new();
    for turned in 0..3 {
        let mut points = drop;
        points.rotate_left(3 * turned);
        let completed = fit(&batch(&points, true), Joints::C1, Some(0.6));
        assert_eq!(completed.reports()[0].status, CurveStatus::Converged);
        let mut found = completed.control_points().points(0).to_vec();
        assert_eq!(found[..2], points[0]);
        found.rotate_right(6 * turned);
        let knots = completed.into_fit().curve(0).knots().to_vec();
        let mut lengths: Vec<f64> = knots.windows(2).map(|pair| pair[1] - pair[0]).collect();
        lengths.rotate_right(turned);
        all.push((found, lengths.iter().map(|length| length.to_bits() >> 8).collect::<Vec<_>>()));
    }
    assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{all:?}");
}

#[test]
fn a_part_that_cannot_be_completed_leaves_its_chain_as_it_was() {
    let mut points = peak();
    points[9] = [f64::NAN; 2];
    let batch = batch(&points, false);
    let completed = fit(&batch, Joints::C1, Some(0.5));
    let report = &completed.reports()[0];
    assert_eq!(report.status, CurveStatus::Invalid);
    assert!(report.message.as_ref().unwrap().contains("point 9"), "{report:?}");
    assert_eq!(completed.degree(0), None);
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
    assert!(same(completed.control_points().points(0), batch.points(0)));
    let error = Chain { corners: Some(4.0), ..Chain::default() }.fit(&batch, &Device::cpu()).unwrap_err();
    assert!(error.to_string().contains("the angle of corners is 4 radians"), "{error}");
}
