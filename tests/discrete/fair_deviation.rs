//! Curves near their points keep the deviation asked for, and are as fair as it allows.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use faircurve::discrete::{Energy, Fair, Pins, Segments, attachment, bending, length, tautness, variation};
use faircurve::surface::Globe;
use faircurve::{CurveBatch, CurveReport, CurveStatus, Deviation, Device, Sampling, io};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::common::*;

const SEGMENTS: usize = 8;

fn near(energy: Energy, deviation: f64) -> Fair {
    let segments = Segments::PerSpan(SEGMENTS);
    Fair { energy, segments, deviation: Some(deviation.into()), max_iterations: 2000, ..Fair::default() }
}

fn energy() -> Energy {
    bending(2.0) + 0.1 * length()
}

/// Points of a circle of radius 1, and of a turn of a helix of that radius, with noise of this size.
fn noisy<const D: usize>(points: usize, noise: f64, seed: u64) -> Vec<[f64; D]> {
    risen(points, noise, seed, |t| 0.3 * t)
}

/// Points around the z-axis at distance 1 with this height, with noise of this size.
fn risen<const D: usize>(points: usize, noise: f64, seed: u64, height: fn(f64) -> f64) -> Vec<[f64; D]> {
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let point = |k: usize| -> [f64; D] {
        let t = TAU * k as f64 / points as f64;
        std::array::from_fn(|c| [t.cos(), t.sin(), height(t)][c] + rng.random_range(-noise..noise))
    };
    (0..points).map(point).collect()
}

/// Whether a curve with this many segments a span has a loop: a span more than twice as long as its
/// chord, and longer by the deviation.
fn has_a_loop(vertices: &[Planar], segments: usize, closed: bool, allowed: f64) -> bool {
    let ends = if closed { Some(vertices[0]) } else { None };
    let all: Vec<Planar> = vertices.iter().copied().chain(ends).collect();
    let span = |from: usize| {
        let own = &all[from..=from + segments];
        length_of(own, false) > 2.0 * norm(minus(own[segments], own[0])) + allowed
    };
    (0..all.len() - 1).step_by(segments).any(span)
}

/// Largest distance of data points from their vertices.
fn deviation<const D: usize>(vertices: &[[f64; D]], points: &[[f64; D]]) -> f64 {
    let away = |(k, point): (usize, &[f64; D])| norm(minus(vertices[k * SEGMENTS], *point));
    points.iter().enumerate().map(away).fold(0.0, f64::max)
}

/// Asserts that a curve has converged, and that its deviation is at most, and about, as much as was allowed.
fn comes_close(report: &CurveReport, allowed: f64, what: &str) {
    assert_eq!(report.status, CurveStatus::Converged, "{what}: {report:?}");
    assert!(report.gradient_norm <= 1e-8, "{what}: {report:?}");
    assert!(report.max_deviation <= allowed && report.max_deviation >= 0.9997 * allowed, "{what}: {report:?}");
}

#[test]
fn every_border_keeps_the_deviation_uses_it_and_has_no_loops() {
    let batch = io::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/countries-110m.geojson")).unwrap();
    let allowed = 0.2;
    let fair = Fair { deviation: Some(allowed.into()), ..Fair::default() };
    let (fit, samples) = fair.fit_sampled(&batch, Sampling::PerSpan(16), &Device::cpu()).unwrap();
    let (mut converged, mut touching, mut small, mut untangled) = (0, 0, 0, 0);
    for (i, report) in fit.reports().iter().enumerate() {
        let (vertices, points) = (samples.points(i).as_chunks::<2>().0, batch.points(i).as_chunks::<2>().0);
        if report.status == CurveStatus::Degenerate {
            continue;
        }
        let away = |(k, point): (usize, &Planar)| norm(minus(vertices[16 * k], *point));
        let found = points.iter().enumerate().map(away).fold(0.0, f64::max);
        assert!(found <= allowed, "{i}: {found}");
        assert!((found - report.max_deviation).abs() <= 1e-12, "{i}: {found} {report:?}");
        assert!(!has_a_loop(vertices, 16, batch.is_closed(i), allowed), "{i}: {report:?}");
        converged += usize::from(report.status == CurveStatus::Converged);
        touching += usize::from(found >= 0.9997 * allowed);
        let says = |what: &str| report.message.as_ref().is_some_and(|message| message.contains(what));
        small += usize::from(says("it stays within"));
        untangled += usize::from(says("crossed itself where its points do not: it is drawn tauter"));
    }
    println!(
        "{converged} converged, {touching} touch their discs, {small} are small, {untangled} crossed, of {}",
        batch.len()
    );
    // 592 of 594: corners of the other two are as wide as their discs, and make for a valley that Newton's method does not
    // come out of.
    assert!(converged >= 592, "{converged}");
    assert!(touching >= 400 && small > 0 && untangled > 0, "{touching} {small} {untangled}");
}

