//! The curve of least bending within a distance of its points is that, and within it.

use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{SecondOrderConeT, ZeroConeT};
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus};
use faircurve::spline::{Parametrisation, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, CurveStatus, Device, Fit};
use nalgebra::DMatrix;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

fn tube(distance: f64) -> Smoothing {
    Smoothing { target: SmoothingTarget::Tube(distance.into()), ..Smoothing::default() }
}

fn fit(batch: &CurveBatch, options: Smoothing) -> Fit {
    options.fit(batch, &Device::cpu()).unwrap()
}

/// Noisy tracks of 3 to 24 points, and one of 60, at uneven parameters; a fifth of the points lies
/// far off.
fn tracks(dimension: usize, closed: bool, seed: u64) -> CurveBatch {
    let mut random = StdRng::seed_from_u64(seed);
    let (mut coords, mut t, mut offsets, mut closing) = (Vec::new(), Vec::new(), vec![0], Vec::new());
    for n in (3..=24).chain([60]) {
        let mut here: f64 = random.random_range(-5.0..5.0);
        for k in 0..n {
            let angle = if closed { std::f64::consts::TAU * k as f64 / n as f64 } else { 0.7 * here };
            let far = if random.random_range(0..5) == 0 { 1.0 } else { 0.15 };
            let smooth = [if closed { 4.0 * angle.cos() } else { here }, 4.0 * angle.sin(), angle.cos()];
            coords.extend(smooth[..dimension].iter().map(|x| x + far * random.random_range(-1.0..1.0)));
            t.push(here);
            here += random.random_range(0.1..1.0);
        }
        closing.push(random.random_range(0.1..1.0));
        offsets.push(t.len());
    }
    let batch = CurveBatch::from_ragged(dimension, coords, offsets).unwrap().with_parameters(t).unwrap();
    batch.with_closing_spans(closing).unwrap().closed(closed)
}

/// Spans of a curve, the closing one included.
fn spans(batch: &CurveBatch, i: usize) -> Vec<f64> {
    let steps = batch.parameters(i).unwrap().windows(2).map(|pair| pair[1] - pair[0]);
    steps.chain(batch.is_closed(i).then(|| batch.closing_span(i).unwrap())).collect()
}

/// The matrix of the energy of the natural or periodic spline in its values: Q R⁻¹ Qᵀ, dense.
fn stiffness(h: &[f64], n: usize, closed: bool) -> DMatrix<f64> {
    let knots: Vec<usize> = if closed { (0..n).collect() } else { (1..n - 1).collect() };
    let at = |k: usize| knots.iter().position(|knot| *knot == k % n);
    let (mut q, mut r) = (DMatrix::<f64>::zeros(n, knots.len()), DMatrix::<f64>::zeros(knots.len(), knots.len()));
    for (span, h) in h.iter().enumerate() {
        let ends = [at(span), at(span + 1)];
        for (from, to) in [(0, 1), (1, 0)] {
            let Some(row) = ends[from] else { continue };
            r[(row, row)] += h / 3.0;
            ends[to].iter().for_each(|column| r[(row, *column)] += h / 6.0);
            q[((span + to) % n, row)] += 1.0 / h;
            q[((span + from) % n, row)] -= 1.0 / h;
        }
    }
    &q * r.cholesky().unwrap().solve(&q.transpose())
}

