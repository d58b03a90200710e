//! Every fair curve ends with an honest status: hard, degenerate and impossible ones, at every
//! size; and what does not make sense is refused with a sentence.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use faircurve::discrete::{Energy, Fair, Pins, Segments, attachment, bending, length, tautness, tension, variation};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Sampling, io};
use glam::{DMat3, DVec3};
use rand::RngExt;
use rand::SeedableRng;
use rand::rngs::StdRng;

use crate::common::*;

fn of(energy: Energy) -> Fair {
    Fair { energy, ..Fair::default() }
}

const S: [Planar; 5] = [[0.0, 0.0], [1.0, 0.8], [2.0, 0.1], [3.2, -0.5], [4.0, 0.3]];

const TRIANGLE: [Planar; 3] = [[0.0, 0.0], [2.0, 0.0], [0.7, 1.5]];

fn energies() -> [Energy; 4] {
    [bending(2.0) + length(), variation() + length(), length(), tension()]
}

#[test]
fn few_segments_and_few_points_are_fitted_too() {
    for energy in energies() {
        for n in [1, 2, 3, 4] {
            for (points, closed) in [(&S[..2], false), (&S[..3], false), (&S[..], false), (&TRIANGLE, true), (&S, true)]
            {
                // Every arc through two points has no variation: nothing but length tells them
                // apart, and the inner product of order 3 needs a third point.
                if energy.order() == 3 && points.len() == 2 {
                    continue;
                }
                let fair = Fair { segments: Segments::PerSpan(n), ..of(energy.clone()) };
                let (vertices, report) = fitted::<2>(&fair, &one(points, closed), n);
                let case = format!("{energy}, {n} segments, {} points, closed {closed}", points.len());
                assert_eq!(report.status, CurveStatus::Converged, "{case}: {report:?}");
                let spans = points.len() - usize::from(!closed);
                assert_eq!(vertices.len(), spans * n + usize::from(!closed), "{case}");
                points.iter().enumerate().for_each(|(k, point)| assert_eq!(vertices[k * n], *point, "{case}"));
            }
        }
    }
}

#[test]
fn collinear_points_give_the_line_without_energy() {
    let points = [[0.0, 0.0], [1.0, 2.0], [1.5, 3.0], [4.0, 8.0]];
    for energy in [bending(2.0), bending(1.0), bending(3.5), variation()] {
        let (vertices, report) = fitted::<2>(&of(energy.clone()), &one(&points, false), 16);
        assert_eq!(report.status, CurveStatus::Converged, "{energy}: {report:?}");
        assert!(report.energy <= 1e-12, "{energy}: {report:?}");
        assert!(vertices.iter().all(|[x, y]| (y - 2.0 * x).abs() <= 1e-13), "{energy}");
    }
}

#[test]
fn order_1_gives_the_polygon_at_once() {
    for energy in [length(), tension(), length() + tension()] {
        let (vertices, report) = fitted::<2>(&of(energy.clone()), &one(&S, false), 16);
        assert_eq!(report.status, CurveStatus::Converged, "{energy}: {report:?}");
        let polygon: f64 = S.windows(2).map(|pair| norm(minus(pair[1], pair[0]))).sum();
        assert!((length_of(&vertices, false) / polygon - 1.0).abs() <= 1e-6, "{energy}");
    }
}

#[test]
fn repeated_points_are_one_vertex() {
    let fair = of(bending(2.0) + length());
    for closed in [false, true] {
        let (_, plain) = fitted::<2>(&fair, &one(&S, closed), 16);
        for (at, point) in S.into_iter().enumerate() {
            let mut points = S.to_vec();
            points.insert(at, point);
            points.insert(at, point);
            let batch = one(&points, closed);
            let (vertices, report) = fitted::<2>(&fair, &batch, 16);
            assert_eq!(report.status, CurveStatus::Converged, "closed {closed}, point {at}: {report:?}");
            assert!((report.energy / plain.energy - 1.0).abs() <= 1e-10, "closed {closed}, point {at}: {report:?}");
            // A closed curve drops a last point that repeats its first.
            let spans = batch.spans(0);
            assert_eq!(vertices.len(), spans * 16 + usize::from(!closed), "closed {closed}, point {at}");
        }
        if closed {
            let seam: Vec<Planar> = S.iter().copied().chain([S[0], S[0]]).collect();
            let (vertices, report) = fitted::<2>(&fair, &one(&seam, true), 16);
            assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
            assert!((report.energy / plain.energy - 1.0).abs() <= 1e-10, "{report:?}");
            assert_eq!(vertices.len(), one(&seam, true).spans(0) * 16);
        }
    }
}