#[test]
fn every_border_whose_corners_are_kept_has_a_minimum_that_makes_use_of_the_deviation() {
    let batch = io::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/countries-110m.geojson")).unwrap();
    let fair = Fair { corners: Some(60f64.to_radians()), ..near(bending(2.0), 0.2) };
    let fit = fair.fit(&batch, &Device::cpu()).unwrap();
    let unusable: Vec<usize> = (0..fit.len()).filter(|&i| !fit.reports()[i].status.is_usable()).collect();
    // It is a single point.
    assert_eq!(unusable, [386]);
}

#[test]
fn borders_in_bending_alone_keep_the_deviation_and_never_swing_out() {
    let all = io::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/countries-110m.geojson")).unwrap();
    let batch = all.select(&(20..110).collect::<Vec<_>>());
    let allowed = 0.2;
    let fair = Fair { max_iterations: 500, ..near(bending(2.0), allowed) };
    let (fit, samples) = fair.fit_sampled(&batch, Sampling::PerSpan(SEGMENTS), &Device::cpu()).unwrap();
    let mut converged = 0;
    for (i, report) in fit.reports().iter().enumerate() {
        assert!(report.max_deviation <= allowed, "{i}: {report:?}");
        let vertices = samples.points(i).as_chunks::<2>().0;
        assert!(!has_a_loop(vertices, SEGMENTS, batch.is_closed(i), allowed), "{i}: {report:?}");
        converged += usize::from(report.status == CurveStatus::Converged);
        assert!(report.status == CurveStatus::Converged || report.message.is_some(), "{i}: {report:?}");
    }
    println!("{converged} of {} converged", batch.len());
    assert!(converged >= 60, "{converged}");
}

#[test]
fn a_device_counts_every_curve_once_when_it_is_finished() {
    let counted = |fair: &Fair, batch: &CurveBatch| {
        let counter = Arc::new(AtomicUsize::new(0));
        let device = Device::cpu().with_counter(counter.clone());
        fair.fit(batch, &device).unwrap();
        counter.load(Ordering::Relaxed)
    };
    let (plain, two) = (noisy::<2>(9, 0.1, 3), [[0.0, 0.0], [3.0, 1.0]]);
    let (bad, same) = ([[0.0, 0.0], [f64::NAN, 1.0], [2.0, 0.0]], [[1.0, 1.0]; 3]);
    let stairs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [3.0, 2.0]];
    let batch = CurveBatch::from_slices(&[&plain[..], &bad, &two, &same, &stairs, &plain]).unwrap();
    for fair in [Fair { energy: energy(), ..Fair::default() }, near(energy(), 0.05), near(bending(2.0), 1e-13)] {
        assert_eq!(counted(&fair, &batch), batch.len(), "{fair:?}");
        assert_eq!(counted(&Fair { corners: Some(1.0), ..fair.clone() }, &batch), batch.len(), "{fair:?} with corners");
    }
}

