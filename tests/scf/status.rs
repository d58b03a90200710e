//! Every curve of a batch is fitted or says why not, by itself, and the same every time.

use faircurve::scf::{Smooth, Start};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Fit, Sampling};
use glam::DVec2;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::common::{S, SCALENE, circumcircle, fit, of, set};
use crate::points::{Planar, constrained, one};
use crate::rough::Family;

#[test]
fn repeated_points_count_once() {
    let (quad, _) = set("quad");
    for (plain, closed) in [(&S[..], false), (&quad, true)] {
        let mut points = plain.to_vec();
        for k in [3, 2, 2, 0] {
            points.insert(k, plain[k]);
        }
        if closed {
            // At the end again, as some files close their curves.
            points.push(plain[0]);
        }
        let [alone, again] = [plain, &points].map(|points| {
            // As given: no repeated end is dropped.
            CurveBatch::from_ragged(2, points.as_flattened().to_vec(), vec![0, points.len()]).unwrap().closed(closed)
        });
        let [alone, again] = [fit(&of(3.0), &alone), fit(&of(3.0), &again)];
        assert_eq!(alone.reports()[0].status, CurveStatus::Converged);
        assert_eq!(alone.reports(), again.reports());
        let curve = again.curve(0);
        assert_eq!(curve.length(), alone.curve(0).length());
        let (knots, mut zero_spans) = (curve.knots(), 0);
        for span in 0..curve.spans() {
            let point = curve.jet(span, 0.5).point;
            if points[span] == points[(span + 1) % points.len()] {
                zero_spans += 1;
                assert!(knots[span + 1] == knots[span] && [point.x, point.y] == points[span], "span {span}");
            } else {
                assert!(knots[span + 1] > knots[span], "span {span}");
            }
        }
        assert!(zero_spans >= 4, "{zero_spans}");
        let samples = again.polylines(Sampling::PerSpan(4));
        assert_eq!(samples.count(0), 4 * curve.spans() + usize::from(!closed));
        assert!(samples.points(0).iter().all(|x| x.is_finite()));
    }
}

#[test]
fn two_points_and_points_on_a_line_are_joined_straight() {
    let on_a_line: Vec<Planar> = [0.0, 1.0, 1.5, 4.0].iter().map(|&t| [3.0 * t, 4.0 * t]).collect();
    for points in [&on_a_line[..2], &on_a_line] {
        for nu in [1.2, 2.0, 20.0] {
            let found = fit(&of(nu), &one(points, false));
            let report = &found.reports()[0];
            assert_eq!((report.status, report.message.as_ref()), (CurveStatus::Converged, None), "ν = {nu}");
            assert!(report.energy.abs() <= 1e-12 && report.iterations <= 2, "ν = {nu}: {report:?}");
            let end = points[points.len() - 1];
            assert!((found.curve(0).length() - end[0].hypot(end[1])).abs() <= 1e-12);
            let samples = found.polylines(Sampling::PerSpan(8));
            assert!(samples.points(0).as_chunks::<2>().0.iter().all(|[x, y]| (4.0 * x - 3.0 * y).abs() <= 1e-7));
        }
    }
    // A bow, where the ends are held.
    let bow = fit(&of(2.0), &constrained(&[[0.0, 0.0], [2.0, 0.0]], false, &[(0, [0.0, 1.0]), (1, [0.0, -1.0])], &[]));
    assert!((bow.reports()[0].energy * 2.0 - 5.742160088369037).abs() <= 1e-12);
}

/// Everything said of one curve.
fn said(nu: f64, batch: &CurveBatch) -> (CurveStatus, String) {
    let found = fit(&of(nu), batch);
    let report = &found.reports()[0];
    (report.status, report.message.clone().unwrap_or_default())
}

