//! Chains of Béziers through points: splines, and what a batch of them comes to.

use faircurve::bezier::{Chain, Completed, Energy, Joints, PieceLengths};
use faircurve::spline::{Natural, Parametrisation};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Fit};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Curves through random points, of 2 to 40 of them.
fn data(dimension: usize, closed: bool, curves: usize, seed: u64) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(seed);
    let (mut coords, mut offsets) = (Vec::new(), vec![0]);
    for i in 0..curves {
        let count = if i == 0 { 2 + usize::from(closed) } else { rng.random_range(3..=40) };
        coords.extend((0..count * dimension).map(|_| rng.random_range(-1.0..1.0)));
        offsets.push(offsets[i] + count);
    }
    CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed_each(vec![closed; curves]).unwrap()
}

/// The same points as joints of chains, all others unknown; tangents at joints as they are.
fn chains(data: &CurveBatch, degree: usize) -> CurveBatch {
    let d = data.dimension();
    let (mut coords, mut offsets, mut known, mut tangents) = (Vec::new(), vec![0], Vec::new(), Vec::new());
    for i in 0..data.len() {
        for (k, joint) in data.points(i).chunks_exact(d).enumerate() {
            let more = if data.is_closed(i) || k + 1 < data.count(i) { degree - 1 } else { 0 };
            coords.extend_from_slice(joint);
            known.push(true);
            tangents.extend_from_slice(data.tangent(i, k).unwrap_or(&[f64::NAN; 3][..d]));
            for j in 0..more {
                coords.extend((0..d).map(|_| 100.0 + j as f64));
                known.push(false);
                tangents.extend_from_slice(&[f64::NAN; 3][..d]);
            }
        }
        offsets.push(known.len());
    }
    let tangents = data.constraints().tangents.as_ref().map(|_| tangents);
    let constraints = Constraints { known: Some(known), tangents, ..Constraints::default() };
    CurveBatch::from_ragged(d, coords, offsets)
        .and_then(|batch| batch.closed_each((0..data.len()).map(|i| data.is_closed(i)).collect()))
        .and_then(|batch| batch.with_constraints(constraints))
        .unwrap()
}

fn fit(chain: &Chain, batch: &CurveBatch) -> Completed {
    chain.fit(batch, &Device::cpu()).unwrap()
}

/// Both are the same curves: jets, knots, energies.
fn assert_same(found: Completed, wanted: &Fit, tolerance: f64) {
    let found = found.into_fit();
    for i in 0..wanted.len() {
        let (ours, theirs) = (&found.reports()[i], &wanted.reports()[i]);
        assert_eq!(ours.status, CurveStatus::Converged, "curve {i}: {ours:?}");
        let off = (ours.energy - theirs.energy).abs();
        assert!(off <= tolerance * theirs.energy.max(1.0), "curve {i}: {} and {}", ours.energy, theirs.energy);
        let (ours, theirs) = (found.curve(i), wanted.curve(i));
        assert_eq!(ours.spans(), theirs.spans());
        for (a, b) in ours.knots().iter().zip(theirs.knots().iter()) {
            assert!((a - b).abs() <= 1e-13 * (1.0 + b), "curve {i}: knots {a} and {b}");
        }
        let knots = theirs.knots();
        for span in 0..theirs.spans() {
            let h = knots[span + 1] - knots[span];
            for u in [0.0, 0.3, 0.5, 1.0] {
                let (a, b) = (ours.jet(span, u), theirs.jet(span, u));
                let off = (a.point - b.point).length().max(h * (a.first - b.first).length());
                let off = off.max(h * h * (a.second - b.second).length());
                assert!(off <= tolerance, "curve {i}, span {span}, {u}: off by {off:e}");
            }
        }
    }
}

/// Natural splines whose parameters are lengths of chords, as those of chains are.
fn by_chords() -> Natural {
    Natural { parametrisation: Parametrisation::ChordLength, ..Natural::default() }
}

