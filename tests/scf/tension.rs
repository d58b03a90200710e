//! Curves under tension: least Σ∫(|κ|^ν + λ) ds.

use faircurve::scf::Smooth;
use faircurve::{CurveBatch, CurveStatus, Device, Fit, Sampling};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use serde::Deserialize;

use crate::common::{fit, of, slopes, wrap};

/// A row of the reference values of `scf_tension.py`, rounded to f64.
#[derive(Deserialize)]
struct Exact {
    closed: bool,
    nu: f64,
    tension: f64,
    points: Vec<[f64; 2]>,
    cost: f64,
}

fn taut(exponent: f64, tension: f64) -> Smooth {
    Smooth { exponent, tension, ..Smooth::default() }
}

fn one(points: &[[f64; 2]], closed: bool) -> CurveBatch {
    CurveBatch::from_slices(&[points]).unwrap().closed(closed)
}

/// A walk with turns of any size, or points around a circle.
fn random(rng: &mut StdRng, closed: bool) -> Vec<[f64; 2]> {
    let n = rng.random_range(3..9);
    let (mut at, mut direction) = ([0.0, 0.0], 0.0f64);
    let point = |k: usize| {
        if closed {
            let angle = std::f64::consts::TAU * (k as f64 + rng.random_range(-0.4..0.4)) / n as f64;
            let radius = rng.random_range(0.4..1.6);
            return [radius * angle.cos(), radius * angle.sin()];
        }
        direction += rng.random_range(-2.8..2.8);
        let length = 10f64.powf(rng.random_range(-0.7..0.7));
        at = [at[0] + length * direction.cos(), at[1] + length * direction.sin()];
        at
    };
    (0..n).map(point).collect()
}

fn converged(fit: &Fit) {
    for report in fit.reports() {
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    }
}

#[test]
fn curves_cost_as_in_fifty_digit_arithmetic() {
    let rows: Vec<Exact> = serde_json::from_str(include_str!("../data/scf_tension.json")).unwrap();
    assert_eq!(rows.len(), 97);
    let mut largest: f64 = 0.0;
    for row in rows {
        let found = fit(&taut(row.nu, row.tension), &one(&row.points, row.closed));
        converged(&found);
        let off = (found.reports()[0].energy / row.cost - 1.0).abs();
        assert!(off < 1e-13, "ν = {}, {:?}: the cost is off by {off:e}", row.nu, row.points);
        largest = largest.max(off);
    }
    println!("costs are off by {largest:.1e} at most");
}

#[test]
fn every_random_list_of_points_has_a_curve() {
    let mut rng = StdRng::seed_from_u64(3);
    for nu in [1.5, 2.0, 3.0, 20.0] {
        let lists: Vec<(bool, Vec<[f64; 2]>)> = (0..40).map(|k| (k % 2 == 0, random(&mut rng, k % 2 == 0))).collect();
        let slices: Vec<&[[f64; 2]]> = lists.iter().map(|(_, points)| &points[..]).collect();
        let closed = lists.iter().map(|(closed, _)| *closed).collect();
        let batch = CurveBatch::from_slices(&slices).unwrap().closed_each(closed).unwrap();
        let found = taut(nu, 1.0).fit(&batch, &Device::cpu()).unwrap();
        for (report, (closed, points)) in found.reports().iter().zip(&lists) {
            assert_eq!(report.status, CurveStatus::Converged, "ν = {nu}, closed {closed}, {points:?}: {report:?}");
        }
    }
}

#[test]
fn what_has_no_minimiser_without_tension_has_one_with_it() {
    let scalene = [[0.0, 0.0], [2.0, 0.2], [0.7, 1.4]];
    let zigzag: Vec<[f64; 2]> = (0..9).map(|k| [0.1 * k as f64, f64::from(k % 2)]).collect();
    let spike = [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0]];
    let there_and_back = [[0.0, 0.0], [1.0, 0.0], [0.3, 0.0]];
    for nu in [1.5, 2.0, 3.0, 20.0] {
        for (points, closed) in [
            (&scalene[..], true),
            (&zigzag[..], false),
            (&spike[..], false),
            (&spike[..], true),
            (&there_and_back[..], false),
        ] {
            converged(&fit(&taut(nu, 1.0), &one(points, closed)));
        }
    }
    let without = fit(&of(2.0), &one(&scalene, true));
    assert_eq!(without.reports()[0].status, CurveStatus::NoMinimiser);
    assert!(without.reports()[0].message.as_ref().unwrap().contains("give a tension (`Smooth::tension`)"));
}

