//! Splines in surfaces with velocities that are given at their ends.

use std::sync::Arc;

use faircurve::spline::{Ends, Natural, SmoothingTarget, SurfaceSpline};
use faircurve::surface::{Globe, HeightField, Quadric, Surface, Torus};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Sampling};
use glam::{DQuat, DVec2, DVec3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::in_surface::{fit, go_on, timed, unit_sphere};

const FREE: DVec3 = DVec3::NAN;

/// A batch with tangents at the first and the last point of every curve, free where they are NaN.
fn with_ends(batch: CurveBatch, ends: &[[DVec3; 2]]) -> CurveBatch {
    let d = batch.dimension();
    let mut tangents = vec![f64::NAN; batch.coords().len()];
    for (i, ends) in ends.iter().enumerate() {
        let [first, last] = [batch.offsets()[i], batch.offsets()[i + 1] - 1];
        for (k, end) in [first, last].into_iter().zip(ends) {
            tangents[d * k..d * (k + 1)].copy_from_slice(&end.to_array()[..d]);
        }
    }
    batch.with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() }).unwrap()
}

fn on_globe(points: &[[f64; 2]], t: &[f64]) -> CurveBatch {
    CurveBatch::from_slices(&[points]).unwrap().with_parameters(t.to_vec()).unwrap()
}

#[test]
fn splines_in_a_plane_are_natural_ones_with_the_same_ends() {
    let seed = 11;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let normal = DVec3::new(1.0, 2.0, 2.0) / 3.0;
    let plane: Arc<dyn Surface> = Arc::new(Quadric::plane(normal, 0.3));
    let tilt = DQuat::from_rotation_arc(DVec3::Z, normal);
    let mut flat = || tilt * DVec3::new(rng.random_range(-2.0..2.0), rng.random_range(-2.0..2.0), 0.0);
    let t = [0.0, 0.5, 2.0, 2.1, 3.0, 4.5];
    let mut worst: f64 = 0.0;
    for ends in [Ends::Auto, Ends::Clamped] {
        for own in [[flat(), flat()], [flat(), FREE], [FREE, flat()]] {
            if ends == Ends::Clamped && !(own[0] + own[1]).is_finite() {
                continue;
            }
            let points: Vec<DVec3> = (0..6).map(|_| flat() + 0.3 * normal).collect();
            let given = with_ends(timed(&points, &t), &[own]);
            // What stands across does not count.
            let tilted = with_ends(timed(&points, &t), &[own.map(|v| v + 5.0 * normal)]);
            let natural = Natural { ends, ..Natural::default() }.fit(&given, &Device::cpu()).unwrap();
            let spline = SurfaceSpline { ends, parts: 3, ..SurfaceSpline::new(plane.clone()) };
            for batch in [given, tilted] {
                let found = fit(&spline, &batch);
                let (curve, wanted) = (found.curve(0), natural.curve(0));
                for t in (0..=45).map(|k| 0.1 * f64::from(k)) {
                    worst = worst.max(curve.point(t).distance(wanted.point(t)));
                }
                let energies = [found.reports()[0].energy, natural.reports()[0].energy];
                assert!((energies[0] / energies[1] - 1.0).abs() < 1e-10, "{energies:?}");
            }
        }
    }
    println!("away {worst:e}");
    assert!(worst < 1e-11, "{worst:e}");
}

/// A great circle that is run along by θ(t), a cubic: its covariant acceleration θ″ is linear in t.
#[test]
fn great_circles_of_any_cubic_pace_are_found_to_order_four_by_their_velocities() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
    let angle = |t: f64| 0.3 * t + 0.5 * t * t - 0.15 * t * t * t;
    let pace = |t: f64| 0.3 + t - 0.45 * t * t;
    let place = |t: f64| turn * DVec3::new(angle(t).cos(), angle(t).sin(), 0.0);
    let velocity = |t: f64| turn * (pace(t) * DVec3::new(-angle(t).sin(), angle(t).cos(), 0.0));
    let t = [0.0, 0.4, 1.3, 2.0];
    let open = timed(&t.map(place), &t);
    let clamped = with_ends(open.clone(), &[[velocity(0.0), velocity(2.0)]]);
    let away = |parts: usize, batch: &CurveBatch| {
        let found = fit(&SurfaceSpline { parts, ..SurfaceSpline::new(unit_sphere()) }, batch);
        let curve = found.curve(0);
        (0..=40).map(|k| 0.05 * f64::from(k)).map(|t| curve.point(t).distance(place(t))).fold(0.0, f64::max)
    };
    let errors = [4, 8, 16].map(|parts| away(parts, &clamped));
    let natural = away(16, &open);
    println!("errors {errors:?}, with natural ends {natural}");
    assert!(errors[0] / errors[1] > 13.0 && errors[1] / errors[2] > 13.0 && errors[2] < 1e-7, "{errors:?}");
    assert!(natural > 0.01, "{natural}");
}

