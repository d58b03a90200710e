//! Curves keep their limits, at the least energy, or say where they cannot.

use faircurve::discrete::{Energy, Fair, Limits, Segments, bending, length, tautness, tension, variation};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device};
use serde_json::Value;

use crate::common::*;
use crate::rough::Family;

const SEGMENTS: usize = 16;

fn limited(energy: Energy, curvature: Option<f64>, shape: bool) -> Fair {
    Fair { energy, limits: Limits { curvature, shape, ..Limits::default() }, ..Fair::default() }
}

/// The vectors (T′ − T)/Δa at the vertices between two edges.
fn curvatures<const D: usize>(vertices: &[[f64; D]], closed: bool) -> Vec<[f64; D]> {
    let count = vertices.len();
    let of = |v: usize| {
        let [before, after] = [count - 1, 0].map(|k| minus(vertices[(v + k + 1) % count], vertices[(v + k) % count]));
        let share = 2.0 / (norm(before) + norm(after));
        minus(unit(after), unit(before)).map(|x| share * x)
    };
    if closed { (0..count).map(of).collect() } else { (1..count - 1).map(of).collect() }
}

/// Signed curvatures at the vertices between two edges of an open curve.
fn sides(vertices: &[Planar]) -> Vec<f64> {
    let turn = |w: &[Planar]| {
        let [a, b] = [minus(w[1], w[0]), minus(w[2], w[1])];
        a[0] * b[1] - a[1] * b[0]
    };
    vertices.windows(3).map(turn).collect()
}

/// The same largest curvature for every point of a curve: this part of the largest that it has without limits.
fn bounded(fair: &Fair, batch: CurveBatch, part: f64) -> CurveBatch {
    let free = fit(fair, &batch);
    let d = batch.dimension();
    let largest = |i: usize| match d {
        2 => {
            curvatures::<2>(&vertices(&free, i, SEGMENTS), batch.is_closed(i)).into_iter().map(norm).fold(0.0, f64::max)
        }
        _ => {
            curvatures::<3>(&vertices(&free, i, SEGMENTS), batch.is_closed(i)).into_iter().map(norm).fold(0.0, f64::max)
        }
    };
    let bounds = (0..batch.len()).flat_map(|i| vec![part * largest(i); batch.count(i)]).collect();
    batch.with_constraints(Constraints { largest_curvatures: Some(bounds), ..Constraints::default() }).unwrap()
}

#[test]
fn bounded_and_one_sided_elastica_are_those_of_the_exact_curves() {
    let oracle: Value = serde_json::from_str(include_str!("../data/bounded_elastica.json")).unwrap();
    for case in oracle["cases"].as_array().unwrap() {
        let number = |name: &str| case[name].as_f64();
        let points: Vec<Planar> = serde_json::from_value(case["points"].clone()).unwrap();
        let (exact, bound) = (number("energy").unwrap(), number("kappa_max"));
        let shape = number("kappa_min") == Some(0.0);
        let energy = bending(2.0) + number("length_weight").unwrap() * length();
        let errors = [16, 32, 64].map(|n| {
            let fair = Fair { segments: Segments::PerSpan(n), ..limited(energy.clone(), bound, shape) };
            let (vertices, report) = fitted::<2>(&fair, &one(&points, false), n);
            assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
            if bound.is_some() || shape {
                assert_eq!(report.limits.unwrap().violation, 0.0, "{report:?}");
            }
            if let Some(discrete) = case["discrete_energy"][n.to_string()].as_f64() {
                // The margin of 2e-7 costs less than so much of the energy.
                assert!((report.energy / discrete - 1.0).abs() < 3e-7, "{case}, {n}: {report:?}");
            }
            if let Some(bound) = bound {
                assert_eq!(report.limits.unwrap().active, held(&vertices, bound).iter().filter(|held| **held).count());
                assert_eq!(switches(&vertices, bound, n, case), None, "{n} edges a span");
            }
            report.energy / exact - 1.0
        });
        println!("{}: {errors:?}", case["name"]);
        // By h², 1e-3 at 32 edges a span, and 1e-6 after Richardson.
        assert!(errors[1].abs() < 1e-3, "{errors:?}");
        assert!((errors[0] / errors[1] - 4.0).abs() < 0.3 && (errors[1] / errors[2] - 4.0).abs() < 0.3, "{errors:?}");
        assert!(((4.0 * errors[2] - errors[1]) / 3.0).abs() < 1e-6, "{errors:?}");
    }
}