#[test]
fn what_cannot_be_fitted_says_why_and_comes_out_as_it_came_in() {
    let same = "curve 0, point 0: all points of the curve are one and the same; at least two different points are needed: add points, or \
                remove the curve";
    for closed in [false, true] {
        for points in [&S[..1], &[S[1]; 4]] {
            let batch = one(points, closed);
            let (status, message) = said(2.0, &batch);
            assert_eq!((status, message.as_str()), (CurveStatus::Degenerate, same));
            let found = fit(&of(2.0), &batch);
            assert!(found.reports()[0].energy.is_nan() && !found.curve(0).is_fitted());
            assert_eq!(found.polylines(Sampling::PerSpan(16)).points(0), batch.points(0));
        }
    }
    let mut points = S;
    points[2][1] = f64::NAN;
    let (status, message) = said(2.0, &one(&points, false));
    assert_eq!(status, CurveStatus::Invalid);
    assert!(message.contains("y is NaN; every coordinate must be a finite number"), "{message}");
    let far = [[-4.9e21, 0.0], [1e-300, 1.2], [1e300, 0.0]];
    let (status, message) = said(2.0, &one(&far, false));
    let sentence =
        "curve 0, point 1: the curve from this point to the next is too long for the range of numbers: scale the curve";
    assert_eq!((status, message.as_str()), (CurveStatus::Invalid, sentence));
    let (status, message) = said(2.0, &constrained(&S, false, &[(3, [0.0, 0.0])], &[]));
    let sentence = "curve 0, point 3: the tangent is 0 long and has no direction: leave it out, or give one";
    assert_eq!((status, message.as_str()), (CurveStatus::Invalid, sentence));
    let constraints = Constraints { exponents: Some(vec![2.0, 1.0, 2.0, 2.0, 2.0]), ..Constraints::default() };
    let (status, message) = said(2.0, &one(&S, false).with_constraints(constraints).unwrap());
    let sentence = "curve 0, point 1: the exponent nu is 1; it must be above 1, such as 2, or left empty";
    assert_eq!((status, message.as_str()), (CurveStatus::Invalid, sentence));
    assert!(fit(&of(2.0), &CurveBatch::from_ragged(2, vec![], vec![0]).unwrap()).is_empty());
    let (status, _) = said(2.0, &CurveBatch::from_ragged(2, vec![], vec![0, 0]).unwrap());
    assert_eq!(status, CurveStatus::Degenerate);
}

#[test]
fn what_makes_no_sense_is_refused_with_a_sentence() {
    let refused = |smooth: Smooth, batch: &CurveBatch| smooth.fit(batch, &Device::cpu()).err().unwrap().to_string();
    let batch = one(&S, false);
    for nu in [1.0, 0.5, -2.0, f64::INFINITY, f64::NAN] {
        assert_eq!(refused(of(nu), &batch), format!("the exponent is {nu}; it must be above 1, such as 2"));
    }
    for tolerance in [0.0, -1.0, f64::NAN] {
        let sentence = format!("the tolerance is {tolerance}; it must be a positive number, such as 1e-10");
        assert_eq!(refused(Smooth { tolerance, ..Smooth::default() }, &batch), sentence);
    }
    assert_eq!(refused(Smooth { starts: 0, ..Smooth::default() }, &batch), "0 starts: at least 1 is needed");
    assert_eq!(
        refused(Smooth::default(), &one(&[[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]], false)),
        "smooth connection functions are planar, and the points have three coordinates: leave z out, or choose `discrete::Fair`"
    );
    let sentence = |what: &str| {
        format!(
            "smooth connection functions know no {what}: leave these columns out, or choose a method that knows them"
        )
    };
    assert_eq!(
        refused(Smooth::default(), &constrained(&S, false, &[], &[(1, [0.0, 1.0])])),
        sentence("curvature vectors (columns kx ky kz)")
    );
    let known = Constraints { known: Some(vec![true; 5]), ..Constraints::default() };
    let known = batch.with_constraints(known).unwrap();
    assert_eq!(refused(Smooth::default(), &known), sentence("known control points (column known)"));
}

