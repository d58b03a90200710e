//! Chains of Béziers against dense least squares: control points, energies, what is determined and
//! what is not.

use std::slice;

use faircurve::bezier::{Chain, Energy, Joints, PieceLengths};
use faircurve::{CurveStatus, Device};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::chains::{Case, QS, batch, spread};
use crate::reference::{Reference, size};

const ENERGIES: [[f64; 3]; 5] = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.3, 1.0, 0.1], [0.0, 2.0, 0.5]];

/// Chains that have what their joints ask for, with random points unknown.
fn cases(joints: Joints, degree: usize, seed: u64) -> Vec<(Chain, Case)> {
    let mut rng = StdRng::seed_from_u64(seed);
    let mut cases = Vec::new();
    for weights in ENERGIES {
        for closed in [false, true] {
            for pieces in [1, 2, 4] {
                for lengths in [PieceLengths::Chords, PieceLengths::Equal] {
                    let chain = Chain { degree, joints, energy: Energy { weights }, lengths, corners: None };
                    let known = [rng.random_range(0.5..1.2), rng.random_range(-0.3..1.0)];
                    let dimension = rng.random_range(2..=3);
                    cases.push((chain, Case::random(&chain, dimension, pieces, closed, known, &mut rng)));
                }
            }
        }
    }
    cases
}

#[test]
fn chains_are_those_of_dense_least_squares_whatever_is_known() {
    let (mut converged, mut undetermined, mut worst) = (0, 0, 0.0f64);
    for (q, joints) in QS {
        for degree in 2 * q + 1..=7 {
            for (chain, case) in cases(joints, degree, 7 + degree as u64) {
                let reference = Reference::of(&chain, &case);
                let completed = chain.fit(&batch(slice::from_ref(&case)), &Device::cpu()).unwrap();
                let report = &completed.reports()[0];
                let place = format!("{chain:?}, {case:?}: {report:?}");
                if !reference.is_unique {
                    assert!(matches!(report.status, CurveStatus::Degenerate | CurveStatus::NotUnique), "{place}");
                    undetermined += 1;
                    if report.status == CurveStatus::NotUnique {
                        let energy = reference.energy(completed.control_points().coords());
                        assert!((energy - reference.least).abs() <= 1e-9 * reference.largest, "{place}: {energy}");
                    }
                    continue;
                }
                assert_eq!(report.status, CurveStatus::Converged, "{place}");
                converged += 1;
                let found = completed.control_points().points(0);
                let tolerance = (1e-12 * reference.condition).clamp(1e-12, 1e-7);
                let off = spread(found, &reference.points) / size(&case);
                assert!(off <= tolerance, "{place}: {off:e}, condition {:e}", reference.condition);
                worst = worst.max(off / reference.condition.max(1.0));
                let energy = reference.energy(found);
                let rounding = 1e-12 * reference.largest + 1e-9 * energy;
                assert!((report.energy - energy).abs() <= rounding, "{place}: {energy}");
                for (k, &is_known) in case.known.iter().enumerate() {
                    let own = k * case.dimension..(k + 1) * case.dimension;
                    assert!(!is_known || found[own.clone()] == case.points[own], "{place}: known point {k} moved");
                }
            }
        }
    }
    assert!(converged > 700 && undetermined > 50, "{converged}, {undetermined}");
    println!("{converged} unique, {undetermined} not; off by {worst:e} of condition");
}

#[test]
fn no_chain_with_the_same_joints_and_known_points_has_less_energy() {
    let mut rng = StdRng::seed_from_u64(5);
    for (q, joints) in QS {
        for degree in 2 * q + 1..=7 {
            for (chain, case) in cases(joints, degree, 100 + degree as u64) {
                let reference = Reference::of(&chain, &case);
                let completed = chain.fit(&batch(slice::from_ref(&case)), &Device::cpu()).unwrap();
                if !completed.reports()[0].status.is_usable() {
                    continue;
                }
                let found = completed.control_points().points(0);
                let least = reference.energy(found);
                assert!(reference.off(found) <= 1e-11 * size(&case), "{chain:?}, {case:?}: {}", reference.off(found));
                for _ in 0..3 {
                    let step = reference.feasible_step(&mut rng, 0.1 * size(&case));
                    let moved =
                        |factor: f64| -> Vec<f64> { found.iter().zip(&step).map(|(x, d)| x + factor * d).collect() };
                    let [up, down] = [1.0, -1.0].map(|factor| reference.energy(&moved(factor)));
                    let rounding = 1e-10 * (reference.largest + up);
                    assert!(up >= least - rounding && down >= least - rounding, "{chain:?}, {case:?}");
                    assert!((up - down).abs() <= 1e-6 * (up + down) + rounding, "{chain:?}, {case:?}: {up}, {down}");
                }
            }
        }
    }
}

#[test]
fn cubics_and_quartics_have_c2_joints_of_least_bending() {
    let mut rng = StdRng::seed_from_u64(11);
    for (degree, closed, clamped) in
        [(3, false, false), (3, true, false), (3, false, true), (4, false, false), (4, true, false)]
    {
        let chain = Chain { degree, joints: Joints::C2, ..Chain::default() };
        let mut case = Case::random(&Chain { joints: Joints::C1, ..chain }, 3, 6, closed, [2.0, -1.0], &mut rng);
        if clamped {
            let last = case.known.len() - 1;
            (case.known[1], case.known[last - 1]) = (true, true);
        }
        let completed = chain.fit(&batch(slice::from_ref(&case)), &Device::cpu()).unwrap();
        assert_eq!(completed.reports()[0].status, CurveStatus::Converged);
        // The reference has C2 joints as a constraint, here the condition of a minimum.
        let reference = Reference::of(&chain, &case);
        let found = completed.control_points().points(0);
        assert!(spread(found, &reference.points) <= 1e-10 * size(&case));
        assert!(reference.off(found) <= 1e-11 * size(&case));
    }
}

#[test]
fn points_within_pieces_that_nothing_determines_are_the_smallest() {
    // ∫|X‴|² of quadratic pieces is 0 whatever the middle points are.
    let chain = Chain { degree: 2, joints: Joints::Free, energy: Energy::of_order(3), ..Chain::default() };
    let case = Case {
        dimension: 2,
        closed: false,
        points: vec![1.0, 1.0, 9.0, 9.0, 3.0, 1.0, 9.0, 9.0, 3.0, 5.0],
        known: vec![true, false, true, false, true],
    };
    let completed = chain.fit(&batch(slice::from_ref(&case)), &Device::cpu()).unwrap();
    assert_eq!(completed.reports()[0].status, CurveStatus::NotUnique);
    assert_eq!(completed.control_points().points(0)[2..4], [0.0, 0.0]);
    assert_eq!(completed.reports()[0].energy, 0.0);
}
