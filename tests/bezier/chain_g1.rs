//! Chains of Béziers with G1 joints: handles of a drawing of least energy.

use std::slice;

use faircurve::bezier::{Chain, Completed, Energy, Joints, PieceLengths};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device};
use nalgebra::DMatrix;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::chains::{Case, batch, spread};
use crate::reference::{form_of, pieces};

const G1: Chain =
    Chain { degree: 3, joints: Joints::G1, energy: Energy::bending(), lengths: PieceLengths::Chords, corners: None };

/// Joints of a wavy ring or arc, uneven, in so many dimensions.
fn wavy(dimension: usize, joints: usize, closed: bool, seed: u64) -> Vec<Vec<f64>> {
    let mut rng = StdRng::seed_from_u64(seed);
    let turn = if closed { std::f64::consts::TAU / joints as f64 } else { 5.0 / joints as f64 };
    let mut at = |k: usize| {
        let angle = turn * (k as f64 + rng.random_range(-0.2..0.2));
        let r = 2.0 + 0.3 * (3.0 * angle).sin() + 0.02 * rng.random_range(-1.0..1.0);
        [r * angle.cos(), r * angle.sin(), 0.5 * (2.0 * angle).sin()][..dimension].to_vec()
    };
    (0..joints).map(&mut at).collect()
}

/// A chain of which the joints are known.
fn case(degree: usize, joints: &[Vec<f64>], closed: bool) -> Case {
    let (dimension, n) = (joints[0].len(), joints.len());
    let pieces = if closed { n } else { n - 1 };
    let count = degree * pieces + usize::from(!closed);
    // What stands at unknown points is not read.
    let mut points: Vec<f64> = (0..count * dimension).map(|k| 50.0 + k as f64).collect();
    for (k, joint) in joints.iter().enumerate() {
        points[k * degree * dimension..][..dimension].copy_from_slice(joint);
    }
    let known = (0..count).map(|k| k % degree == 0).collect();
    Case { dimension, closed, points, known }
}

fn fit(chain: &Chain, case: &Case) -> Completed {
    chain.fit(&batch(slice::from_ref(case)), &Device::cpu()).unwrap()
}

fn energy(form: &DMatrix<f64>, dimension: usize, points: &[f64]) -> f64 {
    let points = DMatrix::from_row_slice(points.len() / dimension, dimension, points);
    (points.transpose() * form * points).trace()
}

/// The handles before and after a joint, relative to it.
fn handles(case: &Case, degree: usize, points: &[f64], joint: usize) -> [Option<(usize, Vec<f64>)>; 2] {
    let (d, count) = (case.dimension, case.known.len());
    let place = joint * degree;
    let at = |k: usize| -> Vec<f64> { (0..d).map(|c| points[k * d + c] - points[place * d + c]).collect() };
    let before = if case.closed { Some((place + count - 1) % count) } else { place.checked_sub(1) };
    let after = if case.closed { Some((place + 1) % count) } else { Some(place + 1).filter(|&k| k < count) };
    [before, after].map(|k| k.map(|k| (k, at(k))))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Handles of every joint point opposite ways, to rounding.
fn assert_g1(case: &Case, degree: usize, points: &[f64]) {
    let pieces = pieces(case, degree);
    for joint in 0..if case.closed { pieces } else { pieces + 1 } {
        if let [Some((_, a)), Some((_, b))] = handles(case, degree, points, joint) {
            let ratio = (dot(&b, &b) / dot(&a, &a)).sqrt();
            let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| b + ratio * a).collect();
            assert!(dot(&off, &off).sqrt() <= 1e-12 * (1.0 + dot(&b, &b).sqrt()), "joint {joint}: {a:?}, {b:?}");
        }
    }
}

