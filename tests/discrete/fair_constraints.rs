//! Fair curves meet what they are asked to meet, to rounding, and are the best that do.

use std::f64::consts::TAU;

use faircurve::discrete::{Energy, Fair, Segments, bending, length, tautness, tension, variation};
use faircurve::{Constraints, CurveBatch, CurveStatus, Fit};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::common::*;

fn held(energy: Energy) -> Fair {
    Fair { energy, ..Fair::default() }
}

const S: [Planar; 5] = [[0.0, 0.0], [1.0, 0.8], [2.0, 0.1], [3.2, -0.5], [4.0, 0.3]];

/// Eight points around an uneven oval.
fn oval() -> Vec<Planar> {
    let radius = [1.0, 1.2, 0.9, 1.1, 1.0, 1.3, 0.95, 1.05];
    let point = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / 8.0).sin_cos();
        [3.0 + 2.0 * radius[k] * cos, radius[k] * sin - 1.0]
    };
    (0..8).map(point).collect()
}

const KNOT: [Spatial; 5] = [[0.0, 0.0, 0.0], [1.0, 0.8, 0.3], [2.0, 0.1, 0.9], [3.2, -0.5, 0.4], [4.0, 0.3, 0.0]];

/// The direction and the curvature vector of a fitted curve at a point, before and after it.
fn sides<const D: usize>(fit: &Fit, k: usize, closed: bool) -> Vec<([f64; D], [f64; D])> {
    let curve = fit.curve(0);
    let spans = curve.spans();
    let before = if k > 0 { Some(k - 1) } else { closed.then_some(spans - 1) };
    let at = before.map(|span| (span, 1.0)).into_iter().chain((k < spans).then_some((k, 0.0)));
    at.map(|(span, u)| {
        let jet = curve.jet(span, u);
        let tangent = jet.first.normalize();
        let bend = (jet.second - jet.second.dot(tangent) * tangent) / jet.first.length_squared();
        (std::array::from_fn(|c| tangent[c]), std::array::from_fn(|c| bend[c]))
    })
    .collect()
}

/// The curve has this tangent at a point, on both sides.
fn assert_tangent<const D: usize>(fit: &Fit, k: usize, closed: bool, tangent: [f64; D]) {
    let sides = sides::<D>(fit, k, closed);
    assert!(!sides.is_empty());
    for (found, _) in sides {
        let away = norm(minus(found, unit(tangent)));
        assert!(away < 1e-14, "point {k}: {found:?} for {tangent:?}");
    }
}

/// The curve has this curvature vector at a point, on both sides.
fn assert_curvature<const D: usize>(fit: &Fit, k: usize, closed: bool, wanted: [f64; D]) {
    for (_, found) in sides::<D>(fit, k, closed) {
        let away = norm(minus(found, wanted));
        assert!(away <= 1e-12 * norm(wanted), "point {k}: {found:?} for {wanted:?}");
    }
}

/// No small move across the curve that keeps the constraints lowers the energy.
fn assert_stationary<const D: usize>(
    energy: &Energy,
    vertices: &[[f64; D]],
    closed: bool,
    n: usize,
    held: &[usize],
    seed: u64,
) {
    let mut rng = StdRng::seed_from_u64(seed);
    let at = energy_of(energy, vertices, closed);
    let count = vertices.len();
    let near = |row: usize| {
        held.iter().any(|&k| {
            let gap = row.abs_diff(k * n);
            gap.min(if closed { count - gap } else { gap }) <= 1
        })
    };
    for _ in 0..50 {
        // A smooth bump in one span that is 0 with its slope at both ends, in a random direction.
        let span = rng.random_range(0..if closed { count / n } else { (count - 1) / n });
        let random: [f64; D] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        let size = 10_f64.powf(rng.random_range(-5.0..-2.0));
        let mut moved = vertices.to_vec();
        for k in 1..n {
            let row = span * n + k;
            if !near(row) {
                let bump = size * (TAU / 2.0 * k as f64 / n as f64).sin().powi(4);
                let tangent = unit(minus(vertices[(row + 1) % count], vertices[row - 1]));
                let along = dot(tangent, random);
                moved[row] = std::array::from_fn(|c| vertices[row][c] + bump * (random[c] - along * tangent[c]));
            }
        }
        let after = energy_of(energy, &moved, closed);
        // Edges that are equal, as the regularisation keeps them, cost h⁴ more than the best: 5e-6 here.
        assert!(after >= at - 1e-6 * at, "a move of {size:e} in span {span}: {after} below {at}");
    }
}

