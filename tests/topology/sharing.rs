//! What neighbours share.

use std::collections::{BTreeMap, HashMap, HashSet};

use faircurve::discrete::{Fair, Pins, bending, length};
use faircurve::scf::Smooth;
use faircurve::spline::{Natural, Smoothing, SmoothingTarget};
use faircurve::topology::{Options, Topology};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Fit, Sampling};

use crate::{EIGHT, bits, world};

type Method = (&'static str, Box<dyn Fn(&CurveBatch) -> Fit>);

/// Methods through the points, and near them.
fn methods() -> Vec<Method> {
    let smoothing = |target| {
        move |batch: &CurveBatch| {
            Smoothing { target, pin_ends: true, ..Smoothing::default() }.fit(batch, &Device::cpu()).unwrap()
        }
    };
    let fair =
        Fair { energy: bending(2.0) + length(), pins: Pins::Ends, deviation: Some(0.2.into()), ..Fair::default() };
    vec![
        ("natural", Box::new(|batch| Natural::default().fit(batch, &Device::cpu()).unwrap())),
        ("smoothing", Box::new(smoothing(SmoothingTarget::Lambda(0.05)))),
        ("deviation", Box::new(smoothing(SmoothingTarget::Deviation(0.2.into())))),
        ("tube", Box::new(smoothing(SmoothingTarget::Tube(0.2.into())))),
        ("fair", Box::new(move |batch| fair.fit(batch, &Device::cpu()).unwrap())),
        ("scf", Box::new(|batch| Smooth::default().fit(batch, &Device::cpu()).unwrap())),
    ]
}

/// Edges of the data that two rings share, by the ends' bits, and the rings.
fn shared_edges(batch: &CurveBatch) -> BTreeMap<[[u64; 2]; 2], Vec<usize>> {
    let mut edges: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for i in 0..batch.len() {
        let points = bits(batch, i);
        for k in 0..points.len() {
            let (a, b) = (points[k], points[(k + 1) % points.len()]);
            if a != b {
                edges.entry([a.min(b), a.max(b)]).or_default().push(i);
            }
        }
    }
    edges.retain(|_, rings| rings.len() > 1 && rings.iter().collect::<HashSet<_>>().len() == rings.len());
    edges
}

#[test]
fn neighbours_share_every_sample_of_their_borders_bit_for_bit() {
    let world = world();
    let topology = Topology::new(&world, &Options::of(&world)).unwrap();
    assert!(topology.shared_arcs() > 500 && topology.junctions() > 300);
    let edges = shared_edges(&world);
    assert!(edges.len() > 4_000, "{}", edges.len());
    for (method, fit) in methods() {
        let fit = topology.join(fit(topology.strokes()));
        for sampling in [EIGHT, Sampling::Spacing(0.3)] {
            let samples = fit.polylines(sampling);
            let sets: Vec<HashSet<[u64; 2]>> =
                (0..samples.len()).map(|i| bits(&samples, i).into_iter().collect()).collect();
            // A border of rings is what lies between equal samples: all of it, so that the count of
            // equal samples is that of the shared spans at least.
            let mut spans: HashMap<[usize; 2], usize> = HashMap::new();
            for rings in edges.values() {
                *spans.entry([rings[0], rings[1]]).or_default() += 1;
            }
            for ([a, b], count) in spans {
                let equal = sets[a].intersection(&sets[b]).count();
                let least = if sampling == EIGHT { 8 * count } else { 1 };
                assert!(equal >= least, "{method}: rings {a} and {b} share {count} spans, and {equal} samples");
            }
        }
    }
}

#[test]
fn curves_that_share_nothing_are_fitted_as_ever() {
    let rings = [0.0, 5.0, 11.0].map(|x| [[x, 0.0], [x + 3.0, 0.5], [x + 2.0, 2.0], [x + 0.5, 2.5]]);
    let batch = CurveBatch::from_slices(&[&rings[0][..], &rings[1][..], &rings[2][..]]).unwrap();
    for closed in [false, true] {
        let batch = batch.clone().closed(closed);
        let topology = Topology::new(&batch, &Options::default()).unwrap();
        for (method, fit) in methods() {
            let (alone, joined) = (fit(&batch), topology.join(fit(topology.strokes())));
            assert_eq!(alone.reports(), joined.reports(), "{method}");
            let [alone, joined] = [alone, joined].map(|fit| fit.polylines(EIGHT));
            let distance = alone.coords().iter().zip(joined.coords()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(alone.offsets() == joined.offsets() && distance < 1e-12, "{method}: {distance}");
        }
    }
}

#[test]
fn a_border_that_goes_straight_on_has_no_corner_and_a_free_one_may_have_one() {
    // A wavy line along x with a line that ends on it.
    let wave: Vec<[f64; 2]> = (0..9).map(|k| [f64::from(k), 0.3 * (f64::from(k) * 1.3).sin()]).collect();
    let other = [wave[4], [4.2, 1.0], [4.0, 2.0]];
    let batch = CurveBatch::from_slices(&[&wave[..=4], &wave[4..], &other[..]]).unwrap();
    let turn = |straight: f64| {
        let topology = Topology::new(&batch, &Options { straight, ..Options::default() }).unwrap();
        let fit = topology.join(Natural::default().fit(topology.strokes(), &Device::cpu()).unwrap());
        let (before, after) = (fit.curve(0).jet(3, 1.0), fit.curve(1).jet(0, 0.0));
        let point = |k: usize| fit.curve(k).jet(0, 0.0).point;
        assert_eq!((point(1), point(2)), (after.point, before.point), "all three meet");
        (
            topology.strokes().len(),
            before.first.normalize().cross(after.first.normalize()).length(),
            before.curvature(2) - after.curvature(2),
        )
    };
    let (strokes, angle, jump) = turn(Options::default().straight);
    assert!(strokes == 2 && angle < 1e-12 && jump.abs() < 1e-12, "{strokes}, {angle}, {jump}");
    let (strokes, angle, _) = turn(0.0);
    assert!(strokes == 3 && angle > 0.01, "{strokes}, {angle}");
}

#[test]
fn nearly_equal_points_are_one_within_the_distance_and_not_beyond() {
    let left = [[0.0, 0.0], [1.0, 0.0], [1.1, 0.5], [1.0, 1.0], [0.0, 1.0]];
    let right = [[1.0001, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0001], [1.1, 0.5001]];
    let batch = CurveBatch::from_slices(&[&left[..], &right[..]]).unwrap().closed(true);
    let shared = |snap: f64| Topology::new(&batch, &Options { snap, ..Options::default() }).unwrap().shared_arcs();
    assert_eq!([0.0, 1e-5, 2e-4].map(shared), [0, 0, 1]);
    let topology = Topology::new(&batch, &Options { snap: 2e-4, ..Options::default() }).unwrap();
    let fit = topology.join(Natural::default().fit(topology.strokes(), &Device::cpu()).unwrap());
    let samples = fit.polylines(EIGHT);
    let of = |i: usize| bits(&samples, i).into_iter().collect::<HashSet<_>>();
    assert_eq!(of(0).intersection(&of(1)).count(), 17);
}

#[test]
fn both_sides_of_the_antimeridian_are_one_place() {
    let east = [[178.0, 0.0], [180.0, 0.0], [180.0, 1.0], [180.0, 2.0], [178.0, 2.0]];
    let west = [[-180.0, 0.0], [-178.0, 0.0], [-178.0, 2.0], [-180.0, 2.0], [-180.0, 1.0]];
    let batch = CurveBatch::from_slices(&[&east[..], &west[..]]).unwrap().closed(true);
    let shared =
        |geographic| Topology::new(&batch, &Options { geographic, ..Options::default() }).unwrap().shared_arcs();
    assert_eq!([false, true].map(shared), [0, 1]);
    let topology = Topology::new(&batch, &Options { geographic: true, ..Options::default() }).unwrap();
    let fit = topology.join(Natural::default().fit(topology.strokes(), &Device::cpu()).unwrap());
    let samples = fit.polylines(EIGHT);
    let longitudes = |i: usize| samples.points(i).iter().step_by(2).copied().collect::<Vec<_>>();
    assert!(longitudes(0).iter().all(|x| *x > 170.0) && longitudes(1).iter().all(|x| *x < -170.0));
    let on_it = |i: usize| bits(&samples, i).into_iter().map(|[_, y]| y).collect::<HashSet<_>>();
    assert!(on_it(0).intersection(&on_it(1)).count() >= 17);
}

#[test]
fn what_cannot_be_fitted_shares_nothing_and_spoils_nothing() {
    let ring = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let bad = [[1.0, 0.0], [2.0, f64::NAN], [1.0, 1.0]];
    let point = [[1.0, 0.0]; 3];
    let batch = CurveBatch::from_slices(&[&ring[..], &bad[..], &point[..], &[]]).unwrap();
    let batch = batch.closed_each(vec![true, true, true, false]).unwrap();
    let topology = Topology::new(&batch, &Options::default()).unwrap();
    assert_eq!((topology.junctions(), topology.strokes().len()), (0, 4));
    for (method, fit) in methods() {
        let fit = topology.join(fit(topology.strokes()));
        assert!(fit.reports()[0].status.is_usable(), "{method}: {:?}", fit.reports()[0]);
        assert_eq!(fit.reports()[1].status, CurveStatus::Invalid, "{method}");
        assert!(fit.reports()[1].message.as_ref().unwrap().starts_with("curve 1, point 1: "), "{method}");
        let samples = fit.polylines(EIGHT);
        assert_eq!((samples.count(0), samples.count(1), samples.count(3)), (32, 3, 0), "{method}");
    }
}

#[test]
fn columns_of_points_are_refused_with_a_remedy() {
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0]][..]]).unwrap();
    let pinned = Constraints { pinned: Some(vec![true, false]), ..Constraints::default() };
    for batch in [batch.clone().with_weights(vec![1.0, 2.0]).unwrap(), batch.clone().with_constraints(pinned).unwrap()]
    {
        let error = Topology::new(&batch, &Options::default()).err().unwrap().to_string();
        assert!(error.contains("leave these columns out"), "{error}");
    }
    let error = Topology::new(&batch, &Options { snap: -1.0, ..Options::default() }).err().unwrap().to_string();
    assert!(error.contains("points are one is -1"), "{error}");
}