#[test]
fn energies_fall_from_c2_to_c1_to_g1_joints() {
    for (dimension, closed) in [(2, false), (2, true), (3, false), (3, true)] {
        for (n, seed) in [(2, 1), (3, 2), (5, 3), (12, 4), (60, 5)] {
            // Polygons turn by 90 degrees and more.
            if closed && n < 5 {
                continue;
            }
            let case = case(3, &wavy(dimension, n, closed, seed), closed);
            let [c2, c1, g1] = [Joints::C2, Joints::C1, Joints::G1].map(|joints| fit(&Chain { joints, ..G1 }, &case));
            let report = &g1.reports()[0];
            assert_eq!(report.status, CurveStatus::Converged, "{dimension}, {closed}, {n}: {report:?}");
            assert!(report.gradient_norm <= 1e-11 && report.iterations <= 20, "{dimension}, {closed}, {n}: {report:?}");
            let [c2, c1, least] = [&c2, &c1, &g1].map(|completed| completed.reports()[0].energy);
            assert!(c1 <= c2 * (1.0 + 1e-12) && least <= c1 * (1.0 + 1e-12) + 1e-28, "{c2}, {c1}, {least}");
            assert!(n < 5 || least < c1 * (1.0 - 1e-6), "{dimension}, {closed}, {n}: {c1}, {least}");
            assert_g1(&case, 3, g1.control_points().points(0));
            println!(
                "{dimension}-D, closed {closed}, {n}: {c2:.6} {c1:.6} {least:.6}, {} iterations",
                report.iterations
            );
        }
    }
}

/// Turns the handles of a joint in the plane of two axes, and scales them; returns what becomes of
/// the energy.
fn perturbed(
    case: &Case,
    degree: usize,
    points: &[f64],
    joint: usize,
    turn: (usize, usize, f64),
    scales: [f64; 2],
) -> Vec<f64> {
    let (d, (x, y, angle)) = (case.dimension, turn);
    let mut points = points.to_vec();
    for (side, handle) in handles(case, degree, &points.clone(), joint).into_iter().enumerate() {
        let Some((k, mut v)) = handle else { continue };
        if case.known[k] {
            continue;
        }
        (v[x], v[y]) = (angle.cos() * v[x] - angle.sin() * v[y], angle.sin() * v[x] + angle.cos() * v[y]);
        for c in 0..d {
            points[k * d + c] = points[joint * degree * d + c] + scales[side] * v[c];
        }
    }
    points
}

/// The energy's changes when directions and speeds of one joint change have no slope, and do not
/// fall.
fn assert_least(chain: &Chain, case: &Case, found: &[f64], turns: bool) {
    let form = form_of(chain, case);
    let least = energy(&form, case.dimension, found);
    let pieces = pieces(case, chain.degree);
    let step = 1e-3;
    for joint in 0..if case.closed { pieces } else { pieces + 1 } {
        let planes = [(0, 1), (0, 2), (1, 2)].into_iter().filter(|&(_, y)| turns && y < case.dimension);
        let turned = planes.map(|(x, y)| ([1.0, 1.0], (x, y, step)));
        let scaled = [[1.0 + step, 1.0], [1.0, 1.0 + step]].map(|scales| (scales, (0, 1, 0.0)));
        for (scales, turn) in turned.chain(scaled) {
            let other = (scales.map(|x| 2.0 - x), (turn.0, turn.1, -turn.2));
            let [up, down] = [(scales, turn), other].map(|(scales, turn)| {
                energy(&form, case.dimension, &perturbed(case, chain.degree, found, joint, turn, scales)) - least
            });
            // Slopes against curvatures: of order step² where the slope is 0.
            assert!(up >= -1e-12 * least && down >= -1e-12 * least, "joint {joint}: {up:e}, {down:e}");
            assert!((up - down).abs() <= 1e-2 * (up + down) + 1e-11 * least, "joint {joint}: {up:e}, {down:e}");
        }
    }
}