#[test]
fn the_energy_falls_as_the_deviation_grows() {
    let batch = gentle(20, 9, 0.04, 11);
    let mut before: Option<Vec<f64>> = None;
    for allowed in [0.004, 0.008, 0.016] {
        let fair = near(energy(), allowed);
        let fit = fit(&fair, &batch);
        for (i, report) in fit.reports().iter().enumerate() {
            comes_close(report, allowed, &format!("{i} at {allowed}"));
            let polygon = energy_of(&fair.energy, &vertices::<2>(&fit, i, SEGMENTS), false);
            assert!((report.energy - polygon).abs() <= 1e-9 * polygon.max(1.0), "{} of {polygon}", report.energy);
        }
        let energies: Vec<f64> = fit.reports().iter().map(|report| report.energy).collect();
        if let Some(before) = before {
            before.iter().zip(&energies).for_each(|(before, now)| assert!(now < before, "{allowed}: {now} {before}"));
        }
        before = Some(energies);
    }
}

#[test]
fn a_deviation_that_a_curve_might_vanish_in_costs_no_energy() {
    let batch = io::read("tests/data/clover.csv").unwrap().closed(true);
    let within = |allowed: f64| Fair { deviation: Some(allowed.into()), ..Fair::default() };
    let energies = [0.7, 1.0, 1.5, 3.0, 5.0].map(|allowed| {
        let report = fit(&within(allowed), &batch).reports()[0].clone();
        assert_eq!(report.status, CurveStatus::Converged, "{allowed}: {report:?}");
        report.energy
    });
    println!("{energies:?}");
    assert!(energies.is_sorted_by(|before, after| after <= before), "{energies:?}");
}

#[test]
fn no_curve_of_one_attachment_weight_that_keeps_the_deviation_is_fairer() {
    let points = noisy::<2>(9, 0.1, 3);
    for (energy, closed) in [(energy(), false), (energy(), true), (variation() + length(), false)] {
        let allowed = 0.05;
        let fair = near(energy.clone(), allowed);
        let (_, report) = fitted::<2>(&fair, &one(&points, closed), SEGMENTS);
        let what = format!("{energy}, closed {closed}");
        comes_close(&report, allowed, &what);
        let (mut least, mut keep) = (f64::INFINITY, 0);
        for k in -20..60 {
            let attached = energy.clone() + 2f64.powf(0.5 * f64::from(k)) * attachment();
            let fair = Fair { energy: attached, pins: Pins::Ends, deviation: None, ..fair.clone() };
            let (found, one) = fitted::<2>(&fair, &one(&points, closed), SEGMENTS);
            if one.status == CurveStatus::Converged && one.max_deviation <= allowed {
                least = least.min(energy_of(&energy, &found, closed));
                keep += 1;
            }
        }
        println!("{what}: {} beside {least} of {keep} weights", report.energy);
        assert!(keep > 5 && report.energy < 0.998 * least, "{what}: {} {least}", report.energy);
    }
}

#[test]
fn the_curve_is_the_exact_one_of_forces_where_it_touches_and_of_none_elsewhere() {
    // One point off the line between the ends: the least bending within D of it bends to its disc straight away from it,
    // and is the least curve through that place of the disc.
    for height in [0.3, -0.4] {
        let points = [[0.0, 0.0], [1.0, height], [2.0, 0.0]];
        let allowed = 0.1;
        let (found, report) = fitted::<2>(&near(energy(), allowed), &one(&points, false), SEGMENTS);
        comes_close(&report, allowed, "one point");
        let top = found[SEGMENTS];
        let expected = [1.0, height.signum() * (height.abs() - allowed * (1.0 - 1e-4))];
        assert!(norm(minus(top, expected)) <= 1e-4 * allowed, "{top:?} {expected:?}");
        let through = Fair { energy: energy(), segments: Segments::PerSpan(SEGMENTS), ..Fair::default() };
        let (wanted, _) = fitted::<2>(&through, &one(&[points[0], top, points[2]], false), SEGMENTS);
        assert!(apart(&found, &wanted) <= 1e-6, "{:e}", apart(&found, &wanted));
    }
}