#[test]
fn points_that_almost_coincide_end_with_a_status_and_a_finite_curve() {
    let fair = of(bending(2.0) + length());
    for gap in [1e-2, 1e-4, 1e-7, 1e-10, 1e-14] {
        let mut points = S.to_vec();
        points.insert(2, [S[1][0] + gap, S[1][1]]);
        let fit = fit(&fair, &one(&points, false));
        let report = &fit.reports()[0];
        println!("{gap:e}: {:?} {} {:?}", report.status, report.iterations, report.message);
        assert!(report.status == CurveStatus::Converged || report.message.is_some(), "{gap:e}: {report:?}");
        assert!(vertices::<2>(&fit, 0, 16).as_flattened().iter().all(|x| x.is_finite()), "{gap:e}");
        if gap >= 1e-4 {
            assert_eq!(report.status, CurveStatus::Converged, "{gap:e}: {report:?}");
        }
    }
}

#[test]
fn curves_that_turn_back_on_a_line_are_degenerate() {
    let on_a_line = |at: &[f64]| -> Vec<Planar> { at.iter().map(|x| [1.0 + x, 3.0 - 2.0 * x]).collect() };
    let curves = [(&[0.0, 1.0][..], true), (&[0.0, 1.0, 1.5, 4.0], true), (&[0.0, 2.0, 1.0, 4.0], false)];
    for (at, closed) in curves {
        for energy in [bending(2.0) + length(), bending(1.0), variation() + length()] {
            let fit = fit(&of(energy.clone()), &one(&on_a_line(at), closed));
            let report = &fit.reports()[0];
            let case = format!("{energy}, {at:?}: {report:?}");
            assert_eq!(report.status, CurveStatus::Degenerate, "{case}");
            let message = report.message.clone().unwrap();
            assert!(
                message.ends_with(
                    "the points around it lie on a line on which the curve turns back, with no side to turn to: move \
                     one aside, or give it a tangent"
                ),
                "{case}"
            );
            assert!(message.starts_with("curve 0, point "), "{case}");
            assert_eq!(fit.polylines(Sampling::PerSpan(16)).points(0), on_a_line(at).as_flattened(), "{case}");
        }
        // The shortest curve is the doubled line.
        let (_, report) = fitted::<2>(&of(length()), &one(&on_a_line(at), closed), 16);
        assert_eq!(report.status, CurveStatus::Converged, "{at:?}: {report:?}");
    }
}

#[test]
fn too_little_is_degenerate_and_comes_out_as_it_came_in() {
    let fair = of(bending(2.0) + length());
    for (points, closed) in [(&S[..1], false), (&S[..1], true), (&[S[0]; 4][..], false), (&[S[0]; 4][..], true)] {
        let fit = fit(&fair, &one(points, closed));
        assert_eq!(fit.reports()[0].status, CurveStatus::Degenerate, "{points:?}, closed {closed}");
        assert!(fit.reports()[0].message.is_some() && fit.reports()[0].energy.is_nan());
        assert_eq!(fit.polylines(Sampling::PerSpan(16)).points(0), one(points, closed).points(0));
    }
    let nothing = CurveBatch::from_ragged(2, vec![], vec![0]).unwrap();
    assert!(fit(&fair, &nothing).is_empty());
    let fit = fit(&fair, &CurveBatch::from_ragged(3, vec![], vec![0, 0]).unwrap());
    assert_eq!(fit.reports()[0].status, CurveStatus::Degenerate);
}