#[test]
fn two_points_and_two_velocities_make_a_riemannian_cubic() {
    let start = [DVec3::X, DVec3::new(0.0, 0.7, 0.2), DVec3::new(0.0, -0.5, 0.6), DVec3::new(0.0, 0.4, -0.9)];
    let [end, last, ..] = go_on(start, 1.2);
    let batch = with_ends(timed(&[start[0], end], &[0.0, 1.2]), &[[start[1], last]]);
    let mut errors = Vec::new();
    for parts in [4, 8, 16] {
        let spline = SurfaceSpline { ends: Ends::Clamped, parts, ..SurfaceSpline::new(unit_sphere()) };
        let found = fit(&spline, &batch);
        let curve = found.curve(0);
        let at = |k: i32| 0.1 * f64::from(k);
        errors.push((0..=12).map(|k| curve.point(at(k)).distance(go_on(start, at(k))[0])).fold(0.0, f64::max));
        assert!(curve.jet(0, 0.0).first.distance(start[1]) < 1e-14 && curve.jet(0, 1.0).first.distance(last) < 1e-13);
    }
    println!("errors {errors:?}");
    assert!(errors[0] / errors[1] > 13.0 && errors[1] / errors[2] > 13.0 && errors[2] < 1e-6, "{errors:?}");
}

#[test]
fn tracks_and_velocities_turned_by_any_rotation_are_the_turned_tracks() {
    let seed = 12;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let globe = Globe::sphere(1.0).unwrap();
    let spline = SurfaceSpline { ends: Ends::Clamped, ..SurfaceSpline::new(Arc::new(globe)) };
    // λ = atan2(y, x) and φ = asin z of a motion.
    let rates = |x: DVec3, v: DVec3| {
        let square = x.x * x.x + x.y * x.y;
        [(x.x * v.y - x.y * v.x) / square, v.z / square.sqrt()].map(f64::to_degrees)
    };
    let mut worst: f64 = 0.0;
    for _ in 0..20 {
        let mut places = vec![DVec3::X];
        let mut times = vec![0.0];
        for k in 0..5 {
            let aside = DVec3::new(rng.random_range(-1.0..1.0), 0.7, rng.random_range(-1.0..1.0));
            places.push((places[k] + 0.4 * aside).normalize());
            times.push(times[k] + rng.random_range(0.5..2.0));
        }
        let velocities = [places[0], places[5]].map(|x| {
            let v = DVec3::new(rng.random_range(-0.5..0.5), 0.3, rng.random_range(-0.5..0.5));
            v - v.dot(x) * x
        });
        let fitted = |turn: DQuat| -> Vec<DVec3> {
            let points: Vec<[f64; 2]> = places.iter().map(|place| globe.angles(turn * *place)).collect();
            let of = |k: usize, v: DVec3| DVec2::from(rates(turn * places[k], turn * v)).extend(0.0);
            let ends = [of(0, velocities[0]), of(5, velocities[1])];
            let found = fit(&spline, &with_ends(on_globe(&points, &times), &[ends]));
            let samples = found.polylines(Sampling::PerSpan(8));
            samples.points(0).chunks_exact(2).map(|point| globe.place(point[0], point[1])).collect()
        };
        let own = fitted(DQuat::IDENTITY);
        let over_pole = DQuat::from_rotation_arc(places[3], DVec3::Z);
        let over_line = DQuat::from_rotation_z(std::f64::consts::PI - places[3].y.atan2(places[3].x));
        for turn in [over_pole, over_line, DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 2.0)] {
            let there = fitted(turn);
            worst = own.iter().zip(&there).map(|(a, b)| (turn * *a).distance(*b)).fold(worst, f64::max);
        }
    }
    println!("away {worst:e}");
    assert!(worst < 1e-9, "{worst:e}");
}