#[test]
fn directions_and_speeds_of_g1_joints_are_stationary() {
    for (dimension, closed) in [(2, false), (2, true), (3, false), (3, true)] {
        for degree in [3, 4, 6] {
            for weights in [[0.0, 1.0, 0.0], [0.2, 1.0, 0.1]] {
                let chain = Chain { degree, energy: Energy { weights }, ..G1 };
                let case = case(degree, &wavy(dimension, 9, closed, 30 + degree as u64), closed);
                let completed = fit(&chain, &case);
                assert_eq!(completed.reports()[0].status, CurveStatus::Converged, "{:?}", completed.reports()[0]);
                let found = completed.control_points().points(0);
                assert_least(&chain, &case, found, true);
                let energy = energy(&form_of(&chain, &case), dimension, found);
                assert!((completed.reports()[0].energy - energy).abs() <= 1e-10 * energy);
            }
        }
    }
}

#[test]
fn a_handle_known_on_one_side_is_the_direction_on_the_other() {
    for (dimension, closed) in [(2, true), (3, false)] {
        let mut case = case(3, &wavy(dimension, 8, closed, 77), closed);
        let free = fit(&G1, &case);
        // Handles of another shape: a little longer, a little turned.
        for (joint, side) in [(2, 0), (3, 1), (5, 0), (5, 1)] {
            let handle = handles(&case, 3, free.control_points().points(0), joint)[side].clone().unwrap();
            let (sine, cosine) = (0.2_f64.sin(), 0.2_f64.cos());
            let (k, v) = handle;
            let turned = [1.1 * (cosine * v[0] - sine * v[1]), 1.1 * (sine * v[0] + cosine * v[1]), *v.last().unwrap()];
            for (c, x) in turned.iter().take(dimension).enumerate() {
                case.points[k * dimension + c] = case.points[joint * 3 * dimension + c] + x;
            }
            case.known[k] = true;
        }
        let completed = fit(&G1, &case);
        assert_eq!(completed.reports()[0].status, CurveStatus::Converged, "{:?}", completed.reports()[0]);
        assert!(completed.reports()[0].energy > free.reports()[0].energy);
        let found = completed.control_points().points(0);
        assert_g1(&case, 3, found);
        for k in (0..case.known.len()).filter(|&k| case.known[k]) {
            assert_eq!(found[k * dimension..(k + 1) * dimension], case.points[k * dimension..(k + 1) * dimension]);
        }
        // Speeds beside known handles are of least energy too; a joint whose handles are known is
        // as it is.
        let form = form_of(&G1, &case);
        let least = energy(&form, dimension, found);
        for (joint, scales) in [(2, [1.0, 1.001]), (2, [1.0, 0.999]), (3, [1.001, 1.0]), (3, [0.999, 1.0])] {
            let other = perturbed(&case, 3, found, joint, (0, 1, 0.0), scales);
            assert!(energy(&form, dimension, &other) > least, "{joint}, {scales:?}");
        }
    }
}

#[test]
fn tangents_of_g1_joints_are_directions() {
    let case = case(3, &wavy(2, 7, false, 8), false);
    let free = fit(&G1, &case);
    let (count, mut tangents) = (case.known.len(), vec![f64::NAN; 2 * case.known.len()]);
    for joint in [0, 3, 6] {
        let side = usize::from(joint != 6);
        let (_, v) = handles(&case, 3, free.control_points().points(0), joint)[side].clone().unwrap();
        let sign = if side == 0 { -7.0 } else { 7.0 };
        tangents[6 * joint..6 * joint + 2].copy_from_slice(&[sign * v[0], sign * v[1]]);
    }
    let of = |tangents: Vec<f64>| {
        let constraints =
            Constraints { known: Some(case.known.clone()), tangents: Some(tangents), ..Constraints::default() };
        let batch = CurveBatch::from_ragged(2, case.points.clone(), vec![0, count]).unwrap();
        G1.fit(&batch.with_constraints(constraints).unwrap(), &Device::cpu()).unwrap()
    };
    // The directions of the free chain leave it what it is, of whatever length.
    let same = of(tangents.clone());
    assert_eq!(same.reports()[0].status, CurveStatus::Converged, "{:?}", same.reports()[0]);
    let off = spread(same.control_points().coords(), free.control_points().coords());
    assert!(off <= 1e-10, "{off:e}");
    // And others are kept.
    (tangents[18], tangents[19]) = (tangents[18] - 0.3 * tangents[19], tangents[19] + 0.3 * tangents[18]);
    let other = of(tangents.clone());
    assert_eq!(other.reports()[0].status, CurveStatus::Converged);
    let (_, v) = handles(&case, 3, other.control_points().points(0), 3)[1].clone().unwrap();
    assert!(
        (v[0] * tangents[19] - v[1] * tangents[18]).abs()
            <= 1e-13 * dot(&v, &v).sqrt() * tangents[18].hypot(tangents[19])
    );
    assert!(other.reports()[0].energy > free.reports()[0].energy);
    // Against the chain, the slower the better.
    let back = of(tangents.iter().map(|x| -x).collect());
    assert_eq!(back.reports()[0].status, CurveStatus::NoMinimiser);
    assert_eq!(back.degree(0), None);
    let message = back.reports()[0].message.as_ref().unwrap();
    assert!(
        message.contains("while the speed on one side of this joint goes to 0: give a handle or a tangent"),
        "{message}"
    );
}