/// Whether the curvature stands at its bound, at every vertex between two edges.
fn held(vertices: &[Planar], bound: f64) -> Vec<bool> {
    curvatures(vertices, false).into_iter().map(|k| norm(k) > (1.0 - 1e-6) * bound).collect()
}

/// The first span in which the curvature does not enter and leave its bound where that of the exact curve does.
fn switches(vertices: &[Planar], bound: f64, n: usize, case: &Value) -> Option<String> {
    let spans: Vec<Vec<f64>> = serde_json::from_value(case["switches_arclength_in_span"].clone()).unwrap();
    // At the ends of the curve there is no curvature.
    let ends = [vec![false], held(vertices, bound), vec![false]].concat();
    spans.iter().enumerate().find_map(|(span, exact)| {
        let first = span * n;
        let edge = length_of(&vertices[first..=first + n], false) / n as f64;
        let found: Vec<f64> =
            (0..n).filter(|k| ends[first + k] != ends[first + k + 1]).map(|k| (k as f64 + 0.5) * edge).collect();
        let is_near = found.len() == exact.len() && found.iter().zip(exact).all(|(a, b)| (a - b).abs() <= 1.5 * edge);
        (!is_near).then(|| format!("span {span}: {found:?} for {exact:?}, edges of {edge}"))
    })
}

#[test]
fn rough_curves_keep_their_limits_or_are_infeasible() {
    const CURVES: usize = 100;
    // At most so many of a hundred are infeasible, and none is neither.
    for (dimension, closed, sigma, part, shape, most) in [
        (2, false, 0.2, 0.8, false, 1),
        (2, false, 0.6, 0.9, false, 0),
        (2, false, 0.6, 0.8, false, 2),
        (2, false, 1.2, 0.8, false, 9),
        (2, false, 0.6, f64::INFINITY, true, 0),
        (2, false, 0.6, 0.8, true, 3),
        (2, true, 0.2, 0.97, true, 0),
        (3, false, 0.6, 0.9, false, 2),
        (3, false, 1.2, 0.9, false, 0),
    ] {
        let free = limited(bending(2.0) + 0.1 * length(), None, false);
        let batch = Family { dimension, closed, points: 5, sigma }.batch(CURVES, 17);
        let batch = if part.is_finite() { bounded(&free, batch, part) } else { batch };
        let found = fit(&limited(free.energy.clone(), None, shape), &batch);
        let of = |status| found.reports().iter().filter(|report| report.status == status).count();
        let (met, infeasible) = (of(CurveStatus::Converged), of(CurveStatus::Infeasible));
        println!(
            "{dimension}-D, closed {closed}, σ {sigma}, {part}, shape {shape}: {met} met, {infeasible} infeasible"
        );
        assert!(met + infeasible == CURVES && infeasible <= most, "{met}, {infeasible}: at most {most} were expected");
        for (i, report) in found.reports().iter().enumerate() {
            let limits = report.limits.unwrap();
            assert_eq!(report.status == CurveStatus::Converged, limits.violation == 0.0, "{report:?}");
            let bound = batch.constraints().largest_curvatures.as_ref().map(|all| all[5 * i]);
            if report.status != CurveStatus::Converged {
                println!("{}", report.message.as_deref().unwrap_or_default());
                continue;
            }
            let largest = match dimension {
                2 => curvatures::<2>(&vertices(&found, i, SEGMENTS), closed).into_iter().map(norm).fold(0.0, f64::max),
                _ => curvatures::<3>(&vertices(&found, i, SEGMENTS), closed).into_iter().map(norm).fold(0.0, f64::max),
            };
            // A vertex in units of the input has a rounding of its own.
            assert!(bound.is_none_or(|bound| largest <= bound * (1.0 + 1e-9)), "{i}: {largest} {bound:?}");
        }
    }
}

#[test]
fn curves_near_which_others_find_one_that_keeps_its_limits_are_not_called_infeasible() {
    // Between soft penalties all of them end in loops.
    let batch = faircurve::io::read("tests/data/limits_near.csv").unwrap();
    let found = fit(&limited(bending(2.0) + 0.1 * length(), None, false), &batch);
    let kept = found.reports().iter().filter(|report| report.status == CurveStatus::Converged);
    let stretches: Vec<f64> = kept.map(|report| report.limits.unwrap().stretch).collect();
    println!("{} of {}: {stretches:.3?}", stretches.len(), batch.len());
    // Without limits one has a stretch of 2.8, and the one near it is longer than others.
    assert!(batch.len() == 23 && stretches.iter().filter(|stretch| **stretch < 1.25).count() >= 20);
}

