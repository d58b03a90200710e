//! Splines in surfaces: Riemannian cubics.

use std::sync::Arc;

use faircurve::spline::{Natural, Parametrisation, Smoothing, SmoothingTarget, SurfaceSpline};
use faircurve::surface::{Globe, HeightField, Quadric, Surface, Torus};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Fit, Sampling};
use glam::{DQuat, DVec3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

pub fn unit_sphere() -> Arc<dyn Surface> {
    Arc::new(Quadric::sphere(1.0))
}

pub fn timed(points: &[DVec3], t: &[f64]) -> CurveBatch {
    let points: Vec<[f64; 3]> = points.iter().map(|point| point.to_array()).collect();
    CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(t.to_vec()).unwrap()
}

pub fn fit(spline: &SurfaceSpline, batch: &CurveBatch) -> Fit {
    let fit = spline.fit(batch, &Device::cpu()).unwrap();
    for report in fit.reports() {
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    }
    fit
}

/// x, ẋ, a = D ẋ and j = D a of a Riemannian cubic on the unit sphere.
pub type State = [DVec3; 4];

/// D j + R(a, ẋ)ẋ = 0 with R(X, Y)Z = (Y·Z) X − (X·Z) Y, and D y = ẏ + (ẋ·y) x of tangent vectors.
fn rate([x, v, a, j]: State) -> State {
    let along = |y: DVec3| -y.dot(v) * x;
    [v, a + along(v), j + along(a), a.dot(v) * v - v.length_squared() * a + along(j)]
}

/// The cubic after a time, by the classical method of Runge and Kutta.
pub fn go_on(mut state: State, time: f64) -> State {
    let steps = 4000;
    let h = time / f64::from(steps);
    let moved = |state: &State, by: &State, h: f64| -> State { std::array::from_fn(|k| state[k] + h * by[k]) };
    for _ in 0..steps {
        let a = rate(state);
        let b = rate(moved(&state, &a, 0.5 * h));
        let c = rate(moved(&state, &b, 0.5 * h));
        let d = rate(moved(&state, &c, h));
        state = std::array::from_fn(|k| state[k] + h / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]));
    }
    state
}

/// A spline of two spans with natural ends on the unit sphere, by shooting: its states at both knots, where j jumps at the
/// second, and at the end.
fn shot(t: [f64; 3]) -> (State, State, State) {
    let start = [DVec3::X, DVec3::new(0.0, 0.5, 0.2), DVec3::ZERO, DVec3::new(0.0, 0.4, -0.9)];
    let [x, v, a, j] = go_on(start, t[1] - t[0]);
    let (e, f) = x.any_orthonormal_pair();
    let after = |c: [f64; 2]| [x, v, a, j + c[0] * e + c[1] * f];
    // a = 0 at the end, by Newton's method with differences.
    let miss = |c: [f64; 2]| {
        let end = go_on(after(c), t[2] - t[1]);
        let (p, q) = end[0].any_orthonormal_pair();
        [end[2].dot(p), end[2].dot(q)]
    };
    let mut c = [0.0; 2];
    for _ in 0..8 {
        let (here, h) = (miss(c), 1e-6);
        let columns = [miss([c[0] + h, c[1]]), miss([c[0], c[1] + h])].map(|to| [0, 1].map(|k| (to[k] - here[k]) / h));
        let determinant = columns[0][0] * columns[1][1] - columns[1][0] * columns[0][1];
        c[0] -= (here[0] * columns[1][1] - columns[1][0] * here[1]) / determinant;
        c[1] -= (columns[0][0] * here[1] - here[0] * columns[0][1]) / determinant;
    }
    let end = go_on(after(c), t[2] - t[1]);
    assert!(end[2].length() < 1e-11, "the oracle has natural ends: {}", end[2].length());
    (start, after(c), end)
}