#[test]
fn a_curve_that_is_no_number_leaves_its_neighbours_bits() {
    let fair = of(bending(2.0) + length());
    let good = gentle(20, 5, 0.1, 3);
    let mut coords = good.coords().to_vec();
    coords[63] = f64::NAN;
    coords[94] = f64::INFINITY;
    let bad = CurveBatch::from_ragged(2, coords, good.offsets().to_vec()).unwrap();
    let (of_good, of_bad) = (fit(&fair, &good), fit(&fair, &bad));
    for i in 0..20 {
        if i == 6 || i == 9 {
            assert_eq!(of_bad.reports()[i].status, CurveStatus::Invalid, "curve {i}");
            assert!(of_bad.reports()[i].message.is_some());
            continue;
        }
        assert_eq!(of_good.reports()[i], of_bad.reports()[i], "curve {i}");
        assert_eq!(vertices::<2>(&of_good, i, 16), vertices::<2>(&of_bad, i, 16), "curve {i}");
    }
}

#[test]
fn curves_of_every_size_are_fitted() {
    let (_, wanted) = fitted::<2>(&of(bending(2.0)), &one(&S[..4], false), 16);
    assert_eq!(wanted.status, CurveStatus::Converged, "{wanted:?}");
    for size in [1e-100, 1e-9, 1e9, 1e100] {
        let points: Vec<Planar> = S[..4].iter().map(|p| p.map(|x| size * x)).collect();
        let (_, report) = fitted::<2>(&of(bending(2.0)), &one(&points, false), 16);
        assert_eq!(report.status, CurveStatus::Converged, "{size:e}: {report:?}");
        assert!((report.energy * size / wanted.energy - 1.0).abs() <= 1e-9, "{size:e}: {report:?}");
    }
}

/// A walk that turns sharply at every point.
fn wild(seed: u64) -> CurveBatch {
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let coords: Vec<f64> = (0..24).map(|_| rng.random_range(-1.0..1.0)).collect();
    CurveBatch::from_ragged(2, coords, vec![0, 12]).unwrap()
}

#[test]
fn bending_alone_runs_away_on_wild_data_and_the_tautness_proposed_holds_it() {
    let mut unbounded = 0;
    for seed in 0..8 {
        let batch = wild(seed);
        let found = fit(&of(bending(2.0)), &batch);
        let report = found.reports()[0].clone();
        println!("{:?} after {} iterations: {:?}", report.status, report.iterations, report.message);
        if report.status != CurveStatus::Unbounded {
            continue;
        }
        unbounded += 1;
        // It comes out as its input, and nothing is reported of the curve that ran away.
        assert_eq!(found.polylines(Sampling::PerSpan(16)).points(0), batch.points(0));
        assert!(report.energy.is_nan() && report.max_deviation == 0.0, "{report:?}");
        let message = report.message.unwrap();
        let (said, advice) = message.split_once("; add tautness to it, such as tautness=").unwrap();
        assert_eq!(
            said,
            format!(
                "curve 0, point 0: its length passed 5 times that of its points' polygon after {} iterations while its \
                 energy fell: this energy has no minimum here, and the curve stays as it is",
                report.iterations
            )
        );
        let held = of(bending(2.0) + advice.parse::<f64>().unwrap() * tautness());
        let report = fit(&held, &batch).reports()[0].clone();
        println!("  with tautness: {:?} after {} iterations", report.status, report.iterations);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    }
    assert!(unbounded >= 3, "{unbounded} ran away");
}