#[test]
fn a_radius_that_the_shortest_curve_keeps_is_kept() {
    // Its length is 6.5976, and its energy at most (0.8² + 0.5) times that.
    let tight = [[0.0, 0.44], [1.12, -1.65], [2.09, -0.06]];
    let energy = bending(2.0) + 0.5 * length();
    let fair = limited(energy.clone(), Some(0.8), false);
    let (found, report) = fitted::<2>(&fair, &one(&tight, false), SEGMENTS);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    let largest = curvatures(&found, false).into_iter().map(norm).fold(0.0, f64::max);
    assert!(largest <= 0.8 * (1.0 + 1e-9) && report.energy <= 1.14 * 6.5976, "{largest} {report:?}");
    let cost = report.limits.unwrap().cost;
    let free = fit(&limited(energy.clone(), None, false), &one(&tight, false)).reports()[0].energy;
    assert!((cost - (report.energy / free - 1.0)).abs() < 1e-6, "{cost} {free}");
    // What is left turns by loops that cross, or is more than 1.5 times as long as its shortest curve.
    for (closed, most) in [(false, 16), (true, 30)] {
        let batch = Family { dimension: 2, closed, points: 5, sigma: 0.6 }.batch(60, 17);
        let found = fit(&limited(energy.clone(), Some(0.9), false), &batch);
        let of = |status| found.reports().iter().filter(|report| report.status == status).count();
        let (met, infeasible) = (of(CurveStatus::Converged), of(CurveStatus::Infeasible));
        println!("closed {closed}: {met} met, {infeasible} infeasible");
        assert!(met + infeasible == 60 && infeasible <= most, "{met} met, {infeasible} infeasible");
    }
}

#[test]
fn convex_points_have_a_convex_curve() {
    let points = [[-0.3, 1.2], [0.0, 0.0], [1.5, 0.0], [3.0, 0.15], [3.2, 1.4]];
    let [free, kept] = [false, true].map(|shape| {
        let fair = limited(bending(2.0) + 0.01 * length(), None, shape);
        let (vertices, report) = fitted::<2>(&fair, &one(&points, false), SEGMENTS);
        assert_eq!(report.status, CurveStatus::Converged);
        sides(&vertices).into_iter().fold(f64::INFINITY, f64::min)
    });
    assert!(free < -1e-5 && kept >= 0.0, "{free} {kept}");
}

#[test]
fn curves_that_keep_their_limits_anyway_have_the_same_bits_and_cost_nothing() {
    let batch = Family { dimension: 2, closed: false, points: 6, sigma: 0.4 }.batch(20, 3);
    let free = fit(&limited(Fair::default().energy, None, false), &batch);
    let wide = fit(&limited(Fair::default().energy, Some(1e3), false), &batch);
    for i in 0..batch.len() {
        assert_eq!(vertices::<2>(&free, i, SEGMENTS), vertices::<2>(&wide, i, SEGMENTS));
        let limits = wide.reports()[i].limits.unwrap();
        assert_eq!((limits.violation, limits.active, limits.cost), (0.0, 0, 0.0));
        assert_eq!((free.reports()[i].limits, free.reports()[i].iterations), (None, wide.reports()[i].iterations));
    }
}

#[test]
fn a_bound_of_one_span_leaves_the_others_free() {
    let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0], [4.0, 0.0]];
    let energy = bending(2.0) + length();
    let (free, _) = fitted::<2>(&limited(energy.clone(), None, false), &one(&points, false), SEGMENTS);
    let bound =
        0.8 * curvatures(&free, false)[SEGMENTS + 4..2 * SEGMENTS - 4].iter().map(|k| norm(*k)).fold(0.0, f64::max);
    let column = vec![f64::NAN, bound, f64::NAN, f64::NAN, f64::NAN];
    let batch = one(&points, false)
        .with_constraints(Constraints { largest_curvatures: Some(column), ..Constraints::default() })
        .unwrap();
    let (kept, report) = fitted::<2>(&limited(energy, None, false), &batch, SEGMENTS);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    let found = curvatures(&kept, false);
    let largest = |rows: std::ops::Range<usize>| found[rows].iter().map(|k| norm(*k)).fold(0.0, f64::max);
    assert!(largest(SEGMENTS - 1..2 * SEGMENTS) <= bound && largest(2 * SEGMENTS..4 * SEGMENTS - 1) > 1.2 * bound);
}