#[test]
fn chains_through_known_joints_are_natural_and_periodic_cubic_splines() {
    for (dimension, closed) in [(2, false), (3, false), (2, true), (3, true)] {
        let data = data(dimension, closed, 20, 1);
        let splines = by_chords().fit(&data, &Device::cpu()).unwrap();
        for (degree, joints) in
            [(3, Joints::C1), (3, Joints::C2), (4, Joints::C2), (5, Joints::C1), (5, Joints::C2), (7, Joints::C2)]
        {
            let chain = Chain { degree, joints, ..Chain::default() };
            assert_same(fit(&chain, &chains(&data, degree)), &splines, if degree < 5 { 1e-12 } else { 5e-12 });
        }
    }
}

#[test]
fn chains_of_higher_degree_are_the_cubics_elevated() {
    let data = data(2, false, 10, 2);
    let cubics = fit(&Chain { joints: Joints::C2, ..Chain::default() }, &chains(&data, 3));
    for degree in [4, 5, 7] {
        let chain = Chain { degree, joints: Joints::C2, ..Chain::default() };
        let found = fit(&chain, &chains(&data, degree));
        let wanted = cubics.clone().elevate(degree - 3, &Device::cpu()).unwrap();
        assert_eq!(found.control_points().offsets(), wanted.control_points().offsets());
        let off = found.control_points().coords().iter().zip(wanted.control_points().coords());
        let off = off.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        assert!(off <= 1e-12, "degree {degree}: {off:e}");
    }
}

#[test]
fn tangents_at_the_ends_make_clamped_splines() {
    let mut rng = StdRng::seed_from_u64(3);
    for dimension in [2, 3] {
        let data = data(dimension, false, 12, 3);
        let mut tangents = vec![f64::NAN; data.coords().len()];
        for i in 0..data.len() {
            // At the start, at the end, or at both.
            for k in [0, data.count(i) - 1].into_iter().enumerate().filter(|(end, _)| i % 3 != *end).map(|(_, k)| k) {
                let at = (data.offsets()[i] + k) * dimension;
                tangents[at..at + dimension].fill_with(|| rng.random_range(-2.0..2.0));
            }
        }
        let data = data.with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() }).unwrap();
        let splines = by_chords().fit(&data, &Device::cpu()).unwrap();
        for (degree, joints) in [(3, Joints::C1), (3, Joints::C2), (5, Joints::C2)] {
            let chain = Chain { degree, joints, ..Chain::default() };
            assert_same(fit(&chain, &chains(&data, degree)), &splines, 5e-12);
        }
    }
}

#[test]
fn joints_are_as_smooth_as_asked_for() {
    let data = data(3, true, 10, 4);
    for (degree, joints, q) in
        [(3, Joints::C1, 1), (4, Joints::C1, 1), (3, Joints::C2, 2), (5, Joints::C2, 2), (8, Joints::C2, 2)]
    {
        for weights in [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1.0, 0.2]] {
            if joints == Joints::C2 && degree < 5 && weights != [0.0, 1.0, 0.0] {
                continue;
            }
            let chain = Chain { degree, joints, energy: Energy { weights }, ..Chain::default() };
            let fit = fit(&chain, &chains(&data, degree)).into_fit();
            for (curve, report) in &fit {
                assert_eq!(report.status, CurveStatus::Converged, "{chain:?}: {report:?}");
                let knots = curve.knots();
                for span in 0..curve.spans() {
                    let next = (span + 1) % curve.spans();
                    let (a, b) = (curve.jet(span, 1.0), curve.jet(next, 0.0));
                    let h = (knots[span + 1] - knots[span]).min(knots[next + 1] - knots[next]);
                    assert!((a.point - b.point).length() <= 1e-14);
                    assert!(h * (a.first - b.first).length() <= 1e-12, "{chain:?}");
                    assert!(q < 2 || h * h * (a.second - b.second).length() <= 1e-11, "{chain:?}");
                }
            }
        }
    }
}

