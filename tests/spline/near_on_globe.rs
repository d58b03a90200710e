//! Smoothing splines within a distance of their points on a globe.

use std::sync::Arc;

use faircurve::spline::{SmoothingTarget, SurfaceSpline};
use faircurve::surface::Globe;
use faircurve::{CurveBatch, CurveStatus, Deviation, Device, Sampling};
use glam::{DQuat, DVec3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::in_surface::fit;

/// A target for a distance.
type Near = fn(f64) -> SmoothingTarget;

const TARGETS: [Near; 2] = [|d| SmoothingTarget::Tube(d.into()), |d| SmoothingTarget::Deviation(d.into())];

fn spline(globe: Globe, target: SmoothingTarget) -> SurfaceSpline {
    SurfaceSpline { smoothing: Some(target), ..SurfaceSpline::new(Arc::new(globe)) }
}

/// A noisy walk of 60 points from a place, in steps of this length.
fn walk(seed: u64, step: f64) -> Vec<DVec3> {
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let mut at = DVec3::X;
    let mut noise = |size: f64| size * DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
    let mut way = DVec3::Y;
    let mut walk = Vec::new();
    for _ in 0..60 {
        way = (way + noise(0.4)).reject_from(at).normalize();
        at = (at + step * way).normalize();
        walk.push((at + noise(0.1 * step)).normalize());
    }
    walk
}

#[test]
fn tracks_within_metres_keep_them_everywhere_on_the_earth() {
    for (step, distance) in [(1e-6, 3.0), (1e-4, 100.0), (3e-3, 2e3), (0.03, 4e4)] {
        let walk = walk(5, step);
        let turns = [DQuat::IDENTITY, DQuat::from_rotation_y(-1.2), DQuat::from_rotation_arc(walk[30], DVec3::Z)];
        for turn in turns.into_iter().chain([DQuat::from_rotation_z(std::f64::consts::PI)]) {
            let points: Vec<[f64; 2]> = walk.iter().map(|place| Globe::WGS84.angles(turn * *place)).collect();
            let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
            let batch = batch.with_parameters((0..60).map(|k| f64::from(k * k)).collect()).unwrap();
            for target in TARGETS {
                let found = fit(&spline(Globe::WGS84, target(distance)), &batch);
                let samples = found.polylines(Sampling::PerSpan(1));
                let places = samples.points(0).chunks_exact(2).zip(&points);
                let away = places.map(|(a, b)| Globe::WGS84.place(a[0], a[1]).distance(Globe::WGS84.place(b[0], b[1])));
                let farthest = away.fold(0.0, f64::max);
                let report = &found.reports()[0];
                assert!(farthest <= distance * (1.0 + 1e-9) + 1e-8, "{farthest} {distance}");
                assert!((farthest - report.max_deviation).abs() < 1e-6 * distance, "{farthest} {report:?}");
                // It is used, and lengths are shorter than through all points.
                assert!(farthest > 0.98 * distance, "{farthest} of {distance}");
            }
        }
    }
}

#[test]
fn near_tracks_turned_by_any_rotation_are_the_turned_tracks() {
    let (globe, walk) = (Globe::sphere(1.0).unwrap(), walk(7, 0.02));
    for target in TARGETS {
        let fitted = |turn: DQuat| -> Vec<DVec3> {
            let points: Vec<[f64; 2]> = walk.iter().map(|place| globe.angles(turn * *place)).collect();
            let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
            let batch = batch.with_parameters((0..60).map(f64::from).collect()).unwrap();
            let found = fit(&spline(globe, target(5e-3)), &batch).polylines(Sampling::PerSpan(4));
            found.points(0).chunks_exact(2).map(|point| globe.place(point[0], point[1])).collect()
        };
        let own = fitted(DQuat::IDENTITY);
        for turn in
            [DQuat::from_rotation_arc(walk[20], DVec3::Z), DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 2.0)]
        {
            let there = fitted(turn);
            let away = own.iter().zip(&there).map(|(a, b)| (turn * *a).distance(*b)).fold(0.0, f64::max);
            // The programme ends within 1e-8 of the least energy.
            assert!(away < 1e-6, "{away:e}");
        }
    }
}