#[test]
fn ends_of_open_curves_stay_unless_they_are_freed() {
    let points = noisy::<2>(9, 0.1, 5);
    let fair = near(energy(), 0.05);
    let (found, report) = fitted::<2>(&fair, &one(&points, false), SEGMENTS);
    comes_close(&report, 0.05, "pinned");
    assert_eq!((found[0], found[8 * SEGMENTS]), (points[0], points[8]));
    let (freed, report) = fitted::<2>(&Fair { pins: Pins::None, ..fair }, &one(&points, false), SEGMENTS);
    comes_close(&report, 0.05, "freed");
    assert!(freed[0] != points[0] && freed[8 * SEGMENTS] != points[8]);
    assert!(deviation(&freed, &points) <= 0.05);
}

#[test]
fn within_discs_the_nearest_vertex_is_the_one_of_the_point() {
    // The least energy is 1.8462, of a curve that an independent search found.
    let points = [[0.0, 1.0], [0.7, -0.3], [1.4, 0.0], [2.5, -0.9]];
    let segments = Segments::PerSpan(16);
    let fair = Fair { segments, ..near(bending(2.0) + 0.5 * length(), 0.3) };
    let (vertices, report) = fitted::<2>(&fair, &one(&points, false), 16);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    assert!(report.energy <= 1.8462 * 1.001, "{report:?}");
    for (k, point) in points.iter().enumerate().take(3).skip(1) {
        let [before, after] = [0, 1].map(|step| minus(vertices[16 * k + step], vertices[16 * k + step - 1]));
        let along: Planar = std::array::from_fn(|c| before[c] / norm(before) + after[c] / norm(after));
        let offset = minus(vertices[16 * k], *point);
        let cosine = dot(along, offset) / (norm(along) * norm(offset));
        assert!(cosine.abs() < 1e-3, "{k}: {cosine}");
    }
}

#[test]
fn curves_in_space_keep_the_deviation_too() {
    // A helix that is closed comes back from its end to its start by two loops.
    let (helix, saddle) = (noisy::<3>(13, 0.05, 7), risen::<3>(13, 0.05, 7, |t| 0.3 * (2.0 * t).cos()));
    for (closed, energy) in [(false, energy()), (true, energy()), (false, variation() + length())] {
        let points = if closed { &saddle } else { &helix };
        let (found, report) = fitted::<3>(&near(energy.clone(), 0.04), &one(points, closed), SEGMENTS);
        comes_close(&report, 0.04, &format!("{energy}, closed {closed}"));
        assert!((deviation(&found, points) - report.max_deviation).abs() <= 1e-12);
    }
}

#[test]
fn what_is_straight_enough_becomes_the_line_between_its_ends() {
    let points: Vec<Planar> = (0..9).map(|k| [f64::from(k), 0.1 * f64::from(k % 2)]).collect();
    let (found, report) = fitted::<2>(&near(bending(2.0), 0.2), &one(&points, false), SEGMENTS);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    assert!(report.energy < 1e-8, "{report:?}");
    assert!(found.iter().all(|[_, y]| y.abs() <= 1e-4), "{found:?}");
    assert!((report.max_deviation - 0.1).abs() <= 1e-3, "{report:?}");
}

#[test]
fn a_ring_smaller_than_its_deviation_stays_a_ring_and_says_within_what() {
    let points = noisy::<2>(12, 0.02, 9);
    let (found, report) = fitted::<2>(&near(energy(), 5.0), &one(&points, true), SEGMENTS);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    assert!(report.max_deviation <= 0.5 && length_of(&found, true) > 0.5 * TAU, "{report:?}");
    let message = report.message.unwrap();
    assert!(message.contains("it could vanish within 5 of its points: it stays within "), "{message}");
}