#[test]
fn curves_that_grow_without_end_have_no_minimiser_and_say_where() {
    const REMEDY: &str = "; give a tension (`Smooth::tension`), add points where it turns, fix a tangent, or choose an exponent nearer to 1";
    for nu in [1.5, 2.0] {
        let (name, points) = ("scalene", &SCALENE);
        let found = fit(&of(nu), &one(points, true));
        let report = &found.reports()[0];
        println!("{name}, ν = {nu}: {report:?}");
        assert_eq!(report.status, CurveStatus::NoMinimiser, "{name}, ν = {nu}");
        let message = report.message.as_ref().unwrap();
        let rest = message.strip_prefix("curve 0, point ").unwrap();
        let (point, rest) = rest.split_once(": ").unwrap();
        assert!(point.parse::<usize>().unwrap() < points.len());
        let nowhere = "from this point to the next there is no curve of least ∫|κ|^ν, from any start tried: it would turn too far, and \
                       larger loops are always cheaper";
        let left = format!(
            "after {} iterations cheaper curves have a segment without minimiser, that from this point to the next, which turns too far: \
             the curve is the best one reached",
            report.iterations
        );
        let said = rest.strip_suffix(REMEDY).unwrap_or_else(|| panic!("{message}"));
        assert!(said == nowhere || said == left, "{message}");
        let samples = found.polylines(Sampling::PerSpan(4));
        assert!(samples.points(0).iter().all(|x| x.is_finite()));
    }
    // Held, the triangle has one.
    let out = |k: usize| {
        let (centre, _) = circumcircle(SCALENE);
        let [x, y] = (DVec2::from(SCALENE[k]) - centre).perp().to_array();
        (k, [x, y])
    };
    let held = fit(&of(2.0), &constrained(&SCALENE, true, &[out(0), out(1), out(2)], &[]));
    println!("{:?}", held.reports()[0]);
}

/// Curves of several lengths, gentle and rough, open ones.
fn ragged(count: usize, seed: u64) -> Vec<Vec<Planar>> {
    let mut rng = StdRng::seed_from_u64(seed);
    let curve = |i: usize| {
        let points = 2 + i % 13;
        (0..points).map(|k| [k as f64, rng.random_range(-0.8..0.8)]).collect()
    };
    (0..count).map(curve).collect()
}

fn together(curves: &[&[Planar]], closed: bool) -> CurveBatch {
    CurveBatch::from_slices(curves).unwrap().closed(closed)
}

#[test]
fn a_curves_bits_depend_on_nothing_but_the_curve() {
    let curves = ragged(3000, 5);
    for (closed, smooth) in [(false, of(3.0)), (true, Smooth { starts: 3, seed: 9, ..of(4.0) })] {
        let take = |which: &[usize]| {
            let chosen: Vec<&[Planar]> = which.iter().map(|&i| &curves[i][..]).collect();
            fit(&smooth, &together(&chosen, closed))
        };
        let all = take(&(0..curves.len()).collect::<Vec<_>>());
        let mut which: Vec<usize> = (0..curves.len()).filter(|i| i % 7 < 3).collect();
        which.reverse();
        let some = take(&which);
        for (place, &i) in which.iter().enumerate() {
            // Messages name the curve's number.
            let [a, b] = [&all.reports()[i], &some.reports()[place]];
            assert_eq!(
                (a.status, a.energy.to_bits(), a.iterations),
                (b.status, b.energy.to_bits(), b.iterations),
                "curve {i}"
            );
            let points = |fit: &Fit, i: usize| {
                let curve = fit.curve(i);
                (0..curve.spans()).map(|span| curve.jet(span, 0.3).point.to_array()).collect::<Vec<_>>()
            };
            assert_eq!(points(&all, i), points(&some, place), "curve {i}");
        }
        let alone = take(&which[..1]);
        assert_eq!(alone.reports()[0].energy.to_bits(), some.reports()[0].energy.to_bits());
    }
}