#[test]
fn a_noisy_great_circle_is_one_again_at_even_speed() {
    let globe = Globe::sphere(6_371_000.0).unwrap();
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0);
    let place = |k: i32, side: f64| {
        let (sin, cos) = (0.01 * f64::from(k)).sin_cos();
        globe.angles(turn * DVec3::new(cos, sin, side))
    };
    let points: Vec<[f64; 2]> = (0..40).map(|k| place(k, 1e-5 * f64::from(k * k % 7 - 3))).collect();
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let batch = batch.with_parameters((0..40).map(f64::from).collect()).unwrap();
    for target in TARGETS {
        let found = fit(&spline(globe, target(400.0)), &batch);
        let curve = found.curve(0);
        for t in [0.0, 3.7, 20.2, 39.0] {
            let (span, u) = curve.locate(t);
            assert!((curve.speed(span, u) / 63_710.0 - 1.0).abs() < 1e-4, "{}", curve.speed(span, u));
        }
        assert!(curve.max_curvature() * 6_371_000.0 < 1.01, "{}", curve.max_curvature());
    }
}

#[test]
fn what_has_no_plane_is_refused_in_a_sentence() {
    let round: Vec<[f64; 2]> = (0..36).map(|k| [10.0 * f64::from(k), 0.0]).collect();
    let track: Vec<[f64; 2]> = (0..9).map(|k| [f64::from(k), 50.0 + 0.3 * f64::from(k % 3)]).collect();
    let batch = CurveBatch::from_slices(&[&round[..], &track[..]]).unwrap().closed_each(vec![true, false]).unwrap();
    let found = spline(Globe::WGS84, SmoothingTarget::Tube(1e4.into())).fit(&batch, &Device::cpu()).unwrap();
    let [first, second] = found.reports() else { panic!("two reports") };
    assert_eq!((first.status, second.status), (CurveStatus::Invalid, CurveStatus::Converged));
    assert!(first.message.as_ref().unwrap().contains("it goes round the globe"), "{first:?}");
    let sphere = crate::in_surface::unit_sphere();
    let near = SurfaceSpline { smoothing: Some(SmoothingTarget::Tube(0.1.into())), ..SurfaceSpline::new(sphere) };
    let space = CurveBatch::from_slices(&[&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]][..]]).unwrap();
    let error = near.fit(&space, &Device::cpu()).unwrap_err().to_string();
    assert!(error.contains("lie on a globe"), "{error}");
}

#[test]
fn heights_have_a_distance_of_their_own() {
    let points: Vec<[f64; 3]> =
        (0..50).map(|k| [0.01 * f64::from(k), 47.0, 500.0 + 2.0 * f64::from(k) + f64::from(k * 7 % 5)]).collect();
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let batch = batch.with_parameters((0..50).map(f64::from).collect()).unwrap();
    let tube = |d: f64| Some(SmoothingTarget::Tube(Deviation::Metres(d)));
    let through = spline(Globe::WGS84, SmoothingTarget::Tube(10.0.into()));
    let within = SurfaceSpline { heights: tube(3.0), ..through.clone() };
    let [through, within] = [through, within].map(|spline| fit(&spline, &batch).polylines(Sampling::PerSpan(1)));
    let away = |batch: &CurveBatch, k: usize| (batch.points(0)[3 * k + 2] - points[k][2]).abs();
    assert!((0..50).all(|k| away(&through, k) < 1e-9 && away(&within, k) <= 3.0));
    // 2 m a point, and nothing else.
    let steps: Vec<f64> = (1..50).map(|k| within.points(0)[3 * k + 2] - within.points(0)[3 * k - 1]).collect();
    assert!(steps.iter().all(|step| (step - steps[0]).abs() < 1e-9 && (step - 2.0).abs() < 0.1), "{steps:?}");
}