/// The least energy, and its curve at the knots, by Clarabel.
fn least(batch: &CurveBatch, i: usize, distance: f64, pinned: bool) -> (f64, Vec<f64>) {
    let (d, n) = (batch.dimension(), batch.count(i));
    let k = stiffness(&spans(batch, i), n, batch.is_closed(i));
    let (mut rows, mut columns, mut entries) = (vec![], vec![], vec![]);
    for (a, b, c) in (0..n).flat_map(|a| (a..n).flat_map(move |b| (0..d).map(move |c| (a, b, c)))) {
        rows.push(a * d + c);
        columns.push(b * d + c);
        entries.push(2.0 * k[(a, b)]);
    }
    let quadratic = CscMatrix::new_from_triplets(n * d, n * d, rows, columns, entries);
    let (mut rows, mut columns, mut entries, mut right, mut cones) = (vec![], vec![], vec![], vec![], vec![]);
    for point in 0..n {
        let held = pinned && (point == 0 || point + 1 == n);
        cones.push(if held { ZeroConeT(d) } else { SecondOrderConeT(d + 1) });
        (!held).then(|| right.push(distance));
        for c in 0..d {
            rows.push(right.len());
            columns.push(point * d + c);
            entries.push(1.0);
            right.push(batch.points(i)[point * d + c]);
        }
    }
    let left = CscMatrix::new_from_triplets(right.len(), n * d, rows, columns, entries);
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_rel(1e-11)
        .tol_gap_abs(1e-13)
        .tol_feas(1e-11)
        .build()
        .unwrap();
    let mut solver = DefaultSolver::new(&quadratic, &vec![0.0; n * d], &left, &right, &cones, settings).unwrap();
    solver.solve();
    let status = solver.solution.status;
    assert!(matches!(status, SolverStatus::Solved | SolverStatus::AlmostSolved), "{status:?}");
    (solver.solution.obj_val, solver.solution.x.clone())
}

/// Largest distance from a data point to the curve's point of its parameter.
fn farthest(batch: &CurveBatch, fit: &Fit, i: usize) -> f64 {
    let (d, curve) = (batch.dimension(), fit.curve(i));
    let points = batch.points(i).chunks(d).zip(batch.parameters(i).unwrap());
    let distance = |(y, t): (&[f64], &f64)| {
        let p = curve.point(*t).to_array();
        y.iter().zip(p).map(|(y, p)| (y - p).powi(2)).sum::<f64>().sqrt()
    };
    points.map(distance).fold(0.0, f64::max)
}

#[test]
fn it_is_the_least_that_another_solver_finds() {
    for (dimension, closed, pin_ends, seed) in [
        (2, false, false, 1),
        (3, false, false, 2),
        (2, false, true, 3),
        (3, false, true, 4),
        (2, true, false, 5),
        (3, true, false, 6),
    ] {
        let batch = tracks(dimension, closed, seed);
        for distance in [0.02, 0.3, 1.0] {
            let fit = fit(&batch, Smoothing { pin_ends, ..tube(distance) });
            let mut bent = 0;
            for (i, report) in fit.reports().iter().enumerate() {
                let name =
                    format!("{dimension}-D, closed {closed}, pinned {pin_ends}, {} points, {distance}", batch.count(i));
                assert_eq!(report.status, CurveStatus::Converged, "{name}: {report:?}");
                assert!(farthest(&batch, &fit, i) <= distance && report.gradient_norm <= 1e-8, "{name}: {report:?}");
                let (energy, values) = least(&batch, i, distance, pin_ends);
                // Closed curves that would collapse are not the least.
                if report.message.is_some() {
                    assert!(closed && report.energy >= energy);
                    continue;
                }
                let error = (report.energy - energy).abs();
                assert!(error <= 1e-6 * energy + 1e-9, "{name}: {} and {energy}", report.energy);
                // Where the energy is not 0, the curve is unique: the gap is half its squared
                // distance in the energy's norm, some 1e-3 of the distance where curves bend most
                // easily.
                if energy > 1e-3 {
                    bent += 1;
                    let curve = fit.curve(i);
                    for (t, wanted) in batch.parameters(i).unwrap().iter().zip(values.chunks(dimension)) {
                        let p = curve.point(*t).to_array();
                        let off = wanted.iter().zip(p).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                        assert!(off < 5e-3 * distance + 1e-6, "{name}: {off}");
                    }
                }
            }
            // Within 1 many are lines, or too small closed curves.
            assert!(bent > 5 || distance == 1.0, "{bent} curves of {distance}");
        }
    }
}