#[test]
fn two_points_repeated_points_and_one_bad_curve_are_no_trouble_to_others() {
    let mut doubled = noisy::<2>(9, 0.1, 3);
    let plain = doubled.clone();
    doubled.insert(4, doubled[4]);
    let two = [[0.0, 0.0], [3.0, 1.0]];
    let bad = [[0.0, 0.0], [f64::NAN, 1.0], [2.0, 0.0]];
    let same = [[1.0, 1.0]; 3];
    let curves = [&plain[..], &bad, &two, &doubled, &same, &plain];
    let batch = CurveBatch::from_slices(&curves).unwrap();
    let fair = near(energy(), 0.05);
    let fit = fit(&fair, &batch);
    let statuses: Vec<CurveStatus> = fit.reports().iter().map(|report| report.status).collect();
    use CurveStatus::{Converged, Degenerate, Invalid};
    assert_eq!(statuses, [Converged, Invalid, Converged, Converged, Degenerate, Converged]);
    let (alone, report) = fitted::<2>(&fair, &one(&plain, false), SEGMENTS);
    for i in [0, 5] {
        assert_eq!(vertices::<2>(&fit, i, SEGMENTS), alone);
        assert_eq!(fit.reports()[i], report);
    }
    let line = &fit.reports()[2];
    assert_eq!((line.max_deviation, line.smoothing), (0.0, None));
    comes_close(&fit.reports()[3], 0.05, "doubled");
    assert_eq!(fit.polylines(Sampling::PerSpan(SEGMENTS)).count(3), 9 * SEGMENTS + 1);
}

#[test]
fn a_deviation_next_to_rounding_is_kept_by_the_points_themselves() {
    let points = noisy::<2>(5, 0.1, 13);
    let (found, report) = fitted::<2>(&near(energy(), 1e-13), &one(&points, false), SEGMENTS);
    assert_eq!((report.status, report.max_deviation), (CurveStatus::Converged, 0.0), "{report:?}");
    assert_eq!(deviation(&found, &points), 0.0);
    let message = report.message.unwrap();
    let said =
        "curve 0, point 0: a deviation of 0.0000000000001 is next to rounding here: the curve goes through its points";
    assert_eq!(message, said);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let batch = one(&noisy::<2>(5, 0.1, 13), false);
    let refused = |fair: Fair, sentence: &str| {
        let error = fair.fit(&batch, &Device::cpu()).expect_err("it is refused").to_string();
        assert!(error.contains(sentence), "{error}");
    };
    for (allowed, word) in [(0.0, "0"), (-1.0, "-1"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        let sentence = format!("the largest deviation allowed is {word}; it must be positive and finite");
        refused(near(energy(), allowed), &sentence);
    }
    refused(
        near(energy() + attachment(), 0.1),
        "a deviation of 0.1 keeps the curve near its points, and so does the attachment in the energy: leave one of both out",
    );
    for (angle, word) in [(-0.1, "-0.1"), (3.2, "3.2"), (f64::NAN, "NaN")] {
        let sentence = format!("the angle of corners is {word}; angles from 0 to π are possible, such as 1.05 (60°)");
        refused(Fair { corners: Some(angle), ..Fair::default() }, &sentence);
    }
}

#[test]
fn a_deviation_in_parts_of_the_size_is_that_distance_for_every_curve_of_any_size() {
    let points = noisy::<2>(12, 0.2, 71);
    let larger: Vec<Planar> = points.iter().map(|p| p.map(|x| 1000.0 * x)).collect();
    let other = noisy::<2>(20, 0.3, 72);
    let batch = CurveBatch::from_slices(&[&points[..], &larger[..], &other[..]]).unwrap();
    let size = |points: &[Planar]| {
        let side = |c: usize| {
            let (low, high) = points.iter().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p[c]), b.max(p[c])));
            high - low
        };
        side(0).hypot(side(1))
    };
    let share = 0.03;
    let fair = Fair { deviation: Some(Deviation::OfSize(share)), ..near(bending(2.0) + tautness(), 1.0) };
    let fit = fair.fit(&batch, &Device::cpu()).unwrap();
    for (i, points) in [&points, &larger, &other].into_iter().enumerate() {
        let allowed = share * size(points);
        comes_close(&fit.reports()[i], allowed, &format!("curve {i}"));
        let alone = near(bending(2.0) + tautness(), allowed);
        let alone = alone.fit(&CurveBatch::from_slices(&[&points[..]]).unwrap(), &Device::cpu()).unwrap();
        assert_eq!(alone.reports()[0].energy, fit.reports()[i].energy, "curve {i}");
    }
}