fn assert_through<const D: usize>(vertices: &[[f64; D]], points: &[[f64; D]], n: usize) {
    for (k, point) in points.iter().enumerate() {
        assert_eq!(vertices[k * n].map(f64::to_bits), point.map(f64::to_bits), "point {k}");
    }
}

#[test]
fn curves_pass_through_their_points_bit_for_bit() {
    let fair = held(bending(2.0) + 0.1 * length());
    for (points, closed) in [(S.to_vec(), false), (oval(), true)] {
        let (vertices, report) = fitted::<2>(&fair, &one(&points, closed), 16);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        assert_eq!(report.max_deviation, 0.0);
        assert_through(&vertices, &points, 16);
    }
    let (vertices, _) = fitted::<3>(&fair, &one(&KNOT, false), 16);
    assert_through(&vertices, &KNOT, 16);
}

#[test]
fn tangents_hold_to_rounding_at_ends_and_inside() {
    let fair = held(bending(2.0) + 0.1 * length());
    let tangents = [(0, [1.0, 0.0]), (2, [3.0, -3.0]), (4, [0.2, 0.9])];
    let fit = fit(&fair, &constrained(&S, false, &tangents, &[]));
    let (vertices, report) = (vertices::<2>(&fit, 0, 16), &fit.reports()[0]);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    assert_eq!(vertices.len(), 4 * 16 + 1);
    assert_through(&vertices, &S, 16);
    tangents.iter().for_each(|&(k, tangent)| assert_tangent(&fit, k, false, tangent));
    assert_stationary(&fair.energy, &vertices, false, 16, &[0, 2, 4], 1);
}

#[test]
fn curvature_vectors_hold_at_ends_and_inside_and_on_rings() {
    let tangents = [(0, [1.0, 0.5]), (2, [1.0, -0.8]), (4, [1.0, 1.0])];
    let curvatures = [(0, [-0.5, 1.0]), (2, [0.4, 0.5]), (4, [0.0, 0.0])];
    let energy = variation() + 0.3 * bending(2.0) + 0.1 * length();
    let fit = fit(&held(energy.clone()), &constrained(&S, false, &tangents, &curvatures));
    assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports());
    for ((k, tangent), (_, curvature)) in tangents.into_iter().zip(curvatures) {
        assert_tangent(&fit, k, false, tangent);
        assert_curvature(&fit, k, false, curvature);
    }
    let points = oval();
    let tangents = [(0, [0.2, 1.0]), (3, [-1.0, -0.6])];
    let ring = constrained(&points, true, &tangents, &[(0, [-1.6, 0.32])]);
    let fit = self::fit(&held(energy), &ring);
    assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports());
    let vertices = vertices::<2>(&fit, 0, 16);
    assert_eq!(vertices.len(), 8 * 16);
    assert_through(&vertices, &points, 16);
    tangents.iter().for_each(|&(k, tangent)| assert_tangent(&fit, k, true, tangent));
    assert_curvature(&fit, 0, true, [-1.6, 0.32]);
}