#[test]
fn one_outlier_does_not_stiffen_the_rest() {
    // 41 points with noise of 0.15 around a wave, one of them 2 off.
    for seed in 1..=6 {
        let mut ratios = Vec::new();
        for outlier in [0.0, 2.0] {
            let mut random = StdRng::seed_from_u64(seed);
            let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
            let track: Vec<[f64; 2]> = (0..41)
                .map(|k| {
                    let x = f64::from(k) * 0.25;
                    [x, 5.0 * (0.6 * x).sin() + 0.15 * normal() + if k == 20 { outlier } else { 0.0 }]
                })
                .collect();
            let batch = CurveBatch::from_slices(&[&track[..]]).unwrap();
            let batch = batch.with_parameters((0..41).map(f64::from).collect()).unwrap();
            let energy = |target| fit(&batch, Smoothing { target, ..Smoothing::default() }).reports()[0].energy;
            ratios.push(energy(SmoothingTarget::Deviation(1.0.into())) / energy(SmoothingTarget::Tube(1.0.into())));
        }
        println!("seed {seed}: one λ costs {:.2} times the least, with an outlier {:.2} times", ratios[0], ratios[1]);
        assert!((1.0..1.5).contains(&ratios[0]) && (5.0..20.0).contains(&ratios[1]), "seed {seed}: {ratios:?}");
    }
}

#[test]
fn forces_hold_it_only_where_it_touches_and_towards_the_points() {
    // Hurricane tracks: positions at 6-hour steps, some at one time.
    let (mut coords, mut offsets, mut hours) = (Vec::new(), vec![0], Vec::new());
    let mut storm = "";
    for line in include_str!("../data/storms_excerpt.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |k: usize| fields[k].parse::<f64>().unwrap();
        if fields[0] != storm && !storm.is_empty() {
            offsets.push(hours.len());
        }
        storm = fields[0];
        hours.push(number(1));
        coords.extend([number(2), number(3)]);
    }
    offsets.push(hours.len());
    let storms = CurveBatch::from_ragged(2, coords, offsets).unwrap().with_parameters(hours).unwrap();
    let mut touched = 0;
    for (batch, distance) in [(&storms, 0.3), (&tracks(2, true, 8), 0.3), (&tracks(3, false, 9), 0.1)] {
        let fit = fit(batch, tube(distance));
        for (i, report) in fit.reports().iter().enumerate() {
            if report.status != CurveStatus::Converged || report.message.is_some() || report.energy < 1e-9 {
                assert!(report.status.is_usable() || report.message.as_ref().unwrap().contains("same parameter"));
                continue;
            }
            let times = batch.parameters(i).unwrap();
            if times.windows(2).any(|pair| pair[0] == pair[1]) {
                continue;
            }
            let curve = fit.curve(i);
            let third: Vec<glam::DVec3> = (0..curve.spans()).map(|span| curve.jet(span, 0.5).third).collect();
            let d = batch.dimension();
            let closed = batch.is_closed(i);
            let n = times.len();
            let force = |k: usize| {
                let zero = glam::DVec3::ZERO;
                let before = if k > 0 {
                    third[k - 1]
                } else if closed {
                    third[n - 1]
                } else {
                    zero
                };
                third.get(k).copied().unwrap_or(zero) - before
            };
            let strongest = (0..n).map(|k| force(k).length()).fold(0.0, f64::max);
            for (k, &t) in times[..n].iter().enumerate() {
                let y = &batch.points(i)[k * d..(k + 1) * d];
                let point = glam::DVec3::new(y[0], y[1], y.get(2).copied().unwrap_or(0.0));
                let off = curve.point(t) - point;
                let pull = force(k);
                if off.length() < 0.99 * distance {
                    assert!(pull.length() <= 1e-5 * strongest, "curve {i}, point {k}: {pull} of {strongest}");
                } else if pull.length() > 1e-3 * strongest {
                    touched += 1;
                    // p⁗ = −Σ w (p − y) δ(t − t_k), w ≥ 0.
                    let aligned = -pull.dot(off) / (pull.length() * off.length());
                    assert!(aligned > 1.0 - 1e-4, "curve {i}, point {k}: {aligned}");
                }
            }
        }
    }
    assert!(touched > 100, "{touched}");
}