#[test]
fn a_part_of_the_size_is_of_the_whole_curve_where_corners_cut_it() {
    // A long and a short side with a corner between them, and a bump on each.
    let points = [[0.0, 0.0], [1.0, 0.1], [2.0, -0.1], [3.0, 0.0], [10.0, 0.0], [10.1, 0.3], [9.9, 0.6], [10.0, 1.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let cornered = |deviation: Deviation| Fair {
        deviation: Some(deviation),
        corners: Some(60f64.to_radians()),
        ..near(bending(2.0) + tautness(), 1.0)
    };
    let size = 10.1f64.hypot(1.1);
    let [relative, absolute] = [Deviation::OfSize(0.008), Deviation::Units(0.008 * size)]
        .map(|deviation| cornered(deviation).fit(&batch, &Device::cpu()).unwrap().reports()[0].clone());
    assert_eq!(relative.status, CurveStatus::Converged, "{relative:?}");
    assert!((relative.energy - absolute.energy).abs() <= 1e-12 * absolute.energy, "{relative:?} {absolute:?}");
    assert!((relative.max_deviation - 0.008 * size).abs() <= 3e-4 * 0.008 * size, "{relative:?}");
}

#[test]
fn a_curve_without_a_size_has_no_part_in_what_others_are_allowed() {
    let wave = [[0.0, 0.0], [1.0, 0.4], [2.0, -0.3], [3.0, 0.5], [4.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&[[1.0, 1.0]; 1][..], &wave, &[[2.0, 2.0]; 3]]).unwrap();
    let fair = Fair { deviation: Some(Deviation::OfSize(0.02)), ..near(bending(2.0) + tautness(), 1.0) };
    let fit = fair.fit(&batch, &Device::cpu()).unwrap();
    let statuses: Vec<CurveStatus> = fit.reports().iter().map(|report| report.status).collect();
    assert_eq!(statuses, [CurveStatus::Degenerate, CurveStatus::Converged, CurveStatus::Degenerate]);
    comes_close(&fit.reports()[1], 0.02 * 4f64.hypot(0.8), "the wave");
}

#[test]
fn deviations_of_each_curve_are_those_of_fits_alone() {
    let curves: Vec<Vec<Planar>> = (0..3).map(|seed| noisy::<2>(24, 0.05, seed)).collect();
    let deviations = [0.03, 0.1, 0.3].map(Deviation::Units);
    let batch = CurveBatch::from_slices(&curves.iter().map(Vec::as_slice).collect::<Vec<_>>()).unwrap();
    let fair = near(energy(), 1.0);
    for fair in [fair.clone(), Fair { corners: Some(1.0), ..fair }] {
        let fit = fair.fit_each(&batch, &deviations, &Device::cpu()).unwrap();
        for (i, deviation) in deviations.into_iter().enumerate() {
            let fair = Fair { deviation: Some(deviation), ..fair.clone() };
            let alone = fair.fit(&batch.select(&[i]), &Device::cpu()).unwrap();
            assert_eq!(
                fit.select(&[i]).polylines(Sampling::PerSpan(SEGMENTS)).coords(),
                alone.polylines(Sampling::PerSpan(SEGMENTS)).coords()
            );
            assert_eq!(fit.reports()[i].energy, alone.reports()[0].energy);
        }
        let refused = |deviations: &[Deviation], fair: &Fair| {
            fair.fit_each(&batch, deviations, &Device::cpu()).unwrap_err().to_string()
        };
        assert!(refused(&deviations[1..], &fair).contains("2 deviations are given for 3 curves"));
        assert!(refused(&[Deviation::Units(-1.0); 3], &fair).contains("must be positive"));
        let on_sphere = Fair { surface: Some(Arc::new(Globe::sphere(1.0).unwrap().surface())), ..fair };
        assert!(refused(&deviations, &on_sphere).contains("in a surface"));
    }
}