#[test]
fn bending_and_tautness_have_a_curve_for_every_border_in_any_unit_and_none_runs_into_loops() {
    let borders = io::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/countries-110m.geojson")).unwrap();
    let taut = of(bending(2.0) + tautness());
    let found = fit(&taut, &borders);
    let others: Vec<_> = found.reports().iter().filter(|report| report.status != CurveStatus::Converged).collect();
    // One border is a point.
    println!("{} of {} converge; {others:?}", found.len() - others.len(), found.len());
    assert!(others.len() == 1 && others[0].status == CurveStatus::Degenerate, "{others:?}");
    let chords = |i: usize| {
        let points = borders.points(i).as_chunks::<2>().0;
        let after = |k: usize| points[if k + 1 == points.len() { 0 } else { k + 1 }];
        (0..borders.spans(i)).map(|k| (after(k)[0] - points[k][0]).hypot(after(k)[1] - points[k][1])).sum::<f64>()
    };
    // A loop around a point makes one span several times as long, and most borders a few per cent longer.
    let longest = (0..found.len()).map(|i| found.curve(i).length() / chords(i)).fold(0.0, f64::max);
    assert!(longest < 1.5, "{longest} times as long as its chords");
    // In units a thousand times smaller the same curves, with the same weight.
    let coords: Vec<f64> = borders.coords().iter().map(|x| 1000.0 * x).collect();
    let closed = (0..borders.len()).map(|i| borders.is_closed(i)).collect();
    let offsets = borders.offsets().to_vec();
    let large = CurveBatch::from_ragged(2, coords, offsets).unwrap().closed_each(closed).unwrap();
    let same = fit(&taut, &large);
    let (here, there) = (found.polylines(Sampling::PerSpan(16)), same.polylines(Sampling::PerSpan(16)));
    for i in 0..borders.len() {
        let off = std::iter::zip(here.points(i), there.points(i)).map(|(x, y)| (x - y / 1000.0).abs());
        // Curves end within their tolerance of the minimum.
        assert!(off.fold(0.0, f64::max) <= 1e-6 * chords(i) + 1e-12, "curve {i}");
    }
}

#[test]
fn too_few_iterations_are_said_and_the_best_curve_is_returned() {
    let fair = Fair { max_iterations: 1, ..of(bending(2.0) + length()) };
    let (vertices, report) = fitted::<2>(&fair, &one(&S, false), 16);
    assert_eq!((report.status, report.iterations), (CurveStatus::NotConverged, 1));
    let sentence = format!(
        "curve 0, point 0: 1 iterations were not enough, with a gradient of {:.1e} where 1.0e-8 was asked for: allow more",
        report.gradient_norm
    );
    assert_eq!(report.message.as_deref(), Some(&sentence[..]));
    let (_, best) = fitted::<2>(&of(bending(2.0) + length()), &one(&S, false), 16);
    let (_, start) = fitted::<2>(&Fair { max_iterations: 0, ..fair.clone() }, &one(&S, false), 16);
    let found = energy_of(&fair.energy, &vertices, false);
    assert!(best.energy < found && found < start.energy, "{} {found} {}", best.energy, start.energy);
}

fn refused(fair: &Fair, batch: &CurveBatch) -> String {
    fair.fit(batch, &Device::cpu()).err().unwrap().to_string()
}