#[test]
fn splines_on_the_sphere_are_riemannian_cubics_to_order_four() {
    let t = [0.0, 1.0, 1.6];
    let (start, middle, end) = shot(t);
    let batch = timed(&[start[0], middle[0], end[0]], &t);
    let mut errors = Vec::new();
    for parts in [2, 4, 8, 16] {
        let found = fit(&SurfaceSpline { parts, ..SurfaceSpline::new(unit_sphere()) }, &batch);
        assert!(found.reports()[0].iterations <= 6, "{} iterations", found.reports()[0].iterations);
        let curve = found.curve(0);
        let mut worst: f64 = 0.0;
        for k in 0..32 {
            let at = 1.6 * f64::from(k) / 32.0;
            let exact = if at < t[1] { go_on(start, at) } else { go_on(middle, at - t[1]) };
            worst = worst.max(curve.point(at).distance(exact[0]));
        }
        errors.push(worst);
    }
    println!("errors {errors:?}");
    for pair in errors.windows(2) {
        assert!(pair[0] / pair[1] > 13.0, "{errors:?}");
    }
    assert!(errors[1] < 1e-4 && errors[3] < 1e-6, "{errors:?}");
}

#[test]
fn energies_are_those_of_the_exact_cubics() {
    let t = [0.0, 1.0, 1.6];
    let (start, middle, end) = shot(t);
    let batch = timed(&[start[0], middle[0], end[0]], &t);
    // |a|² by Simpson's rule over exact states.
    let mut exact = 0.0;
    for (from, length) in [(start, 1.0), (middle, 0.6)] {
        let n = 64;
        let square = |k: u32| go_on(from, length * f64::from(k) / f64::from(n))[2].length_squared();
        let weight = |k: u32| if k == 0 || k == n { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
        exact += (0..=n).map(|k| weight(k) * square(k)).sum::<f64>() * length / f64::from(3 * n);
    }
    let energy = |parts: usize| {
        fit(&SurfaceSpline { parts, ..SurfaceSpline::new(unit_sphere()) }, &batch).reports()[0].energy / exact - 1.0
    };
    let errors = [4, 8, 16].map(energy);
    println!("errors of energies {errors:?}");
    assert!(errors[0] / errors[1] > 12.0 && errors[2].abs() < 1e-6, "{errors:?}");
}

#[test]
fn splines_in_a_plane_are_natural_and_smoothing_splines() {
    let seed = 5;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let plane: Arc<dyn Surface> = Arc::new(Quadric::plane(DVec3::new(1.0, 2.0, 2.0), 1.0));
    let tilt = DQuat::from_rotation_arc(DVec3::Z, DVec3::new(1.0, 2.0, 2.0) / 3.0);
    for closed in [false, true] {
        let points: Vec<DVec3> = (0..7)
            .map(|k| {
                let angle = 0.8 * f64::from(k);
                let flat = DVec3::new(3.0 * angle.cos(), 2.0 * angle.sin() + rng.random_range(-0.5..0.5), 1.0);
                tilt * flat
            })
            .collect();
        let t = [0.0, 0.5, 2.0, 2.1, 3.0, 4.5, 5.0];
        let batch = timed(&points, &t).closed_each(vec![closed]).unwrap().with_closing_spans(vec![0.7]).unwrap();
        let natural = Natural::default().fit(&batch, &Device::cpu()).unwrap();
        let lambda = 0.05;
        let smooth = Smoothing { target: SmoothingTarget::Lambda(lambda), ..Smoothing::default() };
        let smooth = smooth.fit(&batch, &Device::cpu()).unwrap();
        let own = SurfaceSpline { parts: 3, ..SurfaceSpline::new(plane.clone()) };
        let smoothed = SurfaceSpline { smoothing: Some(SmoothingTarget::Lambda(lambda)), ..own.clone() };
        for (own, other) in [(own, natural), (smoothed, smooth)] {
            let found = fit(&own, &batch);
            let (curve, flat) = (found.curve(0), other.curve(0));
            let away = (0..=50)
                .map(|k| curve.domain().1 * f64::from(k) / 50.0)
                .map(|t| curve.point(t).distance(flat.point(t)))
                .fold(0.0, f64::max);
            assert!(away < 1e-11, "closed: {closed}: {away:e}");
            let (a, b) = (&found.reports()[0], &other.reports()[0]);
            assert!((a.energy / b.energy - 1.0).abs() < 1e-10, "{} {}", a.energy, b.energy);
            assert!((a.max_deviation - b.max_deviation).abs() < 1e-10);
        }
    }
}

#[test]
fn tracks_turned_by_any_rotation_are_the_turned_tracks() {
    let seed = 6;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let globe = Globe::sphere(1.0).unwrap();
    let spline = SurfaceSpline::new(Arc::new(globe));
    for _ in 0..20 {
        let mut at = DVec3::X;
        let mut places = vec![at];
        let mut times = vec![0.0];
        for _ in 0..6 {
            at = (at + 0.4 * DVec3::new(rng.random_range(-1.0..1.0), 0.7, rng.random_range(-1.0..1.0))).normalize();
            places.push(at);
            times.push(times[times.len() - 1] + rng.random_range(0.5..2.0));
        }
        let fitted = |turn: DQuat| -> Vec<DVec3> {
            let points: Vec<[f64; 2]> = places.iter().map(|place| globe.angles(turn * *place)).collect();
            let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(times.clone()).unwrap();
            let found = fit(&spline, &batch).polylines(Sampling::PerSpan(8));
            found.points(0).chunks_exact(2).map(|point| globe.place(point[0], point[1])).collect()
        };
        let own = fitted(DQuat::IDENTITY);
        let over_pole = DQuat::from_rotation_arc(places[3], DVec3::Z);
        let over_line = DQuat::from_rotation_z(std::f64::consts::PI - places[3].y.atan2(places[3].x));
        for turn in [over_pole, over_line, DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 2.0)] {
            let there = fitted(turn);
            let away = own.iter().zip(&there).map(|(a, b)| (turn * *a).distance(*b)).fold(0.0, f64::max);
            assert!(away < 1e-9, "{away:e}");
        }
    }
}

