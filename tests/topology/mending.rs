//! What is left to cross.

use faircurve::spline::{Natural, Smoothing, SmoothingTarget};
use faircurve::topology::{Options, Topology};
use faircurve::{CurveBatch, Device, Fit, Sampling};

use crate::{EIGHT, world};

fn natural(topology: &Topology) -> Fit {
    Natural::default().fit(topology.strokes(), &Device::cpu()).unwrap()
}

fn smoothed(topology: &Topology, lambda: f64) -> Fit {
    let smoothing = Smoothing { target: SmoothingTarget::Lambda(lambda), pin_ends: true, ..Smoothing::default() };
    smoothing.fit(topology.strokes(), &Device::cpu()).unwrap()
}

/// The area that a ring encloses.
fn area(batch: &CurveBatch, i: usize) -> f64 {
    let points = batch.points(i).as_chunks::<2>().0;
    let next = |k: usize| points[(k + 1) % points.len()];
    0.5 * (0..points.len()).map(|k| points[k][0] * next(k)[1] - next(k)[0] * points[k][1]).sum::<f64>()
}

#[test]
fn mended_maps_cross_nowhere_but_where_their_data_do() {
    let world = world();
    let topology = Topology::new(&world, &Options::of(&world)).unwrap();
    for (fit, worse) in [(natural(&topology), 10), (smoothed(&topology, 0.05), 5), (smoothed(&topology, 1.0), 0)] {
        let sampled = topology.sample(fit, EIGHT);
        let before = sampled.faults();
        assert!(before.crossings.len() >= before.of_data + worse, "{before:?}");
        let (sampled, mended) = sampled.mend(0.5);
        assert_eq!(mended.before, before.crossings.len());
        assert!(mended.left.len() <= before.of_data, "{:?}", mended.left);
        let after = sampled.faults();
        assert!(after.crossings.len() == mended.left.len() && after.misplaced.is_empty(), "{after:?}");
    }
}

#[test]
fn mending_leaves_what_does_not_cross_and_breaks_no_direction() {
    let hairpin = [[0.0, 0.0], [10.0, 0.0], [10.2, 0.1], [10.0, 0.2], [0.0, 0.2], [-5.0, 3.0], [-9.0, 0.0]];
    // A line so near that the spline runs into it.
    let beside = [[2.0, -0.3], [8.0, -0.3], [12.0, -4.0], [20.0, 0.0], [30.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&hairpin[..], &beside[..]]).unwrap();
    let topology = Topology::new(&batch, &Options::default()).unwrap();
    let fit = natural(&topology);
    let faults = topology.sample(fit.clone(), EIGHT).faults();
    assert!(!faults.crossings.is_empty() && faults.of_data == 0, "{faults:?}");
    let (mended, report) = topology.sample(fit.clone(), EIGHT).mend(0.5);
    assert!(report.left.is_empty() && report.tightened > 0, "{report:?}");
    let last = |fit: &Fit| fit.curve(1).jet(3, 0.5).point;
    assert_eq!(last(&fit), last(mended.strokes()), "far away nothing moves");
    for (i, spans) in [(0, 6), (1, 4)] {
        let curve = mended.strokes().curve(i);
        for k in 1..spans {
            let (before, after) = (curve.jet(k - 1, 1.0), curve.jet(k, 0.0));
            assert!(before.point.distance(after.point) < 1e-12, "curve {i} at {k}");
            let angle = before.first.angle_between(after.first);
            assert!(angle < 1e-6, "curve {i} turns by {angle} at {k}");
        }
    }
}

#[test]
fn rings_keep_their_share_of_area_and_islands_their_side_of_the_coast() {
    // A coast with a bay, and an island in it: smoothed, the coast runs over the island.
    let mut coast: Vec<[f64; 2]> = vec![[-20.0, -10.0], [20.0, -10.0], [20.0, 0.0], [10.0, 0.0], [3.0, 0.0]];
    coast.extend([[2.5, -2.0], [0.0, -3.0], [-2.5, -2.0], [-3.0, 0.0], [-10.0, 0.0], [-20.0, 0.0]]);
    let island = [[-0.4, -2.0], [0.4, -2.0], [0.4, -1.4], [-0.4, -1.4]];
    let batch = CurveBatch::from_slices(&[&coast[..], &island[..]]).unwrap().closed(true);
    let topology = Topology::new(&batch, &Options::default()).unwrap();
    let fit = smoothed(&topology, 60.0);
    let faults = topology.sample(fit.clone(), EIGHT).faults();
    assert_eq!(faults.misplaced, [1], "{faults:?}");
    let (mended, report) = topology.sample(fit.clone(), EIGHT).mend(0.5);
    assert!(report.misplaced > 0 && report.kept > 0 && report.left.is_empty(), "{report:?}");
    let faults = mended.faults();
    assert!(faults.misplaced.is_empty() && faults.crossings.is_empty(), "{faults:?}");
    let [before, after] = [topology.join(fit), mended.join()].map(|fit| fit.polylines(EIGHT));
    assert!(area(&before, 1) < 0.5 * area(&batch, 1) && area(&after, 1) >= 0.5 * area(&batch, 1));
}

#[test]
fn lakes_stay_inside_coasts_of_few_samples() {
    // A cape with a lake: smoothed, the coast runs below the lake, with samples far from both.
    let mut coast: Vec<[f64; 2]> = vec![[-20.0, -10.0], [20.0, -10.0], [20.0, 0.0]];
    coast.extend((3..20).rev().map(|x| [f64::from(x), 0.0]));
    coast.extend([[3.0, 3.0], [2.0, 6.0], [0.0, 7.0], [-2.0, 6.0], [-3.0, 3.0]]);
    coast.extend((-20..-2).rev().map(|x| [f64::from(x), 0.0]));
    let lake = [[-0.2, 4.4], [-0.2, 4.6], [0.2, 4.6], [0.2, 4.4]];
    let batch = CurveBatch::from_slices(&[&coast[..], &lake[..]]).unwrap().closed(true);
    let topology = Topology::new(&batch, &Options::default()).unwrap();
    for tolerance in [0.01, 0.3, 1.0, 3.0] {
        let sampled = topology.sample(smoothed(&topology, 2000.0), Sampling::Tolerance(tolerance));
        assert_eq!(sampled.faults().misplaced, [1], "tolerance {tolerance}");
        let (sampled, mended) = sampled.mend(0.0);
        assert!(mended.misplaced == 1 && mended.astray.is_empty(), "tolerance {tolerance}: {mended:?}");
        assert!(sampled.faults().misplaced.is_empty(), "tolerance {tolerance}");
    }
}

#[test]
fn crossings_of_the_data_stay_and_are_told() {
    let eight = [[0.0, 0.0], [2.0, 2.0], [4.0, 0.0], [4.0, 2.0], [2.0, 0.0], [0.0, 2.0]];
    let batch = CurveBatch::from_slices(&[&eight[..]]).unwrap().closed(true);
    let topology = Topology::new(&batch, &Options::default()).unwrap();
    let sampled = topology.sample(natural(&topology), EIGHT);
    let faults = sampled.faults();
    assert!(faults.of_data > 0);
    let (_, mended) = sampled.mend(0.0);
    assert_eq!(mended.left.len(), faults.of_data, "{mended:?}");
    assert_eq!(mended.left[0].curves, [0, 0]);
}