#[test]
fn what_makes_no_sense_is_refused_with_a_sentence() {
    let batch = one(&S, false);
    let check = |fair: Fair, sentence: &str| assert_eq!(refused(&fair, &batch), sentence);
    check(of(-1.0 * bending(2.0)), "the weight of bending is -1: give a finite number of at least 0");
    check(of(f64::NAN * length()), "the weight of length is NaN: give a finite number of at least 0");
    check(of(bending(0.5)), "the exponent of bending is 0.5: give a finite number of at least 1");
    for nothing in [Energy::default(), 0.0 * bending(2.0), attachment()] {
        check(
            of(nothing),
            "the energy has no fairness in it: give bending, variation, length or tension a positive weight",
        );
    }
    for tolerance in [0.0, -1.0, f64::INFINITY] {
        let sentence = format!("the tolerance is {tolerance}; it must be a positive number, such as 1e-8");
        check(Fair { tolerance, ..Fair::default() }, &sentence);
    }
    check(
        Fair { segments: Segments::PerSpan(0), ..Fair::default() },
        "0 segments a span: at least 1 is needed, such as 16",
    );
    check(
        Fair { segments: Segments::Spacing(-0.1), ..Fair::default() },
        "the spacing is -0.1; it must be a positive length in units of the input, such as 0.5",
    );
    check(
        Fair { pins: Pins::Ends, ..Fair::default() },
        "points that are not pinned need an attachment, or the curve would not know of them: add attachment to the \
         energy, or pin all points",
    );
    check(
        of(bending(2.0) + attachment()),
        "the energy attaches the curve to points that are all pinned: pin the ends only, or none, or leave the \
         attachment out",
    );
    let nu = Constraints { exponents: Some(vec![2.0; 5]), ..Constraints::default() };
    let known = Constraints { known: Some(vec![true; 5]), ..Constraints::default() };
    for (constraints, what) in [(nu, "exponents of spans (column nu)"), (known, "known control points (column known)")]
    {
        let batch = batch.clone().with_constraints(constraints).unwrap();
        let sentence =
            format!("fair curves know no {what}: leave these columns out, or choose a method that knows them");
        assert_eq!(refused(&Fair::default(), &batch), sentence);
    }
}

#[test]
fn spacing_gives_edges_no_longer_than_asked() {
    let fair = Fair { segments: Segments::Spacing(0.1), ..of(bending(2.0) + length()) };
    let fit = fit(&fair, &one(&S, false));
    assert_eq!(fit.usable(), 1);
    let samples = fit.polylines(Sampling::Spacing(0.1));
    let edges = samples.points(0).as_chunks::<2>().0.windows(2).map(|pair| norm(minus(pair[1], pair[0])));
    assert!(edges.clone().all(|edge| edge <= 0.1 + 1e-12) && edges.fold(0.0, f64::max) > 0.095);
    // Twice as fine is closer to the smooth curve by h²: the edges are those asked for.
    let at = |spacing: f64| {
        let fair = Fair { segments: Segments::Spacing(spacing), ..fair.clone() };
        fitted::<2>(&fair, &one(&S, false), 1).1.energy
    };
    let energies = [0.2, 0.1, 0.05, 0.025].map(at);
    let steps: Vec<f64> = energies.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    assert!(steps[0] > 2.5 * steps[1] && steps[1] > 2.5 * steps[2], "{energies:?}");
}

#[test]
fn polylines_of_k_points_have_n_times_k_minus_1_plus_1_and_closed_ones_n_times_k() {
    let fit = fit(&of(bending(2.0) + length()), &one(&S, false));
    let closed = self::fit(&of(bending(2.0) + length()), &one(&S, true));
    for n in [1, 5, 16, 40] {
        assert_eq!(fit.polylines(Sampling::PerSpan(n)).count(0), 4 * n + 1);
        assert_eq!(closed.polylines(Sampling::PerSpan(n)).count(0), 5 * n);
    }
}