#[test]
fn sharp_corners_have_no_least_g1_chain() {
    let back = [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [2.1, 0.2], [0.0, 0.4]].map(|p| p.to_vec());
    let triangle = [[0.0, 0.0], [2.0, 0.0], [1.0, 1.8]].map(|p| p.to_vec());
    for (joints, closed) in [(&back[..], false), (&triangle[..], true)] {
        let case = case(3, joints, closed);
        let completed = fit(&G1, &case);
        let report = &completed.reports()[0];
        assert_eq!(report.status, CurveStatus::NoMinimiser, "{report:?}");
        let message = report.message.as_ref().unwrap();
        assert!(closed || message.starts_with("curve 0, point 6: "), "{message}");
        assert!(message.contains("the energy falls while the speed on one side of this joint goes to 0"), "{message}");
        assert_eq!(completed.control_points().points(0), case.points);
        // With C1 joints there is a chain.
        assert_eq!(fit(&Chain { joints: Joints::C1, ..G1 }, &case).reports()[0].status, CurveStatus::Converged);
    }
}

#[test]
fn what_g1_joints_cannot_have_is_refused_with_a_sentence() {
    let joints = wavy(2, 4, false, 1);
    let message = |case: &Case| {
        let report = fit(&G1, case).reports()[0].clone();
        assert_eq!(report.status, CurveStatus::Invalid, "{report:?}");
        report.message.unwrap()
    };
    let mut unknown = case(3, &joints, false);
    unknown.known[3] = false;
    assert_eq!(
        message(&unknown),
        "curve 0, point 3: it is a joint and unknown, and G1 joints must be known: give it, or take C1 joints"
    );
    let mut corner = case(3, &joints, false);
    let [x, y] = [corner.points[6], corner.points[7]];
    corner.points[4..6].copy_from_slice(&[x - 1.0, y]);
    corner.points[8..10].copy_from_slice(&[x, y + 1.0]);
    (corner.known[2], corner.known[4]) = (true, true);
    let sentence = message(&corner);
    assert!(
        sentence.starts_with("curve 0, point 4: the handles and the tangent at the joint at point 3 are not G1"),
        "{sentence}"
    );
    assert!(sentence.contains("turns by 9.000e1 degrees; mark it as unknown"), "{sentence}");
    let mut still = case(3, &joints, false);
    still.points.copy_within(6..8, 4);
    still.known[2] = true;
    assert!(message(&still).contains("it gives the joint no direction: move it away from the joint"));
    let refused =
        Chain { energy: Energy::of_order(3), ..G1 }.fit(&batch(&[still]), &Device::cpu()).unwrap_err().to_string();
    assert!(refused.starts_with("∫|p‴|² alone does not determine speeds at G1 joints"), "{refused}");
    let nowhere = case(3, &vec![vec![1.0, 1.0]; 3], false);
    let report = fit(&G1, &nowhere).reports()[0].clone();
    assert_eq!(report.status, CurveStatus::Degenerate);
    assert!(report.message.unwrap().contains("all joints coincide"));
}