#[test]
fn even_motion_along_a_great_circle_is_found_to_order_four() {
    let points = [0.0, 30.0, 80.0, 140.0].map(|degrees: f64| [degrees + 100.0, 0.0]);
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(vec![0.0, 3.0, 8.0, 14.0]).unwrap();
    let mut errors = Vec::new();
    for parts in [4, 8, 16] {
        let found = fit(&SurfaceSpline { parts, ..SurfaceSpline::new(Arc::new(Globe::WGS84)) }, &batch);
        let curve = found.curve(0);
        let mut error: f64 = 0.0;
        for t in [1.0, 5.5, 9.7] {
            let at = curve.point(t);
            assert!(at.y.abs() < 1e-12, "{at}");
            error = error.max((at.x - (100.0 + 10.0 * t)).abs());
        }
        errors.push(error);
    }
    println!("errors in degrees {errors:?}");
    assert!(errors[0] / errors[1] > 13.0 && errors[1] / errors[2] > 13.0 && errors[2] < 1e-6, "{errors:?}");
}

#[test]
fn second_derivatives_are_continuous_and_ends_are_free() {
    let t = [0.0, 1.0, 1.6];
    let (start, middle, end) = shot(t);
    let batch = timed(&[start[0], middle[0], end[0]], &t);
    let tangential = |x: DVec3, a: DVec3| a - a.dot(x) * x;
    let mut errors = Vec::new();
    for parts in [8, 16] {
        let found = fit(&SurfaceSpline { parts, ..SurfaceSpline::new(unit_sphere()) }, &batch);
        let curve = found.curve(0);
        let (before, after) = (curve.jet(0, 1.0), curve.jet(1, 0.0));
        assert!(before.second.distance(after.second) < 1e-12);
        let mut error = tangential(before.point, before.second).distance(middle[2]);
        for jet in [curve.jet(0, 0.0), curve.jet(1, 1.0)] {
            error = error.max(tangential(jet.point, jet.second).length());
        }
        assert!(curve.jet(0, 0.0).first.distance(start[1]) < 1e-4);
        errors.push(error);
    }
    println!("errors of accelerations {errors:?} beside {}", middle[2].length());
    assert!(errors[0] / errors[1] > 3.5 && errors[1] < 2e-3, "{errors:?}");
}