#[test]
fn pinned_points_stay_where_they_are_and_the_others_are_as_smooth_as_they_can_be() {
    let noisy = |k: i32| [f64::from(k), 0.4 * f64::from((k * 7919) % 13 - 6) / 6.0];
    let points: Vec<[f64; 2]> = (0..40).map(noisy).collect();
    let batch = CurveBatch::from_slices(&[&points[..], &points[..]]).unwrap().closed_each(vec![false, true]).unwrap();
    let pins: Vec<bool> = (0..80).map(|k| k % 40 == 13 || k % 40 == 26).collect();
    let pinned = batch.with_constraints(Constraints { pinned: Some(pins), ..Constraints::default() }).unwrap();
    for (method, fit) in methods() {
        let fit = fit(&pinned);
        for i in 0..2 {
            assert!(fit.reports()[i].status != CurveStatus::Invalid, "{method}: {:?}", fit.reports()[i]);
            for k in [13, 26] {
                let point = fit.curve(i).jet(k, 0.0).point;
                assert_eq!([point.x, point.y], points[k], "{method}, curve {i}, point {k}");
            }
        }
    }
    // A deviation that allows anything: the curve nears the spline through the pins alone.
    let wide = Smoothing { target: SmoothingTarget::Deviation(100.0.into()), pin_ends: true, ..Smoothing::default() };
    let fit = wide.fit(&pinned, &Device::cpu()).unwrap();
    let report = &fit.reports()[0];
    assert_eq!((report.status, &report.message), (CurveStatus::Converged, &None));
    let t: Vec<f64> = [0, 13, 26, 39].iter().map(|&k| fit.curve(0).knots()[k]).collect();
    let alone = CurveBatch::from_slices(&[&[points[0], points[13], points[26], points[39]][..]]).unwrap();
    let alone = Natural::default().fit(&alone.with_parameters(t).unwrap(), &Device::cpu()).unwrap();
    let distance = |k: usize| {
        let at = fit.curve(0).knots()[k];
        (fit.curve(0).jet(k.min(38), f64::from(k == 39)).point - alone.curve(0).point(at)).length()
    };
    let largest = (0..40).map(distance).fold(0.0, f64::max);
    assert!(largest < 1e-6, "{largest}");
}