#[test]
fn data_that_leave_little_to_do_are_fitted() {
    let wave = |n: usize| -> Vec<[f64; 2]> { (0..n).map(|k| [k as f64, (k as f64 * 1.3).sin()]).collect() };
    for closed in [false, true] {
        for n in (2..=130).chain([1000]) {
            let batch = CurveBatch::from_slices(&[&wave(n)[..]]).unwrap().closed(closed);
            for distance in [1e-300, 1e-12, 1e-6, 0.1, 1.5, 1e3, 1e300] {
                for pin_ends in [false, true] {
                    let fit = fit(&batch, Smoothing { pin_ends, ..tube(distance) });
                    let report = &fit.reports()[0];
                    let name = format!("{n} points, closed {closed}, {distance}, pinned {pin_ends}: {report:?}");
                    assert_eq!(report.status, CurveStatus::Converged, "{name}");
                    assert!(report.max_deviation <= distance, "{name}");
                    assert!(report.smoothing.is_none() != report.message.is_some(), "{name}");
                    assert!(closed || distance < 10.0 || report.energy == 0.0, "{name}");
                }
            }
        }
    }
}

#[test]
fn within_reach_of_a_line_that_is_not_the_regression_line_the_bend_is_none() {
    // The regression line passes 1.6 from the fifth point, another line within 1.1 of all.
    let points: Vec<[f64; 2]> = (0..9).map(|k| [f64::from(k), if k == 4 { 2.0 } else { 0.0 }]).collect();
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let report = fit(&batch, Smoothing { parametrisation: Parametrisation::Uniform, ..tube(1.1) }).reports()[0].clone();
    assert_eq!(report.status, CurveStatus::Converged);
    assert!(report.energy < 1e-8, "{report:?}");
}

#[test]
fn points_at_one_parameter_are_all_kept() {
    let points = [[0.0, 0.0], [1.0, 1.0], [1.0, 1.8], [2.0, 0.0], [3.0, 1.0], [4.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let batch = batch.with_parameters(vec![0.0, 1.0, 1.0, 2.0, 3.0, 4.0]).unwrap();
    let fitted = fit(&batch, tube(0.45));
    assert_eq!(fitted.usable(), 1, "{:?}", fitted.reports()[0]);
    assert!(farthest(&batch, &fitted, 0) <= 0.45);
    // Their mean is 0.4 from both.
    let report = fit(&batch, tube(0.3)).reports()[0].clone();
    assert_eq!(report.status, CurveStatus::NotConverged);
    assert!(report.message.unwrap().contains("other points have the same parameter; the deviation allowed is 0.3"));
}

#[test]
fn weights_have_no_part_in_it_and_neighbours_none_either() {
    let batch = tracks(2, false, 10);
    let weights = (0..batch.total_points()).map(|k| 1.0 + (k % 7) as f64).collect();
    let (plain, weighted) = (fit(&batch, tube(0.2)), fit(&batch.clone().with_weights(weights).unwrap(), tube(0.2)));
    let mut coords = batch.coords().to_vec();
    coords[2 * batch.offsets()[5] + 1] = f64::NAN;
    let spoiled = CurveBatch::from_ragged(2, coords, batch.offsets().to_vec()).unwrap();
    let t = (0..batch.len()).flat_map(|i| batch.parameters(i).unwrap().to_vec()).collect();
    let spoiled = fit(&spoiled.with_parameters(t).unwrap(), tube(0.2));
    assert_eq!(spoiled.reports()[5].status, CurveStatus::Invalid);
    // Where a line serves it is the regression line, in which weights do play a part.
    for i in (0..batch.len()).filter(|i| *i != 5 && plain.reports()[*i].energy > 0.0) {
        for span in 0..plain.curve(i).spans() {
            assert_eq!(plain.curve(i).jet(span, 0.3), weighted.curve(i).jet(span, 0.3));
            assert_eq!(plain.curve(i).jet(span, 0.3), spoiled.curve(i).jet(span, 0.3));
        }
    }
}