#[test]
fn a_ring_through_8_points_meets_two_tangents_for_any_exponent() {
    let points = oval();
    let tangents = [(0, [0.2, 1.0]), (3, [-1.0, -0.6])];
    for energy in [bending(2.0) + 0.1 * length(), bending(3.0) + 0.1 * length()] {
        let fair = held(energy);
        let fit = fit(&fair, &constrained(&points, true, &tangents, &[]));
        let (vertices, report) = (vertices::<2>(&fit, 0, 16), &fit.reports()[0]);
        assert_eq!(report.status, CurveStatus::Converged, "{}: {report:?}", fair.energy);
        assert_eq!(vertices.len(), 8 * 16);
        assert_through(&vertices, &points, 16);
        tangents.iter().for_each(|&(k, tangent)| assert_tangent(&fit, k, true, tangent));
        assert_stationary(&fair.energy, &vertices, true, 16, &[0, 3], 3);
    }
}

#[test]
fn a_mix_of_constraints_holds_in_space() {
    let tangents = [(0, [1.0, 1.0, 0.0]), (2, [1.0, -0.5, 0.2]), (3, [1.0, 0.0, -1.0])];
    for (energy, curvature) in
        [(bending(2.0) + 0.1 * length(), None), (variation() + bending(2.0), Some([0.5, 1.4, 1.0]))]
    {
        let curvatures: Vec<(usize, Spatial)> = curvature.iter().map(|own| (2, *own)).collect();
        let fit = fit(&held(energy), &constrained(&KNOT, false, &tangents, &curvatures));
        assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports());
        assert_through(&vertices::<3>(&fit, 0, 16), &KNOT, 16);
        tangents.iter().for_each(|&(k, tangent)| assert_tangent(&fit, k, false, tangent));
        curvature.iter().for_each(|&curvature| assert_curvature(&fit, 2, false, curvature));
    }
}

/// The ratios of differences of what is found with 16, 32, 64 and 128 segments a span.
fn ratios(found: impl Fn(usize) -> f64) -> [f64; 2] {
    let [a, b, c, d] = [16, 32, 64, 128].map(found);
    [(b - a) / (c - b), (c - b) / (d - c)]
}

#[test]
fn energies_and_curvatures_are_of_second_order() {
    let wave = [[0.0, 0.0], [1.0, 0.8], [2.0, 0.1], [3.0, -0.5]];
    let tangents = [(0, [1.0, 0.2]), (2, [1.0, -1.2]), (3, [1.0, 0.6])];
    let within = [(2, [1.0, -1.2])];
    let curvatures = [(0, [-0.2, 1.0]), (2, [0.6, 0.5])];
    let bends = bending(2.0) + 0.1 * length();
    let varies = variation() + bending(2.0) + 0.1 * length();
    let tight = bending(2.0) + 0.5 * tension();
    let cases: [(&str, &Energy, CurveBatch); 6] = [
        ("bending, tangents", &bends, constrained(&wave, false, &tangents, &[])),
        ("bending, a tangent within", &bends, constrained(&wave, false, &within, &[])),
        ("tension, tangents", &tight, constrained(&wave, false, &tangents, &[])),
        ("variation, none", &varies, one(&wave, false)),
        ("variation, tangents", &varies, constrained(&wave, false, &tangents, &[])),
        ("variation, curvatures", &varies, constrained(&wave, false, &tangents, &curvatures)),
    ];
    for (name, energy, batch) in cases {
        let fit = |n: usize| {
            let fit = fit(&Fair { segments: Segments::PerSpan(n), ..held(energy.clone()) }, &batch);
            assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{name}: {:?}", fit.reports());
            fit
        };
        let by_energy = ratios(|n| fit(n).reports()[0].energy);
        let by_curvature = ratios(|n| norm(sides::<2>(&fit(n), 3, false)[0].1));
        println!("{name}: energies {by_energy:.2?}, curvatures at the end {by_curvature:.2?}");
        assert!(by_energy.iter().all(|ratio| (3.5..4.6).contains(ratio)), "{name}: {by_energy:?}");
        // A free end has none under bending.
        if name != "bending, a tangent within" {
            assert!(by_curvature.iter().all(|ratio| (3.5..4.6).contains(ratio)), "{name}: {by_curvature:?}");
        }
    }
}