#[test]
fn scale_rotation_mirror_and_reversal_change_nothing_else() {
    let mut rng = StdRng::seed_from_u64(8);
    for nu in [1.5, 2.0, 5.0] {
        let points = random(&mut rng, false);
        let energy = |points: &[[f64; 2]]| {
            let found = fit(&taut(nu, 1.0), &one(points, false));
            converged(&found);
            (found.reports()[0].energy, found.curve(0).length())
        };
        let (cost, length) = energy(&points);
        let (sine, cosine) = 0.7f64.sin_cos();
        let moved = |f: &dyn Fn([f64; 2]) -> [f64; 2]| points.iter().map(|&p| f(p)).collect::<Vec<_>>();
        for (other, scale) in [
            (moved(&|[x, y]| [1000.0 * x, 1000.0 * y]), 1000.0),
            (moved(&|[x, y]| [cosine * x - sine * y + 3.0, sine * x + cosine * y]), 1.0),
            (moved(&|[x, y]| [x, -y]), 1.0),
            (points.iter().rev().copied().collect(), 1.0),
        ] {
            let (own, own_length) = energy(&other);
            assert!((own / cost / f64::powf(scale, 1.0 - nu) - 1.0).abs() < 1e-10, "ν = {nu}: {own} for {cost}");
            assert!((own_length / length / scale - 1.0).abs() < 1e-7, "ν = {nu}: {own_length} for {length}");
        }
    }
}

#[test]
fn points_on_a_line_two_points_and_repeated_points_are_exactly_straight() {
    for nu in [1.5, 2.0, 3.0, 20.0] {
        for points in [&[[0.0, 0.0], [3.0, 4.0]][..], &[[0.0, 0.0], [0.0, 0.0], [0.6, 0.8], [0.6, 0.8], [3.0, 4.0]][..]]
        {
            let found = fit(&taut(nu, 1.0), &one(points, false));
            converged(&found);
            let curve = found.curve(0);
            assert!((curve.length() - 5.0).abs() < 1e-14);
            assert_eq!(curve.max_curvature(), 0.0);
            for k in 0..=10 {
                let point = curve.point(0.5 * f64::from(k));
                assert!((point.x * 0.8 - point.y * 0.6).abs() < 1e-14, "ν = {nu}: {point}");
            }
        }
    }
}

#[test]
fn a_weak_tension_leads_to_the_curve_without() {
    let points = [[0.0, 0.0], [1.0, 0.6], [2.1, 0.1], [3.0, 0.9]];
    for nu in [1.5, 2.0, 4.0] {
        let without = fit(&of(nu), &one(&points, false));
        let with = fit(&taut(nu, 1e-4), &one(&points, false));
        converged(&with);
        // λ is of order τ^ν.
        let off = with.reports()[0].energy / without.reports()[0].energy - 1.0;
        assert!(off > -1e-14 && off < 10.0 * 1e-4f64.powf(nu), "ν = {nu}: {off:e}");
        for (one, other) in slopes(&with, 0).iter().zip(slopes(&without, 0)) {
            assert!(wrap(one - other).abs() < 100.0 * 1e-4f64.powf(nu) + 1e-8);
        }
    }
}

#[test]
fn a_curve_does_not_depend_on_its_neighbours_nor_bad_ones() {
    let mut rng = StdRng::seed_from_u64(5);
    let lists: Vec<Vec<[f64; 2]>> = (0..6).map(|_| random(&mut rng, false)).collect();
    let same = [[1.0, 1.0]; 3];
    let bad = [[0.0, 0.0], [f64::NAN, 1.0], [2.0, 0.0]];
    let mut slices: Vec<&[[f64; 2]]> = lists.iter().map(|points| &points[..]).collect();
    slices.insert(2, &same);
    slices.insert(4, &bad);
    let batch = CurveBatch::from_slices(&slices).unwrap();
    let found = taut(3.0, 1.0).fit(&batch, &Device::cpu()).unwrap();
    assert_eq!(found.reports()[2].status, CurveStatus::Degenerate);
    assert_eq!(found.reports()[4].status, CurveStatus::Invalid);
    let together = found.polylines(Sampling::PerSpan(7));
    for (points, i) in lists.iter().zip([0, 1, 3, 5, 6, 7]) {
        let alone = fit(&taut(3.0, 1.0), &one(points, false));
        assert_eq!(alone.polylines(Sampling::PerSpan(7)).points(0), together.points(i));
        assert_eq!(alone.reports()[0].energy.to_bits(), found.reports()[i].energy.to_bits());
    }
}