#[test]
fn points_of_every_kind_have_a_status_and_leave_their_neighbours_bits() {
    let torus = Torus::new(2.0, 1.0).unwrap();
    let on = |u: f64, v: f64| [(2.0 + u.cos()) * v.cos(), (2.0 + u.cos()) * v.sin(), u.sin()];
    let good: Vec<[f64; 3]> = (0..5).map(|k| on(0.5 * f64::from(k), 0.3 * f64::from(k))).collect();
    let ring: Vec<[f64; 3]> = (0..6).map(|k| on(0.3, f64::from(k))).collect();
    let repeated = [on(0.0, 0.0), on(0.0, 0.0), on(0.5, 0.5), on(0.5, 0.5), on(1.0, 0.5)];
    let two = [on(0.0, 0.0), on(0.4, 0.4)];
    let off = [on(0.0, 0.0), [2.5, 0.1, 0.3], on(1.0, 0.5)];
    let lists: [&[[f64; 3]]; 7] = [&good, &ring, &repeated, &[], &two[..1], &two, &off];
    let closed = [false, true, false, false, false, true, false];
    let batch = CurveBatch::from_slices(&lists).unwrap().closed_each(closed.to_vec()).unwrap();
    let spline = SurfaceSpline::new(Arc::new(torus));
    let together = spline.fit(&batch, &Device::cpu()).unwrap();
    let statuses: Vec<CurveStatus> = together.reports().iter().map(|report| report.status).collect();
    use CurveStatus::{Converged, Degenerate, Invalid};
    assert_eq!(statuses, [Converged, Converged, Converged, Degenerate, Degenerate, Converged, Invalid]);
    let message = together.reports()[6].message.clone().unwrap();
    assert!(message.contains("off the torus of radii 2 and 1"), "{message}");
    let samples = together.polylines(Sampling::PerSpan(4));
    for (i, list) in lists.iter().enumerate() {
        let alone = CurveBatch::from_slices(&[list]).unwrap().closed_each(vec![closed[i]]).unwrap();
        let alone = spline.fit(&alone, &Device::cpu()).unwrap().polylines(Sampling::PerSpan(4));
        assert_eq!(samples.points(i), alone.points(0), "curve {i}");
        for point in samples.points(i).chunks_exact(3).filter(|_| statuses[i] == Converged) {
            let height = torus.value(DVec3::from_slice(point));
            assert!(height.abs() < 1e-14, "{height:e}");
        }
    }
}

#[test]
fn smoothed_tracks_keep_pinned_points_and_bend_less_the_larger_lambda() {
    let points: Vec<[f64; 2]> = (0..12).map(|k| [8.0 * f64::from(k), 60.0 + 6.0 * f64::from(k * k % 5)]).collect();
    let pinned = (0..12).map(|k| k == 4).collect();
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let batch = batch.with_constraints(Constraints { pinned: Some(pinned), ..Constraints::default() }).unwrap();
    let of = |lambda: f64| SurfaceSpline {
        smoothing: Some(SmoothingTarget::Lambda(lambda)),
        parametrisation: Parametrisation::Uniform,
        ..SurfaceSpline::new(Arc::new(Globe::sphere(1.0).unwrap()))
    };
    let mut before = f64::INFINITY;
    for lambda in [0.0, 1e-3, 0.1, 10.0, 1e4] {
        let found = fit(&of(lambda), &batch);
        let energy = found.reports()[0].energy;
        assert!(energy < before, "λ = {lambda}: {energy} after {before}");
        before = energy;
        let at = found.curve(0).point(4.0);
        assert!((at.x - points[4][0]).abs() < 1e-9 && (at.y - points[4][1]).abs() < 1e-9, "{at}");
    }
    // A great circle at an even speed is left.
    assert!(before < 1e-6, "{before}");
}

#[test]
fn what_does_not_converge_says_so_within_its_iterations() {
    let t = [0.0, 1.0, 1.6];
    let (start, middle, end) = shot(t);
    let batch = timed(&[start[0], middle[0], end[0]], &t);
    for max_iterations in [0, 1] {
        let spline = SurfaceSpline { max_iterations, ..SurfaceSpline::new(unit_sphere()) };
        let report = spline.fit(&batch, &Device::cpu()).unwrap().reports()[0].clone();
        assert_eq!((report.status, report.iterations), (CurveStatus::NotConverged, max_iterations));
        assert!(report.message.unwrap().contains(&format!("{max_iterations} iterations did not lead to a minimum")));
    }
}