#[test]
fn limits_and_a_deviation_are_both_kept() {
    let batch = Family { dimension: 2, closed: false, points: 10, sigma: 0.6 }.batch(60, 23);
    let near = Fair { deviation: Some(0.2.into()), ..limited(bending(2.0) + tautness(), None, false) };
    let batch = bounded(&near, batch, 0.85);
    let found = fit(&near, &batch);
    let mut met = 0;
    for (i, report) in found.reports().iter().enumerate() {
        assert!(matches!(report.status, CurveStatus::Converged | CurveStatus::Infeasible), "{report:?}");
        if report.status == CurveStatus::Converged {
            met += 1;
            let bound = batch.constraints().largest_curvatures.as_ref().unwrap()[10 * i];
            let largest =
                curvatures::<2>(&vertices(&found, i, SEGMENTS), false).into_iter().map(norm).fold(0.0, f64::max);
            assert!(largest <= bound * (1.0 + 1e-9) && report.max_deviation <= 0.2, "{report:?}");
        }
    }
    println!("{met} of {}", batch.len());
    assert!(met >= 57, "{met}");
}

#[test]
fn an_infeasible_curve_says_where_and_what_is_possible_and_its_neighbours_keep_their_bits() {
    // A square corner in steps of 1 cannot be turned with a radius of 5 through its points.
    let tight = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0]];
    let gentle = [[0.0, 0.0], [1.0, 0.1], [2.0, 0.0], [3.0, 0.1]];
    let fair = limited(Fair::default().energy, Some(0.3), false);
    let batch = CurveBatch::from_slices(&[&gentle[..], &tight[..], &gentle[..]]).unwrap();
    let found = fit(&fair, &batch);
    let report = &found.reports()[1];
    assert_eq!(report.status, CurveStatus::Infeasible, "{report:?}");
    let message = report.message.as_ref().unwrap();
    assert!(
        message.contains("no curve near keeps its limits: its curvature is") && message.contains("0.3 is the largest"),
        "{message}"
    );
    assert!(report.limits.unwrap().violation > 1.0 && !report.status.is_usable());
    let alone = fit(&fair, &one(&gentle, false));
    for i in [0, 2] {
        assert_eq!(vertices::<2>(&found, i, SEGMENTS), vertices::<2>(&alone, 0, SEGMENTS));
    }
}

#[test]
fn limits_that_make_no_sense_are_refused_with_a_sentence() {
    let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]];
    let refused = |fair: &Fair, batch: &CurveBatch| fair.fit(batch, &Device::cpu()).unwrap_err().to_string();
    for bound in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let message = refused(&limited(Fair::default().energy, Some(bound), false), &one(&points, false));
        assert!(message.contains(&format!("the largest curvature is {bound}")), "{message}");
    }
    let message = refused(&limited(tension(), Some(1.0), false), &one(&points, false));
    assert!(message.contains("ask for an energy that holds bending"), "{message}");
    let column = |bounds: [f64; 3]| Constraints { largest_curvatures: Some(bounds.to_vec()), ..Constraints::default() };
    let batch = one(&points, false).with_constraints(column([f64::NAN, -2.0, 1.0])).unwrap();
    let report = &fit(&Fair::default(), &batch).reports()[0].clone();
    assert_eq!(report.status, CurveStatus::Invalid);
    assert_eq!(
        report.message.as_deref(),
        Some("curve 0, point 1: its largest curvature is -2; give a positive number in 1/length, or leave it empty")
    );
}

#[test]
fn exponents_and_variation_keep_limits_too() {
    let points = [[0.0, 0.0], [1.0, 0.8], [2.0, 0.0], [3.0, 0.6]];
    // For large exponents the largest curvature is about as small as it can be.
    for (energy, part) in
        [(bending(4.0) + length(), 0.97), (bending(8.0) + length(), 0.99), (variation() + length(), 0.95)]
    {
        let (free, _) = fitted::<2>(&limited(energy.clone(), None, false), &one(&points, false), SEGMENTS);
        let bound = part * curvatures(&free, false).into_iter().map(norm).fold(0.0, f64::max);
        let (kept, report) = fitted::<2>(&limited(energy, Some(bound), false), &one(&points, false), SEGMENTS);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        assert!(curvatures(&kept, false).into_iter().map(norm).fold(0.0, f64::max) <= bound);
    }
}