#[test]
fn the_curve_goes_through_its_points_with_one_tangent_and_one_moment() {
    let mut rng = StdRng::seed_from_u64(11);
    for nu in [1.5, 2.0, 3.0, 20.0] {
        let points = random(&mut rng, true);
        let found = fit(&taut(nu, 1.0), &one(&points, true));
        converged(&found);
        let curve = found.curve(0);
        let largest = curve.max_curvature();
        for k in 0..curve.spans() {
            let (end, next) = (curve.jet(k, 1.0), curve.jet((k + 1) % points.len(), 0.0));
            assert_eq!([next.point.x, next.point.y], points[(k + 1) % points.len()]);
            assert!((end.point - next.point).length() < 1e-13 && (end.first - next.first).length() < 1e-12);
            let [one, other] = [end, next].map(|jet| jet.curvature(2) / largest);
            let moment = |k: f64| k.abs().powf(nu - 1.0).copysign(k);
            assert!((moment(one) - moment(other)).abs() < 1e-7, "ν = {nu}: {one} and {other}");
            // Sites lie where their arc length says: the chords of fine samples add up to it.
            let sites: Vec<_> = (0..=2000).map(|i| curve.jet(k, f64::from(i) / 2000.0)).collect();
            let (mut sum, step) = (0.0, curve.span_length(k) / 2000.0);
            for pair in sites.windows(2) {
                let chord = (pair[1].point - pair[0].point).length();
                assert!((chord / step - 1.0).abs() < (step * largest).powi(2) + 1e-9, "ν = {nu}: {chord} for {step}");
                assert!(pair[1].curvature(2).abs() <= largest * (1.0 + 1e-9));
                sum += chord;
            }
            assert!((sum / curve.span_length(k) - 1.0).abs() < 1e-5);
        }
        let least = found.curve(0).beziers(1e-6).len();
        assert!(least >= points.len() && least < 60 * points.len(), "{least}");
    }
}

#[test]
fn given_tangents_and_exponents_of_spans_are_kept() {
    use faircurve::Constraints;
    let points = [[0.0, 0.0], [1.0, 0.6], [2.1, 0.1], [3.0, 0.9]];
    let nan = [f64::NAN; 2];
    let tangents = vec![nan, [0.0, 1.0], nan, [1.0, 0.0]].into_flattened();
    let constraints = Constraints {
        tangents: Some(tangents),
        exponents: Some(vec![f64::NAN, 4.0, f64::NAN, f64::NAN]),
        ..Constraints::default()
    };
    let batch = one(&points, false).with_constraints(constraints).unwrap();
    let found = fit(&taut(2.0, 1.0), &batch);
    converged(&found);
    let own = slopes(&found, 0);
    assert!((own[1] - std::f64::consts::FRAC_PI_2).abs() < 1e-12 && own[3].abs() < 1e-12, "{own:?}");
    let curve = found.curve(0);
    // ν|κ|^(ν−1) of spans with ν = 4 and 2 at the third point, where the tangent is free.
    let [before, after] = [curve.jet(1, 1.0), curve.jet(2, 0.0)].map(|jet| jet.curvature(2));
    assert!((4.0 * before.powi(3) - 2.0 * after).abs() < 1e-7 * after.abs(), "{before} and {after}");
}

#[test]
fn tensions_that_make_no_sense_are_refused() {
    for (tension, told) in [(-1.0, "-1"), (f64::NAN, "NaN"), (51.0, "51")] {
        let error = taut(2.0, tension).fit(&one(&[[0.0, 0.0], [1.0, 0.0]], false), &Device::cpu()).err().unwrap();
        assert_eq!(
            error.to_string(),
            format!("the tension is {told}; it must be from 0, which is none, to 50, such as 1")
        );
    }
}