#[test]
fn a_coast_without_a_curve_is_fitted_border_by_border_and_the_rest_stays_as_it_was() {
    let world = world();
    // Bending alone has no least curve for many coasts.
    let bending = Fair { energy: bending(2.0), ..Fair::default() };
    let fit = |batch: &CurveBatch| bending.fit(batch, &Device::cpu()).unwrap();
    let usable = |options: &Options| {
        let topology = Topology::new(&world, options).unwrap();
        topology.join(fit(topology.strokes())).usable()
    };
    let topology = Topology::new(&world, &Options::of(&world)).unwrap();
    let before = fit(topology.strokes());
    let divided = topology.divide(&before).expect("strokes without a curve");
    assert!(divided.count() > 10 && divided.arcs().len() > 2 * divided.count());
    let arcs = fit(divided.arcs());
    let (whole, strokes) = divided.with(before.clone(), arcs);
    assert_eq!(strokes.len(), whole.strokes().len());
    // No stroke of several arcs is left without a curve, and those with a curve keep it to the bit.
    assert!(whole.divide(&strokes).is_none());
    let lines = |fit: &Fit| {
        let samples = fit.polylines(EIGHT);
        let usable = (0..fit.len()).filter(|&i| fit.reports()[i].status.is_usable());
        usable.map(|i| bits(&samples, i)).collect::<HashSet<_>>()
    };
    assert!(lines(&strokes).is_superset(&lines(&before)));
    let rings = whole.join(strokes);
    let [divided, undivided] = [rings.usable(), topology.join(before).usable()];
    let free = usable(&Options { straight: 0.0, ..Options::of(&world) });
    println!("usable rings: {undivided}, {divided} divided, {free} with free junctions");
    assert!(divided > undivided && divided >= free);
}