#[test]
fn the_curve_goes_on_smoothly_across_spans_and_has_the_vertices_curvature() {
    for closed in [false, true] {
        let fit = fit(&of(bending(2.0) + length()), &one(&S, closed));
        let (curve, vertices) = (fit.curve(0), vertices::<2>(&fit, 0, 16));
        let count = vertices.len();
        for span in 0..curve.spans() - usize::from(!closed) {
            let (end, start) = (curve.jet(span, 1.0), curve.jet((span + 1) % curve.spans(), 0.0));
            assert_eq!(end.point, start.point, "span {span}");
            assert!(end.first.angle_between(start.first) <= 1e-7, "span {span}");
            assert!((end.curvature(2) - start.curvature(2)).abs() <= 1e-9, "span {span}");
        }
        for row in 1..count - 1 {
            let jet = curve.jet(row / 16, (row % 16) as f64 / 16.0);
            assert_eq!([jet.point.x, jet.point.y], vertices[row]);
            let (e, f) = (minus(vertices[row], vertices[row - 1]), minus(vertices[row + 1], vertices[row]));
            let (s, t) = (norm(e), norm(f));
            let k = norm(minus(f.map(|x| x / t), e.map(|x| x / s))) / (0.5 * (s + t));
            // K is not quite perpendicular to the tangent where edges differ, as the regularisation leaves
            // them beside data points.
            assert!((jet.curvature(2).abs() - k).abs() <= 0.01 * k + 1e-9, "vertex {row}: {} {k}", jet.curvature(2));
        }
        let polygon = length_of(&vertices, closed);
        assert!(curve.length() >= polygon && curve.length() <= 1.01 * polygon);
        let pieces = curve.beziers(1e-4);
        let outside = |p: glam::DVec3| {
            let nearest = (0..=20_000).map(|k| {
                let t = curve.spans() as f64 * f64::from(k) / 20_000.0;
                (curve.point(t) - p).length()
            });
            nearest.fold(f64::INFINITY, f64::min)
        };
        for piece in pieces.iter().step_by(5) {
            let middle = 0.125 * (piece[0] + 3.0 * piece[1] + 3.0 * piece[2] + piece[3]);
            // The samples are 0.001 apart at most.
            assert!(outside(middle) <= 1e-4 + 0.001, "{}", outside(middle));
        }
    }
}

#[test]
fn flat_points_in_space_have_the_curve_of_their_plane() {
    let points: [Planar; 5] = [[0.0, 0.0], [1.0, 0.5], [2.0, -0.4], [3.0, 0.6], [4.0, 0.0]];
    let ring: [Planar; 5] = [[2.0, 0.1], [0.9, 1.4], [-1.2, 1.0], [-1.0, -1.3], [1.1, -0.9]];
    let fair = Fair { energy: variation() + 0.5 * length(), segments: Segments::PerSpan(64), ..Fair::default() };
    let turned = DMat3::from_euler(glam::EulerRot::ZXZ, 0.4, 1.1, -2.0);
    let level = |[x, y]: Planar| [x, y, 0.7];
    let steep = |[x, y]: Planar| (turned * DVec3::new(x, y, 0.0) + DVec3::new(5.0, -3.0, 2.0)).to_array();
    for closed in [false, true] {
        let own = if closed { ring } else { points };
        let planar = fit(&fair, &one(&own, closed));
        assert_eq!(planar.reports()[0].status, CurveStatus::Converged, "{:?}", planar.reports());
        let wanted: Vec<Planar> = vertices(&planar, 0, 64);
        // A curve that lies in no plane is beside them.
        let wound: Vec<Spatial> = (0..5).map(|k| [own[k][0], own[k][1], 0.1 * (k * k) as f64]).collect();
        let curves = [own.map(level).to_vec(), wound, own.map(steep).to_vec()];
        let coords = curves.concat().into_flattened();
        let batch = CurveBatch::from_ragged(3, coords, vec![0, 5, 10, 15]).unwrap().closed(closed);
        let counter = Arc::new(AtomicUsize::new(0));
        let both = fair.fit(&batch, &Device::cpu().with_counter(counter.clone())).unwrap();
        assert_eq!(counter.load(Ordering::Relaxed), 3);
        for i in [0, 2] {
            assert_eq!(both.reports()[i].status, CurveStatus::Converged, "{:?}", both.reports()[i]);
            let found: Vec<Spatial> = vertices(&both, i, 64);
            (0..5).for_each(|k| assert_eq!(found[64 * k], curves[i][k]));
            let away =
                found.iter().zip(&wanted).map(|(x, y)| norm(minus(*x, if i == 0 { level(*y) } else { steep(*y) })));
            let away = away.fold(0.0, f64::max);
            assert!(away <= if i == 0 { 0.0 } else { 1e-8 }, "closed {closed}, {i}: {away:e}");
        }
        let alone = fit(&fair, &one(&curves[1], closed));
        assert_eq!(alone.reports()[0], both.reports()[1]);
        assert_eq!(vertices::<3>(&alone, 0, 64), vertices::<3>(&both, 1, 64));
    }
}