#[test]
fn a_bad_curve_leaves_its_neighbours_bits() {
    let mut curves = ragged(60, 6);
    let take =
        |curves: &[Vec<Planar>]| fit(&of(2.0), &together(&curves.iter().map(|c| &c[..]).collect::<Vec<_>>(), false));
    let good = take(&curves);
    curves[11][1][0] = f64::NAN;
    curves[25] = vec![[1.0, 1.0]; 3];
    curves[38][2][1] = f64::INFINITY;
    let bad = take(&curves);
    let wrong = [(11, CurveStatus::Invalid), (25, CurveStatus::Degenerate), (38, CurveStatus::Invalid)];
    for (i, status) in wrong {
        assert_eq!(bad.reports()[i].status, status);
        assert!(bad.reports()[i].message.as_ref().unwrap().starts_with(&format!("curve {i}, point ")));
    }
    for i in (0..60).filter(|i| wrong.iter().all(|(k, _)| k != i)) {
        assert_eq!(good.reports()[i], bad.reports()[i], "curve {i}");
        assert_eq!(
            good.polylines(Sampling::PerSpan(3)).points(i),
            bad.polylines(Sampling::PerSpan(3)).points(i),
            "curve {i}"
        );
    }
}

#[test]
fn more_starts_are_never_worse_and_the_same_seed_gives_the_same_bits() {
    let batch = Family { dimension: 2, closed: true, points: 9, sigma: 0.25 }.batch(300, 7);
    for nu in [2.0, 4.0] {
        let with = |starts: u32, seed: u64| fit(&Smooth { starts, seed, ..of(nu) }, &batch);
        let [one, several, again, other] = [with(1, 0), with(12, 0), with(12, 0), with(12, 1)];
        assert_eq!(format!("{:?}", several.reports()), format!("{:?}", again.reports()));
        let (mut better, mut more) = (0, 0);
        for i in 0..batch.len() {
            let [first, best] = [&one.reports()[i], &several.reports()[i]];
            if first.status == CurveStatus::Converged {
                assert_eq!(best.status, CurveStatus::Converged, "curve {i}");
                assert!(best.energy <= first.energy, "curve {i}: {} {}", best.energy, first.energy);
                better += usize::from(best.energy < first.energy * (1.0 - 1e-6));
            } else {
                more += usize::from(best.status == CurveStatus::Converged);
            }
        }
        println!("ν = {nu}: {better} of {} better, {more} found only so", batch.len());
        assert!(other.reports().iter().zip(several.reports()).any(|(a, b)| a.energy != b.energy));
    }
}

#[test]
fn every_start_leads_to_the_same_gentle_curve() {
    let batch = Family { dimension: 2, closed: false, points: 12, sigma: 0.2 }.batch(200, 8);
    let found =
        [Start::Circle, Start::Neighbours, Start::Bisector].map(|start| fit(&Smooth { start, ..of(3.0) }, &batch));
    for i in 0..batch.len() {
        let energies = [0, 1, 2].map(|k| found[k].reports()[i].energy);
        assert!(energies.iter().all(|e| (e / energies[0] - 1.0).abs() <= 1e-9), "curve {i}: {energies:?}");
    }
}

#[test]
fn too_few_iterations_are_said() {
    let (points, closed) = set("quad");
    let found = fit(&Smooth { max_iterations: 1, ..of(4.0) }, &one(&points, closed));
    let report = &found.reports()[0];
    assert_eq!((report.status, report.iterations), (CurveStatus::NotConverged, 1));
    let sentence = format!(
        "curve 0, point 0: 1 iterations were not enough, with a decrement of {:.1e} where 1.0e-10 was asked for: allow more",
        report.gradient_norm
    );
    assert_eq!(report.message.as_deref(), Some(&sentence[..]));
    let best = fit(&of(4.0), &one(&points, closed)).reports()[0].energy;
    assert!(report.energy > best && report.energy < 1.2 * best, "{} {best}", report.energy);
}

#[test]
fn messages_name_no_decrement_where_there_is_none() {
    let triangle = one(&[[0.0, 0.0], [2.0, 0.2], [0.7, 1.4]], true);
    for nu in [1.05, 1.1, 1.15, 1.2, 1.3, 2.0] {
        let found = fit(&of(nu), &triangle);
        let message = found.reports()[0].message.clone().unwrap_or_default();
        assert!(!message.contains("inf"), "ν = {nu}: {message}");
    }
}