#[test]
fn a_tangent_that_the_free_curve_has_changes_nothing_and_any_other_costs_energy() {
    let fair = held(bending(2.0) + 0.1 * length());
    let free = fit(&fair, &one(&S, false));
    let energy = free.reports()[0].energy;
    let own = sides::<2>(&free, 2, false)[0].0;
    for n in [16, 32] {
        let finer = Fair { segments: Segments::PerSpan(n), ..fair.clone() };
        let (same, with_own) = fitted(&finer, &constrained(&S, false, &[(2, own)], &[]), n);
        let (free, report) = fitted::<2>(&finer, &one(&S, false), n);
        // Two half turns cost h³κ′²/16 more than one, and the middle of an edge turns by h²κ′/8 from its mean.
        let (cost, away) = (with_own.energy / report.energy - 1.0, apart(&free, &same));
        println!("{n}: {cost:e}, {away:e}");
        let h = 1.0 / n as f64;
        assert!(cost.abs() < 0.02 * h.powi(3) && away < 0.12 * h * h, "{n}: {cost:e}, {away:e}");
    }
    let mut before = energy;
    for turn in [0.1_f64, 0.3, 0.6] {
        let (sin, cos) = turn.sin_cos();
        let turned = [own[0] * cos - own[1] * sin, own[0] * sin + own[1] * cos];
        let (_, with_turned) = fitted::<2>(&fair, &constrained(&S, false, &[(2, turned)], &[]), 16);
        assert_eq!(with_turned.status, CurveStatus::Converged, "{with_turned:?}");
        assert!(with_turned.energy > before, "{} after {before}", with_turned.energy);
        before = with_turned.energy;
    }
}

#[test]
fn free_curves_are_stationary() {
    for energy in [bending(2.0) + 0.1 * length(), bending(3.0) + 0.1 * length(), variation() + 0.1 * length()] {
        let fair = held(energy);
        for (points, closed) in [(S.to_vec(), false), (oval(), true)] {
            let (vertices, report) = fitted::<2>(&fair, &one(&points, closed), 16);
            assert_eq!(report.status, CurveStatus::Converged, "{}, closed {closed}: {report:?}", fair.energy);
            assert_stationary(&fair.energy, &vertices, closed, 16, &[], 5);
        }
    }
}

fn sentence(batch: &CurveBatch, fair: &Fair) -> String {
    let fit = fit(fair, batch);
    let report = &fit.reports()[0];
    assert_eq!(report.status, CurveStatus::Invalid);
    assert!(!fit.curve(0).is_fitted());
    report.message.clone().unwrap()
}

#[test]
fn constraints_that_cannot_be_met_are_refused_with_a_sentence() {
    let fair = held(bending(2.0) + length());
    let coarse = Fair { segments: Segments::PerSpan(3), ..fair.clone() };
    let lonely = constrained(&S, false, &[], &[(1, [0.0, 1.0])]);
    assert_eq!(
        sentence(&lonely, &fair),
        "curve 0, point 1: a curvature vector needs a tangent beside it: give tx, ty (and tz) too"
    );
    let skew = constrained(&S, false, &[(1, [1.0, 0.0])], &[(1, [3.0, 4.0])]);
    assert_eq!(
        sentence(&skew, &fair),
        "curve 0, point 1: its curvature vector is not perpendicular to its tangent (cosine 6.0e-1, at most 1e-6 is \
         possible): subtract its part along the tangent"
    );
    let jumping = constrained(&S, false, &[(1, [1.0, 0.0])], &[(1, [0.0, 1.0])]);
    assert_eq!(
        sentence(&jumping, &fair),
        "curve 0, point 1: a curvature vector needs an energy that holds variation, since bending lets curvature jump: add \
         some, such as variation=0.1, or leave the vector out"
    );
    let zero = constrained(&S, false, &[(3, [0.0, 0.0])], &[]);
    assert_eq!(
        sentence(&zero, &fair),
        "curve 0, point 3: its tangent has length 0; give a direction, or leave it empty"
    );
    let tangent = constrained(&S, false, &[(2, [1.0, 0.0])], &[]);
    assert_eq!(
        sentence(&tangent, &coarse),
        "curve 0, point 2: its span has 3 segments; to meet a tangent it needs 4: ask for more samples, or a smaller \
         spacing"
    );
    let repeated = [S[0], S[1], S[1], S[2]];
    let two = constrained(&repeated, false, &[(1, [1.0, 0.0]), (2, [0.0, 1.0])], &[]);
    assert_eq!(
        sentence(&two, &fair),
        "curve 0, point 2: the same point repeated before it asks for another tangent: leave one out"
    );
}