#[test]
fn heights_are_splines_over_the_same_times() {
    let points = [[10.0, 50.0, 100.0], [12.0, 51.0, 300.0], [13.0, 53.0, 250.0], [11.0, 54.0, 0.0]];
    let t = vec![0.0, 1.0, 3.0, 4.0];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(t.clone()).unwrap();
    let found = fit(&SurfaceSpline::new(Arc::new(Globe::WGS84)), &batch);
    let heights: Vec<[f64; 2]> = points.iter().map(|point| [point[2], 0.0]).collect();
    let heights = CurveBatch::from_slices(&[&heights[..]]).unwrap().with_parameters(t).unwrap();
    let heights = Natural::default().fit(&heights, &Device::cpu()).unwrap();
    for t in [0.5, 1.7, 3.9] {
        let (own, wanted) = (found.curve(0).point(t).z, heights.curve(0).point(t).x);
        assert!((own - wanted).abs() < 1e-9, "{own} {wanted}");
    }
}

#[test]
fn what_is_not_kept_is_refused_with_a_sentence() {
    let points = [[10.0, 50.0], [12.0, 51.0], [13.0, 53.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let spline = SurfaceSpline::new(Arc::new(Globe::WGS84));
    let refused = |spline: SurfaceSpline, batch: &CurveBatch, what: &str| {
        let error = spline.fit(batch, &Device::cpu()).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(what), "{error}");
    };
    refused(SurfaceSpline { smoothing: Some(SmoothingTarget::Lambda(-1.0)), ..spline.clone() }, &batch, "λ is -1");
    refused(SurfaceSpline { parts: 0, ..spline.clone() }, &batch, "0 parts");
    refused(SurfaceSpline { tolerance: f64::NAN, ..spline.clone() }, &batch, "tolerance is NaN");
    refused(SurfaceSpline { off_surface: Some(-1.0), ..spline.clone() }, &batch, "-1 off the surface");
    refused(SurfaceSpline::new(unit_sphere()), &batch, "three coordinates");
    let curvatures = Constraints { curvatures: Some(vec![1.0; 6]), ..Constraints::default() };
    refused(spline.clone(), &batch.clone().with_constraints(curvatures).unwrap(), "curvature vectors");
    let antipodal = CurveBatch::from_slices(&[&[[0.0, 0.0], [180.0, 0.0]][..]]).unwrap();
    let report = &spline.fit(&antipodal, &Device::cpu()).unwrap().reports()[0].clone();
    assert_eq!(report.status, CurveStatus::Invalid);
    assert!(report.message.as_ref().unwrap().contains("give points between"), "{report:?}");
}

#[test]
fn splines_over_terrain_at_the_coordinates_of_a_map_are_those_about_the_origin() {
    // An easting and a northing in metres, whose last digits are 1e-9 m.
    let [east, north] = [412_345.678, 5_654_321.987];
    let wave = |x: f64, y: f64| 150.0 * (x / 210.0).sin() * (y / 260.0).cos() + 500.0;
    let heights = (0..40 * 50).map(|k| wave(30.0 * f64::from(k % 50), 30.0 * f64::from(k / 50)));
    let field = HeightField::new([40, 50], heights.collect()).unwrap().with_spacing([30.0; 2]).unwrap();
    let far = field.clone().with_origin([east, north]).unwrap();
    let mut rng = StdRng::seed_from_u64(15);
    let mut most = 0.0f64;
    for _ in 0..40 {
        let place = |k: usize, rng: &mut StdRng| {
            [150.0 + 280.0 * k as f64 + rng.random_range(-80.0..80.0), rng.random_range(250.0..900.0)]
        };
        let flat: Vec<[f64; 2]> = (0..5).map(|k| place(k, &mut rng)).collect();
        let moved: Vec<[f64; 2]> = flat.iter().map(|[x, y]| [x + east, y + north]).collect();
        let t = vec![0.0, 1.0, 2.3, 3.1, 4.5];
        let fits = [(flat, field.clone()), (moved, far.clone())].map(|(points, field)| {
            let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(t.clone()).unwrap();
            fit(&SurfaceSpline::new(Arc::new(field)), &batch)
        });
        let [near, moved] = &fits;
        assert_eq!(near.reports()[0].iterations, moved.reports()[0].iterations);
        for k in 0..=45 {
            let away = near.curve(0).point(0.1 * f64::from(k)) + DVec3::new(east, north, 0.0);
            most = most.max(away.distance(moved.curve(0).point(0.1 * f64::from(k))));
        }
    }
    println!("{most:.1e} m apart");
    assert!(most < 1e-6, "{most:e}");
}