#[test]
fn velocities_at_ends_are_met_in_degrees_of_every_globe_and_in_heights() {
    let points = [[10.0, 50.0, 100.0], [12.0, 51.0, 300.0], [13.0, 53.0, 250.0], [11.0, 54.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(vec![0.0, 1.0, 3.0, 4.0]).unwrap();
    let [from, to] = [DVec3::new(0.4, -1.0, 120.0), DVec3::new(-2.5, 0.3, -60.0)];
    for globe in [Globe::WGS84, Globe { equatorial: 2.0, polar: 3.0 }] {
        for (own, spans) in [([from, to], vec![(0, 0.0, from), (2, 1.0, to)]), ([FREE, to], vec![(2, 1.0, to)])] {
            let found = fit(&SurfaceSpline::new(Arc::new(globe)), &with_ends(batch.clone(), &[own]));
            for (span, u, wanted) in spans {
                let first = found.curve(0).jet(span, u).first;
                assert!(first.distance(wanted) < 1e-11 * wanted.length(), "{first} {wanted}");
            }
        }
    }
}

#[test]
fn planar_velocities_over_terrain_rise_with_it() {
    let place = |k: usize| [(k % 9) as f64, (k / 9) as f64];
    let heights = (0..81).map(place).map(|[x, y]| (0.8 * x).sin() * (0.5 * y).cos()).collect();
    let terrain = HeightField::new([9, 9], heights).unwrap();
    let points = [[1.2, 1.1], [3.0, 4.5], [6.8, 5.9]];
    let [from, to] = [DVec3::new(2.0, -1.0, 0.0), DVec3::new(0.5, 3.0, 0.0)];
    let batch = with_ends(on_globe(&points, &[0.0, 1.0, 2.0]), &[[from, to]]);
    let found = fit(&SurfaceSpline::new(Arc::new(terrain.clone())), &batch);
    for (span, u, wanted) in [(0, 0.0, from), (1, 1.0, to)] {
        let jet = found.curve(0).jet(span, u);
        let h = 1e-5;
        let along = |h: f64| terrain.height(jet.point.x + h * wanted.x, jet.point.y + h * wanted.y);
        let rise = (along(h) - along(-h)) / (2.0 * h);
        assert!(jet.first.distance(wanted.with_z(rise)) < 1e-8, "{} {rise}", jet.first);
    }
}

/// For every knot but the ends w (x − p) + λ [x‴] = 0, where [x‴] is the jump of the third derivative.
#[test]
fn smoothed_splines_with_velocities_at_ends_are_the_least() {
    let plane: Arc<dyn Surface> = Arc::new(Quadric::plane(DVec3::Z, 0.0));
    let t = [0.0, 0.5, 2.0, 2.3, 3.0, 4.5];
    let points =
        [(0.0, 0.0), (1.0, 0.8), (2.0, -0.5), (2.4, 0.6), (3.1, 0.2), (4.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
    let [from, to] = [DVec3::new(1.0, -2.0, 0.0), DVec3::new(0.3, 0.9, 0.0)];
    let lambda = 0.07;
    let spline =
        SurfaceSpline { smoothing: Some(SmoothingTarget::Lambda(lambda)), pin_ends: true, ..SurfaceSpline::new(plane) };
    let found = fit(&spline, &with_ends(timed(&points, &t), &[[from, to]]));
    let curve = found.curve(0);
    assert!(curve.jet(0, 0.0).first.distance(from) < 1e-12 && curve.jet(4, 1.0).first.distance(to) < 1e-12);
    assert_eq!([curve.point(0.0), curve.point(4.5)], [points[0], points[5]]);
    for (k, point) in points.into_iter().enumerate().take(5).skip(1) {
        let [before, after] = [curve.jet(k - 1, 1.0), curve.jet(k, 0.0)];
        let jump = lambda * (after.third - before.third);
        let pull = after.point - point;
        assert!(pull.length() > 1e-3 && (pull + jump).length() < 1e-10, "{k}: {pull} {jump}");
    }
}

#[test]
fn any_velocities_have_splines_that_converge() {
    let seed = 13;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let torus = Torus::new(2.0, 1.0).unwrap();
    let on = |u: f64, v: f64| [(2.0 + u.cos()) * v.cos(), (2.0 + u.cos()) * v.sin(), u.sin()];
    let points: Vec<[f64; 3]> = (0..5).map(|k| on(0.5 * f64::from(k), 0.3 * f64::from(k))).collect();
    let count = 200;
    let lists = vec![&points[..]; count];
    let mut vector = |size: f64| size * DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
    let ends: Vec<[DVec3; 2]> = (0..count).map(|k| [vector(k as f64 / 10.0), vector(k as f64 / 10.0)]).collect();
    let batch =
        CurveBatch::from_slices(&lists).unwrap().with_parameters([0.0, 1.0, 2.0, 3.0, 4.0].repeat(count)).unwrap();
    let found = SurfaceSpline::new(Arc::new(torus)).fit(&with_ends(batch, &ends), &Device::cpu()).unwrap();
    let converged = found.reports().iter().filter(|report| report.status == CurveStatus::Converged).count();
    let most = found.reports().iter().map(|report| report.iterations).max();
    println!("{converged} of {count} converged, iterations {most:?}");
    assert_eq!(converged, count);
}

#[test]
fn velocities_that_are_none_are_refused_and_leave_their_neighbours_bits() {
    let points = [DVec3::X, DVec3::new(0.6, 0.8, 0.0), DVec3::Y];
    let good = [DVec3::new(0.0, 1.0, 0.5), FREE];
    let cases: [([DVec3; 2], &str); 6] = [
        (good, ""),
        ([DVec3::new(0.0, f64::INFINITY, 0.0), FREE], "its tangent is [0.0, inf, 0.0]: give finite numbers"),
        ([FREE, DVec3::new(1.0, f64::NAN, 0.0)], "its tangent is [1.0, NaN, 0.0]: give finite numbers"),
        (
            [DVec3::new(-3.0, 0.0, 0.0), FREE],
            "its tangent [-3.0, 0.0, 0.0] stands across the sphere of radius 1: give one",
        ),
        ([DVec3::ZERO, FREE], ""),
        (good, ""),
    ];
    let list: Vec<[f64; 3]> = points.iter().map(|point| point.to_array()).collect();
    let lists = vec![&list[..]; cases.len()];
    let batch = CurveBatch::from_slices(&lists).unwrap().with_parameters([0.0, 1.0, 2.0].repeat(cases.len())).unwrap();
    let batch = with_ends(batch, &cases.map(|(ends, _)| ends));
    let spline = SurfaceSpline::new(unit_sphere());
    let found = spline.fit(&batch, &Device::cpu()).unwrap();
    for (report, (_, sentence)) in found.reports().iter().zip(cases) {
        let message = report.message.clone().unwrap_or_default();
        let status = if sentence.is_empty() { CurveStatus::Converged } else { CurveStatus::Invalid };
        assert!(report.status == status && message.contains(sentence), "{report:?}");
    }
    let alone = fit(&spline, &with_ends(timed(&points, &[0.0, 1.0, 2.0]), &[good]));
    let (samples, own) = (found.polylines(Sampling::PerSpan(4)), alone.polylines(Sampling::PerSpan(4)));
    assert!([0, 5].iter().all(|&i| samples.points(i) == own.points(0)));
    // A start at rest.
    assert!(found.curve(4).jet(0, 0.0).first.length() < 1e-14);
}

#[test]
fn tangents_that_cannot_be_met_are_refused_with_a_sentence() {
    let points = [DVec3::X, DVec3::new(0.6, 0.8, 0.0), DVec3::Y];
    let batch = timed(&points, &[0.0, 1.0, 2.0]);
    let clamped = with_ends(batch.clone(), &[[DVec3::Y, -DVec3::X]]);
    let mut inner = vec![f64::NAN; 9];
    inner[3..6].copy_from_slice(&[-0.8, 0.6, 0.0]);
    let inner = Constraints { tangents: Some(inner), ..Constraints::default() };
    let spline = SurfaceSpline::new(unit_sphere());
    let smooth = SurfaceSpline { smoothing: Some(SmoothingTarget::Lambda(0.1)), ..spline.clone() };
    for (spline, batch, what) in [
        (&spline, batch.clone().with_constraints(inner).unwrap(), "at its two ends only"),
        (&spline, clamped.clone().closed_each(vec![true]).unwrap(), "a closed spline is periodic"),
        (&SurfaceSpline { ends: Ends::Natural, ..spline.clone() }, clamped.clone(), "natural ends leave no room"),
        (&SurfaceSpline { ends: Ends::Clamped, ..spline.clone() }, batch, "clamped ends need a tangent here"),
        (&smooth, clamped.clone(), "it has a tangent, and smoothing moves it: pin the ends"),
    ] {
        let report = spline.fit(&batch, &Device::cpu()).unwrap().reports()[0].clone();
        assert_eq!(report.status, CurveStatus::Invalid, "{what}");
        assert!(report.message.as_ref().unwrap().contains(what), "{report:?}");
    }
    let pinned = Constraints { pinned: Some(vec![true, false, true]), ..clamped.constraints().clone() };
    fit(&smooth, &clamped.with_constraints(pinned).unwrap());
    let heights = CurveBatch::from_slices(&[&[[10.0, 50.0, 1.0], [11.0, 51.0, 2.0]][..]]).unwrap();
    let on_globe = SurfaceSpline { surface: Arc::new(Globe::WGS84), ..smooth };
    let refused = on_globe.fit(&with_ends(heights, &[[DVec3::ONE, FREE]]), &Device::cpu());
    let error = refused.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("smoothing splines of heights have natural ends"), "{error}");
}