#[test]
fn a_thousand_chains_in_one_call_have_the_bits_of_each_alone() {
    let data = data(2, false, 1500, 5);
    for joints in [Joints::Free, Joints::C1, Joints::C2, Joints::G1] {
        let chain = Chain { degree: if joints == Joints::C2 { 5 } else { 3 }, joints, ..Chain::default() };
        let batch = chains(&data, chain.degree);
        let all = fit(&chain, &batch);
        for i in (0..batch.len()).step_by(37) {
            let alone = fit(&chain, &batch.select(&[i]));
            assert_eq!(alone.control_points().points(0), all.control_points().points(i));
            assert_eq!(alone.reports()[0].energy.to_bits(), all.reports()[i].energy.to_bits());
            assert_eq!(alone.reports()[0].status, all.reports()[i].status);
        }
    }
}

#[test]
fn a_bad_curve_says_why_and_leaves_its_neighbours_alone() {
    let good: Vec<[f64; 2]> = (0..7).map(|k| [f64::from(k), f64::from(k * k % 5)]).collect();
    let mut bad = vec![good.clone(); 8];
    bad[1].pop();
    bad[2].clear();
    bad[4][2][1] = f64::NAN;
    // The handles around joint 3 that are known are not C1.
    bad[5][2] = [2.0, 9.0];
    bad[6][1] = [1e300, 1e300];
    let known = |i: usize, k: usize| match i {
        4 => true,
        5 => k.is_multiple_of(3) || k == 2 || k == 4,
        6 => k.is_multiple_of(3) || k == 1,
        7 => k == 3,
        _ => k.is_multiple_of(3),
    };
    let slices: Vec<&[[f64; 2]]> = bad.iter().map(Vec::as_slice).collect();
    let flags = bad.iter().enumerate().flat_map(|(i, curve)| (0..curve.len()).map(move |k| known(i, k))).collect();
    let count: usize = bad.iter().map(Vec::len).sum();
    let mut tangents = vec![f64::NAN; 2 * count];
    // Point 1 of curve 3, no joint.
    tangents[2 * (7 + 6 + 1)..2 * (7 + 6 + 2)].fill(1.0);
    let constraints = Constraints { known: Some(flags), tangents: Some(tangents), ..Constraints::default() };
    let batch = CurveBatch::from_slices(&slices).unwrap().with_constraints(constraints).unwrap();
    let completed = fit(&Chain::default(), &batch);
    let alone = fit(&Chain::default(), &batch.select(&[0]));
    assert_eq!(completed.control_points().points(0), alone.control_points().points(0));
    assert_eq!(completed.reports()[0], alone.reports()[0]);
    let wanted = [
        (
            1,
            CurveStatus::Invalid,
            "curve 1, point 5: 6 control points make no chain of degree 3: an open one has 3 n + 1, n pieces",
        ),
        (2, CurveStatus::Degenerate, "curve 2, point 0: a chain has 4 control points at least: give some"),
        (
            3,
            CurveStatus::Invalid,
            "curve 3, point 1: it has a tangent, but is no joint, as only points with numbers 3 n are: leave",
        ),
        (4, CurveStatus::Invalid, "curve 4, point 2: y is NaN; every coordinate must be a finite number"),
        (
            5,
            CurveStatus::Invalid,
            "curve 5, point 4: the known control points and the tangent around the joint at point 3 are not C1",
        ),
        (6, CurveStatus::Invalid, "curve 6, point 0: the completed control points overflow"),
        (
            7,
            CurveStatus::Degenerate,
            "curve 7, point 0: the energy does not determine the chain from 1 known control points: give more",
        ),
    ];
    for (i, status, sentence) in wanted {
        let report = &completed.reports()[i];
        let message = report.message.as_deref().unwrap_or("none");
        assert_eq!(report.status, status, "{message}");
        assert!(message.starts_with(sentence), "{message}");
        assert!(report.energy.is_nan() && completed.degree(i).is_none());
        let same = completed.control_points().points(i).iter().zip(batch.points(i));
        assert!(same.clone().all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

#[test]
fn chains_that_are_known_have_their_energy_and_what_is_not_smooth_is_refused() {
    let chain = Chain { joints: Joints::C2, ..Chain::default() };
    let data = data(2, false, 5, 6);
    let splines = fit(&chain, &chains(&data, 3));
    for joints in [Joints::Free, Joints::C1, Joints::C2, Joints::G1] {
        let again = fit(&Chain { joints, ..chain }, splines.control_points());
        assert_eq!(again.control_points().coords(), splines.control_points().coords());
        for (a, b) in again.reports().iter().zip(splines.reports()) {
            assert_eq!(a.status, CurveStatus::Converged, "{joints:?}: {a:?}");
            assert!((a.energy - b.energy).abs() <= 1e-12 * b.energy.max(1.0), "{} {}", a.energy, b.energy);
        }
    }
    // Three handles of one line, one of which is too long for p″.
    let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [3.0, 1.0], [4.0, 1.0], [5.0, 5.0], [6.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    assert_eq!(
        fit(&Chain { lengths: PieceLengths::Equal, ..Chain::default() }, &batch).reports()[0].status,
        CurveStatus::Converged
    );
    let report = fit(&Chain { lengths: PieceLengths::Equal, ..chain }, &batch).reports()[0].clone();
    assert_eq!(report.status, CurveStatus::Invalid);
    let message = report.message.unwrap();
    assert!(message.starts_with("curve 0, point 3: all control points are known, but p″ jumps here by "), "{message}");
}

#[test]
fn c2_cubics_have_no_freedom_for_handles_and_tangents_inside() {
    let chain = Chain { joints: Joints::C2, ..Chain::default() };
    let points: Vec<[f64; 2]> = (0..10).map(|k| [f64::from(k), f64::from(k * k % 7)]).collect();
    let of = |handle: usize, tangent: Option<usize>| {
        let known = (0..10).map(|k| k % 3 == 0 || k == handle).collect();
        let mut tangents = vec![f64::NAN; 20];
        tangent.into_iter().for_each(|k| tangents[2 * k..2 * k + 2].fill(1.0));
        let constraints = Constraints { known: Some(known), tangents: Some(tangents), ..Constraints::default() };
        let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().with_constraints(constraints).unwrap();
        fit(&chain, &batch).reports()[0].clone()
    };
    for (handle, tangent) in [(1, None), (8, None), (0, Some(0)), (1, Some(9))] {
        assert_eq!(of(handle, tangent).status, CurveStatus::Converged);
    }
    let message = of(4, None).message.unwrap();
    assert!(
        message.starts_with("curve 0, point 4: it is known, but C2 pieces of degree 3 have no freedom"),
        "{message}"
    );
    assert!(message.ends_with("mark it as unknown, give degree 5 or more, or take C1 joints"), "{message}");
    let message = of(0, Some(3)).message.unwrap();
    assert!(
        message.starts_with("curve 0, point 3: it has a tangent, but C2 joints of pieces of degree 3"),
        "{message}"
    );
}

#[test]
fn chains_that_no_degree_has_are_refused_with_the_remedy() {
    let batch = chains(&data(2, false, 1, 7), 3);
    let refused = |degree: usize, joints: Joints, weights: [f64; 3]| {
        let chain = Chain { degree, joints, energy: Energy { weights }, ..Chain::default() };
        chain.fit(&batch, &Device::cpu()).unwrap_err().to_string()
    };
    let bending = [0.0, 1.0, 0.0];
    assert_eq!(refused(0, Joints::Free, bending), "the degree of the pieces of a chain is 0; 1 to 30 are possible");
    assert!(refused(31, Joints::Free, bending).contains("is 31; 1 to 30"));
    let low = "pieces of degree 2 have no freedom for joints C1: give degree 3 or more, or take free joints";
    assert_eq!(refused(2, Joints::C1, bending), low);
    assert!(refused(1, Joints::G1, bending).contains("joints G1: give degree 3"));
    assert!(refused(2, Joints::C2, bending).contains("give degree 5 or more (3 and 4 serve for bending alone)"));
    assert!(refused(3, Joints::C2, [0.1, 1.0, 0.0]).contains("or take C1 joints"));
    assert!(refused(3, Joints::C1, [0.0; 3]).contains("all weights of the energy are 0"));
}