#[test]
fn a_curve_whose_constraints_are_refused_leaves_its_neighbours_as_they_were() {
    let fair = held(bending(2.0) + length());
    let coords: Vec<f64> = [S, S, S].as_flattened().as_flattened().to_vec();
    let all = CurveBatch::from_ragged(2, coords, vec![0, 5, 10, 15]).unwrap();
    let mut tangents = vec![f64::NAN; 30];
    (tangents[14], tangents[15]) = (0.0, 0.0);
    let constraints = faircurve::Constraints { tangents: Some(tangents), ..Default::default() };
    let fit = fit(&fair, &all.with_constraints(constraints).unwrap());
    let (alone, report) = fitted::<2>(&fair, &one(&S, false), 16);
    assert_eq!(fit.reports()[1].status, CurveStatus::Invalid);
    for i in [0, 2] {
        assert_eq!(fit.reports()[i], report);
        assert_eq!(vertices::<2>(&fit, i, 16), alone);
    }
}

/// Rough curves through 6 points, of which 4 have tangents far from the chords.
fn rough_with_tangents<const D: usize>(count: usize, seed: u64) -> CurveBatch {
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let mut normal = || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
    let (mut coords, mut tangents) = (Vec::new(), Vec::new());
    for k in 0..6 * count {
        let (mut point, mut tangent) = ([0.0; D], [0.0; D]);
        (point[0], tangent[0]) = ((k % 6) as f64, 1.0);
        for c in 1..D {
            (point[c], tangent[c]) = (0.6 * normal(), normal());
        }
        coords.extend(point);
        tangents.extend(if [0, 2, 3, 5].contains(&(k % 6)) { tangent } else { [f64::NAN; D] });
    }
    let batch = CurveBatch::from_ragged(D, coords, (0..=count).map(|i| 6 * i).collect()).unwrap();
    batch.with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() }).unwrap()
}

#[test]
fn rough_curves_with_given_tangents_converge_in_few_iterations() {
    for energy in [bending(2.0) + 0.1 * length(), bending(2.0) + tautness()] {
        for (spatial, most) in [(false, 14), (true, 30)] {
            let fair = Fair { energy: energy.clone(), ..Fair::default() };
            let batch = if spatial { rough_with_tangents::<3>(60, 8) } else { rough_with_tangents::<2>(60, 7) };
            let fit = fit(&fair, &batch);
            let mut iterations: Vec<u32> = fit.reports().iter().map(|report| report.iterations).collect();
            iterations.sort_unstable();
            let converged = fit.reports().iter().filter(|report| report.status == CurveStatus::Converged).count();
            println!(
                "{energy}, spatial {spatial}: {converged} of 60, {} and {} iterations",
                iterations[30], iterations[54]
            );
            assert!(converged >= 58 && iterations[30] <= most, "{converged} converged, {iterations:?}");
        }
    }
}
